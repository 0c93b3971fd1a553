"""The node `ragdoll`: runs a simulation in real time and connects it to topics and services."""
from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

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

from ..files.scene import load_scene
from ..model import errors
from ..model.scene import Scene
from ..physics.logged_simulation import LoggedSimulation
from ..physics.prepared_change import PreparedChange
from ..physics.simulation import Simulation
from .diagnostics import Diagnostics, DuplicateNodes, overlaps_text
from .event_log import EventLog, RunScene
from .impacts.publisher import ImpactPublisher
from .imu.publishers import ImuPublishers
from .inputs.bodies.body_subscriptions import BodySubscriptions
from .inputs.input_counts import InputCounts
from .inputs.interactive_marker_server import InteractiveMarkerServer
from .inputs.motor_subscriptions import MotorSubscriptions
from .inputs.no_world import NO_WORLD, NoWorld
from .inputs.state_subscription import StateSubscription
from .inputs.subscriptions import PushSubscriptions
from .log_lines import end_line, start_line
from .messages.interactive_markers import InteractiveMarkers
from .outputs import Outputs, PreparedOutputs
from .parameters.node_settings import SPECS, NodeSettings
from .parameters.parameters import Parameters, make_simulation
from .process.node_executor import NodeExecutor
from .process.rclpy_context import rclpy_context
from .process.signals import run_uninterrupted, run_until_signal
from .recovery import Recovery
from .services import Services
from .simulation_interfaces.servers import SimulationInterfaces
from .stamps import Stamps
from .ticker import QOS_EVENT_INTERVAL, SERVICE_INTERVAL, Result, Ticker

InvalidROSArguments = rclpy_implementation.RCLInvalidROSArgsError

GRAPH_PERIOD = 0.5
"""s of wall time between two checks of the ROS graph, and two messages on /clock while paused."""

IMU_SETTINGS = {'rate', 'real_time_factor', 'publish_clock',
                *(name for name in SPECS if name.startswith('imu'))}
"""Parameters that configure the IMU publishers."""

EXAMPLE = """examples:
  ragdoll_node
  ragdoll_node --ros-args -p scene:=crowd -p real_time_factor:=0.5
  ragdoll_node --ros-args -p scene:=/path/to/my_scene.yaml
"""


class PreparedScene(NamedTuple):
    """What the parts of the node need for a scene."""

    run_scene: RunScene
    outputs: PreparedOutputs
    markers: InteractiveMarkers


class LoadedWorld(NamedTuple):
    """A scene with all that the node needs for it with these settings."""

    scene: Scene
    settings: NodeSettings
    simulation: LoggedSimulation
    prepared: PreparedScene


