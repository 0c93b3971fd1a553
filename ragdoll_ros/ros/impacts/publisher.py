"""Publisher of ~/impacts and ~/impacts/markers, and of the worst impacts for /diagnostics."""
from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from ...files.limits import load_limits
from ...model.errors import RagdollError
from ..latched_topic import has_subscribers
from .markers import to_impact_markers
from .messages import to_impacts

if TYPE_CHECKING:
    from ...physics.simulation import Simulation
    from ..parameters.node_settings import NodeSettings

DEPTH = 100
"""Queue depth: ticks of a second."""


class ImpactPublisher:
    """Records impacts while a topic is subscribed, and publishes those of each tick."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '~/impacts', DEPTH)
        self._markers = node.create_publisher(MarkerArray, '~/impacts/markers', DEPTH)
        self._marker_count = 0
        self._limits_name = ''
        self._recorded: Simulation | None = None
        """The simulation whose impacts are recorded."""
        self._refused: Simulation | None = None
        """The simulation whose engine finds none."""
        self._worst: dict[str, tuple[float, str]] = {}
        """Largest ratio to the limit, and what was hit, by region since the start of the run."""
        self._run = -1

    def configure(self, settings: NodeSettings) -> None:
        """Take frame, marker lifetime and limits from these settings, and end the recording."""
        self._frame, self._lifetime = settings.frame_id, settings.impact_marker_lifetime
        if settings.impact_limits != self._limits_name:
            self._limits_name = settings.impact_limits
            self._limits = load_limits(self._limits_name)
        self.stop()

    def stop(self) -> None:
        """End the recording, as before the simulation is closed; start() begins it anew."""
        if self._recorded is not None:
            self._recorded.record_impacts(None)
        self._recorded = self._refused = None
        self._worst, self._run = {}, -1

    def start(self, simulation: Simulation) -> None:
        """Begin to record if there is a subscriber, else end it; to be called before a tick."""
        if not (has_subscribers(self._publisher) or has_subscribers(self._markers)):
            if self._recorded is not None or self._refused is not None:
                self.stop()
        elif simulation not in (self._recorded, self._refused):
            try:
                simulation.record_impacts(self._limits)
                self._recorded = simulation
            except RagdollError:
                self._refused = simulation
                self._node.get_logger().warning(f'~/impacts: {self.status}')

    def publish(self, simulation: Simulation, stamp: int) -> None:
        """Publish the impacts of the last tick, which ends at ``stamp``, ns, if it has any."""
        if simulation is not self._recorded:
            return
        if self._run != simulation.reset_count:
            self._worst, self._run = {}, simulation.reset_count
        impacts = simulation.impacts
        if not impacts:
            return
        if self._publisher.get_subscription_count():
            self._publisher.publish(to_impacts(self._frame, stamp, impacts, self._limits))
        if self._markers.get_subscription_count():
            self._markers.publish(to_impact_markers(self._frame, stamp, impacts, self._marker_count,
                                                    self._lifetime))
        self._marker_count += len(impacts)
        for impact in impacts:
            if impact.region:
                worst = self._worst.get(impact.region, (0.0, ''))
                self._worst[impact.region] = max(worst, (impact.ratio, impact.against))

    @property
    def status(self) -> str:
        """For /diagnostics: the largest ratios to the limits by region, or why there are none."""
        if self._refused is not None:
            return (f'the engine {self._refused.engine_name} finds no times of impact, so that '
                    'there are none; the engine rigid does')
        if self._recorded is None:
            return 'not recorded: nobody subscribes to ~/impacts or its markers'
        worst = sorted(self._worst.items(), key=lambda item: -item[1][0])
        return ', '.join(f'{region} {ratio:.3g} ({against})'
                         for region, (ratio, against) in worst) or 'none'
