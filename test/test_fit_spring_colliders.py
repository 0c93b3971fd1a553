"""Colliders of VRM spring bones: their places and sizes, and that hair stays outside of them."""
import dataclasses

import numpy as np
import pytest
from fit_rigs import HALF, matrix
from test_fit_spring_bones import HEAD, in_ros, new, old, rig, written
from test_swing_colliders import distance

from ragdoll_ros.files.doll import build_doll, doll_data, load_doll, save_doll
from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import errors
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.swing import Collider, Link, Swing
from ragdoll_ros.physics.simulation import Simulation

HEAD_NODE = 2 + next(k for k, bone in enumerate(rig().bones) if bone.name == HEAD)
CENTER, END = np.array((.05, 1.42, -.2)), np.array((0, 1.4, -.05))
"""Of a sphere and of a capsule, m, in glTF's axes; the second joint is in the sphere."""


def in_head(data, point):
    """A point of the armature's frame in the head's node, file units."""
    world, node, parents = np.eye(4), HEAD_NODE, {}
    for number, each in enumerate(data['nodes']):
        parents |= dict.fromkeys(each.get('children', ()), number)
    while node != 0:
        world = np.array(data['nodes'][node]['matrix']).reshape(4, 4).T @ world
        node = parents[node]
    return np.linalg.inv(world) @ np.append(point, 1)


def new_colliders(data, unit=1.0, inverse=None):
    """VRM 1.0: a sphere in one group, a capsule in another, a plane that is ignored."""
    # Of joints in the file's units, of colliders in the node's.
    new(data, hitRadius=.01)
    inverse = np.eye(4) if inverse is None else inverse

    def at(point):
        return in_head(data, (inverse @ np.append(point * unit, 1))[:3])[:3].tolist()
    vrm = data['extensions']['VRMC_springBone']
    vrm['colliders'] = [
        {'node': HEAD_NODE, 'shape': {'sphere': {'offset': at(CENTER), 'radius': .13 * unit}}},
        {'node': HEAD_NODE, 'shape': {'plane': {}}},
        {'node': HEAD_NODE, 'shape': {'capsule': {
            'offset': at(CENTER), 'tail': at(END), 'radius': .05 * unit}}}]
    vrm['colliderGroups'] = [{'name': 'head', 'colliders': [0, 1]}, {'colliders': [2]}]
    vrm['springs'][0]['colliderGroups'] = [1, 0]


def old_colliders(data):
    """VRM 0: offsets with z reversed, radii of the group."""
    old(data)
    x, y, z, _ = in_head(data, CENTER)
    animation = data['extensions']['VRM']['secondaryAnimation']
    animation['colliderGroups'] = [
        {'node': -1, 'colliders': []},
        {'node': HEAD_NODE, 'colliders': [{'offset': {'x': x, 'y': y, 'z': -z}, 'radius': .13}]}]
    animation['boneGroups'][0] |= {'colliderGroups': [1], 'hitRadius': .02}


def swing_of(path):
    [swing] = fit_character(read_character(path)).doll.swings
    return swing


def test_a_sphere_and_a_capsule_of_vrm_1(tmp_path):
    fit = fit_character(read_character(written(tmp_path, new_colliders)))
    [swing] = fit.doll.swings
    capsule, ball = swing.colliders
    assert (ball.bone, capsule.bone, ball.to) == (HEAD, HEAD, None)
    # The file's matrices are float32 at places of the order of 1 m.
    assert np.abs(ball.at - in_ros([CENTER])[0]).max() < 1e-6
    assert np.abs(np.array([capsule.at, capsule.to]) - in_ros([CENTER, END])).max() < 1e-6
    assert (ball.radius, capsule.radius) == pytest.approx((.13, .05), rel=1e-5)
    assert [link.radius for link in swing.links] == pytest.approx([.01] * 3)
    assert any('collider 1 is neither' in note for note in fit.notes)


def test_a_sphere_of_vrm_0(tmp_path):
    swing = swing_of(written(tmp_path, old_colliders))
    [ball] = swing.colliders
    assert np.abs(ball.at - in_ros([CENTER])[0]).max() < 1e-6 and ball.to is None
    assert ball.radius == pytest.approx(.13, rel=1e-5)
    assert [link.radius for link in swing.links] == pytest.approx([.02] * 3)


