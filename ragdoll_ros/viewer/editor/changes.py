"""Changes of a bone or its joint: each returns a changed scene, or raises a ModelError.

Bones are named as in ``Scene.bone_names``. The path of an error starts with that name:
``left shin.mass``, ``left shin.joint.limits_deg[0]``. The dataclasses validate the values.

A body that is moved, rotated or given another shape leaves the rest of the doll where it is in the
bind pose: anchors, other bodies, and the skeleton of the skin. With ``limb``, the subtree of the
body moves rigidly with it, with joints, axes, swings and skin, and with its own joint.
"""
from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from ...model import errors, rotation
from ...model.ragdoll import (
    JOINT_KINDS,
    MAX_SWING,
    Bone,
    Joint,
    Ragdoll,
    SkeletonFrame,
    no_collision_errors,
)
from ...model.scene import Placement, Scene
from ...model.shapes import SHAPES, Box, Shape, Sphere
from ...model.swing import Swing
from ...model.vectors import floats

DEFAULT_LIMIT, DEFAULT_TWIST = math.radians(45), math.radians(30)
"""rad: limit of an axis, and twist of a ball joint, where the joint had none before."""

NAME = re.compile(r'[^\s/][^/\x00-\x1f]{0,99}')
"""Names that config/doll.schema.json allows."""


def find(scene: Scene, name: str) -> tuple[Placement, Bone]:
    """The doll of a bone, and the bone; UnknownBone."""
    index = scene.bone_index(name)
    return scene.dolls[scene.doll_of_bone[index]], scene.bones[index]


def joint_of(scene: Scene, name: str) -> Joint | None:
    """Joint between a bone and its parent; None for a root."""
    placement, bone = find(scene, name)
    return next((joint for joint in placement.doll.joints if joint.child == bone.name), None)


def replace_doll(scene: Scene, placement: Placement, **fields: object) -> Scene:
    """Replace fields of one doll."""
    doll = dataclasses.replace(placement.doll, **fields)
    return _with_placement(scene, placement, dataclasses.replace(placement, doll=doll))


def change_placement(scene: Scene, name: str, **fields: object) -> Scene:
    """Set fields of a bone's doll in the scene: velocity, spin, fixed_root."""
    placement, _ = find(scene, name)
    with _errors_at(name):
        changed = dataclasses.replace(placement, **fields)
    return _with_placement(scene, placement, changed)


def change_bone(scene: Scene, name: str, **fields: object) -> Scene:
    """Set fields of a bone: mass, friction, color, ...; a new size keeps the mass.

    The inertia of a uniform solid is updated. For its pose see ``set_pose``.
    """
    placement, bone = find(scene, name)
    with _errors_at(name):
        changed = dataclasses.replace(bone, **fields)
    return replace_doll(scene, placement, bones=_replaced(placement.doll.bones, bone, changed))


def change_joint(scene: Scene, name: str, **fields: object) -> Scene:
    """Set fields of the joint to a bone's parent: anchor, axes, damping, ...; limits in rad."""
    placement, _ = find(scene, name)
    joint = joint_of(scene, name)
    if joint is None:
        raise errors.Detached(f'{name}.joint', name, 'a bone with a parent: the root has no joint')
    with _errors_at(f'{name}.joint'):
        changed = dataclasses.replace(joint, **fields)
    return replace_doll(scene, placement, joints=_replaced(placement.doll.joints, joint, changed))


def set_pose(scene: Scene, name: str, position: Sequence[float] | None = None,
             orientation: Sequence[float] | None = None, limb: bool = False) -> Scene:
    """Set the pose of a body: centre of mass, m, and quaternion; doll's frame, bind pose."""
    placement, bone = find(scene, name)
    fields = {'position': position, 'orientation': orientation}
    with _errors_at(name):
        moved = dataclasses.replace(
            bone, **{key: value for key, value in fields.items() if value is not None})
    if limb:
        return _move_limb(scene, placement, bone, moved)
    riders = tuple(reattached(rider, bone, moved) if rider.bone == bone.name else rider
                   for rider in placement.doll.riders)
    return replace_doll(scene, placement, riders=riders,
                        bones=_replaced(placement.doll.bones, bone, moved))


def set_no_collision(scene: Scene, name: str, others: Sequence[str]) -> Scene:
    """Set the bones of its doll with which a bone does not collide, beside those that joints
    connect.
    """
    placement, bone = find(scene, name)
    doll = placement.doll
    before = [pair for pair in doll.no_collision if bone.name in pair]
    kept = tuple(pair for pair in doll.no_collision if pair not in before)
    had = {other for pair in before for other in pair if other != bone.name}
    with _errors_at(name):
        found = no_collision_errors([each.name for each in doll.bones],
                                    [(bone.name, other) for other in others])
        if found:
            raise found[0]
    # Pairs that were there stay as they are.
    kept += tuple(pair for pair in before if set(pair) - {bone.name} <= set(others))
    new = tuple((bone.name, other) for other in dict.fromkeys(others) if other not in had)
    return replace_doll(scene, placement, no_collision=kept + new)