class RagdollNode(Node):
    """The node ``ragdoll``. Options are those of rclpy's Node.

    Raises a RagdollError with all faults if its parameters or its scene are not valid.
    """

    def __init__(self, **options: object) -> None:
        super().__init__('ragdoll', **options)
        try:
            self._set_up()
        except BaseException:
            self.destroy_node()
            raise

    def _set_up(self) -> None:
        self.input_counts = InputCounts(self.get_logger())
        self._node_parameters = Parameters(self, self._parameter_overrides)
        self.simulation = make_simulation(self._node_parameters.scene, self.settings)
        self.has_world = True
        self._loaded: LoadedWorld | None = None
        """What use_world() is to set the parameter `scene` for."""
        self._prepared: LoadedWorld | None = None
        """What the change of parameters that is being made needs."""
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._stamps = Stamps(self._ros_time)
        self._outputs, self._imus = Outputs(self), ImuPublishers(self)
        self._impacts = ImpactPublisher(self)
        self._event_log = EventLog(self)
        self.inputs = PushSubscriptions(self, self.input_counts)
        self.states = StateSubscription(self, self.input_counts, self._show_if_paused)
        self.bodies = BodySubscriptions(self, self.input_counts, self._show_if_paused,
                                        lambda: self.stamp)
        self.motors = MotorSubscriptions(self, self.input_counts)
        self.interactive = InteractiveMarkerServer(self, self.input_counts, time.monotonic_ns)
        self._diagnostics = Diagnostics(self, self._steady, self.input_counts,
                                        self._diagnostic_values, self._diagnostics_stamp,
                                        self.bodies)
        Services(self, self)
        self.simulation_interfaces = SimulationInterfaces(self, self, self._steady,
                                                          self._show_if_paused)
        self._duplicate_nodes = DuplicateNodes(self)
        self.recovery = Recovery(self)
        self.paused = False
        self._set_simulation(self.simulation)
        self._log_start()
        self._outputs.set_clock_publisher(self.settings.publish_clock)
        self.ticker = Ticker(self, self._steady, self.tick)
        self.create_timer(GRAPH_PERIOD, self._on_graph_timer, clock=self._steady)
        if self.settings.start_paused:
            self.pause(True)
            self._publish_start()
        else:
            self._restart_ticker()
        self._node_parameters.add_callbacks(self._load, self._prepare, self._apply)

    @property
    def settings(self) -> NodeSettings:
        """Values of the parameters."""
        return self._node_parameters.settings

    @property
    def stamp(self) -> int:
        """Stamp of the current state, ns."""
        return self.simulation.time if self.settings.publish_clock else self._stamps.latest

    @property
    def services(self) -> Iterator[Service]:
        """Services that an executor is to poll at this wake-up."""
        return super().services if self.ticker.polls(SERVICE_INTERVAL) else iter(())

    @property
    def waitables(self) -> Iterator[Waitable]:
        """QoS events and actions that an executor is to poll at this wake-up."""
        if self.ticker.polls(QOS_EVENT_INTERVAL):
            return super().waitables
        return iter(self.simulation_interfaces.actions
                    if self.ticker.polls(SERVICE_INTERVAL) else ())

    def tick(self, due: float | None = None) -> None:
        """Make one tick and publish; a bad state is not published.

        ``due``: when it was due, ns of the steady clock; default: now.
        """
        start = time.monotonic_ns()
        self._impacts.start(self.simulation)
        is_good = self.recovery.advance(self.settings.dump_directory)
        if is_good:
            self._event_log.count_tick()
        elif self.recovery.failed:
            self._replace(make_simulation(self._node_parameters.scene, self.settings))
        self._stamps.advance(due)
        self._publish()
        if is_good:
            self._imus.publish(self.simulation, self.stamp)
            self._impacts.publish(self.simulation, self.stamp)
        self.ticker.set_idle(self.simulation.asleep and not (
            self._outputs.has_subscribers or self._imus.has_subscribers))
        lag = 0.0 if due is None else start - due
        self._diagnostics.record_tick(time.monotonic_ns() - start, lag, self.simulation.tick)

    def reset(self, keep_time: bool = False) -> None:
        """Reset the simulation, bit-identically to its start, and publish its state."""
        self.simulation.reset(keep_time)
        self._publish_start()

    def run_beside(self, make: Callable[[], Result]) -> Result:
        """Run ``make`` in a thread while the ticks go on, and return what it returns."""
        return self.ticker.run_beside(make)

    def change_dolls(self, prepare: Callable[[Simulation], PreparedChange]) -> None:
        """Add or remove dolls as ``prepare(simulation)`` says, which runs beside the ticks. Time
        goes on; topics and parameters follow. Raises what ``prepare`` raises.
        """
        def prepared() -> tuple[Simulation, PreparedChange, PreparedScene]:
            simulation = self.simulation
            made = prepare(simulation)
            return simulation, made, self._prepare_scene(made.change.after, self.settings)

        simulation, change, scene = self.run_beside(prepared)
        if simulation is not self.simulation:  # restarted, as it failed
            simulation, change, scene = prepared()
        simulation.carry_out(change)
        self._node_parameters.follow(change.change)
        self._set_simulation(simulation, scene)
        self._show_if_paused()

    def load_world(self, name: str) -> LoadedWorld:
        """Load the scene that a value of the parameter `scene` names, and make its simulation, for
        use_world(). This may run beside the ticks of the present one. Raises a RagdollError.
        """
        scene = load_scene(name)
        return self._made_world(scene, self._node_parameters.with_scene(name, scene))

    def use_world(self, loaded: LoadedWorld) -> SetParametersResult:
        """Set the parameter `scene` to that of the loaded world, which replaces the present one."""
        self._loaded = loaded
        done = self.set_parameters_atomically([Parameter('scene', value=loaded.settings.scene)])
        if self._loaded is not None:  # refused before it was looked at
            loaded.simulation.close()
            self._loaded = None
        return done

    def unload_world(self) -> None:
        """End the world: nothing is simulated or published until another one is loaded."""
        self.ticker.stop()
        self._impacts.stop()
        self.has_world, self.paused = False, True
        self._event_log.unload()
        self.simulation.close()
        for inputs in (self.inputs, self.states, self.bodies, self.motors):
            inputs.simulation = NoWorld()
        self._diagnostics.simulation = None
        self._outputs.unload()
        self.interactive.unload()
        self._node_parameters.unload()
        self.get_logger().info(NO_WORLD)
        self._diagnostics.restart()
        self._diagnostics.publish()

    def pause(self, paused: bool) -> None:
        """Pause, or resume."""
        self.paused = paused
        self._event_log.publish('pause', {'paused': paused})
        self._restart_ticker()
        if paused:
            # For late subscribers.
            self._outputs.publish_on_pause(self.simulation, self.stamp)
            self.interactive.publish_poses()
        self._diagnostics.publish()

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters, except unchanged read-only ones; count refusals, also rclpy's."""
        changes = [each for each in parameter_list
                   if not self._node_parameters.is_unchanged_read_only(each)]
        if parameter_list and not changes:
            return SetParametersResult(successful=True)
        result = super().set_parameters_atomically(changes)
        if not result.successful:
            self.input_counts.refuse('parameters', result.reason)
        return result

    def end(self) -> None:
        """Destroy the node and log a summary, which works after rclpy's shutdown as well."""
        line = end_line(self.simulation, self.input_counts.refused.total(),
                        self.ticker.dropped_ticks)
        self.destroy_node()
        self.get_logger().info(line)

    def destroy_node(self) -> None:
        """Close the simulation and destroy the node."""
        for holder in (self, getattr(self, '_prepared', None)):
            if hasattr(holder, 'simulation'):
                holder.simulation.close()
        if hasattr(self, 'simulation_interfaces'):
            self.simulation_interfaces.destroy()
        super().destroy_node()

    def _ros_time(self) -> int:
        """ROS time, ns; read from the system clock where that is the same, which is faster."""
        clock = self.get_clock()
        return clock.now().nanoseconds if clock.ros_time_is_active else time.time_ns()

    def _diagnostics_stamp(self) -> int:
        """ROS time, ns, or simulated time if this node publishes /clock."""
        return self.stamp if self.settings.publish_clock else self._ros_time()

    def _restart_ticker(self) -> None:
        """Restart the ticks at the requested real-time factor, or stop them while paused."""
        self._diagnostics.restart()
        if self.paused:
            self.ticker.stop()
        else:
            self.ticker.start(self.simulation.tick / self.settings.real_time_factor)

    def _publish(self) -> None:
        simulation, now = self.simulation, time.monotonic_ns()
        self._outputs.publish(simulation, self.stamp, now, self.paused)
        self.interactive.publish(now, self.paused)

    def _show_if_paused(self) -> None:
        """Publish a state that was set while paused; else the next tick does."""
        if self.paused:
            self._stamps.advance()
            self._publish()

    def _publish_start(self) -> None:
        """Publish the state after a reset or a new scene, and restart the ticks. /diagnostics,
        which maps stamps to time, comes first.
        """
        self._stamps.advance()
        self._diagnostics.publish()
        self._publish()
        self._restart_ticker()

    def _on_graph_timer(self) -> None:
        """Check for duplicate nodes and for publishers that are not heard; while paused, serve new
        subscribers of /clock and /tf.
        """
        self._duplicate_nodes.update()
        self.inputs.cmd_vel.check_publishers()
        if self.paused and self.has_world:
            self._outputs.republish(self.simulation, self.stamp)

    def _prepare_scene(self, scene: Scene, settings: NodeSettings) -> PreparedScene:
        """What all parts of the node need for a scene; this may run beside the ticks."""
        run_scene = self._event_log.prepare(scene)
        return PreparedScene(
            run_scene,
            self._outputs.prepare(scene, settings.frame_id, settings.publish_tf, run_scene.text),
            self.interactive.prepare(scene, settings.frame_id))

    def _set_simulation(self, simulation: Simulation,
                        prepared: PreparedScene | None = None) -> None:
        """Connect a simulation and the current settings to all parts of the node."""
        prepared = prepared or self._prepare_scene(simulation.scene, self.settings)
        self._event_log.set_simulation(simulation, prepared.run_scene)
        self.has_world = True
        self.simulation = simulation
        for inputs in (self.inputs, self.states, self.motors):
            inputs.simulation = simulation
        self.bodies.set_simulation(simulation, self.settings)
        self._outputs.keep_joints_from({**self.bodies.moved_by, **self.states.moved_by,
                                        **self.motors.moved_by})
        self._diagnostics.simulation = simulation
        self.inputs.settings = self.states.settings = self.settings
        self.recovery.set_simulation(simulation)
        self._outputs.set_scene(simulation.scene, self.settings.frame_id,
                                self.settings.publish_tf, prepared.outputs)
        self._imus.configure(simulation.scene, self.settings)
        self._impacts.configure(self.settings)
        self.interactive.set_simulation(simulation, self.settings, prepared.markers)

    def _log_start(self) -> None:
        self.get_logger().info(start_line(self.simulation, self.settings, self,
                                          self.bodies.moved_by))
        if (overlaps := overlaps_text(self.simulation)) not in ('none', 'unknown'):
            self.get_logger().warning(f'overlaps at the start: {overlaps}')

    def _replace(self, simulation: Simulation, prepared: PreparedScene | None = None) -> None:
        self._impacts.stop()
        self.simulation.close()
        self._set_simulation(simulation, prepared)

    def _load(self, name: str) -> Scene:
        """Load a scene beside the ticks of the present one, unless load_world() has loaded it."""
        if self._loaded is not None and self._loaded.settings.scene == name:
            return self._loaded.scene
        return self.run_beside(lambda: load_scene(name))

    def _made_world(self, scene: Scene, settings: NodeSettings) -> LoadedWorld:
        return LoadedWorld(scene, settings, make_simulation(scene, settings),
                           self._prepare_scene(scene, settings))

    def _prepare(self, changed: set[str], settings: NodeSettings, scene: Scene) -> None:
        """Before a change is accepted, create the simulation that it needs, as that may fail."""
        loaded, self._loaded = self._loaded, None
        if self._prepared is not None:
            self._prepared.simulation.close()
        self._prepared = loaded
        if loaded is not None and (loaded.scene is not scene or loaded.settings != settings):
            loaded.simulation.close()  # parameters have changed since it was loaded
            self._prepared = None
        if self._prepared is None and ('scene' in changed or (
                self.has_world and changed & {'engine', 'workers'})):
            self._prepared = self.run_beside(lambda: self._made_world(scene, settings))

    def _apply(self, changed: set[str]) -> None:
        """Carry out a change of the settings."""
        settings = self.settings
        self.inputs.settings = self.states.settings = self.interactive.settings = settings
        self._event_log.publish('parameters', {name: getattr(settings, name)
                                               for name in sorted(changed)})
        self._outputs.set_clock_publisher(settings.publish_clock)
        if self._prepared is not None:
            prepared, self._prepared = self._prepared, None
            self._replace(prepared.simulation, prepared.prepared)
            self._log_start()
            self._publish_start()
        elif not self.has_world:
            return  # what is loaded next has them
        elif changed & {'frame_id', 'publish_tf'}:
            self._set_simulation(self.simulation)
            if self.paused:
                self._publish()
        if 'accuracy' in changed:
            self.simulation.accuracy = settings.accuracy
        if 'impact_limits' in changed:
            self._impacts.configure(settings)
        if 'body_frames' in changed:
            self.bodies.configure(settings)
        if changed & IMU_SETTINGS:
            self._imus.configure(self.simulation.scene, settings)
            if self.simulation.samples_per_tick != settings.samples_per_tick:
                self.simulation.samples_per_tick = settings.samples_per_tick
        if changed & {'scene', 'rate', 'real_time_factor'}:
            self.simulation.step = settings.step
            self._restart_ticker()

    def _diagnostic_values(self) -> dict:
        """Values of the node for /diagnostics; ``stamp_pace``: simulated time per stamp time."""
        settings, ticker = self.settings, self.ticker
        stamp_factor = 1.0 if settings.publish_clock else settings.real_time_factor
        return {'paused': self.paused, 'real_time_factor': settings.real_time_factor,
                'lost_time': ticker.dropped_time / 1e9, 'dropped_ticks': ticker.dropped_ticks,
                'stamp_pace': stamp_factor, 'namesakes': self._duplicate_nodes.count,
                'unheard_cmd_vel': self.inputs.cmd_vel.unheard,
                'impact_ratios': self._impacts.status,
                'humans': self._outputs.humans.status,
                'simulation_interfaces': self.simulation_interfaces.status,
                'stamp_of_zero': self.stamp - round(self.simulation.time / stamp_factor),
                **self.recovery.diagnostics()}


def main(arguments: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM. Returns 0, or 2 for invalid arguments or scene."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'ragdoll_node', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    try:
        parser.parse_args(remove_ros_args(arguments)[1:])
        return run_until_signal(lambda: _spin(arguments))
    except (errors.RagdollError, ParameterException, InvalidROSArguments) as error:
        print(error, file=sys.stderr)
        return 2


def _spin(arguments: list[str]) -> int:
    with rclpy_context(arguments):
        node = RagdollNode()
        try:
            rclpy.spin(node, NodeExecutor(node.ticker))
        finally:
            run_uninterrupted(node.end)
    return 0


if __name__ == '__main__':
    sys.exit(main())
