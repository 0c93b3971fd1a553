"""The node: makes a simulation go by the clock on the wall, and ties it to topics."""
from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.utilities import remove_ros_args
from rclpy.waitable import Waitable

from ..model import errors
from ..model.scene import Scene
from ..physics.simulation import Simulation
from .diagnostics import Diagnostics
from .event_log import RunLog
from .imus import Imus
from .input_counts import Tally
from .inputs import Inputs
from .interactive import Interactive
from .log_lines import end_line, start_line
from .namesakes import Namesakes
from .outputs import Outputs
from .parameters import SPECS, Parameters, Settings, make_simulation, parts_of, step_of
from .rclpy_context import ros_session
from .recovery import Rescue
from .services import Services
from .signals import end_unbroken, ended_by_signals
from .stamps import Stamps
from .ticker import CALLS, MISFITS, Ticker

InvalidROSArguments = rclpy_implementation.RCLInvalidROSArgsError

LOOK_AROUND = 0.5
"""s on the wall between two looks at who is there, and two messages on /clock while paused."""

IMU_SETTINGS = {'rate', 'real_time_factor', 'publish_clock',
                *(name for name in SPECS if name.startswith('imu'))}
"""What sensors are set up by."""

EXAMPLE = """examples:
  ragdoll_node
  ragdoll_node --ros-args -p scene:=crowd -p real_time_factor:=0.5
  ragdoll_node --ros-args -p scene:=/path/to/my_scene.yaml
"""


