"""A run published in real time on the topics of a node `ragdoll`."""
import time
from collections.abc import Iterator

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..model.ragdoll import WORLD
from ..model.scene import Scene
from ..physics.simulation import Simulation
from ..ros.outputs import Outputs
from ..ros.process.rclpy_context import rclpy_context
from ..ros.process.signals import run_until_signal
from ..ros.stamps import Stamps
from ..ros.ticker import Ticker

BONE_NAMES = 'bone_names'


def publish(steps: Iterator[Simulation], pace: float, arguments: list[str]) -> int:
    """Publish the ``steps`` at the real-time factor ``pace`` until they end. Returns the exit code.

    ``arguments`` are ROS's, from --ros-args on.
    """
    def spin() -> int:
        with rclpy_context(arguments):
            node = PublishedRun(steps, pace)
            try:
                while not node.is_over:
                    rclpy.spin_once(node)
            finally:
                node.destroy_node()
        return 0
    return run_until_signal(spin)


class PublishedRun(Node):
    """Publishes the topics of the recorded node, stamped with the current time."""

    def __init__(self, steps: Iterator[Simulation], pace: float) -> None:
        super().__init__('ragdoll')
        self.is_over = False
        self._steps, self._pace = steps, pace
        self._scene: Scene | None = None
        self._stamps, self._outputs = Stamps(time.time_ns), Outputs(self)
        self.declare_parameter(BONE_NAMES, [''])
        self._ticker = Ticker(self, Clock(clock_type=ClockType.STEADY_TIME), self._tick)
        self._period = 0.0
        self._tick()

    def _tick(self, due: float | None = None) -> None:
        simulation = next(self._steps, None)
        if simulation is None:
            self.is_over = True
            self._ticker.stop()
            return
        if simulation.scene is not self._scene:
            self._scene = simulation.scene
            self._outputs.set_scene(simulation.scene, WORLD, 'all')
            self.set_parameters([rclpy.Parameter(BONE_NAMES, value=list(
                simulation.scene.bone_names))])
        self._stamps.advance(due)
        self._outputs.publish(simulation, self._stamps.latest, time.monotonic_ns())
        if simulation.tick / self._pace != self._period:
            self._period = simulation.tick / self._pace
            self._ticker.start(self._period)
