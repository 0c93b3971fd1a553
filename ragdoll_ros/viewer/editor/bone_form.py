"""The form of a bone and its joint: fields, their values in a scene, and changed values applied.

Lengths in m, masses in kg, angles in degrees. Unchanged values leave the scene exactly as it is.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from ...model import errors, rotation
from ...model.ragdoll import DEFAULT_COLOR, JOINT_KINDS, Joint
from ...model.scene import Scene
from ...model.shapes import SHAPES, SIZES, Shape
from ...model.vectors import unit_vector
from ..widgets import parsing
from ..widgets.form import MIXED, Field, FieldValue, FormValues
from . import changes

SURFACE = ('friction', 'rolling_friction', 'restitution')

SHARED = ('mass', *SURFACE, 'color', 'damping')
"""Fields that several bones can have in common."""

MAXIMA = {'mass': 1e6, 'size': 1e3, 'radius': 1e3, 'length': 1e3, 'position': 1e3, 'anchor': 1e3,
          'damping': 1e4, 'velocity': 1e3, 'spin': 1e3}
"""In the units of the fields. Bodies far beyond their neighbours in mass or distance stop the
simulation for minutes."""

MINIMA = {'mass': 1e-4, 'size': 1e-4, 'radius': 1e-4, 'length': 1e-4}

BODY = (
    Field('shape', 'Shape', 'shape', 'For contact and inertia'),
    Field('size', 'Size, m', 'vector', "Full edges along the body's x, y, z"),
    Field('radius', 'Radius, m', 'number', ''),
    Field('length', 'Length, m', 'number', "Along the body's z; of a capsule's cylinder"),
    Field('mass', 'Mass, kg', 'number', 'Changes the inertia, unless that is set'),
    Field('inertia', 'Inertia, kg m²', 'text',
          "Moments about the body's x, y, z; empty: a uniform solid's"),
    Field('position', 'Position, m', 'vector', "Centre of mass, doll's frame (x forward, z up)"),
    Field('rotation', 'Rotation, °', 'vector', 'Roll, pitch, yaw about fixed axes x, y, z'),
    Field('friction', 'Friction', 'text', "Coefficient, inf for no slip; empty: the scene's"),
    Field('rolling_friction', 'Rolling, m', 'text', "Lever arm; empty: the scene's"),
    Field('restitution', 'Restitution', 'text', "0 to 1; empty: the scene's"),
    Field('color', 'Colour', 'color', 'Picked, or typed: red, #1e90ff, 30 144 255'),
    Field('no_collision', 'Passes through', 'text', 'Names of other bones of the doll, with which '
          'this one does not collide; those that a joint connects never do'),
    Field('velocity', 'Velocity, m/s', 'vector', "Of the doll's centre of mass at the start, world "
          'frame'),
    Field('spin', 'Spin, rad/s', 'vector', 'Angular velocity of the whole doll at the start, world '
          'frame'),
    Field('fixed_root', 'Root fixed to the world', 'checkbox',
          'It stays where it is, whatever acts on it; engine rigid'))

PLACEMENT = ('fixed_root', 'velocity', 'spin')
"""Keys of a root's fields that are of its doll in the scene."""

JOINT = (
    Field('kind', 'Joint', 'joint', 'To the parent'),
    Field('anchor', 'Anchor, m', 'vector', "Position of the joint, doll's frame"),
    Field('axis_1', 'Axis 1', 'vector', 'Fixed in the parent; ball: twist axis'),
    Field('axis_2', 'Axis 2', 'vector', 'Fixed in the child, perpendicular to axis 1'),
    Field('limits_1', 'Limits 1, °', 'text',
          'Lower, upper; ball: swing; child relative to parent; empty: free'),
    Field('limits_2', 'Limits 2, °', 'text', 'Lower, upper; ball: twist; empty: free'),
    Field('limits_3', 'Limits 3, °', 'text', 'Lower, upper; ball with two axes: twist'),
    Field('damping', 'Damping, N m s', 'number',
          'Resistance to rotation, N m s/rad about each axis: more makes the joint stiffer'))


def read_bone(scene: Scene, name: str) -> FormValues:
    """Values of a bone and its joint; UnknownBone. Compound shapes have no shape values.

    A root also has those of PLACEMENT.
    """
    placement, bone = changes.find(scene, name)
    shape = {'shape': bone.shape.kind, **vars(bone.shape)} if bone.shape.kind in SHAPES else {}
    values: FormValues = {**shape, 'mass': bone.mass,
                          'inertia': ', '.join(f'{moment:.9g}' for moment in bone.moments or ()),
                          'position': bone.position, 'rotation': _degrees(bone.orientation),
                          'color': tuple(round(255 * part)
                                         for part in (bone.color or DEFAULT_COLOR)[:3])}
    for key in SURFACE:
        value = getattr(bone, key)
        values[key] = '' if value is None else f'{value:.9g}'
    values['no_collision'] = _join_names(_passed_through(scene, name))
    joint = changes.joint_of(scene, name)
    if joint is None:
        return {**values, **{key: getattr(placement, key) for key in PLACEMENT}}
    return {**values, **_read_joint(joint)}