class RagdollNode(Node):
    """The node ``ragdoll``. Options are those of rclpy's Node.

    Raises a RagdollError with all that is wrong if its parameters or its scene can not be.
    """

    def __init__(self, **options: object) -> None:
        super().__init__('ragdoll', **options)
        try:
            self._set_up()
        except BaseException:
            self.destroy_node()
            raise

    def _set_up(self) -> None:
        self.tally = Tally(self.get_logger())
        self._tuning = Parameters(self, self._parameter_overrides)
        self.simulation = make_simulation(self._tuning.scene, self.settings)
        self._prepared: Simulation | None = None
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._stamps = Stamps(self._ros_time)
        self._outputs, self._imus = Outputs(self), Imus(self)
        self._log = RunLog(self)
        self.inputs = Inputs(self, self.tally)
        self.interactive = Interactive(self, self.tally, time.monotonic_ns)
        self._diagnostics = Diagnostics(self, self._steady, self.tally, self._facts,
                                        self._wanted_pace, self._time_of_report)
        Services(self, self)
        self._namesakes = Namesakes(self)
        self.rescue = Rescue(self)
        self.paused = False
        self._use(self.simulation)
        self._tell_start()
        self._outputs.be_clock(self.settings.publish_clock)
        self._ticker = Ticker(self, self._steady, self.tick)
        self.create_timer(LOOK_AROUND, self._look_around, clock=self._steady)
        if self.settings.start_paused:
            self.pause(True)
            self._begin()
        else:
            self._go_on()
        self._tuning.watch(self._prepare, self._apply)

    @property
    def settings(self) -> Settings:
        """Values of the parameters."""
        return self._tuning.settings

    @property
    def stamp(self) -> int:
        """Stamp of the state as it stands, ns."""
        return self.simulation.time if self.settings.publish_clock else self._stamps.newest

    @property
    def services(self) -> Iterator[Service]:
        """Services that an executor is to look at now."""
        return super().services if self._ticker.looks(CALLS) else iter(())

    @property
    def waitables(self) -> Iterator[Waitable]:
        """Misfits of topics that an executor is to look at now."""
        return super().waitables if self._ticker.looks(MISFITS) else iter(())

    def tick(self, due: float | None = None) -> None:
        """Go on by one tick and publish; a bad state is never shown.

        ``due``: when, ns of the steady clock; now, if it is not said.
        """
        start = time.monotonic_ns()
        stands = self.rescue.advance(self.settings.dump_directory)
        if stands:
            self._log.count_tick()
        elif self.rescue.failed:
            self._replace(make_simulation(self._tuning.scene, self.settings))
        self._stamps.take(due)
        self._publish()
        if stands:
            self._imus.publish(self.simulation, self.stamp)
        self._ticker.doze(self.simulation.asleep
                          and not (self._outputs.heard or self._imus.heard))
        late = 0.0 if due is None else max(0.0, start - due)
        self._diagnostics.count(time.monotonic_ns() - start, late, self.simulation.tick)

    def reset(self) -> None:
        """Go back to the start, to the bit, and publish it."""
        self.simulation.reset()
        self._begin()

    def pause(self, wanted: bool) -> None:
        """Hold the time, or let it go on from where it is."""
        self.paused = wanted
        self._log.tell('pause', {'paused': wanted})
        self._go_on()
        if wanted:
            # What is not published with every tick.
            self._outputs.stand(self.simulation, self.stamp)
            self.interactive.publish_poses()
        self._diagnostics.report()

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters; a refusal is counted, also one by a range that rclpy checks."""
        wanted = [each for each in parameter_list if not self._tuning.stands(each)]
        if parameter_list and not wanted:
            return SetParametersResult(successful=True)
        result = super().set_parameters_atomically(wanted)
        if not result.successful:
            self.tally.refuse('parameters', result.reason)
        return result

    def end(self) -> None:
        """Give all back and say how far it came: ROS may be gone already, the log is not."""
        line = end_line(self.simulation, self.tally.refused.total(), self._ticker.dropped)
        self.destroy_node()
        self.get_logger().info(line)

    def destroy_node(self) -> None:
        """Give the engine back as well."""
        for simulation in (getattr(self, 'simulation', None), getattr(self, '_prepared', None)):
            if simulation is not None:
                simulation.close()
        super().destroy_node()

    def _ros_time(self) -> int:
        """Of the node's clock, ns; of the computer's where that is the same, which is quicker."""
        clock = self.get_clock()
        return clock.now().nanoseconds if clock.ros_time_is_active else time.time_ns()

    def _time_of_report(self) -> int:
        """ROS time, ns; where this node is the clock, what it says, heard or not."""
        return self.stamp if self.settings.publish_clock else self._ros_time()

    def _go_on(self) -> None:
        """Tick from now on at the wanted pace, or not while the doll is paused."""
        self._diagnostics.begin()
        if self.paused:
            self._ticker.stop()
        else:
            self._ticker.start(self.simulation.tick / self.settings.real_time_factor)

    def _publish(self) -> None:
        simulation, now = self.simulation, time.monotonic_ns()
        self._outputs.publish(simulation, self.stamp, now, self.paused)
        self.interactive.publish(now, self.paused)

    def _begin(self) -> None:
        """Publish a start: first which stamp it has, so that listeners know the next one's time."""
        self._stamps.take()
        self._diagnostics.report()
        self._publish()
        self._go_on()

    def _look_around(self) -> None:
        """Look who has come, and tell them what stands: of /clock and /tf nobody asks the past."""
        self._namesakes.look()
        if self.paused:
            self._outputs.repeat(self.simulation, self.stamp)

    def _use(self, simulation: Simulation) -> None:
        """Let all parts work with this simulation and the settings as they are."""
        self._log.follow(simulation)
        self.simulation = self.inputs.simulation = self._diagnostics.simulation = simulation
        self.inputs.settings = self.settings
        self.rescue.use(simulation)
        self._outputs.describe(simulation.scene, self.settings.frame_id,
                               self.settings.publish_tf)
        self._imus.use(simulation.scene, self.settings)
        self.interactive.use(simulation, self.settings)

    def _tell_start(self) -> None:
        """Say what is simulated, by what and how finely, and where to look."""
        self.get_logger().info(start_line(self.simulation, self.settings, self))

    def _replace(self, simulation: Simulation) -> None:
        self.simulation.close()
        self._use(simulation)

    def _prepare(self, changed: set[str], settings: Settings, scene: Scene) -> None:
        """Build what may fail before the change is accepted."""
        if self._prepared is not None:
            self._prepared.close()
        self._prepared = (make_simulation(scene, settings)
                          if changed & {'scene', 'engine', 'workers'} else None)

    def _apply(self, changed: set[str]) -> None:
        """Carry a change of the settings out."""
        settings = self.inputs.settings = self.interactive.settings = self.settings
        self._log.tell('parameters', {name: getattr(settings, name) for name in sorted(changed)})
        self._outputs.be_clock(settings.publish_clock)
        if self._prepared is not None:
            simulation, self._prepared = self._prepared, None
            self._replace(simulation)
            self._tell_start()
            self._begin()
        elif changed & {'frame_id', 'publish_tf'}:
            self._use(self.simulation)
            if self.paused:
                self._publish()
        if 'accuracy' in changed:
            self.simulation.accuracy = settings.accuracy
        if changed & IMU_SETTINGS:
            self._imus.use(self.simulation.scene, settings)
            if self.simulation.samples_per_tick != parts_of(settings):
                self.simulation.samples_per_tick = parts_of(settings)
        if changed & {'scene', 'rate', 'real_time_factor'}:
            self.simulation.step = step_of(settings)
            self._go_on()

    def _wanted_pace(self) -> float:
        return 0.0 if self.paused else self.settings.real_time_factor

    def _facts(self) -> dict:
        settings, ticker = self.settings, self._ticker
        pace = 1.0 if settings.publish_clock else settings.real_time_factor
        return {'paused': self.paused, 'real_time_factor': settings.real_time_factor,
                'lost_time': ticker.lost / 1e9, 'dropped_ticks': ticker.dropped,
                'stamp_pace': pace, 'namesakes': self._namesakes.count,
                'stamp_of_zero': self.stamp - round(self.simulation.time / pace),
                **self.rescue.facts()}


def main(arguments: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; 0, or 2 if it cannot start as it is asked to."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'ragdoll_node', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    try:
        parser.parse_args(remove_ros_args(arguments)[1:])
        return ended_by_signals(lambda: _spin(arguments))
    except (errors.RagdollError, ParameterException, InvalidROSArguments) as error:
        print(error, file=sys.stderr)
        return 2


def _spin(arguments: list[str]) -> int:
    with ros_session(arguments):
        node = RagdollNode()
        try:
            rclpy.spin(node)
        finally:
            end_unbroken(node.end)
    return 0


if __name__ == '__main__':
    sys.exit(main())
