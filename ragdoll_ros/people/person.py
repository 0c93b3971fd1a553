"""A person of a height, mass and sex as a doll: 16 segments after de Leva 1996. Springs that hold
it upright.

The doll stands: arms down, palms forwards, soles on z = 0, x forwards. Masses, centres and inertias
are the table's, normalised to the total mass; lengths are the table's shares of the height, and the
neck is the remainder (see model/anthropometry.py). Shapes are for collision only and have no mass.
"""
import numpy as np

from ..model import errors
from ..model.anthropometry import BODY, PERCENTILES, SAMPLES, SEXES, TRUNK, Segment, mass_fractions
from ..model.compound import Compound
from ..model.ragdoll import Bone, Ragdoll
from ..model.shapes import Box, Capsule, Part
from ..model.vectors import Vector, vector
from .joints import joints
from .places import HEEL, Places, places, radius, trunk_sides

HEIGHTS, MASSES = (1.0, 2.1), (15.0, 160.0)
"""Tested range, m and kg. The tables are those of adults: a small person is no child."""

MIN_CYLINDER = 0.1
"""Smallest length of a capsule's cylinder over the segment's length."""

SKIN = (0.90, 0.75, 0.60, 1.0)

COLORS = {'head': SKIN, 'forearm': SKIN, 'hand': SKIN, 'chest': (0.25, 0.45, 0.70, 1.0),
          'abdomen': (0.25, 0.45, 0.70, 1.0), 'upper_arm': (0.30, 0.52, 0.78, 1.0),
          'foot': (0.25, 0.25, 0.28, 1.0)}
TROUSERS = (0.35, 0.38, 0.45, 1.0)

GRAVITY = 9.8
"""m/s^2"""

ARMS = ('shoulder', 'elbow', 'wrist')

ARM_STIFFNESS = 0.05
"""Stiffness of the hanging arms over that of the other joints."""

DAMPING_TIME = 0.05
"""s: damping over stiffness."""


def standard(sex: str, percentile: int = 50) -> tuple[float, float]:
    """Height, m, and mass, kg, at a percentile (5, 50 or 95) of ANSUR II."""
    _check_sex(sex)
    if percentile not in PERCENTILES[sex]:
        raise errors.OutOfRange('percentile', percentile, '5, 50 or 95')
    return PERCENTILES[sex][percentile]


def person(height: float, mass: float, sex: str, name: str = 'person',
           passive: bool = False) -> Ragdoll:
    """The doll of an adult, standing, by de Leva's anthropometric tables.

    Args:
        height: m, 1.0 to 2.1.
        mass: kg, 15 to 160.
        sex: 'female' or 'male'.
        name: of the doll.
        passive: whether hips, knees, ankles and trunk have the elastic torques of tissue, in place
            of hard limits at the ends of their ranges (engine rigid).

    Returns:
        A doll of 16 bones, soles on z = 0.

    Raises:
        OutOfRange: for a height, mass or sex outside these.

    Example:
        >>> len(person(1.75, 70, 'female').bones)
        16
    """
    errors.check_range('height', height, *HEIGHTS)
    errors.check_range('mass', mass, *MASSES)
    _check_sex(sex)
    at = places(height, mass, sex)
    sample, share = SAMPLES[sex], mass_fractions(sex)
    bones = []
    for bone, part in at.segments:
        segment = sample.segments[part]
        bones.append(_bone(bone, part, segment, segment.length / sample.height * height,
                           share[part] * mass, at))
    return Ragdoll(name, tuple(bones), joints(at, height, mass, passive))


def standing(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Springs that hold a person upright: stiffness, N m/rad, and damping, N m s/rad, by angle.

    For Simulation.hold. The stiffness is weight times height per rad, where the height is that of
    the highest bone's centre above the lowest one's; arms have ARM_STIFFNESS of it. An inverted
    pendulum about both ankles needs the weight times the height of the centre of mass for both
    together (Winter, Patla et al. 1998, J Neurophysiol 80:1211).
    """
    height = float(np.ptp([bone.position[2] for bone in doll.bones]))
    full = doll.mass * GRAVITY * height
    found = {}
    for joint in doll.joints:
        for name in joint.angle_names:
            stiffness = full * (ARM_STIFFNESS if name.endswith(ARMS) else 1.0)
            found[name] = stiffness, DAMPING_TIME * stiffness
    return found


def _bone(name: str, part: str, segment: Segment, length: float, mass: float, at: Places) -> Bone:
    """A segment of ``length`` m; de Leva's radii of gyration are relative to it."""
    shapes, centre = _outline(name, part, segment.centre * length, at)
    radii = segment.sagittal, segment.transverse, segment.longitudinal
    if part == 'foot':
        radii = segment.longitudinal, segment.transverse, segment.sagittal
    return Bone(name, Compound(shapes), mass, centre, color=COLORS.get(part, TROUSERS),
                moments=vector(mass * (radius * length) ** 2 for radius in radii))


def _outline(bone: str, part: str, centre: float, at: Places) -> tuple[tuple[Part, ...], Vector]:
    """Shapes of a bone about its centre of mass, and the position of that centre in the doll, m.

    ``centre``: distance of the centre of mass from the segment's proximal end; for a foot, from the
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
    """A capsule that extends half a radius beyond both joints, but not beyond the ankle."""
    girths = {'upper_arm': (BODY.biceps,), 'forearm': (BODY.forearm, BODY.wrist),
              'thigh': (BODY.thigh, BODY.lower_thigh), 'shin': (BODY.calf, BODY.ankle)}[part]
    thick = radius(sum(girths) / len(girths), wide)
    above, below = thick / 2, 0.0 if part == 'shin' else thick / 2
    whole = max(length + above + below - 2 * thick, MIN_CYLINDER * length) + 2 * thick
    return Part(Capsule(thick, whole - 2 * thick), (0, 0, centre + above - whole / 2))


def _head(at: Places, centre: float) -> tuple[Part, ...]:
    """The skull, from the vertex to the mid-gonion, and the neck below it."""
    thick, length = radius(BODY.head, at.tall), at.lengths['head']
    skull = Capsule(min(thick, 0.49 * length), length - 2 * min(thick, 0.49 * length))
    neck = Capsule(radius(BODY.neck, at.tall), max(at.neck, MIN_CYLINDER * length))
    return (Part(skull, (0, 0, centre - length / 2)),
            Part(neck, (0, 0, centre - length - at.neck / 2)))


def _check_sex(sex: str) -> None:
    if sex not in SEXES:
        raise errors.OutOfRange('sex', sex, ' or '.join(SEXES))
