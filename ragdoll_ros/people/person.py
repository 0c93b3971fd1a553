"""A person of a height, mass and sex as a doll: 16 segments after de Leva 1996.

It stands: arms down, palms forwards, soles on z = 0, x forwards. Masses, centres and inertias are
the table's, normalised to the whole; lengths are the table's shares of the height, and the neck is
what is left of it (see anthropometry.py). Shapes do not weigh: they are what touches.
"""
from __future__ import annotations

from ..model import errors
from ..model.anthropometry import PERCENTILES, SAMPLES, SEXES, Segment, mass_fractions
from ..model.compound import Compound
from ..model.ragdoll import Bone, Ragdoll
from ..model.vectors import vector
from .joints import joints
from .places import Places, places
from .shapes import outline

HEIGHTS, MASSES = (1.0, 2.1), (15.0, 160.0)
"""m and kg, between which people were tried. The tables are of adults: a small one is no child."""

SKIN = (0.90, 0.75, 0.60, 1.0)

COLORS = {'head': SKIN, 'forearm': SKIN, 'hand': SKIN, 'chest': (0.25, 0.45, 0.70, 1.0),
          'abdomen': (0.25, 0.45, 0.70, 1.0), 'upper_arm': (0.30, 0.52, 0.78, 1.0),
          'foot': (0.25, 0.25, 0.28, 1.0)}
TROUSERS = (0.35, 0.38, 0.45, 1.0)


def standard(sex: str, percentile: int = 50) -> tuple[float, float]:
    """Height, m, and mass, kg, at a percentile (5, 50 or 95) of ANSUR II."""
    _check_sex(sex)
    if percentile not in PERCENTILES[sex]:
        raise errors.OutOfRange('percentile', percentile, '5, 50 or 95')
    return PERCENTILES[sex][percentile]


def person(height: float, mass: float, sex: str, name: str = 'person') -> Ragdoll:
    """The doll of an adult, standing, by de Leva's anthropometric tables.

    Args:
        height: m, 1.0 to 2.1.
        mass: kg, 15 to 160.
        sex: 'female' or 'male'.
        name: of the doll.

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
    return Ragdoll(name, tuple(bones), joints(at, height, mass))


def _bone(name: str, part: str, segment: Segment, length: float, mass: float, at: Places) -> Bone:
    """A segment of ``length`` m; de Leva's radii of gyration are shares of that."""
    shapes, centre = outline(name, part, segment.centre * length, at)
    radii = segment.sagittal, segment.transverse, segment.longitudinal
    if part == 'foot':
        radii = segment.longitudinal, segment.transverse, segment.sagittal
    return Bone(name, Compound(shapes), mass, centre, color=COLORS.get(part, TROUSERS),
                moments=vector(mass * (radius * length) ** 2 for radius in radii))


def _check_sex(sex: str) -> None:
    if sex not in SEXES:
        raise errors.OutOfRange('sex', sex, ' or '.join(SEXES))

