"""Length unit of a character's file.

glTF's unit is the metre (2.0, section 3.4), but many files keep the unit of their editor. The
estimate uses a person's height, else that no animal is longer than MAX_EXTENT.
"""
import numpy as np

from ...files.bone_names.names import roles_of
from ...model import errors
from ..roles.person import is_person

UNITS = {0.01: 'centimetres', 0.001: 'millimetres', 0.0254: 'inches', 0.3048: 'feet',
         0.1: 'decimetres', 100.0: 'hundreds of metres (a scale of 0.01 applied twice)'}
"""Metres per unit of the units that editors export, the most common first."""

PERSON_HEIGHTS, ADULT_HEIGHTS = (0.25, 3.0), (0.9, 2.3)
"""m: heights of persons (and puppets) that need no other unit, and that another unit must give."""

DEFAULT_HEIGHT = 1.75
"""m, of a person where no unit fits; an animal then has twice this length."""

LONG_EXTENT, MAX_EXTENT, MIN_EXTENT = 20.0, 100.0, 0.05
"""m: longer files get a warning; sizes in m are at most, at least these."""

KNOWN_EXTENTS = (0.002, 30_000.0)
"""Extents, in units of the file, between which a unit is estimated."""


def metres_per_unit(names: tuple[str, ...], parents: tuple[int, ...], positions: np.ndarray,
                    vertices: np.ndarray, notes: list[str]) -> float:
    """Metres per unit, with a note where it is an estimate.

    ``names``, ``parents`` and ``positions`` (n, 3) are those of the bones, ``vertices`` (v, 3)
    those of the skin, z up, in units of the file. Raises OutOfRange for a skin without an extent.
    """
    extents = np.ptp(vertices, axis=0)
    size = float(extents.max())
    if not 0 < size < 1e30:
        raise errors.OutOfRange('meshes', size, 'a skin with a size')
    if is_person(roles_of(names, parents), positions):
        what, size = 'a person', float(extents[2])
        metres, unit = _person_unit(size)
    else:
        what = 'a character'
        metres, unit = _other_unit(size)
    if metres != 1:
        notes.append(f'{what} of {size:.4g} units suggests {unit}: a unit of {metres:.4g} m is '
                     'assumed (set it with --scale)')
    elif size > LONG_EXTENT:
        notes.append(f'{what} of {size:.4g} units: metres are assumed, as glTF specifies (set the '
                     'unit with --scale)')
    return metres


def _person_unit(height: float) -> tuple[float, str]:
    if PERSON_HEIGHTS[0] <= height <= PERSON_HEIGHTS[1]:
        return 1.0, 'metres'
    low, high = ADULT_HEIGHTS
    return next(((metres, unit) for metres, unit in UNITS.items()
                 if low <= height * metres <= high), (DEFAULT_HEIGHT / height, 'no known unit'))


def _other_unit(size: float) -> tuple[float, str]:
    if MIN_EXTENT <= size <= MAX_EXTENT:
        return 1.0, 'metres'
    if KNOWN_EXTENTS[0] < size < KNOWN_EXTENTS[1]:
        metres = 100.0 if size < MIN_EXTENT else 0.01 if size <= 1000 else 0.001
        return metres, UNITS[metres]
    return 2 * DEFAULT_HEIGHT / size, 'no known unit'
