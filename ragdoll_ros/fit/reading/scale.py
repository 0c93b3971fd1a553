"""How many metres one unit of a character's file has.

glTF's unit is the metre (2.0, section 3.4), but many files keep that of the program that wrote
them. What is known decides: a person's height, else that no animal is longer than TALLEST.
"""
from __future__ import annotations

import numpy as np

from ...model import errors
from ..roles.names import roles_of
from ..roles.person import is_person

UNITS = {0.01: 'centimetres', 0.001: 'millimetres', 0.0254: 'inches', 0.3048: 'feet',
         0.1: 'decimetres', 100.0: 'hundreds of metres (a scale of 0.01 applied twice)'}
"""Metres to the units that programs export in, the commonest first."""

PERSON, ADULT = (0.25, 3.0), (0.9, 2.3)
"""m: heights of persons and puppets that are believed, and for which a unit is looked for."""

USUAL = 1.75
"""m, of a person where no unit fits; half an animal's length there."""

LONG, TALLEST, SMALLEST = 20.0, 100.0, 0.05
"""m: what is longer is worth a warning, too long for metres, or too short."""

FILE = (0.002, 30_000.0)
"""Sizes beyond which no unit is known."""


def metres_per_unit(names: tuple[str, ...], parents: tuple[int, ...], positions: np.ndarray,
                    vertices: np.ndarray, notes: list[str]) -> float:
    """Metres to one unit, with a note where it is a guess; OutOfRange for a skin without a size.

    Bones by name, parent and place (n, 3), skin (v, 3), z up, in the file's units.
    """
    extents = np.ptp(vertices, axis=0)
    size = float(extents.max())
    if not 0 < size < 1e30:
        raise errors.OutOfRange('meshes', size, 'a skin with a size')
    if is_person(roles_of(names, parents), positions):
        what, size = 'a person', float(extents[2])
        metres, unit = _of_person(size)
    else:
        what = 'a character'
        metres, unit = _of_other(size)
    if metres != 1:
        notes.append(f'{what} of {size:.4g} units smells of {unit}: one unit is taken for '
                     f'{metres:.4g} m (--scale says otherwise)')
    elif size > LONG:
        notes.append(f'{what} of {size:.4g} units is taken to be as many metres long, as glTF has '
                     'it (--scale says otherwise)')
    return metres


def _of_person(height: float) -> tuple[float, str]:
    if PERSON[0] <= height <= PERSON[1]:
        return 1.0, 'metres'
    return next(((metres, unit) for metres, unit in UNITS.items()
                 if ADULT[0] <= height * metres <= ADULT[1]), (USUAL / height, 'no known unit'))


def _of_other(size: float) -> tuple[float, str]:
    if SMALLEST <= size <= TALLEST:
        return 1.0, 'metres'
    if FILE[0] < size < FILE[1]:
        metres = 100.0 if size < SMALLEST else 0.01 if size <= 1000 else 0.001
        return metres, UNITS[metres]
    return 2 * USUAL / size, 'no known unit'