def read_bones(scene: Scene, names: Sequence[str]) -> FormValues:
    """Values of one bone, or those that several share; MIXED where they differ.

    A colour that differs is left out.
    """
    each = [read_bone(scene, name) for name in names]
    if len(each) == 1:
        return each[0]
    shared = {key: [values[key] for values in each] for key in SHARED
              if all(key in values for values in each)}
    same = {key: all(value == values[0] for value in values) for key, values in shared.items()}
    return {key: values[0] if same[key] else MIXED for key, values in shared.items()
            if same[key] or key != 'color'}


def apply_values(scene: Scene, name: str, values: Mapping[str, FieldValue], limb: bool = False,
                 found: Sequence[errors.ModelError] = ()) -> Scene:
    """Set a bone and its joint to the values, the bone first. ``limb``: see changes.py.

    Raises ModelErrors with all errors, also those already ``found``; their paths are keys of
    fields.
    """
    shown, found = read_bone(scene, name), list(found)
    new = {**shown, **values}
    steps = _body_steps(name, limb) + (_joint_steps(name, shown) if 'kind' in shown else [])
    for keys, step in steps:
        if any(new.get(key) != shown.get(key) for key in keys):
            try:
                for key in keys:
                    _check_range(key, new.get(key))
                scene = step(scene, new)
            except errors.ModelError as error:
                found.append(_at_field(error, keys))
    if found:
        raise errors.ModelErrors(name, found)
    return scene


Step = tuple[tuple[str, ...], Callable[[Scene, FormValues], Scene]]
"""Keys of fields, and the function that applies them if one has changed."""


def _body_steps(name: str, limb: bool) -> list[Step]:
    def color(scene: Scene, new: FormValues) -> Scene:
        _, old = changes.find(scene, name)
        opacity = (old.color or DEFAULT_COLOR)[3:]
        return changes.change_bone(
            scene, name, color=(*(part / 255 for part in new['color']), *opacity))

    def bone(*keys: str, **fields: Callable[[FormValues], object]) -> Step:
        return keys, lambda scene, new: changes.change_bone(
            scene, name, **{key: made(new) for key, made in fields.items()})

    return [bone('shape', 'size', 'radius', 'length', shape=_shape),
            bone('mass', mass=lambda new: new['mass']),
            bone('inertia', moments=lambda new: (
                parsing.parse_numbers(new['inertia'], 3) if new['inertia'].strip() else None)),
            (('position',), lambda scene, new: changes.set_pose(
                scene, name, new['position'], limb=limb)),
            (('rotation',), lambda scene, new: changes.set_pose(
                scene, name, orientation=_quaternion(new['rotation']), limb=limb)),
            (('color',), color),
            (('no_collision',), lambda scene, new: changes.set_no_collision(
                scene, name, _split_names(new['no_collision']))),
            (PLACEMENT, lambda scene, new: _set_placement(scene, name, new)),
            *(bone(key, **{key: lambda new, key=key: _number_or_none(key, new[key])})
              for key in SURFACE)]


def _joint_steps(name: str, shown: FormValues) -> list[Step]:
    return [(('kind', 'axis_1', 'axis_2', 'limits_1', 'limits_2', 'limits_3'),
             lambda scene, new: _set_axes_and_limits(scene, name, new, shown)),
            *(((key,), lambda scene, new, key=key: changes.change_joint(
                scene, name, **{key: new[key]})) for key in ('anchor', 'damping'))]


def _set_placement(scene: Scene, name: str, new: FormValues) -> Scene:
    """Set the fields of PLACEMENT together, as a fixed root has no velocity."""
    try:
        return changes.change_placement(scene, name, **{key: new[key] for key in PLACEMENT})
    except errors.ModelError as error:
        # What else the doll has, it has not from this form.
        if (key := error.path.rsplit('.', 1)[-1]) not in PLACEMENT:
            raise errors.WrongForm('fixed_root', '', f'off for a doll with {key}') from None
        raise


def _read_joint(joint: Joint) -> FormValues:
    values: FormValues = {'kind': joint.kind, 'anchor': joint.anchor, 'damping': joint.damping}
    for number, axis in enumerate(joint.axes, 1):
        values[f'axis_{number}'] = axis
    for number, pair in enumerate(joint.limits, 1):
        values[f'limits_{number}'] = '' if pair is None else ', '.join(
            f'{math.degrees(angle):.9g}' for angle in pair)
    return values


