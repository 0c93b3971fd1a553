"""Swings as data: files, names, errors, the doll's frame."""
import math

import numpy as np
import pytest

from ragdoll_ros.files.doll import build_doll, doll_data
from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.model.state import State
from ragdoll_ros.model.swing import Link, Swing, strand
from ragdoll_ros.model.swing_mount import mount_swings
from ragdoll_ros.physics.swing.swings import Swings

TURN = rotation.from_rpy(0.3, 0.2, 0.1)
HEAD = Bone('head', Sphere(0.1), 5, (0.1, 0, 1), TURN)


def test_a_scene_with_swings_survives_a_round_trip(tmp_path):
    links = (Link(0.1, 0.02, 1 / 3, 0.7), Link(0.2, 0.01, 0.1, 0.1, (1, 2, 3)))
    doll = Ragdoll('doll', (HEAD,), (), (
        Swing('a', 'head', (0.1, 0.2, 1.1), (1, 1, 1), links, 0.3),
        Swing('b', 'head', (0, 0, 1), (0, 0, -1), (Link(0.1),), -1, 'free', (0.1, 0, 2))))
    scene = Scene('scene', (Placement(doll, orientation=rotation.from_rpy(1, 0, 0)),))
    save_scene(scene, tmp_path / 'scene.yaml')
    assert load_scene(str(tmp_path / 'scene.yaml')) == scene


def test_a_scene_adds_swings_to_a_doll_it_names(tmp_path):
    plain, dressed = load_scene('drop').dolls[0].doll, load_scene('ponytail').dolls[0].doll
    assert dressed.bones == plain.bones
    assert dressed.joints == plain.joints
    assert [swing.name for swing in dressed.swings] == ['ponytail']
    file = tmp_path / 'wrong.yaml'
    file.write_text('dolls:\n  - doll: doll.yaml\n    swings:\n'
                    '      - {name: a, bone: hed, root: [0, 0, 1], direction: [0, 0, 1],'
                    ' strand: {links: 2, length: 1e-4}}\n')
    with pytest.raises(errors.ModelErrors) as raised:
        load_scene(str(file))
    assert {(type(error), error.path) for error in raised.value.errors} == {
        (errors.UnknownBone, 'dolls[0].swings[0].bone'),
        (errors.OutOfRange, 'dolls[0].swings[0].strand.length')}


def test_roots_and_directions_are_given_in_the_dolls_frame():
    swing = Swing('a', 'head', (0.1, 0.2, 1.1), (0, 0, -2), (Link(0.5),))
    placement = Placement(Ragdoll('doll', (HEAD,), (), (swing,)), position=(5, 0, 0))
    scene = Scene('scene', (placement,))
    position, orientation = placement.bone_pose(HEAD)
    zero = np.zeros((1, 3))
    start = State(position[None], orientation[None], zero, zero)
    state = Swings(mount_swings(scene), scene.gravity, lambda t: start).evaluate(0)
    np.testing.assert_allclose(state.roots, [[5.1, 0.2, 1.1]], atol=1e-12)
    np.testing.assert_allclose(state.positions, [[5.1, 0.2, 0.6]], atol=1e-12)
    np.testing.assert_allclose(state.orientations, orientation[None], atol=1e-12)


@pytest.mark.parametrize(('changes', 'error', 'path'), [
    ({'bone': 'hed'}, errors.UnknownBone, 'swings[0].bone'),
    ({'direction': [0, 0, 0]}, errors.NotUnit, 'swings[0].direction'),
    ({'mode': 'wind'}, errors.WrongForm, 'swings[0].mode'),
    ({'mode': 'pendulum'}, errors.WrongForm, 'swings[0].links[1].stiffness'),
    ({'velocity': [1, 0, 0]}, errors.WrongForm, 'swings[0].velocity'),
    ({'root': [0, math.nan, 0]}, errors.NotFinite, 'swings[0].root'),
    ({'gravity': 11}, errors.OutOfRange, 'swings[0].gravity'),
    ({'links': []}, errors.WrongForm, 'swings[0].links'),
    ({'links': [{'length': 0}]}, errors.NotPositive, 'swings[0].links[0].length'),
    ({'links': [{'length': 1e-4}]}, errors.OutOfRange, 'swings[0].links[0].length'),
    ({'links': [{'length': 1, 'damping': -1}]}, errors.OutOfRange, 'swings[0].links[0].damping'),
    ({'strand': {'links': 2, 'length': 1}}, errors.WrongForm, 'swings[0]'),
    ({'independent': 1}, errors.WrongForm, 'swings[0].independent'),
])
def test_what_is_wrong_with_a_swing_is_named(changes, error, path):
    bones = [{'name': 'head', 'shape': {'sphere': {'radius': 0.1}}, 'mass': 1,
              'position': [0, 0, 1]}]
    swing = {'name': 'a', 'bone': 'head', 'root': [0, 0, 1], 'direction': [0, 0, 1],
             'links': [{'length': 0.1}, {'length': 0.1, 'stiffness': 1}]}
    assert build_doll({'bones': bones, 'swings': [swing]})[1] == []
    doll, found = build_doll({'bones': bones, 'swings': [swing | changes]})
    assert doll is None
    assert [(type(one), one.path) for one in found] == [(error, path)]


def test_two_swings_of_one_name_are_refused():
    swing = Swing('a', 'head', (0, 0, 1), (0, 0, 1), (Link(0.1),))
    with pytest.raises(errors.DuplicateName):
        Ragdoll('doll', (HEAD,), (), (swing, swing))


def test_a_strand_is_short_for_links_from_stiff_to_limp():
    links = strand(3, 0.3, 0.6, (3, 1), 0.5)
    assert [link.stiffness for link in links] == [3, 2, 1]
    assert sum(link.length for link in links) == pytest.approx(0.3)
    assert sum(link.mass for link in links) == pytest.approx(0.6)
    doll = Ragdoll('doll', (HEAD,), (), (Swing('a', 'head', (0, 0, 0), (0, 0, 1), links),))
    data = doll_data(doll)
    del data['swings'][0]['links']
    data['swings'][0]['strand'] = {'links': 3, 'length': 0.3, 'mass': 0.6, 'stiffness': [3, 1],
                                   'damping': 0.5}
    assert build_doll(data)[0] == doll


def test_a_strap_is_short_for_links_of_a_rigidity():
    links = strand(4, 0.4, 0.8, damping=0.3, rigidity=0.05)
    assert [link.stiffness for link in links] == pytest.approx([1.0, 0.5, 0.5, 0.5])
    assert [link.mass for link in links] == pytest.approx([0.2, 0.2, 0.2, 0.1])
    with pytest.raises(errors.WrongForm, match='rigidity'):
        strand(4, 0.4, 0.8, 1.0, rigidity=0.05)


def test_independent_links_survive_a_round_trip():
    swing = Swing('a', 'head', (0, 0, 0), (0, 0, 1), strand(2, 0.2), independent=True)
    doll = Ragdoll('doll', (HEAD,), (), (swing,))
    assert doll_data(doll)['swings'][0]['independent'] is True
    assert build_doll(doll_data(doll))[0] == doll
