"""Scenes and dolls as YAML files: found, read, checked with all faults at once, written.

The form is that of config/scene.schema.json and config/doll.schema.json.
"""
from __future__ import annotations

import functools
import json
import math
import os
import re
from pathlib import Path

import jsonschema
import yaml

from . import faults
from .faults import Fault, Faults
from .ragdoll import SHAPES, Bone, Joint, Ragdoll, Rider, Shape, carried_faults, tree_faults
from .rotation import IDENTITY
from .scene import Ground, Material, Placement, Scene, above_ground
from .swing.form import swing_data, swing_from

LARGEST_FILE = 32_000_000
"""Bytes; a doll of 10 000 bones takes 3 MB."""

LARGEST_CONTENT = 5_000_000
"""Values in a file; a doll of 10 000 bones has 0.3 million."""

DEEPEST = 100
"""Levels of lists and mappings in a file; a scene has 12."""


def config_folder() -> Path:
    """Folder of the shipped scenes: the checkout's, else the ROS prefix's, else the package's."""
    package = Path(__file__).resolve().parent
    candidates = [package.parent / 'config'] if (package.parent / 'package.xml').exists() else []
    prefixes = filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))
    candidates += [Path(prefix) / 'share' / 'ragdoll_ros' / 'config' for prefix in prefixes]
    candidates.append(package / 'config')
    return next((path for path in candidates if (path / 'scene.schema.json').exists()),
                candidates[-1])


def scene_names() -> list[str]:
    """Names of the shipped scenes and dolls."""
    return sorted(path.stem for path in config_folder().glob('*.yaml')
                  if re.search(r'^(dolls|bones):', path.read_text(), re.MULTILINE))


def find(name: str, beside: Path | None = None) -> Path:
    """Path of a file given by its path (also from ``beside``) or by its name in config/."""
    choices = [Path(os.path.expanduser(name))]
    if beside is not None:
        choices.insert(0, beside / name)
    choices += [config_folder() / name, config_folder() / f'{name}.yaml']
    for path in choices:
        if os.path.isfile(path):
            return path
    raise faults.Unreadable('', name, f'a file, or one of {", ".join(scene_names())}')


def load_scene(name: str) -> Scene:
    """Read a scene, or a doll (then above level ground); Faults with all that is wrong in it."""
    try:
        path = find(name)
        data = _read(path)
    except Fault as fault:
        raise Faults(str(name), [fault]) from None
    return scene_from(data, path)


def scene_from(data: object, path: Path) -> Scene:
    """Make a scene from what a YAML file at ``path`` holds, a scene or a doll; see load_scene."""
    if isinstance(data, dict) and 'bones' in data:
        return above_ground(_raise_or_give(path, *build_doll(data, path)))
    return _raise_or_give(path, *build_scene(data, path))


def load_doll(name: str) -> Ragdoll:
    """Read a doll's file; Faults with all that is wrong in it."""
    try:
        path = find(name)
        data = _read(path)
    except Fault as fault:
        raise Faults(str(name), [fault]) from None
    return _raise_or_give(path, *build_doll(data, path))


def save_scene(scene: Scene, path: str | Path, head: str = '') -> None:
    """Write a scene with its dolls in it; load_scene gives an equal one back."""
    Path(path).write_text(scene_text(scene, Path(path).parent, head), encoding='utf-8')


def save_doll(doll: Ragdoll, path: str | Path, head: str = '') -> None:
    """Write a doll; load_doll gives an equal one back."""
    text = _text(doll_data(doll, Path(path).parent), 'doll', head)
    Path(path).write_text(text, encoding='utf-8')


def build_scene(data: object, path: Path) -> tuple[Scene | None, list[Fault]]:
    """Make a scene from what a YAML file holds: the scene, or None and every fault."""
    found = _schema_faults('scene', data)
    if not isinstance(data, dict):
        return None, found
    placements = []
    entries = data.get('dolls')
    named = functools.cache(lambda name: _named_doll(name, path))  # a crowd's is read once
    for index, entry in enumerate(entries if isinstance(entries, list) else ()):
        where = f'dolls[{index}]'
        if not isinstance(entry, dict) or 'doll' not in entry:
            continue
        source = entry['doll']
        if isinstance(source, dict):
            doll, more = build_doll(source, path.with_name('doll'))
        else:
            doll, more = named(source) if isinstance(source, str) else (None, [])
        found += [fault.at(f'{where}.doll') for fault in more]
        if doll is not None and not _any_under(found, where):
            doll, more = _with_swings(doll, entry, path)
            found += [fault.at(where) for fault in more]
        if doll is not None and not _any_under(found, where):
            fields = {'position', 'orientation', 'velocity', 'spin', 'name'} & set(entry)
            placements.append(_attempt(found, where, Placement, doll,
                                       **{key: entry[key] for key in fields}))
    parts = {}
    for key, part in (('ground', Ground), ('material', Material)):
        if isinstance(data.get(key), dict) and not _any_under(found, key):
            parts[key] = _attempt(found, key, part, **data[key])
    if found:
        return None, found
    plain = {key: data[key] for key in ('gravity', 'step', 'pace', 'self_collision')
             if key in data}
    scene = _attempt(found, '', Scene, data.get('name', path.stem), tuple(placements),
                     **parts, **plain)
    return scene, found


