"""Impacts as markers: an arrow along each impulse; bone, force and ratio to the limit as text."""
from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from ...model.scene import SECOND
from ...physics.sensors.impact_arrow import ImpactArrow, impact_arrow
from ..messages.convert import to_duration, to_header, to_point, to_vector

if TYPE_CHECKING:
    from ...physics.sensors.impacts import Impact

ARROWS, TEXTS = 'impacts', 'impact_forces'
"""Namespaces; an arrow and its text have the same id."""

WITHIN, ABOVE = (0.55, 0.25, 0.8, 1.0), (0.85, 0.05, 0.25, 1.0)
"""Colours of what is within its limit, or has none, and of what is above it."""

SHAFT, HEAD, HEAD_LENGTH, TEXT_HEIGHT = 0.015, 0.04, 0.06, 0.06
"""m: diameters of shaft and head, length of the head, height of an upper-case letter."""

MOST_IDS = 10_000
"""Ids are used again after so many impacts."""


def to_impact_markers(frame: str, stamp: int, impacts: Sequence[Impact], first: int,
                      lifetime: float) -> MarkerArray:
    """Make an arrow and a text for each impact, which RViz deletes after ``lifetime`` s. Both have
    the same id: ``first`` and up, modulo MOST_IDS.
    """
    header = to_header(stamp, frame)
    return MarkerArray(markers=[
        marker for number, impact in enumerate(impacts, first)
        for marker in _markers(header, impact_arrow(impact), number % MOST_IDS, lifetime)])


def to_arrows(message: MarkerArray) -> tuple[ImpactArrow, ...]:
    """Read the arrows of a message that to_impact_markers() made. Raises ValueError for an arrow
    without two points or without a text.
    """
    texts = {marker.id: marker.text for marker in message.markers if marker.ns == TEXTS}
    found = [marker for marker in message.markers
             if marker.ns == ARROWS and marker.action == Marker.ADD]
    if any(len(marker.points) != 2 or marker.id not in texts for marker in found):
        raise ValueError('arrows without two points, or without a text')
    return tuple(ImpactArrow(
        *((point.x, point.y, point.z) for point in marker.points), texts[marker.id],
        marker.color.r > (WITHIN[0] + ABOVE[0]) / 2) for marker in found)


def _markers(header: Header, arrow: ImpactArrow, number: int,
             lifetime: float) -> tuple[Marker, Marker]:
    common = {'header': header, 'id': number, 'action': Marker.ADD,
              'lifetime': to_duration(round(lifetime * SECOND))}
    body = Marker(ns=ARROWS, type=Marker.ARROW, scale=to_vector((SHAFT, HEAD, HEAD_LENGTH)),
                  points=[to_point(arrow.tail), to_point(arrow.tip)], **common)
    text = Marker(ns=TEXTS, type=Marker.TEXT_VIEW_FACING, text=arrow.text, **common)
    text.pose.position = to_point((*arrow.tip[:2], arrow.tip[2] + TEXT_HEIGHT))
    text.scale.z = TEXT_HEIGHT
    for marker in (body, text):
        marker.pose.orientation.w = 1.0
        (marker.color.r, marker.color.g, marker.color.b,
         marker.color.a) = ABOVE if arrow.is_above else WITHIN
    return body, text
