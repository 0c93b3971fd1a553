"""Static bodies of a recipe, in the frame of the doll's heading at the start."""
from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from ..files.bodies import build_bodies
from ..files.schema import has_error_under, schema_errors
from ..model import errors, rotation
from ..model.errors import ModelError
from ..model.static_body import StaticBody


def read_bodies(data: dict, folder: Path) -> tuple[tuple[StaticBody, ...], list[ModelError]]:
    """Read the bodies of a recipe's data. Returns them and all their errors or, if they have none,
    the error of the first unknown name in ``floor``.

    Paths are relative to ``folder``.
    """
    found = [error for error in schema_errors('scene', {'dolls': [], **_only_bodies(data)})
             if has_error_under([error], 'bodies')]
    built = build_bodies(data, folder, found)
    bodies = tuple(built.static)
    found += [errors.WrongForm('bodies', body.name, 'bodies that never move, without mass and '
                               'follow') for body in built.loose]
    floor = data.get('floor', [])
    for index, name in enumerate(floor if isinstance(floor, list) else ()):
        if not found and not floor_names(bodies, [name]):
            found.append(errors.OutOfRange(f'floor[{index}]', name, errors.one_of(
                [body.name for body in bodies], str(name)) if bodies else 'a name of the bodies'))
    return bodies, found


def floor_names(bodies: tuple[StaticBody, ...], names: list[str]) -> list[str]:
    """Names of the bodies that ``names`` select: each body whose name is in ``names`` or begins
    with one of them and "_", as the names of the copies of a repeated body do.
    """
    return [body.name for body in bodies
            if any(body.name == name or body.name.startswith(f'{name}_') for name in names)]


def turned(bodies: tuple[StaticBody, ...], heading: np.ndarray) -> tuple[StaticBody, ...]:
    """Bodies rotated by the quaternion ``heading`` about the origin."""
    return tuple(dataclasses.replace(
        body, position=tuple(rotation.rotate(heading, body.position)),
        orientation=tuple(rotation.multiply(heading, body.orientation))) for body in bodies)


def _only_bodies(data: dict) -> dict:
    return {'bodies': data['bodies']} if 'bodies' in data else {}