def build_doll(data: object,
               path: Path = Path('doll')) -> tuple[Ragdoll | None, list[Fault]]:
    """Make a doll from what the YAML file at ``path`` holds: the doll, or None and every fault."""
    found = _schema_faults('doll', data)
    if not isinstance(data, dict):
        return None, found
    bones = _build_each(data, 'bones', _bone, found)
    joints = _build_each(data, 'joints', _joint, found)
    swings = _build_each(data, 'swings', swing_from, found)
    riders = _build_each(data, 'riders', lambda entry: Rider(**entry), found)
    names = [entry.get('name') for entry in _entries(data, 'bones')]
    edges = [(entry.get('parent'), entry.get('child')) for entry in _entries(data, 'joints')]
    if all(isinstance(text, str) for text in [*names, *sum(edges, ())]):
        found += tree_faults(names, edges)
        for key in ('swings', 'riders'):
            carried = [(entry.get('name'), entry.get('bone')) for entry in _entries(data, key)]
            if all(isinstance(text, str) for text in sum(carried, ())):
                found += carried_faults(key, names, carried)
    if found:
        return None, found
    model = str(path.parent / data['model']) if 'model' in data else None
    return Ragdoll(data.get('name', path.stem), tuple(bones), tuple(joints), tuple(swings),
                   tuple(riders), model), found


def doll_data(doll: Ragdoll, folder: Path | None = None) -> dict:
    """Give a doll as plain lists and numbers, the form of doll.schema.json.

    The path of its character is written as seen from ``folder``, if given.
    """
    data = {'name': doll.name, 'bones': [_bone_data(bone) for bone in doll.bones],
            'joints': [_joint_data(joint) for joint in doll.joints]}
    if doll.swings:
        data['swings'] = [swing_data(swing) for swing in doll.swings]
    if doll.riders:
        data['riders'] = [_rider_data(rider) for rider in doll.riders]
    if doll.model is not None:
        data['model'] = doll.model if folder is None else _seen_from(folder, doll.model)
    return data


def scene_data(scene: Scene, folder: Path | None = None) -> dict:
    """Give a scene as plain lists and numbers, the form of scene.schema.json; see doll_data."""
    data = {'name': scene.name, 'gravity': list(scene.gravity), 'step': scene.step,
            'pace': scene.pace, 'self_collision': scene.self_collision,
            'material': dict(vars(scene.material)), 'ground': None, 'dolls': []}
    if scene.ground is not None:
        data['ground'] = {'normal': list(scene.ground.normal), 'offset': scene.ground.offset}
    for placement in scene.dolls:
        entry = {'doll': doll_data(placement.doll, folder), 'name': placement.name}
        for key in ('position', 'orientation', 'velocity', 'spin'):
            entry[key] = list(getattr(placement, key))
        data['dolls'].append(entry)
    return data


class _Loader(getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):
    """YAML's safe loader, with 1e-3 read as a number (YAML 1.1 makes a text of it)."""


_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'^[-+]?[0-9][0-9_]*[eE][-+]?[0-9]+$'),
    list('-+0123456789'))