def test_turned_and_in_centimetres(tmp_path):
    """Axes and units of the file change neither places nor sizes."""
    root = matrix((-HALF, 0, 0, HALF), .01)
    turned = rig(unit=100, root=root)
    path = written(tmp_path, lambda data: new_colliders(data, 100, np.linalg.inv(
        root * np.array([[100] * 3 + [1]] * 4))), turned)
    made = swing_of(path)
    plain = swing_of(written(tmp_path, new_colliders))
    for ours, theirs in zip(made.colliders, plain.colliders, strict=True):
        assert ours.radius == pytest.approx(theirs.radius, rel=1e-5)
        assert np.abs(np.subtract(ours.at, theirs.at)).max() < 1e-5
    assert [link.radius for link in made.links] == pytest.approx([.01] * 3, rel=1e-5)


@pytest.mark.parametrize('change', [new_colliders, old_colliders])
def test_the_hair_of_a_character_that_spins_stays_outside(tmp_path, change):
    """Of what is read back from the doll's file: by 1 mm at 60 ticks a second."""
    fit = fit_character(read_character(written(tmp_path, change)))
    save_doll(fit.doll, tmp_path / 'doll.yaml')
    doll = load_doll(str(tmp_path / 'doll.yaml'))
    assert doll == fit.doll
    scene = Scene('spun', (Placement(doll, spin=(3, 6, -4)),), step=1 / 60)
    head, [swing] = scene.bone_index(HEAD), doll.swings
    back, deepest = doll.bone(HEAD).pose, []
    with Simulation(scene, accuracy='draft') as simulation:
        for _ in range(120):
            pose = simulation.state.poses(head)
            for collider in swing.colliders:
                axis = pose.apply(back.apply_inverse(np.array([collider.at,
                                                               collider.to or collider.at])))
                deepest += [collider.radius + link.radius - distance(mass, axis)
                            for link, mass in zip(swing.links, simulation.swings.positions,
                                                  strict=True)]
            simulation.advance()
    assert -2e-3 < max(deepest) < 1e-3


def changed(key, value):
    def change(data):
        new_colliders(data)
        vrm = data['extensions']['VRMC_springBone']
        place = vrm
        *keys, last = key
        for each in keys:
            place = place[each]
        place[last] = value
    return change


@pytest.mark.parametrize('change', [
    changed(('colliders', 0, 'node'), 999), changed(('colliders',), 3),
    changed(('colliders', 0, 'shape', 'sphere', 'radius'), -1),
    changed(('colliders', 0, 'shape', 'sphere', 'offset'), [0, 0]),
    changed(('colliders', 2, 'shape', 'capsule', 'tail'), [0, 0, float('nan')]),
    changed(('colliderGroups', 0, 'colliders'), [3]),
    changed(('springs', 0, 'colliderGroups'), ['head'])])
def test_broken_colliders_end_in_one_sentence(tmp_path, capsys, change):
    assert main([str(written(tmp_path, change))]) == 2
    error = capsys.readouterr().err
    assert error.startswith('ragdoll_fit: ') and error.count('\n') == 1
    assert 'extensions.VRM' in error and 'ollider' in error


def test_a_dolls_file_with_wrong_colliders(tmp_path):
    doll = fit_character(read_character(written(tmp_path, old_colliders))).doll
    data = doll_data(doll)
    data['swings'][0]['colliders'] = [
        {'bone': 'nobody', 'radius': .1, 'at': [0, 0, 0]}]
    _, found = build_doll(data)
    assert [error.path for error in found] == ['swings[0].colliders[0].bone']
    data['swings'][0]['colliders'] = [{'bone': HEAD, 'radius': 0, 'at': [0, 0]}, {'bone': HEAD}]
    _, found = build_doll(data)
    assert {error.path for error in found} == {
        'swings[0].colliders[0].radius', 'swings[0].colliders[0].at', 'swings[0].colliders[1]'}
    with pytest.raises(errors.WrongForm, match=r'colliders.*free'):
        Swing('s', HEAD, (0, 0, 0), (1, 0, 0), (Link(.1),), mode='free',
              colliders=(Collider(HEAD, .1, (0, 0, 0)),))


def test_colliders_are_renamed_and_moved_with_their_bones(tmp_path):
    """Renamed bones, and the head turned by the editor: places on the head stay."""
    from ragdoll_ros.viewer.editor.changes import remove_limb
    doll = fit_character(read_character(written(tmp_path, old_colliders))).doll
    [swing] = doll.renamed(lambda name: f'x{name}').swings
    assert swing.colliders[0].bone == f'x{HEAD}'
    hand = next(bone.name for bone in doll.bones if bone.name.endswith('LeftHand'))
    both = (*doll.swings[0].colliders, Collider(hand, .1, (0, 0, 0)))
    doll = dataclasses.replace(doll, swings=(dataclasses.replace(doll.swings[0],
                                                                 colliders=both),))
    after = remove_limb(Scene('s', (Placement(doll),)), hand).dolls[0].doll
    assert after.swings[0].colliders == both[:1]
