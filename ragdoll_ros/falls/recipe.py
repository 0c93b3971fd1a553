"""A recipe: how falls are drawn, simulated and recorded. All errors found are reported at once; a
check is skipped if a part of the data that it reads has an error.

Its schema is config/recipe.schema.json.
"""
import hashlib
import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..files import yaml_text
from ..files.bodies import body_data
from ..files.config import RECIPES, find
from ..files.doll import build_doll, doll_data
from ..files.schema import is_marked, read_by_name, schema_errors, value_or_raise
from ..model import errors
from ..model.errors import ModelError
from ..model.ragdoll import Ragdoll
from ..model.static_body import StaticBody
from ..people import person, standard
from ..people.fall_phases import ONSET_SPEED, REST_SPEED
from .bodies import floor_names, read_bodies
from .checks import RATE, angle_limits_deg, checked_mount, names_of, value_errors
from .distribution import draw, shifted_means

DEFAULTS = {
    'seed': 0, 'feet': [], 'start': {}, 'pushes': [], 'limp': [], 'ground': {}, 'accuracy': 'draft',
    'record': {}, 'phases': {}}
START = {
    'heading_deg': 0.0, 'lean_deg': 0.0, 'lean_towards_deg': 0.0, 'tumbled': False,
    'clearance': 0.0, 'velocity': [0.0, 0.0, 0.0], 'spin': [0.0, 0.0, 0.0], 'angles_deg': {}}
PUSH = {'towards_deg': 0.0, 'upwards_deg': 0.0, 'at': 0.0, 'duration': 0.1}
GROUND = {'friction': 0.7, 'restitution': 0.0, 'slope_deg': 0.0, 'downhill_deg': 0.0}
RECORD = {'rate': RATE, 'what': ['poses', 'velocities', 'angles', 'touching'], 'imus': []}
PHASES = {'onset_speed': ONSET_SPEED, 'rest_speed': REST_SPEED}

DRAWN = ('seed', 'who', 'start', 'pushes', 'limp', 'ground', 'grabs')
"""Keys that determine the draws: recipes that agree in these draw the same values."""

GRAB = {'at': 0.0, 'duration': 0.1}


@dataclass(frozen=True)
class Recipe:
    """A recipe's ``data`` with defaults filled in, and its ``dolls``. A recipe of people has one
    doll, of average size, with the bones and joints that all people have.

    ``data`` is plain JSON data and refers to no other file.
    """

    name: str
    data: dict
    dolls: tuple[Ragdoll, ...]
    bodies: tuple[StaticBody, ...] = ()
    """Bodies beside the doll, their x axis along its heading."""

    @property
    def falls(self) -> bool:
        """Whether the recipe is of falls: its cause is not `no_fall`, and phases are looked for."""
        return self.data.get('cause') != 'no_fall'

    @property
    def floor(self) -> list[str]:
        """Names of the bodies that count as ground."""
        return self.data.get('floor', [])

    @property
    def frames(self) -> int:
        """Number of frames of each fall, including the start."""
        return round(self.data['duration'] * self.rate)

    @property
    def rate(self) -> int:
        """Frames per second."""
        return self.data['record']['rate']

    @property
    def recorded(self) -> list[str]:
        """Quantities recorded in each frame."""
        return self.data['record']['what']

    @property
    def samples_per_frame(self) -> int:
        """Sensor samples in each frame."""
        return self.data['record'].get('imu_rate', self.rate) // self.rate

    @property
    def imus(self) -> list[dict]:
        """Inertial sensors: name, bone, position m and orientation on the bone, `contact_pulse`,
        and fields of ImuResponse and ImuErrors.
        """
        return self.data['record']['imus']

    @property
    def warnings(self) -> list[str]:
        """Warnings of distributions whose bounds shift their means, which may not be intended."""
        return list(shifted_means({key: part for key, part in self._drawn.items() if key != 'seed'
                                   and not (key == 'who' and 'dolls' in part)}))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the recipe's data, in hexadecimal digits."""
        return _digest(self.data)

    @cached_property
    def philox_key(self) -> int:
        """Key of the random generator, 128 bits: a hash of the data of the DRAWN keys, without the
        stiffness of the ground.
        """
        return int(_digest(self._drawn)[:32], 16)

    @property
    def stiffness(self) -> float:
        """Stiffness of what lies on the ground, N/m; infinite if nothing does or it is rigid."""
        return self.data['ground'].get('stiffness', math.inf)

    @property
    def _drawn(self) -> dict:
        """Data of the DRAWN keys, without the stiffness, which no motion depends on."""
        ground = {key: value for key, value in self.data['ground'].items() if key != 'stiffness'}
        return {key: ground if key == 'ground' else self.data[key]
                for key in DRAWN if key in self.data}

    def doll(self, who: dict | int) -> Ragdoll:
        """The doll that falls; ``who`` is as returned by draw()."""
        if isinstance(who, int):
            return self.dolls[who]
        return person(who['height'], who['bmi'] * who['height'] ** 2, who['sex'],
                      passive=who.get('passive', False))

    def draw(self, number: int) -> dict:
        """Draw the values of fall ``number``: the recipe's ``start``, ``pushes``, ``limp``,
        ``grabs`` and ``ground`` (without stiffness) with a value in the place of each distribution;
        and ``who``, the index of the doll that falls, or the person's sex, height m and bmi kg/m^2.

        The generator is Philox (Salmon et al., Parallel Random Numbers: As Easy as 1, 2, 3, 2011);
        its counter begins at the fall's number times 2^192, so falls are drawn independently.
        """
        errors.check_range('fall', number, 0, 2 ** 63)
        philox = np.random.Philox(key=self.philox_key, counter=[0, 0, 0, number])
        generator = np.random.Generator(philox)
        values = draw({key: part for key, part in self._drawn.items()
                       if key not in ('seed', 'who')}, generator)
        groups = self.data['who'].get('people') or self.dolls
        chosen = min(int(generator.random() * len(groups)), len(groups) - 1)
        values['who'] = draw(groups[chosen], generator) if 'people' in self.data['who'] else chosen
        if values['start']['tumbled']:
            values['start']['shares'] = generator.random(3).tolist()
        return values