def _set_axes_and_limits(scene: Scene, name: str, new: FormValues, shown: FormValues) -> Scene:
    """Set kind, axes and limits together, as each kind has its own number of them."""
    kind, joint = JOINT_KINDS[new['kind']], changes.joint_of(scene, name)
    axes = []
    if kind.name == joint.kind and len(joint.limits) == 3:
        kind = dataclasses.replace(kind, axes=2, limits=3)
    for index in range(kind.axes):
        key = f'axis_{index + 1}'
        # Moving a limb has rotated its axes already.
        kept = kind.name == joint.kind and new[key] == shown[key]
        axes.append(joint.axes[index] if kept else unit_vector(key, new[key]))
    if kind.axes == 2:
        axes[1] = _orthogonalized(*axes)
    symmetric = kind.name == 'ball' and kind.limits == 2
    pairs = [_pair(f'limits_{number}', new.get(f'limits_{number}', ''), symmetric)
             for number in range(1, kind.limits + 1)]
    limits = tuple(pair and tuple(map(math.radians, pair)) for pair in pairs)
    try:
        return changes.change_joint(scene, name, kind=kind.name, axes=tuple(axes), limits=limits)
    except errors.ModelError as error:
        if error.path.endswith('axes'):
            raise _not_perpendicular(new, shown) from None
        for number, pair in enumerate(pairs, 1):
            if error.path.endswith(f'limits[{number - 1}]'):
                raise type(error)(f'limits_{number}', pair, error.expected) from None
        raise


def _orthogonalized(first: tuple[float, ...], second: tuple[float, ...]) -> tuple[float, ...]:
    """Make the second axis perpendicular to the first if it is so up to rounding."""
    cosine = float(np.dot(first, second))
    if not 1e-7 < abs(cosine) < 1e-4:
        return second
    return tuple(np.subtract(second, cosine * np.array(first)))


def _not_perpendicular(new: FormValues, shown: FormValues) -> errors.WrongAxes:
    """Error of two axes that are not perpendicular, at the one that was changed."""
    key, other = 'axis_2', 'axis_1'
    if new[key] == shown.get(key):
        key, other = other, key
    return errors.WrongAxes(key, new[key], f'perpendicular to {other.replace("_", " ")}, which is '
                            + parsing.format_numbers(new[other]))


def _pair(key: str, text: str, symmetric: bool) -> tuple[float, float] | None:
    """Parse a pair of angles, degrees; one number suffices for a symmetric pair."""
    if not text.strip():
        return None
    for count in (2, 1) if symmetric else (2,):
        with suppress(errors.WrongForm):
            numbers = parsing.parse_numbers(text, count, '°')
            return (numbers[0] if count == 2 else -numbers[0]), numbers[-1]
    raise errors.WrongForm(
        key, text, 'two angles in degrees, lower and upper, such as -90; 45.5, or nothing')


def _number_or_none(key: str, text: str) -> float | None:
    if not text.strip():
        return None
    unit = 'm' if key == 'rolling_friction' else ''
    return parsing.parse_number(text, unit, infinite=key == 'friction')


def _passed_through(scene: Scene, name: str) -> list[str]:
    """Names of the bones with which a bone does not collide by ``no_collision``."""
    placement, bone = changes.find(scene, name)
    return [other for pair in placement.doll.no_collision if bone.name in pair
            for other in pair if other != bone.name]


def _split_names(text: str) -> list[str]:
    """Names between commas, or between semicolons if there are any."""
    parts = text.split(';' if ';' in text else ',')
    return [part.strip() for part in parts if part.strip()]


def _join_names(names: Sequence[str]) -> str:
    if not any(',' in name for name in names):
        return ', '.join(names)
    return '; '.join(names) + ';' * (len(names) == 1)


def _shape(new: FormValues) -> Shape:
    sizes = {key: new[key] for key in SIZES[new['shape']]}
    for key, size in sizes.items():
        errors.check_positive(key, size)
    return SHAPES[new['shape']](**sizes)


def _degrees(orientation: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(math.degrees(angle) + 0.0 for angle in rotation.to_rpy(np.array(orientation)))


def _quaternion(degrees: tuple[float, ...]) -> np.ndarray:
    errors.check_finite('rotation', tuple(degrees))
    return rotation.from_rpy(*(math.radians(angle) for angle in degrees))


def _check_range(key: str, value: FieldValue | None) -> None:
    """Raise OutOfRange for values that no engine handles; the model refuses NaN and infinity."""
    for number in value if isinstance(value, tuple) else (value,):
        if key in MAXIMA and isinstance(number, float) and math.isfinite(number):
            if abs(number) > MAXIMA[key]:
                raise errors.OutOfRange(key, value, f'at most {MAXIMA[key]:g}')
            if 0 < number < MINIMA.get(key, 0):
                raise errors.OutOfRange(key, value, f'at least {MINIMA[key]:g}')


def _at_field(error: errors.ModelError, keys: tuple[str, ...]) -> errors.ModelError:
    """The error with the key of its field as path."""
    key_in_path = error.path.rsplit('.', 1)[-1].split('[')[0]
    key = key_in_path if key_in_path in keys else keys[0]
    return type(error)(key, error.value, error.expected)
