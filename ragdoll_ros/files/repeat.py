"""`repeat:` of a doll or a body in a scene: copies in a row, on a grid, scattered, or all of it."""
import dataclasses
import math
from typing import TypeVar

import numpy as np

from ..model import rotation
from ..model.scene import Placement
from ..model.static_body import StaticBody
from ..model.vectors import Vector
from .robots.robot_bodies import PlacedRobot

Placed = TypeVar('Placed', Placement, StaticBody, PlacedRobot)


def repeated(first: Placed, repeat: dict, center: np.ndarray | None = None) -> list[Placed]:
    """Return copies of a doll or a body, named ``name_1`` on; ``repeat`` as in scene.schema.json.

    Each copy is ``shift`` farther than the one before. A grid starts at the first's position and
    fills x, then y, then z; each copy is then moved by up to half of ``spread`` along each axis.
    The same seed gives the same copies. ``turned: yaw`` rotates each copy by up to 180 degrees
    about the vertical through ``center`` (3,) m, in the first's frame: by default the doll's centre
    of mass or the body's origin. ``turned: true`` gives it a random orientation about the origin of
    its frame.
    """
    count, rng = int(repeat['count']), np.random.default_rng(int(repeat.get('seed', 0)))
    columns = repeat.get('columns') or [math.ceil(math.sqrt(count))] * 2
    wide, deep = (int(number) for number in columns)
    grid, spread, shift = (np.array(repeat.get(key, (0.0, 0.0, 0.0)), float)
                           for key in ('grid', 'spread', 'shift'))
    if center is None:
        center = first.mass_centre if isinstance(first, Placement) else np.zeros(3)
    copies = []
    for k in range(count):
        cell = np.array([k % wide, k // wide % deep, k // (wide * deep)])
        place = (np.array(first.position) + cell * grid + k * shift
                 + spread * rng.uniform(-0.5, 0.5, 3))
        turn: tuple[float, ...] = first.orientation
        if repeat.get('turned') == 'yaw':
            place, turn = _yawed(first.orientation, center, place, rng.uniform(0, math.pi))
        elif repeat.get('turned'):
            turn = tuple(rotation.normalized(rng.normal(size=4)))
        copies.append(dataclasses.replace(first, name=f'{first.name}_{k + 1}',
                                          position=tuple(place.tolist()), orientation=turn))
    return copies


def _yawed(orientation: Vector, center: np.ndarray, place: np.ndarray,
           angle: float) -> tuple[np.ndarray, tuple[float, ...]]:
    """Return position (3,) m and orientation of a copy, rotated by ``angle`` rad about the vertical
    through ``center`` (3,) m of its frame; ``place`` and ``orientation`` are those before.
    """
    turn = rotation.from_axis_angle((0.0, 0.0, 1.0), angle)
    arm = rotation.rotate(orientation, center)
    turned = rotation.normalized(rotation.multiply(turn, np.array(orientation)))
    return place + arm - rotation.rotate(turn, arm), tuple(turned.tolist())
