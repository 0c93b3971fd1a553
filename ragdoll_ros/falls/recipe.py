"""A recipe: how falls are drawn, simulated and recorded; read and checked with all errors at once.

The form is that of config/recipe.schema.json.
"""
from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..files import yaml_text
from ..files.building import read_by_name, value_or_raise
from ..files.config import find
from ..files.doll import build_doll, doll_data
from ..files.schema import schema_errors
from ..model import errors
from ..model.errors import ModelError
from ..model.ragdoll import Ragdoll
from ..people import person, standard
from .checks import RATE, mounted, names_of, ranges_of, value_errors
from .distribution import draw

DEFAULTS = {
    'seed': 0, 'feet': [], 'start': {}, 'pushes': [], 'limp': [], 'ground': {}, 'accuracy': 'draft',
    'record': {}, 'phases': {}}
START = {
    'heading_deg': 0.0, 'lean_deg': 0.0, 'lean_towards_deg': 0.0, 'tumbled': False,
    'clearance': 0.0, 'velocity': [0.0, 0.0, 0.0], 'spin': [0.0, 0.0, 0.0], 'angles_deg': {}}
PUSH = {'towards_deg': 0.0, 'upwards_deg': 0.0, 'at': 0.0, 'duration': 0.1}
GROUND = {'friction': 0.7, 'restitution': 0.0, 'slope_deg': 0.0, 'downhill_deg': 0.0}
RECORD = {'rate': RATE, 'what': ['poses', 'velocities', 'angles', 'touching'], 'imus': []}
PHASES = {'onset_speed': 0.1, 'rest_speed': 0.05}

DRAWN = ('seed', 'who', 'start', 'pushes', 'limp', 'ground')
"""What falls are drawn from. Recipes that differ in nothing of it have the same falls, however
finely they are simulated and whatever of them is recorded."""

@dataclass(frozen=True)
class Recipe:
    """What a file says, with its defaults filled in and its ``dolls`` read; of people, one of
    middle size, of whose bones and joints they all are.

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
    def parts(self) -> int:
        """Samples of a sensor in each frame."""
        return self.data['record'].get('imu_rate', self.rate) // self.rate

    @property
    def imus(self) -> list[dict]:
        """Sensors that are worn: name, bone, position m and orientation along the bone's axes, and
        of ImuErrors what is given.
        """
        return self.data['record']['imus']

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that the recipe says, in hexadecimal digits."""
        return _digest(self.data)

    @cached_property
    def key(self) -> int:
        """What all draws depend on beside a fall's number: 128 bits of what is drawn from."""
        return int(_digest({key: self.data[key] for key in DRAWN})[:32], 16)

    def doll(self, who: dict | int) -> Ragdoll:
        """Who falls, as draw() tells."""
        if isinstance(who, int):
            return self.dolls[who]
        return person(who['height'], who['bmi'] * who['height'] ** 2, who['sex'])

    def draw(self, number: int) -> dict:
        """All that is drawn for fall ``number``: the recipe's ``start``, ``pushes``, ``limp`` and
        ``ground`` with a value in the place of each distribution, and ``who`` falls: the number of
        a doll, or a person's sex, height m and bmi kg/m^2.

        By Philox (Salmon et al., Parallel Random Numbers: As Easy as 1, 2, 3, 2011), whose key is
        the recipe's and whose counter begins at the fall's number times 2^192: no fall needs
        another's.
        """
        errors.check_range('fall', number, 0, 2 ** 63)
        philox = np.random.Philox(key=self.key, counter=[0, 0, 0, number])
        generator = np.random.Generator(philox)
        values = draw({key: self.data[key] for key in ('start', 'pushes', 'limp', 'ground')},
                      generator)
        groups = self.data['who'].get('people') or self.dolls
        chosen = min(int(generator.random() * len(groups)), len(groups) - 1)
        values['who'] = draw(groups[chosen], generator) if 'people' in self.data['who'] else chosen
        if values['start']['tumbled']:
            values['start']['shares'] = generator.random(3).tolist()
        return values


def load_recipe(name: str | Path) -> Recipe:
    """Read a recipe by its path or its name in config/; ModelErrors with all that is wrong."""
    data, path = read_by_name(str(name))
    return value_or_raise(path, *build_recipe(data, path))


def recipe_of(data: dict) -> Recipe:
    """The recipe whose ``data`` this is."""
    dolls = [value_or_raise(Path('recipe'), *build_doll(doll))
             for doll in data['who'].get('dolls', ())] or [person(*standard('female'), 'female')]
    return Recipe(data['name'], data, tuple(dolls))


def build_recipe(data: object, path: Path) -> tuple[Recipe | None, list[ModelError]]:
    """Make a recipe from what the YAML file at ``path`` holds: it, or None and every error."""
    found = schema_errors('recipe', data)
    if not isinstance(data, dict):
        return None, found
    dolls, more = _dolls(data, path)
    found += more
    found += value_errors(data, dolls, found)
    if found:
        return None, found
    whole = {**DEFAULTS, **data}
    if 'dolls' in data['who']:
        whole['who'] = {'dolls': [doll_data(doll) for doll in dolls]}
    for key, defaults in (('start', START), ('ground', GROUND), ('record', RECORD),
                          ('phases', PHASES)):
        whole[key] = {**defaults, **whole[key]}
    whole['pushes'] = [{**PUSH, **push} for push in whole['pushes']]
    whole['record']['imus'] = [{**mount, **mounted(mount)} for mount in whole['record']['imus']]
    whole['start'] = _with_all_angles(whole['start'], dolls[0])
    name = whole.setdefault('name', path.stem)
    return Recipe(name, whole, tuple(dolls)), []


def _digest(data: object) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _dolls(data: dict, path: Path) -> tuple[list[Ragdoll], list[ModelError]]:
    """The dolls that a recipe names, and what is wrong with them."""
    dolls, found = [], []
    who = data.get('who')
    if isinstance(who, dict) and set(who) == {'people'}:
        return [person(*standard('female'), 'female')], []
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
            if names_of(doll) != names_of(dolls[0]):
                found.append(errors.WrongForm(where, doll.name, 'the bones and joint angles of '
                                              f'{dolls[0].name!r}, in the same order'))
    return dolls, found


def _with_all_angles(start: dict, doll: Ragdoll) -> dict:
    """The start with a share of its range for each limited angle that is not given itself."""
    start = dict(start)
    share = start.pop('other_angles', None)
    others = sorted(set(ranges_of(doll)) - set(start['angles_deg']))
    start['angle_shares'] = {} if share is None else dict.fromkeys(others, share)
    return start