def _whole_number(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    """Read an int; one that no float can hold is infinite, as 1e400 is, and refused as that."""
    number = loader.construct_yaml_int(node)
    try:
        float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf
    return number


_Loader.add_constructor('tag:yaml.org,2002:int', _whole_number)


def _seen_from(folder: Path, model: str) -> str:
    """Path of a character as it stands in a file of ``folder``: with slashes, relative."""
    try:
        return Path(os.path.relpath(model, folder)).as_posix()
    except ValueError:
        # Another drive has no way there.
        return model


def _read(path: Path) -> object:
    if path.stat().st_size > LARGEST_FILE:
        raise faults.Unreadable('', f'{path.stat().st_size} bytes', f'at most {LARGEST_FILE}')
    try:
        return parse(path.read_bytes())
    except OSError as error:
        raise faults.Unreadable('', str(error), 'a YAML file in UTF-8') from None


def parse(content: bytes) -> object:
    """Give what a YAML file holds as plain data; Unreadable with the place where it is none."""
    if len(content) > LARGEST_FILE:
        raise faults.Unreadable('', f'{len(content)} bytes', f'at most {LARGEST_FILE}')
    try:
        return _construct(content.decode('utf-8'))
    except Fault:
        raise
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        where = f'line {mark.line + 1}, column {mark.column + 1}' if mark else ''
        problem = getattr(error, 'problem', None) or 'no YAML'
        raise faults.Unreadable(where, problem, 'a YAML file') from None
    except (ValueError, RecursionError) as error:
        raise faults.Unreadable('', str(error), 'a YAML file in UTF-8') from None


def _construct(text: str) -> object:
    _check_depth(text)
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        # A few lines of aliases of aliases would fill the memory once they are followed.
        if node is not None and _unfolded(node, {}) > LARGEST_CONTENT:
            raise faults.Unreadable('', 'aliases of aliases',
                                    f'at most {LARGEST_CONTENT} values once they are followed')
        return None if node is None else loader.construct_document(node)
    finally:
        loader.dispose()


def _check_depth(text: str) -> None:
    """Refuse what is nested so deeply that libyaml's recursion would end the process."""
    depth = 0
    for event in yaml.parse(text, _Loader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            mark = event.start_mark
            raise faults.Unreadable(f'line {mark.line + 1}, column {mark.column + 1}',
                                    'nested too deeply', f'at most {DEEPEST} levels')


def _unfolded(node: yaml.Node, sizes: dict[int, float]) -> float:
    """Count what a node holds with each alias written out; without end for one inside itself."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in sizes:
        sizes[id(node)] = math.inf
        pairs = isinstance(node, yaml.MappingNode)
        parts = (part for entry in node.value for part in (entry if pairs else [entry]))
        sizes[id(node)] = 1 + sum(_unfolded(part, sizes) for part in parts)
    return sizes[id(node)]


def scene_text(scene: Scene, folder: Path, head: str = '') -> str:
    """Give what save_scene writes into a file of ``folder``."""
    return _text(scene_data(scene, folder), 'scene', head)


def _text(data: dict, schema: str, head: str) -> str:
    lines = [f'# yaml-language-server: $schema={schema}.schema.json',
             '# Units: m, kg, s, degrees where a key ends in _deg. x forward, y left, z up.']
    lines += ['# ' + line if line else '#' for line in head.splitlines()]
    text = yaml.safe_dump(data, sort_keys=False, width=100, allow_unicode=True,
                          default_flow_style=None)
    return '\n'.join(lines) + '\n' + text


@functools.cache
def _validator(name: str) -> jsonschema.Draft7Validator:
    path = config_folder() / f'{name}.schema.json'
    return jsonschema.Draft7Validator(json.loads(path.read_text(encoding='utf-8')))


_NAMED = {'exclusiveMinimum': faults.NotPositive, 'minimum': faults.OutOfRange,
          'maximum': faults.OutOfRange}


def _schema_faults(schema: str, data: object) -> list[Fault]:
    found = []
    for error in _validator(schema).iter_errors(data):
        path = ''
        for part in error.absolute_path:
            path += f'[{part}]' if isinstance(part, int) else f'.{part}' if path else str(part)
        kind = _NAMED.get(error.validator, faults.WrongForm)
        found.append(kind(path, _wrong(error), _expected(error)))
    return sorted(found, key=lambda fault: fault.path)


def _wrong(error: jsonschema.ValidationError) -> object:
    """Give what is wrong at the place of an error: of a mapping, the keys that none has."""
    if error.validator != 'additionalProperties':
        return error.instance
    return ', '.join(str(key) for key in error.instance if key not in error.schema['properties'])


def _expected(error: jsonschema.ValidationError) -> str:
    """Say in words what the schema asks for at the place of an error."""
    about = error.schema.get('description', '')
    if error.validator == 'required':
        missing = [key for key in error.validator_value if key not in error.instance]
        return 'the missing ' + ', '.join(missing)
    if error.validator == 'additionalProperties':
        return 'only ' + ', '.join(error.schema['properties'])
    rule = {'enum': 'one of {}', 'type': 'a {}', 'minItems': 'at least {} items',
            'maxItems': 'at most {} items', 'exclusiveMinimum': 'above {}',
            'minimum': '{} or more', 'maximum': '{} or less',
            'minProperties': 'at least {} key', 'maxProperties': 'at most {} key'}
    value = error.validator_value
    value = ' or '.join(map(str, value)) if isinstance(value, list) else value
    return (rule.get(error.validator, '') .format(value) + (about and f' ({about})')).strip()


def _named_doll(name: str, path: Path) -> tuple[Ragdoll | None, list[Fault]]:
    """Make the doll a scene names; faults of another file carry its name."""
    try:
        file = find(name, beside=path.parent)
        doll, found = build_doll(_read(file), file)
    except Fault as fault:
        return None, [fault]
    return doll, [fault.at(f'({file.name})') for fault in found]


def _with_swings(doll: Ragdoll, entry: dict, path: Path) -> tuple[Ragdoll | None, list[Fault]]:
    """Give the doll the swings that its place in the scene adds to its own."""
    if not entry.get('swings'):
        return doll, []
    own = len(doll.swings)
    data = doll_data(doll)
    data['swings'] = data.get('swings', []) + entry['swings']
    dressed, found = build_doll(data, path)
    shift = re.compile(r'^swings\[(\d+)\]')
    return dressed, [type(fault)(
        shift.sub(lambda match: f'swings[{int(match[1]) - own}]', fault.path),
        fault.value, fault.expected) for fault in found]


def _raise_or_give(path: Path, made: object, found: list[Fault]) -> object:
    if found:
        raise Faults(str(path), found)
    return made


def _attempt(found: list[Fault], where: str, make: type, *args: object, **kwargs: object) -> object:
    """Make a part; where that fails, note the fault and give None."""
    try:
        return make(*args, **kwargs)
    except Fault as fault:
        found.append(fault.at(where) if where else fault)
        return None


def _any_under(found: list[Fault], where: str) -> bool:
    return any(re.match(re.escape(where) + r'($|[.\[])', fault.path) for fault in found)


def _entries(data: dict, key: str) -> list[dict]:
    entries = data.get(key)
    return [e for e in entries if isinstance(e, dict)] if isinstance(entries, list) else []


def _build_each(data: dict, key: str, make: object, found: list[Fault]) -> list:
    """Make every entry of a list that the schema has nothing against."""
    made = []
    for index, entry in enumerate(_entries(data, key)):
        where = f'{key}[{index}]'
        if not _any_under(found, where):
            made.append(_attempt(found, where, make, entry))
    return made


def _shape(data: dict) -> Shape:
    (kind, sizes), = data.items()
    return SHAPES[kind](**sizes)


def _bone(data: dict) -> Bone:
    fields = dict(data)
    return Bone(shape=_shape(fields.pop('shape')), **fields)


def _joint(data: dict) -> Joint:
    fields = dict(data)
    pairs = fields.pop('limits_deg', ())
    limits = tuple(pair and tuple(math.radians(angle) for angle in pair) for pair in pairs)
    try:
        return Joint(limits=limits, **fields)
    except Fault as fault:
        if not fault.path.startswith('limits'):
            raise
        path = fault.path.replace('limits', 'limits_deg', 1)
        raise type(fault)(path, pairs, fault.expected) from None


def _bone_data(bone: Bone) -> dict:
    sizes = {key: list(value) if isinstance(value, tuple) else value
             for key, value in vars(bone.shape).items()}
    data = {'name': bone.name, 'shape': {bone.shape.kind: sizes}, 'mass': bone.mass,
            'position': list(bone.position)}
    if bone.orientation != IDENTITY:
        data['orientation'] = list(bone.orientation)
    for key in ('friction', 'rolling_friction', 'restitution'):
        if getattr(bone, key) is not None:
            data[key] = getattr(bone, key)
    if bone.color is not None:
        data['color'] = list(bone.color)
    return data


def _rider_data(rider: Rider) -> dict:
    data = {'name': rider.name, 'bone': rider.bone, 'position': list(rider.position)}
    if rider.orientation != IDENTITY:
        data['orientation'] = list(rider.orientation)
    return data


def _joint_data(joint: Joint) -> dict:
    data = {'parent': joint.parent, 'child': joint.child, 'kind': joint.kind,
            'anchor': list(joint.anchor)}
    if joint.axes:
        data['axes'] = [list(axis) for axis in joint.axes]
        data['limits_deg'] = [pair and [round(math.degrees(angle), 9) for angle in pair]
                              for pair in joint.limits]
    if joint.damping:
        data['damping'] = joint.damping
    return data
