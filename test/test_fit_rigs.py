"""Every rig becomes a doll without options: in its place, covered, mirrored, jointed."""
import dataclasses

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS, fitted

from ragdoll_ros.fit.bodies.overlap import covered
from ragdoll_ros.fit.judging.plausibility import find_implausible
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character

HUMANOIDS = ('mixamo', 'unreal', 'vrm', 'cmu', 'makehuman', 'unnamed', 'z_up', 'scaled_nodes')


def positions_in_ros(bones):
    """Bone roots as the rig was drawn, by the map that REP 103 asks for."""
    return np.array([[bone.head[2], bone.head[0], bone.head[1]] for bone in bones])


@pytest.mark.parametrize('name', RIGS)
def test_bones_come_out_in_metres_where_they_were_drawn(name):
    character = fitted(name).character
    drawn = positions_in_ros(RIGS[name].bones)
    if name == 'faces_backwards':
        drawn = drawn * (-1, -1, 1)
    drawn = drawn + RIGS[name].root[[2, 0, 1], 3]
    # The file holds 32-bit floats: 1e-7 of a few metres.
    place = {bone.name: k for k, bone in enumerate(RIGS[name].bones)}
    order = ([place[bone] for bone in character.bone_names] if RIGS[name].named
             else [np.argmin(np.linalg.norm(drawn - p, axis=1)) for p in character.positions])
    assert np.abs(character.positions - drawn[order]).max() < 2e-6
    assert character.extent < 4


@pytest.mark.parametrize('name', RIGS)
def test_every_rig_gives_a_sound_doll(name):
    fit = fitted(name)
    bodies = fit.doll.bones
    assert 1 <= len(bodies) <= len(RIGS[name].bones)
    assert sorted(b for body in fit.bodies for b in body.bones) == sorted(fit.character.bone_names)
    assert [rider.name for rider in fit.doll.riders] == list(fit.character.bone_names)
    # As much water as the skin holds or, where it holds too much (tubes that overlap count twice),
    # as the bodies do.
    volumes = fit.character.volume(), sum(bone.shape.volume for bone in bodies)
    assert any(fit.doll.mass == pytest.approx(1000 * volume, rel=1e-6) for volume in volumes)
    assert find_implausible(fit.doll) == []
    inside = covered(bodies, fit.character.vertices, 0.01)
    assert inside.mean() > 0.9


@pytest.mark.parametrize('name', HUMANOIDS)
def test_humanoids_are_covered_without_bloat(name):
    fit = fitted(name)
    assert covered(fit.doll.bones, fit.character.vertices, 0.01).mean() >= 0.9
    volume = sum(bone.shape.volume for bone in fit.doll.bones)
    assert volume <= 1.6 * fit.character.volume()


@pytest.mark.parametrize('name', HUMANOIDS)
def test_humanoids_have_the_joints_of_a_human(name):
    """By names, or by the bend of the limbs: the knee and the elbow are hinges, 20 bodies."""
    fit = fitted(name)
    kinds = {joint.child: joint.kind for joint in fit.doll.joints}
    roles = {body.bone.name: body.role for body in fit.bodies}
    assert 18 <= len(fit.doll.bones) <= 22
    if name != 'unnamed':
        for child, kind in kinds.items():
            if roles[child] in ('shin', 'forearm'):
                assert kind == 'hinge', child
        assert list(roles.values()).count('shin') == 2
        assert list(roles.values()).count('forearm') == 2
        assert 'finger' not in roles.values()


@pytest.mark.parametrize('name', ['mixamo', 'vrm', 'four_legs', 'bird', 'spider'])
def test_mirrored_limbs_get_mirrored_bodies(name):
    """Each body off the middle has one on the other side, of the same kind and size to 1 %."""
    bodies = fitted(name).doll.bones
    off = [bone for bone in bodies if abs(bone.position[1]) > 0.02]
    assert len(off) >= 8
    for bone in off:
        mirrored = np.multiply(bone.position, (1, -1, 1))
        other = min(bodies, key=lambda b, at=mirrored: np.linalg.norm(np.subtract(b.position, at)))
        assert np.linalg.norm(np.subtract(other.position, mirrored)) < 0.01 * 0.3
        assert other.shape.kind == bone.shape.kind
        assert np.allclose(other.shape.half_extents, bone.shape.half_extents, rtol=0.01)
        assert other.mass == pytest.approx(bone.mass, rel=0.01)


