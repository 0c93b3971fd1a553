"""Dolls as YAML files (config/doll.schema.json): reading with all errors at once, writing."""
import functools
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..model import ragdoll
from ..model.compound import Compound
from ..model.errors import ModelError, OutOfRange
from ..model.mesh import Hull
from ..model.passive import Passive, PassiveEnd
from ..model.ragdoll import Bone, Joint, Ragdoll, SkeletonFrame
from ..model.rotation import IDENTITY
from ..model.shapes import SHAPES, Part, Shape
from ..model.swing import Collider, Link, Swing, strand
from . import yaml_text
from .schema import (
    Made,
    build_each,
    entries,
    is_marked,
    read_by_name,
    schema_errors,
    value_or_raise,
)
from .surfaces import HULLS, build_hull, build_hulls, hull_data

LARGEST_MASS_RATIO = 1e8
"""Largest ratio of two masses in a file. Robots have up to 6.1e7; at 2e8 a tick takes a second, as
the equations of an impact are ill-conditioned."""


def load_doll(name: str) -> Ragdoll:
    """Read a doll from a YAML file.

    Args:
        name: path, or name of a shipped doll in config/.

    Returns:
        The doll.

    Raises:
        ModelErrors: all errors of the file, each with its path, its value, what is expected.

    Example:
        >>> load_doll('doll').mass
        55.0
    """
    data, path = read_by_name(name)
    return value_or_raise(path, *build_doll(data, path))


def save_doll(doll: Ragdoll, path: str | Path, head: str = '') -> None:
    """Write a doll to a YAML file, from which load_doll reads an equal one.

    Args:
        doll: the doll; the path of its ``model`` is written relative to the file.
        path: of the file.
        head: text of a comment at its top.

    Raises:
        OSError: the file can not be written.

    Example:
        >>> save_doll(load_doll('doll'), 'copy.yaml')
        >>> load_doll('copy.yaml') == load_doll('doll')
        True
    """
    text = yaml_text.to_text(doll_data(doll, Path(path).parent), 'doll', head)
    Path(path).write_text(text, encoding='utf-8')


def build_doll(data: object, path: Path = Path('doll')) -> tuple[Ragdoll | None, list[ModelError]]:
    """Build a doll from the data of the YAML file at ``path``; else None and every error."""
    found = schema_errors('doll', data)
    if not is_marked(data, 'doll'):
        return None, found
    bones = build_each(data, 'bones', _bone, found)
    joints = build_each(data, 'joints', _joint, found)
    swings = build_each(data, 'swings', _swing, found)
    riders = build_each(data, 'riders', lambda entry: SkeletonFrame(**entry), found)
    names: list[Any] = [entry.get('name') for entry in entries(data, 'bones')]
    edges: list[Any] = [(entry.get('parent'), entry.get('child'))
                        for entry in entries(data, 'joints')]
    if all(isinstance(text, str) for text in [*names, *sum(edges, ())]):
        found += ragdoll.tree_errors(names, edges)
        for key in ('swings', 'riders'):
            attached: list[Any] = [(entry.get('name'), entry.get('bone'))
                                   for entry in entries(data, key)]
            if all(isinstance(text, str) for text in sum(attached, ())):
                found += ragdoll.attachment_errors(key, names, attached)
        if not found:
            found += ragdoll.no_collision_errors(names, data.get('no_collision', ()))
            found += ragdoll.angle_name_errors(joints) + mass_errors(bones)
            found += ragdoll.link_rider_errors(swings, riders)
            found += ragdoll.collider_errors(swings, names)
    if found:
        return None, found
    model = str(path.parent / data['model']) if 'model' in data else None
    return Ragdoll(data.get('name', path.stem), tuple(bones), tuple(joints), tuple(swings),
                   tuple(riders), model, tuple(map(tuple, data.get('no_collision', ())))), found


