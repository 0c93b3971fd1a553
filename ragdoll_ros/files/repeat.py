"""`repeat:` of a doll in a scene's file: the same doll many times, on a grid, strewn, or both."""
from __future__ import annotations

import dataclasses
import math

import numpy as np

from ..model import rotation
from ..model.scene import Placement


def repeated(first: Placement, repeat: dict) -> list[Placement]:
    """Copies of a placement, named ``name_1`` on; see scene.schema.json for ``repeat``.

    The grid grows from the first's place along x, then y, then z; each copy is then moved by up to
    half of ``spread`` along each axis. The same seed gives the same copies.
    """
    count, rng = int(repeat['count']), np.random.default_rng(int(repeat.get('seed', 0)))
    columns = repeat.get('columns') or [math.ceil(math.sqrt(count))] * 2
    wide, deep = (int(number) for number in columns)
    grid = np.array(repeat.get('grid', (0.0, 0.0, 0.0)), float)
    spread = np.array(repeat.get('spread', (0.0, 0.0, 0.0)), float)
    copies = []
    for k in range(count):
        cell = np.array([k % wide, k // wide % deep, k // (wide * deep)])
        place = np.array(first.position) + cell * grid + spread * rng.uniform(-0.5, 0.5, 3)
        turn = first.orientation
        if repeat.get('turned'):
            turn = tuple(rotation.normalized(rng.normal(size=4)))
        copies.append(dataclasses.replace(first, name=f'{first.name}_{k + 1}',
                                          position=tuple(place.tolist()), orientation=turn))
    return copies