@pytest.mark.parametrize('shape', ['box', 'sphere', 'capsule', 'cylinder'])
@pytest.mark.parametrize('orientation', ['bone', 'principal'])
def test_every_shape_and_orientation_by_choice(shape, orientation):
    character = fitted('four_legs').character
    fit = fit_character(character, FitOptions(shape=shape, orientation=orientation))
    assert {bone.shape.kind for bone in fit.doll.bones} == {shape}
    if orientation == 'bone':
        assert not any(body.axes.principal for body in fit.bodies)
    assert covered(fit.doll.bones, character.vertices, 0.01).mean() > 0.9


def test_options_for_mass_size_and_weight():
    character = fitted('mixamo').character
    fit = fit_character(character, FitOptions(mass=70, masses='proportions'))
    assert fit.doll.mass == pytest.approx(70, rel=1e-8)
    masses = {body.role: body.bone.mass for body in fit.bodies}
    # De Leva's man: a thigh is 14.16 %, a shin 4.33 % of the whole.
    assert masses['thigh'] / masses['shin'] == pytest.approx(14.16 / 4.33, rel=1e-6)
    many = fit_character(character, FitOptions(smallest=0.001)).doll
    few = fit_character(character, FitOptions(smallest=0.3)).doll
    assert len(few.bones) < len(fit.doll.bones) < len(many.bones)
    wide = fit_character(character, FitOptions(weight=0.1))
    assert sum(b.vertices for b in wide.bodies) > sum(b.vertices for b in fit.bodies)


def test_weights_of_zero_everywhere(tmp_path):
    rig = RIGS['two_bones']
    points, faces, joints, weights = fit_rigs.skin(rig.bones)
    path = tmp_path / 'zero.glb'
    path.write_bytes(fit_rigs.document(rig, (points, faces, joints, weights * 0)).glb())
    fit = fit_character(read_character(path))
    assert len(fit.doll.bones) == 1
    assert any('all weights are zero' in note for note in fit.notes)


def test_another_skeleton_is_jointed_where_it_touches():
    fit = fitted('two_skeletons')
    parents = {joint.child: joint for joint in fit.doll.joints}
    whip = parents.keys() & {f'whip{k}' for k in range(4)}
    [first] = [parents[name] for name in whip if not parents[name].parent.startswith('whip')]
    assert (first.parent, first.kind) == ('mixamorig:Head', 'ball')


def test_another_skeleton_that_touches_nothing_is_fixed_with_a_note(tmp_path):
    far = [dataclasses.replace(bone, head=(*bone.head[:2], bone.head[2] - 1),
                               tail=(*bone.tail[:2], bone.tail[2] - 1))
           if bone.name.startswith('whip') else bone for bone in RIGS['two_skeletons'].bones]
    fit = fit_character(read_character(fit_rigs.write(fit_rigs.Rig('far', far), tmp_path)))
    assert any('no bone connects whip0' in note for note in fit.notes)
    assert next(joint for joint in fit.doll.joints if joint.child == 'whip0').kind == 'fixed'


def test_the_mannequin(tmp_path):
    """A real body from PyPI: 54 bones, 24 256 vertices, eight weights each."""
    pytest.importorskip('mannequin')
    path = tmp_path / 'mannequin.glb'
    path.write_bytes(fit_rigs.mannequin().glb())
    fit = fit_character(read_character(path))
    assert len(fit.character.vertices) == 24256
    assert covered(fit.doll.bones, fit.character.vertices, 0.01).mean() >= 0.9
    assert sum(bone.shape.volume for bone in fit.doll.bones) <= 1.6 * fit.character.volume()
    assert find_implausible(fit.doll) == []
