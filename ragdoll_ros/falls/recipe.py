"""A recipe: how falls are drawn, simulated and recorded; read and checked with all errors at once.

The form is that of config/recipe.schema.json.
"""
from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..files import yaml_text
from ..files.building import any_under, raise_or_give, read_named
from ..files.config import find
from ..files.doll import build_doll, doll_data
from ..files.schema import schema_errors
from ..model import errors
from ..model.errors import ModelError
from ..model.ragdoll import Ragdoll
from ..model.rotation import IDENTITY
from ..model.vectors import finite, unit
from .distribution import choices, distribution_errors, draw, support

DEFAULTS = {
    'seed': 0, 'feet': [], 'start': {}, 'pushes': [], 'ground': {}, 'accuracy': 'draft',
    'record': {}, 'phases': {}}
START = {
    'heading_deg': 0.0, 'lean_deg': 0.0, 'lean_towards_deg': 0.0, 'tumbled': False,
    'clearance': 0.0, 'velocity': [0.0, 0.0, 0.0], 'spin': [0.0, 0.0, 0.0], 'angles_deg': {}}
PUSH = {'towards_deg': 0.0, 'upwards_deg': 0.0, 'at': 0.0, 'duration': 0.1}
GROUND = {'friction': 0.7, 'restitution': 0.0, 'slope_deg': 0.0, 'downhill_deg': 0.0}
RECORD = {'rate': 100, 'what': ['poses', 'velocities', 'angles', 'touching'], 'imus': []}
IMU = {'position': [0.0, 0.0, 0.0], 'orientation': list(IDENTITY)}
PHASES = {'onset_speed': 0.1, 'rest_speed': 0.05}

DRAWN = ('seed', 'who', 'start', 'pushes', 'ground')
"""What falls are drawn from. Recipes that differ in nothing of it have the same falls, however
finely they are simulated and whatever of them is recorded."""

TURN = (-3600.0, 3600.0)
RANGES = {
    'start.heading_deg': TURN, 'start.lean_deg': (0, 180), 'start.lean_towards_deg': TURN,
    'start.clearance': (0, 100), 'start.velocity': (-100, 100), 'start.spin': (-100, 100),
    'start.other_angles': (0, 1), 'pushes.force': (0, 1e5), 'pushes.towards_deg': TURN,
    'pushes.upwards_deg': (-90, 90), 'pushes.at': (0, 600), 'pushes.duration': (1e-3, 600),
    'ground.friction': (0, math.inf), 'ground.restitution': (0, 1), 'ground.slope_deg': (0, 45),
    'ground.downhill_deg': TURN, 'duration': (0.1, 600), 'record.rate': (5, 5000),
    'phases.onset_speed': (0, 10), 'phases.rest_speed': (0, 10)}
"""Smallest and largest of what each value may be, in the units of the schema."""


@dataclass(frozen=True)
class Recipe:
    """What a file says, with its defaults filled in and its ``dolls`` read.

    ``data`` is plain, and names nothing outside itself.
    """

    name: str
    data: dict
    dolls: tuple[Ragdoll, ...]

    @property
    def frames(self) -> int:
        """Of each fall, the start's among them."""
        return round(self.data['duration'] * self.rate)

    @property
    def rate(self) -> int:
        """Frames in each s."""
        return self.data['record']['rate']

    @property
    def what(self) -> list[str]:
        """What of each frame is recorded."""
        return self.data['record']['what']

    @property
    def imus(self) -> list[dict]:
        """Sensors that are worn: name, bone, position m and orientation along the bone's axes."""
        return self.data['record']['imus']

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that the recipe says, in hexadecimal digits."""
        return _digest(self.data)

    @cached_property
    def _key(self) -> int:
        """What all draws depend on beside a fall's number: 128 bits of what is drawn from."""
        return int(_digest({key: self.data[key] for key in DRAWN})[:32], 16)

    def draw(self, number: int) -> dict:
        """All that is drawn for fall ``number``: the recipe's ``start``, ``pushes`` and ``ground``
        with a value in the place of each distribution, and which ``doll`` it is.

        By Philox (Salmon et al., Parallel Random Numbers: As Easy as 1, 2, 3, 2011), whose key is
        the recipe's and whose counter begins at the fall's number times 2^192: no fall needs
        another's.
        """
        errors.check_range('fall', number, 0, 2 ** 63)
        philox = np.random.Philox(key=self._key, counter=[0, 0, 0, number])
        generator = np.random.Generator(philox)
        values = draw({key: self.data[key] for key in ('start', 'pushes', 'ground')}, generator)
        values['doll'] = min(int(generator.random() * len(self.dolls)), len(self.dolls) - 1)
        if values['start']['tumbled']:
            values['start']['shares'] = generator.random(3).tolist()
        return values


def load_recipe(name: str | Path) -> Recipe:
    """Read a recipe by its path or its name in config/; ModelErrors with all that is wrong."""
    data, path = read_named(str(name))
    return raise_or_give(path, *build_recipe(data, path))


def recipe_of(data: dict) -> Recipe:
    """The recipe whose ``data`` this is."""
    dolls = [raise_or_give(Path('recipe'), *build_doll(doll)) for doll in data['who']['dolls']]
    return Recipe(data['name'], data, tuple(dolls))


