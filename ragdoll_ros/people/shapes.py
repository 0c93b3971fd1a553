"""What a segment of a person touches with: simple shapes from lengths and circumferences."""
from __future__ import annotations

from ..model.anthropometry import BODY, TRUNK
from ..model.shapes import Box, Capsule, Part
from ..model.vectors import Vector
from .places import HEEL, Places, radius, trunk_sides

LEAST = 0.1
"""Share of a segment's length that its capsule's cylinder has at the least."""


def outline(bone: str, part: str, centre: float, at: Places) -> tuple[tuple[Part, ...], Vector]:
    """Shapes of a bone about its centre of mass, and where that is in the doll, m.

    ``centre``: how far the centre of mass is from the segment's proximal end, of a foot from the
    heel.
    """
    x, y, z = at.proximal(bone)
    if part == 'foot':
        length = at.lengths['foot']
        size = (length, BODY.foot_breadth / 1000 * at.tall, at.ankle)
        behind = length / 2 - centre
        return (Part(Box(size), (behind, 0, 0)),), (centre - HEEL * length, y, z / 2)
    place = (x, y, z - centre)
    if part == 'head':
        return _head(at, centre), place
    if part == 'hand':
        length, breadth = BODY.hand_length / 1000 * at.tall, BODY.hand_breadth / 1000 * at.tall
        thickness = BODY.hand / 2000 * at.tall - breadth
        box = Box((thickness, breadth, length))
        return (Part(box, (0, 0, centre - length / 2)),), place
    length = at.lengths[part]
    if part in TRUNK:
        breadth, depth = trunk_sides(part, at.wide)
        return (Part(Box((depth, breadth, length)), (0, 0, centre - length / 2)),), place
    return (_limb(part, length, at.wide, centre),), place


def _limb(part: str, length: float, wide: float, centre: float) -> Part:
    """A capsule that goes half a radius beyond both joints, but not beyond the ankle."""
    girths = {'upper_arm': (BODY.biceps,), 'forearm': (BODY.forearm, BODY.wrist),
              'thigh': (BODY.thigh, BODY.lower_thigh), 'shin': (BODY.calf, BODY.ankle)}[part]
    thick = radius(sum(girths) / len(girths), wide)
    above, below = thick / 2, 0.0 if part == 'shin' else thick / 2
    whole = max(length + above + below - 2 * thick, LEAST * length) + 2 * thick
    return Part(Capsule(thick, whole - 2 * thick), (0, 0, centre + above - whole / 2))


def _head(at: Places, centre: float) -> tuple[Part, ...]:
    """The skull from the vertex to the mid-gonion's height, and the neck below it."""
    thick, length = radius(BODY.head, at.tall), at.lengths['head']
    skull = Capsule(min(thick, 0.49 * length), length - 2 * min(thick, 0.49 * length))
    neck = Capsule(radius(BODY.neck, at.tall), max(at.neck, LEAST * length))
    return (Part(skull, (0, 0, centre - length / 2)),
            Part(neck, (0, 0, centre - length - at.neck / 2)))