def load_recipe(name: str | Path) -> Recipe:
    """Read a recipe by its path or its name in config/recipes/. Raises ModelErrors with all errors
    found.
    """
    data, path = read_by_name(str(name), RECIPES)
    return value_or_raise(path, *build_recipe(data, path))


def recipe_of(data: dict) -> Recipe:
    """The recipe with this complete ``data``."""
    dolls = [value_or_raise(Path('recipe'), *build_doll(doll))
             for doll in data['who'].get('dolls', ())] or [person(*standard('female'), 'female')]
    bodies, found = read_bodies(data, Path())
    return Recipe(data['name'], data, tuple(dolls), value_or_raise(Path('recipe'), bodies, found))


def build_recipe(data: object, path: Path) -> tuple[Recipe | None, list[ModelError]]:
    """Make a recipe from the data of the YAML file at ``path``. Returns the recipe and no errors,
    or None and all errors found.
    """
    found = schema_errors('recipe', data)
    if not is_marked(data, 'recipe'):
        return None, found
    dolls, more = _dolls(data, path)
    found += more
    bodies, more = read_bodies(data, path.parent)
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
    whole['record']['imus'] = [
        {**mount, **checked_mount(mount)} for mount in whole['record']['imus']]
    whole['start'] = _with_all_angles(whole['start'], dolls[0])
    # Keys without a default, so that recipes without them have the falls that they had.
    if 'grabs' in data:
        whole['grabs'] = [{**GRAB, **grab} for grab in data['grabs']]
    if 'bodies' in data:
        whole['bodies'] = [body_data(body) for body in bodies]
        whole['floor'] = floor_names(bodies, data.get('floor', []))
    name = whole.setdefault('name', path.stem)
    return Recipe(name, whole, tuple(dolls), bodies), []


def _digest(data: object) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _dolls(data: dict, path: Path) -> tuple[list[Ragdoll], list[ModelError]]:
    """The dolls that a recipe names, and their errors."""
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
    """The start with ``angle_shares`` instead of ``other_angles``: this share of its range for each
    limited angle not given; empty without ``other_angles``.
    """
    start = dict(start)
    share = start.pop('other_angles', None)
    others = sorted(set(angle_limits_deg(doll)) - set(start['angles_deg']))
    start['angle_shares'] = {} if share is None else dict.fromkeys(others, share)
    return start
