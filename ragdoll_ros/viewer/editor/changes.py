"""Changes of one bone or of its joint: each takes a scene and gives another, or a ModelError.

Bones go by their names in the scene (``Scene.bone_names``). An error's path begins with that name:
``left shin.mass``, ``left shin.joint.limits_deg[0]``. What the dataclasses check is checked here
by making them.

What belongs together stays together. A body that is moved, rotated or given another shape leaves
all else of the doll where it is in the bind pose: the pivots, its neighbours, and the skeleton of
the skin, as an editor of a fitted doll moves bodies under a skin that stays. With ``limb`` the
body takes along all that hangs from it, with its own joint, axes, swings and skin: one rigid
piece, cut at the pivot to the parent.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from ...model import errors, rotation
from ...model.ragdoll import JOINT_KINDS, MAX_SWING, Bone, Joint, Ragdoll, SkeletonFrame
from ...model.scene import Placement, Scene
from ...model.shapes import SHAPES, Box, Shape, Sphere
from ...model.swing import Swing
from ...model.vectors import floats

USUAL, USUAL_TWIST = math.radians(45), math.radians(30)
"""Limit of an axis, and twist of a ball, where the joint had none of the kind before."""


def find(scene: Scene, name: str) -> tuple[Placement, Bone]:
    """The doll that holds a bone, and the bone; UnknownBone if there is none."""
    index = scene.bone_index(name)
    return scene.dolls[scene.doll_of_bone[index]], scene.bones[index]


def joint_of(scene: Scene, name: str) -> Joint | None:
    """Joint between a bone and its parent, None for a root."""
    placement, bone = find(scene, name)
    return next((joint for joint in placement.doll.joints if joint.child == bone.name), None)


def replace_doll(scene: Scene, placement: Placement, **fields: object) -> Scene:
    """The scene with fields of one doll replaced."""
    doll = dataclasses.replace(placement.doll, **fields)
    return dataclasses.replace(scene, dolls=tuple(
        dataclasses.replace(placement, doll=doll) if each is placement else each
        for each in scene.dolls))


def change_bone(scene: Scene, name: str, **fields: object) -> Scene:
    """Set fields of a bone: mass, friction, color, ...; a new size keeps the mass.

    Inertia follows where a bone is a uniform solid. To move or rotate one, see ``set_pose``.
    """
    placement, bone = find(scene, name)
    with _errors_at(name):
        changed = dataclasses.replace(bone, **fields)
    return replace_doll(scene, placement, bones=_swapped(placement.doll.bones, bone, changed))


def change_joint(scene: Scene, name: str, **fields: object) -> Scene:
    """Set fields of the joint to a bone's parent: anchor, axes, damping, ...; limits in rad."""
    placement, _ = find(scene, name)
    joint = joint_of(scene, name)
    if joint is None:
        raise errors.Detached(f'{name}.joint', name, 'a bone with a parent: the root has no joint')
    with _errors_at(f'{name}.joint'):
        changed = dataclasses.replace(joint, **fields)
    return replace_doll(scene, placement, joints=_swapped(placement.doll.joints, joint, changed))


def set_pose(scene: Scene, name: str, position: Sequence[float] | None = None,
             orientation: Sequence[float] | None = None, limb: bool = False) -> Scene:
    """Place a body: centre of mass (m) and quaternion, doll's frame, bind pose; None stays."""
    placement, bone = find(scene, name)
    fields = {'position': position, 'orientation': orientation}
    with _errors_at(name):
        moved = dataclasses.replace(
            bone, **{key: value for key, value in fields.items() if value is not None})
    if limb:
        return _move_limb(scene, placement, bone, moved)
    riders = tuple(carried(rider, bone, moved) if rider.bone == bone.name else rider
                   for rider in placement.doll.riders)
    return replace_doll(scene, placement, riders=riders,
                        bones=_swapped(placement.doll.bones, bone, moved))


def set_size(scene: Scene, name: str, half_extents: Sequence[float]) -> Scene:
    """Make a body as large as a box (3,) m along its own axes, from its centre; mass stays."""
    _, bone = find(scene, name)
    with _errors_at(name):
        errors.check_positive('size', floats(half_extents))
        if bone.shape.kind not in SHAPES:
            raise errors.WrongForm('size', bone.shape.kind, 'one of ' + ', '.join(SHAPES))
        shape = shape_within(bone.shape.kind, half_extents)
    return change_bone(scene, name, shape=shape)


