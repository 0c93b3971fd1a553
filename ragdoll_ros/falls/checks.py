"""Validate a recipe's values, beyond its schema."""
import math
from collections.abc import Iterator

from ..files.schema import has_error_under
from ..model import errors
from ..model.errors import ModelError
from ..model.ragdoll import Ragdoll
from ..model.rotation import IDENTITY
from ..model.vectors import finite_floats, unit_vector
from ..people.person import HEIGHTS, MASSES
from ..physics.simulation import MAX_SAMPLES_PER_TICK
from .distribution import choices, distribution_errors, support
from .fall import flaws_of, response_of

RATE = 100
"""Default frames per second."""

TURN = (-3600.0, 3600.0)
RANGES = {
    'who.people.height': HEIGHTS, 'who.people.bmi': (5, 100),
    'start.heading_deg': TURN, 'start.lean_deg': (0, 180), 'start.lean_towards_deg': TURN,
    'start.clearance': (0, 100), 'start.velocity': (-100, 100), 'start.spin': (-100, 100),
    'start.other_angles': (0, 1), 'pushes.force': (0, 1e5), 'pushes.towards_deg': TURN,
    'start.walk.speed': (0.1, 3), 'limp.at': (0, 600), 'grabs.at': (0, 600),
    'grabs.duration': (1e-3, 600), 'grabs.to': (-100, 100), 'grabs.takes': (1e-3, 600),
    'pushes.upwards_deg': (-90, 90), 'pushes.at': (0, 600), 'pushes.duration': (1e-3, 600),
    'ground.friction': (0, math.inf), 'ground.friction_under.*': (0, 100),
    'ground.restitution': (0, 1), 'ground.slope_deg': (0, 45),
    'ground.downhill_deg': TURN, 'duration': (0.1, 600), 'record.rate': (5, 5000),
    'phases.onset_speed': (0, 10), 'phases.rest_speed': (0, 10)}
"""Smallest and largest admissible value by key, in the units of the schema."""


def value_errors(data: dict, dolls: list[Ragdoll], found: list[ModelError]) -> list[ModelError]:
    """Further errors of the data, besides those already ``found``; ``dolls`` are the recipe's.
    Names are checked only if no part of the data that holds them has another error.
    """
    more = [error for key, part in data.items() if not has_error_under(found, key)
            for error in distribution_errors(part, key)]
    for check in (_out_of_range, _wrong_people, _wrong_limp, _wrong_walk, _wrong_rate, _wrong_imus):
        more += list(check(data, [*found, *more]))
    if dolls and not any(has_error_under([*found, *more], key) for key in (
            'feet', 'start', 'pushes', 'limp', 'grabs', 'ground', 'record')):
        more += _unknown_names(data, dolls)
    return more


def checked_mount(mount: dict) -> dict:
    """Position m and unit quaternion of an IMU on its bone; NotFinite, NotUnit."""
    return {'position': list(finite_floats('position', mount.get('position', (0, 0, 0)))),
            'orientation': list(unit_vector('orientation', mount.get('orientation', IDENTITY),
                                            count=4))}


def names_of(doll: Ragdoll) -> tuple:
    """Names of all bones, and of all joint angles."""
    return [bone.name for bone in doll.bones], _angle_names(doll)


def _angle_names(doll: Ragdoll) -> list[str]:
    return [name for joint in doll.joints for name in joint.angle_names]


