"""Bones that come and go: a new one at the end of a bone, a limb taken off."""
from __future__ import annotations

import dataclasses
import re

from ...model import errors, rotation
from ...model.ragdoll import Joint
from ...model.scene import Scene
from .changes import USUAL, USUAL_TWIST, carried, find, joint_of, limb, outward_from, replace_doll

NAME = re.compile(r'[^\s/][^/\x00-\x1f]{0,99}')
"""What config/doll.schema.json takes for a name."""


def add_bone(scene: Scene, parent: str, name: str) -> Scene:
    """Add a bone like ``parent`` where that one ends, on a ball joint; names its error ``name``."""
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
        riders=tuple(carried(rider, doll.bone(rider.bone), doll.bone(joint.parent))
                     if rider.bone in gone else rider for rider in doll.riders),
        no_collision=tuple(pair for pair in doll.no_collision if gone.isdisjoint(pair)))
