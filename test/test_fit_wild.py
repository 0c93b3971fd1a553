"""Rigs made for animation become the body that their skin shows: its tree, its root, its joints."""
import numpy as np
import pytest
from wild_rigs import WILD, fitted


def distance_off(bone, point):
    """How far a point is outside a body, of the body's longest extent."""
    off = float(bone.shape.signed_distance(bone.pose.apply_inverse(np.reshape(point, (1, 3))))[0])
    return max(off, 0) / (2 * max(bone.shape.half_extents))


def true_name(name, wild, fit):
    """What the bone is called in the truth, also where the file has no names."""
    if wild.rig.named:
        return name
    place = fit.character.positions[fit.character.bone_names.index(name)]
    drawn = [np.array([bone.head[2], bone.head[0], bone.head[1]]) for bone in wild.rig.bones]
    return wild.rig.bones[int(np.argmin([np.linalg.norm(place - at) for at in drawn]))].name


@pytest.mark.parametrize('name', WILD)
def test_the_tree_is_the_bodys(name):
    wild, fit = WILD[name], fitted(name)
    held = {body.bone.name: {true_name(bone, wild, fit) for bone in body.bones}
            for body in fit.bodies}
    for joint in fit.doll.joints:
        parent, child = held[joint.parent], held[joint.child]
        assert any(wild.truth.get(a) == b or wild.truth.get(b) == a
                   for a in child for b in parent), (joint.parent, joint.child)
        assert joint.kind != 'fixed'
    assert held[fit.doll.root.name] & set(wild.roots)
    # A body for each bone that has a size: none has been lost in another.
    assert len(fit.doll.bones) >= 0.8 * len(wild.truth)


@pytest.mark.parametrize('name', WILD)
def test_joints_are_at_both_bodies(name):
    doll = fitted(name).doll
    for joint in doll.joints:
        for bone in (joint.parent, joint.child):
            # Of the body's longest extent, as the verdict has it.
            assert distance_off(doll.bone(bone), np.array(joint.anchor)) <= 0.06, joint
