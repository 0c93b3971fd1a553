"""`repeat:` of a doll in a scene's file: copies on a grid, scattered, or both."""
from __future__ import annotations

import dataclasses
import math

import numpy as np

from ..model import rotation
from ..model.scene import Placement


def repeated_placements(first: Placement, repeat: dict) -> list[Placement]:
    """Copies of a placement, named ``name_1`` on; ``repeat`` as in scene.schema.json.

    The grid starts at the first's position and fills x, then y, then z; each copy is then moved by
    up to half of ``spread`` along each axis. The same seed gives the same copies. ``turned: yaw``
    rotates by up to 180 degrees about the vertical through the centre of mass, any other by a
    random rotation about the origin of the doll's frame.
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
        if repeat.get('turned') == 'yaw':
            place, turn = _yawed(first, place, rng.uniform(0, math.pi))
        elif repeat.get('turned'):
            turn = tuple(rotation.normalized(rng.normal(size=4)))
        copies.append(dataclasses.replace(first, name=f'{first.name}_{k + 1}',
                                          position=tuple(place.tolist()), orientation=turn))
    return copies


def _yawed(first: Placement, place: np.ndarray,
           angle: float) -> tuple[np.ndarray, tuple[float, ...]]:
    """Position (3,) m and orientation of a copy, rotated by ``angle`` rad about the vertical
    through its centre of mass; before, its frame is at ``place``.
    """
    turn = rotation.from_axis_angle((0.0, 0.0, 1.0), angle)
    arm = rotation.rotate(first.orientation, first.doll.mass_centre)
    orientation = rotation.normalized(rotation.multiply(turn, np.array(first.orientation)))
    return place + arm - rotation.rotate(turn, arm), tuple(orientation.tolist())