def build_recipe(data: object, path: Path) -> tuple[Recipe | None, list[ModelError]]:
    """Make a recipe from what the YAML file at ``path`` holds: it, or None and every error."""
    found = schema_errors('recipe', data)
    if not isinstance(data, dict):
        return None, found
    dolls, more = _dolls(data, path)
    found += more
    found += [error for key, part in data.items() if not any_under(found, key)
              for error in distribution_errors(part, key)]
    found += list(_out_of_range(data, found))
    found += list(_wrong_imus(data, found))
    if dolls and not any(any_under(found, key) for key in ('feet', 'start', 'pushes', 'record')):
        found += _unknown_names(data, dolls)
    if found:
        return None, found
    whole = {**DEFAULTS, **data, 'who': {'dolls': [doll_data(doll) for doll in dolls]}}
    for key, defaults in (('start', START), ('ground', GROUND), ('record', RECORD),
                          ('phases', PHASES)):
        whole[key] = {**defaults, **whole[key]}
    whole['pushes'] = [{**PUSH, **push} for push in whole['pushes']]
    whole['record']['imus'] = [_mounted(mount) for mount in whole['record']['imus']]
    whole['start'] = _with_all_angles(whole['start'], dolls[0])
    name = whole.setdefault('name', path.stem)
    return Recipe(name, whole, tuple(dolls)), []


def _mounted(mount: dict) -> dict:
    """An IMU whose orientation is a unit quaternion; NotUnit for one that is none."""
    turn = unit('orientation', mount.get('orientation', IDENTITY), count=4)
    return {**IMU, **mount, 'orientation': list(turn)}


def _digest(data: object) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _dolls(data: dict, path: Path) -> tuple[list[Ragdoll], list[ModelError]]:
    """The dolls that a recipe names, and what is wrong with them."""
    dolls, found = [], []
    who = data.get('who')
    entries = who.get('dolls') if isinstance(who, dict) else None
    for index, entry in enumerate(entries if isinstance(entries, list) else ()):
        where = f'who.dolls[{index}]'
        if not isinstance(entry, (str, dict)):
            continue
        try:
            file = find(entry, beside=path.parent) if isinstance(entry, str) else path
            doll, more = build_doll(yaml_text.read(file) if isinstance(entry, str) else entry, file)
        except ModelError as error:
            found.append(error.at(where))
            continue
        found += [error.at(where) for error in more]
        if doll:
            dolls.append(doll)
            if _names(doll) != _names(dolls[0]):
                found.append(errors.WrongForm(where, doll.name, 'the bones and joint angles of '
                                              f'{dolls[0].name!r}, in the same order'))
    return dolls, found


def _names(doll: Ragdoll) -> tuple:
    return [bone.name for bone in doll.bones], _angle_names(doll)


def _angle_names(doll: Ragdoll) -> list[str]:
    return [name for joint in doll.joints for name in joint.angle_names]


def _out_of_range(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """Values of which some would be out of their ranges."""
    for key, bounds in RANGES.items():
        for path, value in _values(data, key):
            if any_under(found, path) or isinstance(value, (str, bool)):
                continue
            low, high = support(value)
            if not bounds[0] <= low <= high <= bounds[1]:
                yield errors.OutOfRange(path, value, f'{bounds[0]:g} to {bounds[1]:g}')


def _values(data: object, key: str, path: str = '') -> Iterator[tuple[str, object]]:
    """Where a key like ``pushes.force`` stands in the data, and what stands there."""
    if isinstance(data, list):
        for index, part in enumerate(data):
            yield from _values(part, key, f'{path}[{index}]')
    elif not key:
        yield path, data
    elif isinstance(data, dict):
        first, _, rest = key.partition('.')
        if first in data:
            yield from _values(data[first], rest, f'{path}.{first}' if path else first)


def _wrong_imus(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """IMUs of one name, or whose place or orientation is none."""
    if any_under(found, 'record'):
        return
    names = []
    for index, mount in enumerate(data.get('record', {}).get('imus', ())):
        where = f'record.imus[{index}]'
        try:
            finite('position', mount.get('position', IMU['position']))
            _mounted(mount)
        except ModelError as error:
            yield error.at(where)
        if mount['name'] in names:
            yield errors.DuplicateName(f'{where}.name', mount['name'], 'a name of its own')
        names.append(mount['name'])


def _unknown_names(data: dict, dolls: list[Ragdoll]) -> Iterator[ModelError]:
    """Bones and joint angles that the dolls do not have, and angles beyond their limits."""
    bones, _ = _names(dolls[0])
    named = [(f'feet[{index}]', name) for index, name in enumerate(data.get('feet', ()))]
    named += [(f'pushes[{index}].bone', name) for index, push in enumerate(data.get('pushes', ()))
              for name in choices(push['bone'])]
    imus = data.get('record', {}).get('imus', ())
    named += [(f'record.imus[{index}].bone', mount['bone']) for index, mount in enumerate(imus)]
    for path, name in named:
        if name not in bones:
            yield errors.UnknownBone(path, name, errors.one_of(bones, name))
    for name, value in data.get('start', {}).get('angles_deg', {}).items():
        path, ranges = f'start.angles_deg.{name}', [_ranges(doll).get(name) for doll in dolls]
        if name not in _angle_names(dolls[0]):
            yield errors.WrongForm(path, name, errors.one_of(_angle_names(dolls[0]), name))
            continue
        low = max((pair[0] for pair in ranges if pair), default=-360.0)
        high = min((pair[1] for pair in ranges if pair), default=360.0)
        least, most = support(value)
        if not low - 1e-9 <= least <= most <= high + 1e-9:
            yield errors.OutOfRange(path, value, f'{low:g} to {high:g}, the limits of the joint')


def _ranges(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Limits of each limited joint angle, degrees."""
    return {name: tuple(round(math.degrees(angle), 9) for angle in pair) for joint in doll.joints
            for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True) if pair}


def _with_all_angles(start: dict, doll: Ragdoll) -> dict:
    """The start with a share of its range for each limited angle that is not given itself."""
    start = dict(start)
    share = start.pop('other_angles', None)
    others = sorted(set(_ranges(doll)) - set(start['angles_deg']))
    start['angle_shares'] = {} if share is None else dict.fromkeys(others, share)
    return start
