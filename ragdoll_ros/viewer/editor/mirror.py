"""Mirrors changes to the other side of a doll: of the left arm to the right one, and back."""
from __future__ import annotations

import math
import re

import numpy as np

from ...model import errors
from ...model.compound import Compound
from ...model.mesh import Hull
from ...model.ragdoll import Bone, Joint, Ragdoll
from ...model.scene import Scene
from ...model.shapes import SHAPES, Part, Shape
from ...model.vectors import Quaternion, Vector
from .changes import change_bone, change_joint, find, joint_of, limb, set_pose

OTHER = {'left': 'right', 'right': 'left', 'l': 'r', 'r': 'l', 'lft': 'rgt', 'rgt': 'lft'}
"""Sides in names of bones: the English words of config/bone_names.yaml."""

TOLERANCE = 0.05
"""Largest distance of a partner found by place from the mirrored place, in sizes of the doll."""


def partner(scene: Scene, name: str) -> str:
    """Name of the bone on the other side, by its name or else by its place; UnknownBone."""
    placement, bone = find(scene, name)
    doll = placement.doll
    swapped = re.sub(r'[A-Z]+(?![a-z])|[A-Z]?[a-z]+', _other_word, bone.name)
    names = [each.name for each in doll.bones]
    if swapped == bone.name or swapped not in names:
        swapped = _at_mirrored_place(doll, bone)
    if swapped is None:
        raise errors.UnknownBone('both sides', name, 'a bone with a partner on the other side')
    return scene.qualified(placement, swapped)


def mirrored(scene: Scene, name: str, whole_limb: bool = False) -> Scene:
    """Make the bone on the other side (and its limb) and its joint mirror images of this one.

    The mirror plane passes through the centre of the root, normal to the doll's y axis. Names,
    colours and parents stay. So do the signs of a partner's joint axes if its kind is the same, but
    not for a ball joint with two axes. Swings are not mirrored.
    """
    placement, bone = find(scene, name)
    names = limb(placement.doll, bone.name) if whole_limb else (bone.name,)
    middle = placement.doll.root.position[1]
    for each in names:
        here = scene.qualified(placement, each)
        scene = _mirror_bone(scene, here, partner(scene, here), middle)
    return scene


def _mirror_bone(scene: Scene, name: str, other: str, middle: float) -> Scene:
    (_, bone), joint = find(scene, name), joint_of(scene, name)
    scene = set_pose(scene, other, _point(bone.position, middle), _orientation(bone.orientation))
    fields = {key: getattr(bone, key) for key in (
        'mass', 'moments', 'friction', 'rolling_friction', 'restitution')}
    scene = change_bone(scene, other, shape=_shape(bone.shape), **fields)
    other_joint = joint_of(scene, other)
    if joint is None or other_joint is None:
        return scene
    return change_joint(scene, other, kind=joint.kind, damping=joint.damping,
                        anchor=_point(joint.anchor, middle), **_axes_and_limits(joint, other_joint))


def _axes_and_limits(joint: Joint, other_joint: Joint) -> dict[str, tuple]:
    """Mirror axes and limits: a rotation by t about a becomes one by -t about the image of a."""
    axes, limits = [], list(joint.limits)
    if len(limits) == 3:
        # y = z x x is an axial vector: its image is -(z' x x'), so its angle stays.
        twist, x = (tuple(np.array(axis) * (1, -1, 1) + 0.0) for axis in joint.axes)
        about_x, turn = (limits[index] and (-limits[index][1], -limits[index][0])
                         for index in (0, 2))
        return {'axes': (twist, x), 'limits': (about_x, limits[1], turn)}
    for index, axis in enumerate(joint.axes):
        image = np.array(axis) * (1, -1, 1)
        like = other_joint.axes[index] if other_joint.kind == joint.kind else axis
        if image @ np.array(like) < 0:
            image = -image
        elif limits[index] is not None:
            low, high = limits[index]
            limits[index] = (-high, -low)
        axes.append(image + 0.0)
    return {'axes': tuple(axes), 'limits': tuple(limits)}


def _point(point: Vector, middle: float) -> Vector:
    return (point[0], 2 * middle - point[1], point[2])


def _orientation(q: Quaternion) -> Quaternion:
    """S R S with S = diag(1, -1, 1): the mirrored rotation."""
    return (-q[0], q[1], -q[2], q[3])


def _shape(shape: Shape | Compound) -> Shape | Compound:
    """Mirror image in the body's frame; primitive shapes are symmetric."""
    return shape if shape.kind in SHAPES else Compound(tuple(
        Part(_hull(part.shape) if isinstance(part.shape, Hull) else part.shape,
             _point(part.position, 0.0), _orientation(part.orientation))
        for part in shape.parts))


def _hull(hull: Hull) -> Hull:
    return Hull(hull.vertices * (1, -1, 1), hull.faces[:, ::-1])


def _other_word(match: re.Match) -> str:
    word = match[0]
    other = OTHER.get(word.lower(), word)
    if other is word:
        return word
    return other.upper() if word.isupper() else other.title() if word[0].isupper() else other


def _at_mirrored_place(doll: Ragdoll, bone: Bone) -> str | None:
    """Name of the bone nearest to the mirrored place; None if too far, or the bone itself."""
    places = np.array([each.position for each in doll.bones])
    target = _point(bone.position, doll.root.position[1])
    nearest = int(np.argmin(np.linalg.norm(places - target, axis=1)))
    size = float(np.ptp(places, axis=0).max())
    if doll.bones[nearest] is bone or math.dist(places[nearest], target) > TOLERANCE * size:
        return None
    return doll.bones[nearest].name
