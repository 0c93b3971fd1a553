"""Bones that come and go: a new one at the end of a bone, a limb taken off."""
from __future__ import annotations

import dataclasses
import re

import numpy as np

from ...model import errors, rotation
from ...model.ragdoll import Bone, Joint, SkeletonFrame
from ...model.scene import Scene
from .changes import USUAL, USUAL_TWIST, find, joint_of, limb, replace_doll

NAME = re.compile(r'[^\s/][^/\x00-\x1f]{0,99}')
"""What config/doll.schema.json takes for a name."""


def add_bone(scene: Scene, parent: str, name: str) -> Scene:
    """Add a bone like ``parent`` where that one ends, on a ball joint; names its error ``name``."""
    placement, above = find(scene, parent)
    if not NAME.fullmatch(name):
        raise errors.WrongForm('name', name, 'text without / and control characters')
    if any(bone.name == name for bone in placement.doll.bones):
        raise errors.DuplicateName('name', name, 'a name of its own')
    outward = _outward(above, joint_of(scene, parent))
    reach = float(above.shape.reach(rotation.rotate(rotation.inverse(above.orientation), outward)))
    bone = dataclasses.replace(above, name=name, position=above.position + 2 * reach * outward)
    joint = Joint(above.name, name, 'ball', above.position + reach * outward, (outward,),
                  ((-USUAL, USUAL), (-USUAL_TWIST, USUAL_TWIST)))
    return replace_doll(scene, placement, bones=(*placement.doll.bones, bone),
                        joints=(*placement.doll.joints, joint))


def remove_limb(scene: Scene, name: str) -> Scene:
    """Take off a bone and all that hangs from it, with its swings; its skin goes to the parent."""
    placement, bone = find(scene, name)
    doll, joint = placement.doll, joint_of(scene, name)
    if joint is None:
        raise errors.Detached(name, name, 'a bone with a parent: all hangs from the root')
    gone = set(limb(doll, bone.name))
    return replace_doll(
        scene, placement,
        bones=tuple(bone for bone in doll.bones if bone.name not in gone),
        joints=tuple(joint for joint in doll.joints if joint.child not in gone),
        swings=tuple(swing for swing in doll.swings if swing.bone not in gone),
        riders=tuple(_carried(rider, doll.bone(rider.bone), doll.bone(joint.parent))
                     if rider.bone in gone else rider for rider in doll.riders))


def _carried(rider: SkeletonFrame, old: Bone, new: Bone) -> SkeletonFrame:
    """A rider as another bone carries it: in the bind pose it stays where it is."""
    back = rotation.inverse(new.orientation)
    position = old.position + rotation.rotate(old.orientation, rider.position)
    orientation = rotation.multiply(old.orientation, rider.orientation)
    return dataclasses.replace(
        rider, bone=new.name, orientation=rotation.multiply(back, orientation),
        position=rotation.rotate(back, position - np.array(new.position)))


def _outward(bone: Bone, joint: Joint | None) -> np.ndarray:
    """Unit direction (3,) from where a bone hangs to its middle; up for the root."""
    outward = np.subtract(bone.position, joint.anchor) if joint else np.zeros(3)
    length = np.linalg.norm(outward)
    return outward / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