def _out_of_range(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """Values or distributions that leave their RANGES."""
    for key, bounds in RANGES.items():
        for path, value in _values(data, key):
            if has_error_under(found, path) or isinstance(value, (str, bool)):
                continue
            low, high = support(value)
            if not bounds[0] <= low <= high <= bounds[1]:
                yield errors.OutOfRange(path, value, f'{bounds[0]:g} to {bounds[1]:g}')


def _values(data: object, key: str, path: str = '') -> Iterator[tuple[str, object]]:
    """Paths in the data that match a key like ``pushes.force``, and their values; ``*`` matches
    every key.
    """
    if isinstance(data, list):
        for index, part in enumerate(data):
            yield from _values(part, key, f'{path}[{index}]')
    elif not key:
        yield path, data
    elif isinstance(data, dict):
        first, _, rest = key.partition('.')
        for name in data if first == '*' else [first] if first in data else []:
            yield from _values(data[name], rest, f'{path}.{name}' if path else name)


def _wrong_people(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """Groups of people whose masses would leave MASSES."""
    for path, group in _values(data, 'who.people'):
        if not has_error_under(found, path) and isinstance(group, dict):
            ends = [support(group['bmi'])[end] * support(group['height'])[end] ** 2
                    for end in (0, 1)]
            if not MASSES[0] <= ends[0] <= ends[1] <= MASSES[1]:
                yield errors.OutOfRange(path, f'masses of {ends[0]:.3g} to {ends[1]:.3g} kg',
                                        f'{MASSES[0]:g} to {MASSES[1]:g}')


def _wrong_limp(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """`limp` in a recipe of dolls: only people can be held upright."""
    who = data.get('who')
    if data.get('limp') and isinstance(who, dict) and 'people' not in who:
        yield errors.WrongForm('limp', 'dolls', 'people: only they can be held upright')


def _wrong_walk(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """`walk` or `level_soles` in a recipe of dolls, or together with keys that they determine."""
    start, who = data.get('start'), data.get('who')
    if has_error_under(found, 'start') or not isinstance(start, dict):
        return
    if start.get('level_soles'):
        if isinstance(who, dict) and 'people' not in who:
            yield errors.WrongForm('start.level_soles', 'dolls', 'people: only they have ankles')
        for name in start.get('angles_deg', {}):
            stance = name[:1] != start.get('walk', {}).get('swing', '')[:1]
            if name.endswith('_ankle') and stance:
                yield errors.WrongForm(f'start.angles_deg.{name}', start['angles_deg'][name],
                                       'none beside level_soles')
    if 'walk' not in start:
        return
    if isinstance(who, dict) and 'people' not in who:
        yield errors.WrongForm('start.walk', 'dolls', 'people: only they can walk')
    for key in ('velocity', 'spin', 'tumbled'):
        if key in start:
            yield errors.WrongForm(f'start.{key}', start[key], 'none beside walk')


def _wrong_rate(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """A sensor rate that is not the frame rate times an integer from 1 to MAX_SAMPLES_PER_TICK."""
    record = data.get('record')
    if not has_error_under(found, 'record') and isinstance(record, dict) and 'imu_rate' in record:
        rate, fast = record.get('rate', RATE), record['imu_rate']
        if fast % rate or not 1 <= fast // rate <= MAX_SAMPLES_PER_TICK:
            yield errors.OutOfRange('record.imu_rate', fast,
                                    f'1 to {MAX_SAMPLES_PER_TICK} times the rate, {rate}')


def _wrong_imus(data: dict, found: list[ModelError]) -> Iterator[ModelError]:
    """IMUs with equal names, or with an invalid position, orientation, flaw or response."""
    if has_error_under(found, 'record'):
        return
    names = []
    for index, mount in enumerate(data.get('record', {}).get('imus', ())):
        where = f'record.imus[{index}]'
        try:
            checked_mount(mount)
            flaws_of(mount)
            response_of(mount)
        except ModelError as error:
            yield error.at(where)
        if mount['name'] in names:
            yield errors.DuplicateName(f'{where}.name', mount['name'], 'a unique name')
        names.append(mount['name'])


def _unknown_names(data: dict, dolls: list[Ragdoll]) -> Iterator[ModelError]:
    """Unknown bones and joint angles, and angles beyond the joint limits."""
    bones, _ = names_of(dolls[0])
    named = [(f'feet[{index}]', name) for index, name in enumerate(data.get('feet', ()))]
    named += [(f'pushes[{index}].bone', name) for index, push in enumerate(data.get('pushes', ()))
              for name in choices(push['bone'])]
    named += [(f'grabs[{index}].bone', name) for index, grab in enumerate(data.get('grabs', ()))
              for name in choices(grab['bone'])]
    named += [(f'ground.friction_under.{name}', name)
              for name in data.get('ground', {}).get('friction_under', ())]
    imus = data.get('record', {}).get('imus', ())
    named += [(f'record.imus[{index}].bone', mount['bone']) for index, mount in enumerate(imus)]
    for path, name in named:
        if name not in bones:
            yield errors.UnknownBone(path, name, errors.one_of(bones, name))
    known = _angle_names(dolls[0])
    for index, limp in enumerate(data.get('limp', ())):
        for place, name in enumerate(limp.get('angles', ())):
            if name not in known:
                yield errors.UnknownJoint(f'limp[{index}].angles[{place}]', name,
                                          errors.one_of(known, name))
    for name, value in data.get('start', {}).get('angles_deg', {}).items():
        path = f'start.angles_deg.{name}'
        ranges = [angle_limits_deg(doll).get(name) for doll in dolls]
        if name not in known:
            yield errors.UnknownJoint(path, name, errors.one_of(known, name))
            continue
        low = max((pair[0] for pair in ranges if pair), default=-360.0)
        high = min((pair[1] for pair in ranges if pair), default=360.0)
        least, most = support(value)
        if not low - 1e-9 <= least <= most <= high + 1e-9:
            yield errors.OutOfRange(path, value, f'{low:g} to {high:g}, the limits of the joint')


def angle_limits_deg(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Limits of each limited joint angle, degrees, by name."""
    return {name: tuple(round(math.degrees(angle), 9) for angle in pair) for joint in doll.joints
            for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True) if pair}