def set_size(scene: Scene, name: str, half_extents: Sequence[float]) -> Scene:
    """Scale a body to the half extents (3,) m in its frame; the mass stays."""
    _, bone = find(scene, name)
    with _errors_at(name):
        errors.check_positive('size', floats(half_extents))
        if bone.shape.kind not in SHAPES:
            raise errors.WrongForm('size', bone.shape.kind, 'one of ' + ', '.join(SHAPES))
        shape = shape_within(bone.shape.kind, half_extents)
    return change_bone(scene, name, shape=shape)


def set_shape(scene: Scene, name: str, kind: str) -> Scene:
    """Change the kind of a body's shape, fitted to its bounding box; see `shape_within`.

    A cylinder or capsule is rotated so that its z axis is along the longest side.
    """
    _, bone = find(scene, name)
    if kind not in SHAPES:
        raise errors.WrongForm(f'{name}.shape', kind, 'one of ' + ', '.join(SHAPES))
    if kind == bone.shape.kind:
        return scene
    half, moments = np.array(bone.shape.half_extents), bone.moments
    longest = int(np.argmax(half))
    if kind in ('cylinder', 'capsule') and half[longest] > half[2] * (1 + 1e-9):
        # Rotate by 120 degrees, which permutes the axes and keeps them right-handed.
        cycle = np.roll(np.eye(3), 2 - longest, axis=1).T
        orientation = rotation.multiply(bone.orientation, rotation.from_matrix(cycle.T))
        scene = set_pose(scene, name, orientation=orientation)
        half, moments = cycle @ half, moments and tuple(cycle @ moments)
    return change_bone(scene, name, shape=shape_within(kind, half), moments=moments)


def shape_within(kind: str, half_extents: Sequence[float]) -> Shape:
    """Shape of a kind for half extents (3,) m; round ones use geometric means."""
    x, y, z = (float(edge) for edge in half_extents)
    if kind == 'box':
        return Box((2 * x, 2 * y, 2 * z))
    if kind == 'sphere':
        return Sphere(float(np.cbrt(x * y * z)))
    radius = math.sqrt(x * y)
    if kind == 'capsule':
        # Its cylinder keeps a tenth of the length, which must not be zero.
        radius = min(radius, 0.9 * z)
        return SHAPES[kind](radius, 2 * (z - radius))
    return SHAPES[kind](radius, 2 * z)


def set_joint_kind(scene: Scene, name: str, kind: str) -> Scene:
    """Change the kind of a bone's joint; axes and limits that both kinds have stay."""
    joint = joint_of(scene, name)
    if joint is None or kind not in JOINT_KINDS or kind == joint.kind:
        return change_joint(scene, name, kind=kind)
    _, bone = find(scene, name)
    hinge, universal, twist = _axes(joint, bone)
    pairs = joint.limits or ((-DEFAULT_LIMIT, DEFAULT_LIMIT),)
    widest = max((max(map(abs, pair)) for pair in pairs if pair), default=0.0)
    swing = min(widest, MAX_SWING)
    second = joint.limits[1] if joint.kind == 'universal' else (-DEFAULT_LIMIT, DEFAULT_LIMIT)
    ball = ((-swing, swing), (-DEFAULT_TWIST, DEFAULT_TWIST)) if swing else (None, None)
    axes, limits = {'hinge': ((hinge,), pairs[:1]), 'ball': ((twist,), ball),
                    'universal': ((hinge, universal), (pairs[0], second)),
                    'fixed': ((), ())}[kind]
    return change_joint(scene, name, kind=kind, axes=axes, limits=limits)


def add_bone(scene: Scene, parent: str, name: str) -> Scene:
    """Add a copy of bone ``parent`` at its end, on a ball joint; an error's path is ``name``."""
    placement, above = find(scene, parent)
    if not NAME.fullmatch(name):
        raise errors.WrongForm('name', name, 'text without / and control characters')
    if any(bone.name == name for bone in placement.doll.bones):
        raise errors.DuplicateName('name', name, 'a unique name')
    outward = outward_from(joint_of(scene, parent), above)
    reach = float(above.shape.support(
        rotation.rotate(rotation.inverse(above.orientation), outward)))
    bone = dataclasses.replace(above, name=name, position=above.position + 2 * reach * outward)
    joint = Joint(above.name, name, 'ball', above.position + reach * outward, (outward,),
                  ((-DEFAULT_LIMIT, DEFAULT_LIMIT), (-DEFAULT_TWIST, DEFAULT_TWIST)))
    return replace_doll(scene, placement, bones=(*placement.doll.bones, bone),
                        joints=(*placement.doll.joints, joint))