def set_shape(scene: Scene, name: str, kind: str) -> Scene:
    """Make a body another kind of shape that fills the same box, its long side along z."""
    _, bone = find(scene, name)
    if kind not in SHAPES:
        raise errors.WrongForm(f'{name}.shape', kind, 'one of ' + ', '.join(SHAPES))
    if kind == bone.shape.kind:
        return scene
    half, moments = np.array(bone.shape.half_extents), bone.moments
    longest = int(np.argmax(half))
    if kind in ('cylinder', 'capsule') and half[longest] > half[2] * (1 + 1e-9):
        # A rotation by 120 degrees that brings the long side onto z keeps the axes right-handed.
        cycle = np.roll(np.eye(3), 2 - longest, axis=1).T
        orientation = rotation.multiply(bone.orientation, rotation.from_matrix(cycle.T))
        scene = set_pose(scene, name, orientation=orientation)
        half, moments = cycle @ half, moments and tuple(cycle @ moments)
    return change_bone(scene, name, shape=shape_within(kind, half), moments=moments)


def shape_within(kind: str, half_extents: Sequence[float]) -> Shape:
    """Shape of a kind that fits a box with half edges (3,) m; round ones by the mean."""
    x, y, z = (float(edge) for edge in half_extents)
    if kind == 'box':
        return Box((2 * x, 2 * y, 2 * z))
    if kind == 'sphere':
        return Sphere(float(np.cbrt(x * y * z)))
    radius = math.sqrt(x * y)
    if kind == 'capsule':
        # Its barrel keeps a tenth of the length, as it has to be longer than nothing.
        radius = min(radius, 0.9 * z)
        return SHAPES[kind](radius, 2 * (z - radius))
    return SHAPES[kind](radius, 2 * z)


def set_joint_kind(scene: Scene, name: str, kind: str) -> Scene:
    """Make a bone's joint another kind; axes and limits that the two have in common stay."""
    joint = joint_of(scene, name)
    if joint is None or kind not in JOINT_KINDS or kind == joint.kind:
        return change_joint(scene, name, kind=kind)
    _, bone = find(scene, name)
    hinge, universal, twist = _axes(joint, bone)
    pairs = joint.limits or ((-USUAL, USUAL),)
    widest = max((max(map(abs, pair)) for pair in pairs if pair), default=0.0)
    swing = min(widest, MAX_SWING)
    second = joint.limits[1] if joint.kind == 'universal' else (-USUAL, USUAL)
    ball = ((-swing, swing), (-USUAL_TWIST, USUAL_TWIST)) if swing else (None, None)
    axes, limits = {'hinge': ((hinge,), pairs[:1]), 'ball': ((twist,), ball),
                    'universal': ((hinge, universal), (pairs[0], second)),
                    'fixed': ((), ())}[kind]
    return change_joint(scene, name, kind=kind, axes=axes, limits=limits)


def limb(doll: Ragdoll, root: str) -> tuple[str, ...]:
    """Names of a bone and of all that hangs from it, parents first."""
    names = [root]
    for name in names:
        names += [joint.child for joint in doll.joints if joint.parent == name]
    return tuple(names)


def carried(rider: SkeletonFrame, old: Bone, new: Bone) -> SkeletonFrame:
    """A rider of ``old`` as ``new`` carries it: in the bind pose it stays where it is."""
    back = rotation.inverse(new.orientation)
    rotated = rotation.multiply(back, old.orientation)
    shift = rotation.rotate(back, np.subtract(old.position, new.position))
    return dataclasses.replace(
        rider, bone=new.name, position=shift + rotation.rotate(rotated, rider.position),
        orientation=rotation.multiply(rotated, rider.orientation))


def outward_from(joint: Joint | None, bone: Bone) -> np.ndarray:
    """Unit direction (3,) from where a bone hangs to its middle; up for the root."""
    outward = np.subtract(bone.position, joint.anchor) if joint else np.zeros(3)
    length = np.linalg.norm(outward)
    return outward / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])


def _axes(joint: Joint, bone: Bone) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes (3,) for a joint of any kind: to rotate about, one across it, and along the bone."""
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
    """The scene with all that hangs from ``bone`` moved rigidly as that moves to ``moved``."""
    doll = placement.doll
    rotated = rotation.multiply(moved.orientation, rotation.inverse(bone.orientation))
    names = set(limb(doll, bone.name))

    def point(p: Sequence[float]) -> np.ndarray:
        return moved.position + rotation.rotate(rotated, np.subtract(p, bone.position))

    def direction(v: Sequence[float]) -> np.ndarray:
        return rotation.rotate(rotated, v)

    def swung(swing: Swing) -> Swing:
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
    swings = tuple(swung(swing) if swing.bone in names else swing for swing in doll.swings)
    return replace_doll(scene, placement, bones=_swapped(bones, bones[doll.bones.index(bone)],
                                                         moved), joints=joints, swings=swings)


def _swapped(items: tuple, old: object, new: object) -> tuple:
    return tuple(new if each is old else each for each in items)


@contextmanager
def _errors_at(place: str) -> Iterator[None]:
    """Errors from within have their place in the scene before their path."""
    try:
        yield
    except errors.ModelError as error:
        raise error.at(place) from None
