"""Rigs made for animation become the body that their skin shows: its tree, its root, its joints."""
import numpy as np
import pytest
from wild_rigs import WILD, M, fitted, write

from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import errors


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


def parents_of(fit):
    return {joint.child: joint.parent for joint in fit.doll.joints}


def test_the_tree_may_be_the_files_or_the_skins(tmp_path):
    """Hands that hang from the hips in the file: so with its tree, not with the skin's."""
    character = read_character(write(WILD['hands_of_root-sharp'], tmp_path))
    hand, hips, forearm = f'{M}LeftHand', f'{M}Hips', f'{M}LeftForeArm'
    for tree, parent in (('auto', forearm), ('skin', forearm), ('file', hips)):
        fit = fit_character(character, FitOptions(tree=tree))
        assert parents_of(fit)[hand] == parent, tree
        assert fit.doll.root.name == hips


def test_the_skins_tree_alone_is_misled(tmp_path):
    """What the file's tree is for: bones that move the skin of others far away."""
    character = read_character(write(WILD['head_moves_shoulders-islands'], tmp_path))
    wanted = {'auto': f'{M}Spine2', 'file': f'{M}Spine2', 'skin': f'{M}Head'}
    for tree, parent in wanted.items():
        fit = fit_character(character, FitOptions(tree=tree))
        body = next(body for body in fit.bodies if f'{M}LeftShoulder' in body.bones
                    or f'{M}LeftArm' in body.bones)
        assert parents_of(fit)[body.bone.name] == parent, tree


def test_the_root_may_be_named(tmp_path):
    character = read_character(write(WILD['feet_of_root-sharp'], tmp_path))
    fit = fit_character(character, FitOptions(root=f'{M}Spine2'))
    assert fit.doll.root.name == f'{M}Spine2'
    assert parents_of(fit)[f'{M}Hips'] in (f'{M}Spine', f'{M}Spine1')
    with pytest.raises(errors.UnknownBone, match=r'root: .*Spine9'):
        fit_character(character, FitOptions(root=f'{M}Spine9'))
    control = read_character(write(WILD['poles-sharp'], tmp_path))
    with pytest.raises(errors.WrongForm, match=r'root: .*a bone that moves skin'):
        fit_character(control, FitOptions(root='Root'))
