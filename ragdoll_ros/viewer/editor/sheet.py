"""A bone and its joint as the fields of a form, and back: with units, texts and all errors.

Lengths in m, masses in kg, angles in degrees. A field that still holds what ``read`` gave leaves
the scene as it is, to the bit.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.ragdoll import DEFAULT_COLOR, JOINT_KINDS, Joint
from ...model.scene import Scene
from ...model.shapes import SHAPES, SIZES, Shape
from ...model.vectors import unit_vector
from ..widgets import number_parsing
from . import changes

Value = str | float | tuple[float, ...]
Sheet = dict[str, Value]

SURFACE = ('friction', 'rolling_friction', 'restitution')

LARGEST = {'mass': 1e6, 'size': 1e3, 'radius': 1e3, 'length': 1e3, 'position': 1e3, 'anchor': 1e3,
           'damping': 1e4}
"""Beside usual neighbours, bodies of a larger mass or further away stop the simulation for minutes;
units are those of the fields."""

SMALLEST = {'mass': 1e-4, 'size': 1e-4, 'radius': 1e-4, 'length': 1e-4}


@dataclass(frozen=True)
class Field:
    """One line of the form: its widget, what stands beside it, and what it means."""

    key: str
    label: str
    widget: str
    hint: str


BODY = (
    Field('shape', 'shape', 'shape', 'what the body is for contact and inertia'),
    Field('size', 'size, m', 'vector', 'full edges along the own x, y, z of the body'),
    Field('radius', 'radius, m', 'number', ''),
    Field('length', 'length, m', 'number', "along the body's z; a capsule's without its ends"),
    Field('mass', 'mass, kg', 'number', 'inertia follows, unless it has its own'),
    Field('inertia', 'inertia, kg m²', 'text',
          "moments about the body's x, y, z; empty: a uniform solid's"),
    Field('position', 'place, m', 'vector', "centre of mass, doll's frame (x forward, z up)"),
    Field('turn', 'turn, °', 'vector', 'roll, pitch, yaw about the fixed x, y, z'),
    Field('friction', 'friction', 'text', "coefficient, inf for no slip; empty: the scene's"),
    Field('rolling_friction', 'rolling, m', 'text', "lever arm; empty: the scene's"),
    Field('restitution', 'restitution', 'text', "0 to 1; empty: the scene's"),
    Field('color', 'colour', 'color', 'by a click, or typed: red, #1e90ff, 30 144 255'))

JOINT = (
    Field('kind', 'joint', 'joint', 'to the parent'),
    Field('anchor', 'pivot, m', 'vector', "where the joint is, doll's frame"),
    Field('axis_1', 'axis 1', 'vector', 'fixed in the parent; a ball: the twist axis'),
    Field('axis_2', 'axis 2', 'vector', 'fixed in the child, across axis 1'),
    Field('limits_1', 'limits 1, °', 'text',
          'lower, upper; a ball: swing; child relative to parent; empty: free'),
    Field('limits_2', 'limits 2, °', 'text', 'lower, upper; a ball: twist; empty: free'),
    Field('limits_3', 'limits 3, °', 'text', 'lower, upper; a ball of two axes: twist'),
    Field('damping', 'damping', 'number', 'N m s/rad on each axis'))


def read(scene: Scene, name: str) -> Sheet:
    """Fields of a bone and its joint; UnknownBone if there is no such bone.

    Those of its shape only where that is one: several are not edited here.
    """
    _, bone = changes.find(scene, name)
    shape = {} if bone.shape.kind not in SHAPES else {
        'shape': bone.shape.kind, **vars(bone.shape)}
    sheet: Sheet = {**shape, 'mass': bone.mass,
                    'inertia': ', '.join(f'{moment:.9g}' for moment in bone.moments or ()),
                    'position': bone.position, 'turn': _degrees(bone.orientation),
                    'color': tuple(round(255 * part) for part in (bone.color or DEFAULT_COLOR)[:3])}
    for key in SURFACE:
        value = getattr(bone, key)
        sheet[key] = '' if value is None else f'{value:.9g}'
    joint = changes.joint_of(scene, name)
    return sheet if joint is None else {**sheet, **_read_joint(joint)}


def apply(scene: Scene, name: str, sheet: Mapping[str, Value], limb: bool = False,
          unread: Sequence[errors.ModelError] = ()) -> Scene:
    """The scene with a bone and its joint as the sheet has them.

    ``unread``: what was found wrong already. Raises ModelErrors with all that is wrong, the path of
    each the key of its field. ``limb``: see changes.py; the joint's own fields are set after the
    move.
    """
    shown, found = read(scene, name), list(unread)
    new = {**shown, **sheet}
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


Step = tuple[tuple[str, ...], Callable[[Scene, Sheet], Scene]]
"""Fields, and what makes the scene have them when one has changed."""


def _body_steps(name: str, limb: bool) -> list[Step]:
    def place(scene: Scene, new: Sheet) -> Scene:
        return changes.set_pose(scene, name, new['position'], limb=limb)

    def orientation(scene: Scene, new: Sheet) -> Scene:
        return changes.set_pose(scene, name, orientation=_quaternion(new['turn']), limb=limb)

    def color(scene: Scene, new: Sheet) -> Scene:
        _, old = changes.find(scene, name)
        opacity = (old.color or DEFAULT_COLOR)[3:]
        return changes.change_bone(
            scene, name, color=(*(part / 255 for part in new['color']), *opacity))

    def bone(*keys: str, **fields: Callable[[Sheet], object]) -> Step:
        return keys, lambda scene, new: changes.change_bone(
            scene, name, **{key: made(new) for key, made in fields.items()})

    return [bone('shape', 'size', 'radius', 'length', shape=_shape),
            bone('mass', mass=lambda new: new['mass']),
            bone('inertia', moments=lambda new: _moments(new['inertia'])),
            (('position',), place), (('turn',), orientation),
            (('color',), color),
            *(bone(key, **{key: lambda new, key=key: _number_or_none(key, new[key])})
              for key in SURFACE)]


def _joint_steps(name: str, shown: Sheet) -> list[Step]:
    def anchor(scene: Scene, new: Sheet) -> Scene:
        return changes.change_joint(scene, name, anchor=new['anchor'])

    return [(('kind', 'axis_1', 'axis_2', 'limits_1', 'limits_2', 'limits_3'),
             lambda scene, new: _set_axes_and_limits(scene, name, new, shown)),
            (('anchor',), anchor),
            (('damping',), lambda scene, new: changes.change_joint(
                scene, name, damping=new['damping']))]


def _read_joint(joint: Joint) -> Sheet:
    sheet: Sheet = {'kind': joint.kind, 'anchor': joint.anchor, 'damping': joint.damping}
    for number, axis in enumerate(joint.axes, 1):
        sheet[f'axis_{number}'] = axis
    for number, pair in enumerate(joint.limits, 1):
        sheet[f'limits_{number}'] = '' if pair is None else ', '.join(
            f'{math.degrees(angle):.9g}' for angle in pair)
    return sheet


def _set_axes_and_limits(scene: Scene, name: str, new: Sheet, shown: Sheet) -> Scene:
    """Set kind, axes and limits at once, as each kind asks for its own number of them."""
    kind, joint = JOINT_KINDS[new['kind']], changes.joint_of(scene, name)
    axes = []
    if kind.name == joint.kind and len(joint.limits) == 3:
        kind = dataclasses.replace(kind, axes=2, limits=3)
    for index in range(kind.axes):
        key = f'axis_{index + 1}'
        # A limb that was rotated has rotated its axes already.
        kept = kind.name == joint.kind and new[key] == shown[key]
        axes.append(joint.axes[index] if kept else unit_vector(key, new[key]))
    if kind.axes == 2:
        axes[1] = _straightened(*axes)
    symmetric = kind.name == 'ball' and kind.limits == 2
    pairs = [_pair(f'limits_{number}', new.get(f'limits_{number}', ''), symmetric)
             for number in range(1, kind.limits + 1)]
    limits = tuple(pair and tuple(map(math.radians, pair)) for pair in pairs)
    try:
        return changes.change_joint(scene, name, kind=kind.name, axes=tuple(axes), limits=limits)
    except errors.ModelError as error:
        if error.path.endswith('axes'):
            raise _not_across(new, shown) from None
        for number, pair in enumerate(pairs, 1):
            if error.path.endswith(f'limits[{number - 1}]'):
                raise type(error)(f'limits_{number}', pair, error.expected) from None
        raise


def _straightened(first: tuple[float, ...], second: tuple[float, ...]) -> tuple[float, ...]:
    """The second axis, made perpendicular to the first where only rounding kept it from being."""
    lean = float(np.dot(first, second))
    if not 1e-7 < abs(lean) < 1e-4:
        return second
    return tuple(np.subtract(second, lean * np.array(first)))


def _not_across(new: Sheet, shown: Sheet) -> errors.WrongAxes:
    """What is wrong with two axes that are not perpendicular, told of the one that was changed."""
    key, other = 'axis_2', 'axis_1'
    if new[key] == shown.get(key):
        key, other = other, key
    return errors.WrongAxes(key, new[key], f'perpendicular to {other.replace("_", " ")}, which is '
                            + number_parsing.shown_all(new[other]))


def _pair(key: str, text: str, symmetric: bool) -> tuple[float, float] | None:
    """Read a pair of angles, degrees; one number is enough where they are symmetric."""
    if not text.strip():
        return None
    for count in (2, 1) if symmetric else (2,):
        with suppress(errors.WrongForm):
            numbers = number_parsing.numbers(text, count, '°')
            return (numbers[0] if count == 2 else -numbers[0]), numbers[-1]
    raise errors.WrongForm(
        key, text, 'two angles in degrees, lower and upper, such as -90; 45.5, or nothing')


def _moments(text: str) -> tuple[float, ...] | None:
    if not text.strip():
        return None
    try:
        return number_parsing.numbers(text, 3)
    except errors.WrongForm as error:
        raise error.at('inertia') from None


def _number_or_none(key: str, text: str) -> float | None:
    unit = 'm' if key == 'rolling_friction' else ''
    try:
        if not text.strip():
            return None
        return number_parsing.number(text, unit, infinite=key == 'friction')
    except errors.WrongForm as error:
        raise error.at(key) from None


def _shape(new: Sheet) -> Shape:
    sizes = {key: new[key] for key in SIZES[new['shape']]}
    for key, size in sizes.items():
        errors.check_positive(key, size)
    return SHAPES[new['shape']](**sizes)


def _degrees(orientation: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(math.degrees(angle) + 0.0 for angle in rotation.to_rpy(np.array(orientation)))


def _quaternion(degrees: tuple[float, ...]) -> np.ndarray:
    errors.check_finite('turn', tuple(degrees))
    return rotation.from_rpy(*(math.radians(angle) for angle in degrees))


def _check_range(key: str, value: Value | None) -> None:
    """Refuse what the model takes and no engine gets on with; what is not finite it refuses."""
    for number in value if isinstance(value, tuple) else (value,):
        if key in LARGEST and isinstance(number, float) and math.isfinite(number):
            if abs(number) > LARGEST[key]:
                raise errors.OutOfRange(key, value, f'at most {LARGEST[key]:g}')
            if 0 < number < SMALLEST.get(key, 0):
                raise errors.OutOfRange(key, value, f'at least {SMALLEST[key]:g}')


def _at_field(error: errors.ModelError, keys: tuple[str, ...]) -> errors.ModelError:
    """The error with the key of the field that it belongs to as its path."""
    said = error.path.rsplit('.', 1)[-1].split('[')[0]
    key = said if said in keys else keys[0]
    return type(error)(key, error.value, error.expected)