def doll_data(doll: Ragdoll, folder: Path | None = None) -> dict:
    """A doll as lists and numbers in the form of doll.schema.json.

    The path of its character is made relative to ``folder``, if given.
    """
    data = {'name': doll.name, 'bones': [_bone_data(bone) for bone in doll.bones],
            'joints': [_joint_data(joint) for joint in doll.joints]}
    if doll.no_collision:
        data['no_collision'] = [list(pair) for pair in doll.no_collision]
    if doll.swings:
        data['swings'] = [_swing_data(swing) for swing in doll.swings]
    if doll.riders:
        data['riders'] = [_rider_data(rider) for rider in doll.riders]
    if doll.model is not None:
        data['model'] = doll.model if folder is None else relative_path(folder, doll.model)
    return data


def plain_name(name: str, otherwise: str) -> str:
    """The name as doll files allow it: printable, without slashes, not empty."""
    text = ''.join(c if c.isprintable() and c != '/' else '_' for c in name)
    return text.strip()[:90] or otherwise


def relative_path(folder: Path, file: str) -> str:
    """Path of a file relative to ``folder``, with slashes."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        # It is on another drive.
        return file


def mass_errors(bones: Sequence[Bone]) -> list[ModelError]:
    """Error of the heaviest bone, if the ratio of masses exceeds LARGEST_MASS_RATIO."""
    lightest, heaviest = (choose(bones, key=lambda bone: bone.mass) for choose in (min, max))
    if heaviest.mass <= LARGEST_MASS_RATIO * lightest.mass:
        return []
    return [OutOfRange(
        f'bones[{list(bones).index(heaviest)}].mass', heaviest.mass,
        f'at most {LARGEST_MASS_RATIO:g} times the mass of the lightest bone, {lightest.name} '
        f'with {lightest.mass:g} kg')]


def _shape(data: dict) -> Shape:
    (kind, sizes), = data.items()
    return SHAPES[kind](**sizes)


def _part(data: dict, folder: Path) -> Part:
    kind, = {*SHAPES, Hull.kind} & data.keys()
    shape: Any = build_hull(data[kind], folder) if kind == Hull.kind else _shape({kind: data[kind]})
    return Part(shape, **{key: value for key, value in data.items() if key != kind})


def build_shape(data: dict, folder: Path = Path('/')) -> Shape | Compound:
    """The shape of a bone or body that has ``shape`` or ``shapes``; paths of meshes are relative to
    ``folder``. Raises ModelError.
    """
    if HULLS in data.get('shape', ()):
        return _at(f'shape.{HULLS}', build_hulls,
                   {'data': data['shape'][HULLS], 'folder': folder})
    if 'shape' in data:
        return _shape(data['shape'])
    found: list[ModelError] = []
    parts = build_each(data, 'shapes', functools.partial(_part, folder=folder), found)
    for error in found:
        raise error
    return Compound(tuple(parts))


def shape_data(shape: Shape | Compound) -> dict:
    """A shape as ``shape`` or ``shapes`` of a bone or body."""
    if isinstance(shape, Compound):
        return {'shapes': [_part_data(part) for part in shape.parts]}
    return {'shape': _shape_data(shape)}


def _bone(data: dict) -> Bone:
    fields = {key: value for key, value in data.items() if key not in ('shape', 'shapes')}
    moments = fields.pop('inertia', None)
    return Bone(shape=build_shape(data), moments=moments, **fields)


def _joint(data: dict) -> Joint:
    fields = dict(data)
    pairs = fields.pop('limits_deg', ())
    limits = tuple(pair and tuple(math.radians(angle) for angle in pair) for pair in pairs)
    passive = tuple(entry and _passive(entry, f'passive[{index}]')
                    for index, entry in enumerate(fields.pop('passive', ())))
    try:
        return Joint(limits=limits, passive=passive, **fields)
    except ModelError as error:
        if not error.path.startswith('limits'):
            raise
        path = error.path.replace('limits', 'limits_deg', 1)
        raise type(error)(path, pairs, error.expected) from None


def _passive(data: dict, path: str) -> Passive:
    def end(key: str) -> PassiveEnd:
        given = data[key]
        return _at(f'{path}.{key}', PassiveEnd, {
            'torque': given['torque'],
            **{name: math.radians(given[f'{name}_deg']) for name in ('angle', 'width')}})
    return Passive(end('lower'), end('upper'))


def _passive_data(passive: Passive) -> dict:
    return {key: {'torque': end.torque, 'angle_deg': round(math.degrees(end.angle), 9),
                  'width_deg': round(math.degrees(end.width), 9)}
            for key, end in (('lower', passive.lower), ('upper', passive.upper))}


def _shape_data(shape: Any) -> dict:
    if isinstance(shape, Hull):
        return {shape.kind: hull_data(shape)}
    return {shape.kind: {key: list(value) if isinstance(value, tuple) else value
                         for key, value in vars(shape).items()}}


def _part_data(part: Part) -> dict:
    data = _shape_data(part.shape)
    if any(part.position):
        data['position'] = list(part.position)
    if part.orientation != IDENTITY:
        data['orientation'] = list(part.orientation)
    return data


def _bone_data(bone: Bone) -> dict:
    optional = {'inertia': bone.moments,
                'orientation': None if bone.orientation == IDENTITY else bone.orientation,
                'friction': bone.friction, 'rolling_friction': bone.rolling_friction,
                'restitution': bone.restitution, 'color': bone.color}
    return {'name': bone.name, **shape_data(bone.shape), 'mass': bone.mass,
            'position': list(bone.position),
            **{key: list(value) if isinstance(value, tuple) else value
               for key, value in optional.items() if value is not None}}


def _rider_data(rider: SkeletonFrame) -> dict:
    data = {'name': rider.name, 'bone': rider.bone, 'position': list(rider.position)}
    if rider.orientation != IDENTITY:
        data['orientation'] = list(rider.orientation)
    return data


def _joint_data(joint: Joint) -> dict:
    data: dict[str, Any] = {'parent': joint.parent, 'child': joint.child, 'kind': joint.kind,
                            'anchor': list(joint.anchor)}
    if joint.axes:
        data['axes'] = [list(axis) for axis in joint.axes]
        data['limits_deg'] = [pair and [round(math.degrees(angle), 9) for angle in pair]
                              for pair in joint.limits]
    if joint.damping:
        data['damping'] = joint.damping
    if joint.names:
        data['names'] = list(joint.names)
    if joint.passive:
        data['passive'] = [passive and _passive_data(passive) for passive in joint.passive]
    return data


def _swing(data: dict) -> Swing:
    """Build a swing from a file's data. Raises a ModelError with its path."""
    fields = dict(data)
    if 'strand' in fields:
        links = _at('strand', strand, fields.pop('strand'))
    else:
        links = tuple(_at(f'links[{index}]', Link, entry)
                      for index, entry in enumerate(fields.pop('links')))
    colliders = tuple(_at(f'colliders[{index}]', Collider, entry)
                      for index, entry in enumerate(fields.pop('colliders', ())))
    return Swing(links=links, colliders=colliders, **fields)


def _swing_data(swing: Swing) -> dict:
    data = {'name': swing.name, 'bone': swing.bone, 'root': list(swing.root),
            'direction': list(swing.direction), 'gravity': swing.gravity, 'mode': swing.mode}
    if any(swing.velocity):
        data['velocity'] = list(swing.velocity)
    if swing.independent:
        data['independent'] = True
    if swing.colliders:
        data['colliders'] = [_collider_data(collider) for collider in swing.colliders]
    data['links'] = [_link_data(link) for link in swing.links]
    return data


def _collider_data(collider: Collider) -> dict:
    data = {'bone': collider.bone, 'radius': collider.radius, 'at': list(collider.at)}
    if collider.to is not None:
        data['to'] = list(collider.to)
    return data


def _link_data(link: Link) -> dict:
    data = {key: getattr(link, key) for key in ('length', 'mass', 'stiffness', 'damping')}
    if link.direction is not None:
        data['direction'] = list(link.direction)
    if link.radius:
        data['radius'] = link.radius
    if link.riders:
        data['riders'] = list(link.riders)
    return data


def _at(where: str, make: Callable[..., Made], fields: dict) -> Made:
    try:
        return make(**fields)
    except ModelError as error:
        raise error.at(where) from None