def remove_limb(scene: Scene, name: str) -> Scene:
    """Remove a bone's subtree and its swings; its skin is attached to the parent."""
    placement, bone = find(scene, name)
    doll, joint = placement.doll, joint_of(scene, name)
    if joint is None:
        raise errors.Detached(name, name, 'a bone with a parent: the root carries all others')
    removed = set(limb(doll, bone.name))
    return replace_doll(
        scene, placement,
        bones=tuple(bone for bone in doll.bones if bone.name not in removed),
        joints=tuple(joint for joint in doll.joints if joint.child not in removed),
        swings=tuple(dataclasses.replace(swing, colliders=tuple(
            collider for collider in swing.colliders if collider.bone not in removed))
            for swing in doll.swings if swing.bone not in removed),
        riders=tuple(reattached(rider, doll.bone(rider.bone), doll.bone(joint.parent))
                     if rider.bone in removed else rider for rider in doll.riders),
        no_collision=tuple(pair for pair in doll.no_collision if removed.isdisjoint(pair)))


def limb(doll: Ragdoll, root: str) -> tuple[str, ...]:
    """Names of the bones of a subtree, parents first."""
    names = [root]
    for name in names:
        names += [joint.child for joint in doll.joints if joint.parent == name]
    return tuple(names)


def reattached(rider: SkeletonFrame, old: Bone, new: Bone) -> SkeletonFrame:
    """A frame of ``old`` attached to ``new``, with the same world pose in the bind pose."""
    back = rotation.inverse(new.orientation)
    rotated = rotation.multiply(back, old.orientation)
    shift = rotation.rotate(back, np.subtract(old.position, new.position))
    return dataclasses.replace(
        rider, bone=new.name, position=shift + rotation.rotate(rotated, rider.position),
        orientation=rotation.multiply(rotated, rider.orientation))


def outward_from(joint: Joint | None, bone: Bone) -> np.ndarray:
    """Unit direction (3,) from a bone's joint to its centre; up for the root."""
    outward = np.subtract(bone.position, joint.anchor) if joint else np.zeros(3)
    length = np.linalg.norm(outward)
    return outward / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])


def _axes(joint: Joint, bone: Bone) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes (3,) for a joint of any kind: hinge axis, one normal to it, and along the bone."""
    along = outward_from(joint, bone)
    if joint.kind in ('hinge', 'universal'):
        first = np.array(joint.axes[0])
    else:
        first = np.cross(along, (1.0, 0.0, 0.0))
        if np.linalg.norm(first) < 0.3:
            first = np.array([0.0, 1.0, 0.0])
        first = first / np.linalg.norm(first)
    across = np.cross(first, along)
    if np.linalg.norm(across) < 0.3:
        across = np.cross(first, np.eye(3)[np.argmin(np.abs(first))])
    across = np.array(joint.axes[1]) if joint.kind == 'universal' else across
    return first, across / np.linalg.norm(across), along


def _move_limb(scene: Scene, placement: Placement, bone: Bone, moved: Bone) -> Scene:
    """Move the subtree of ``bone`` rigidly, so that the bone becomes ``moved``."""
    doll = placement.doll
    rotated = rotation.multiply(moved.orientation, rotation.inverse(bone.orientation))
    names = set(limb(doll, bone.name))

    def point(p: Sequence[float]) -> np.ndarray:
        return moved.position + rotation.rotate(rotated, np.subtract(p, bone.position))

    def direction(v: Sequence[float]) -> np.ndarray:
        return rotation.rotate(rotated, v)

    def move_swing(swing: Swing) -> Swing:
        links = tuple(dataclasses.replace(link, direction=direction(link.direction))
                      if link.direction else link for link in swing.links)
        return dataclasses.replace(swing, root=point(swing.root), links=links,
                                   direction=direction(swing.direction))

    bones = tuple(dataclasses.replace(
        each, position=point(each.position),
        orientation=rotation.multiply(rotated, each.orientation))
        if each.name in names else each for each in doll.bones)
    joints = tuple(dataclasses.replace(
        joint, anchor=point(joint.anchor), axes=tuple(direction(axis) for axis in joint.axes))
        if joint.child in names else joint for joint in doll.joints)
    def move_colliders(swing: Swing) -> Swing:
        return dataclasses.replace(swing, colliders=tuple(dataclasses.replace(
            each, at=point(each.at), to=each.to and point(each.to))
            if each.bone in names else each for each in swing.colliders))

    swings = tuple(move_colliders(move_swing(swing) if swing.bone in names else swing)
                   for swing in doll.swings)
    return replace_doll(scene, placement, bones=_replaced(bones, bones[doll.bones.index(bone)],
                                                         moved), joints=joints, swings=swings)


def _with_placement(scene: Scene, old: Placement, new: Placement) -> Scene:
    return dataclasses.replace(scene, dolls=_replaced(scene.dolls, old, new))


def _replaced(items: tuple, old: object, new: object) -> tuple:
    return tuple(new if each is old else each for each in items)


@contextmanager
def _errors_at(place: str) -> Iterator[None]:
    """Prefix the paths of errors with their place in the scene."""
    try:
        yield
    except errors.ModelError as error:
        raise error.at(place) from None
