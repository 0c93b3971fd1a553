"""All bones of a skeleton follow the doll, so that a skin can."""
import dataclasses

import fit_rigs
import numpy as np
import pytest
from conserved import matrices
from fit_rigs import RIGS

from ragdoll_ros.files.doll import build_doll, doll_data, load_doll, save_doll
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll, SkeletonFrame
from ragdoll_ros.model.scene import Placement, Scene, above_ground
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.model.skeleton import Riders, rider_names
from ragdoll_ros.physics.simulation import Simulation


@pytest.fixture
def fit():
    return fit_rigs.fitted('mixamo')


def test_the_bind_pose_is_the_skeletons(fit):
    """Within 1e-9 m and 1e-9 rad of the file's own bones, fingers and all."""
    scene = Scene('still', (Placement(fit.doll),), gravity=(0, 0, 0))
    with Simulation(scene) as simulation:
        positions, turns = Riders(scene).poses(simulation.state)
    assert len(positions) == 52 > len(fit.doll.bones)
    assert np.abs(positions - fit.character.positions).max() < 1e-9
    assert rotation.angle_between(turns, fit.character.orientations).max() < 1e-9


def test_riders_keep_their_place_on_their_bone(fit):
    """After a fall, each finger is where it was along the hand's axes, and turned as it was."""
    scene = above_ground(fit.doll)
    with Simulation(scene) as simulation:
        before = simulation.state
        for _ in range(60):
            after = simulation.advance()
    assert np.abs(after.positions - before.positions).max() > 0.1
    bones = [scene.bone_index(rider.bone) for rider in fit.doll.riders]
    (was, turned), (now, turns) = (along_bones(Riders(scene), state, bones)
                                   for state in (before, after))
    assert now == pytest.approx(was, abs=1e-12)
    assert turns == pytest.approx(turned, abs=1e-12)


def along_bones(riders, state, bones):
    """Places and rotation matrices of riders along the axes of their bones."""
    places, turns = riders.poses(state)
    back = matrices(state.orientations[bones]).transpose(0, 2, 1)
    return (np.einsum('nij,nj->ni', back, places - state.positions[bones]),
            back @ matrices(turns))


def test_a_skin_follows_by_the_files_own_matrices(fit):
    """P_j M_j v, as riders.py says, gives the skin in the bind pose back: its own formula."""
    rig = RIGS['mixamo']
    points, _, joints, weights = fit_rigs.skin(rig.bones)
    binds = np.linalg.inv(np.stack(fit_rigs.worlds(rig)))
    scene = Scene('still', (Placement(fit.doll),), gravity=(0, 0, 0))
    with Simulation(scene) as simulation:
        positions, turns = Riders(scene).poses(simulation.state)
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotation.matrix(turns), positions
    order = [fit.character.bone_names.index(bone.name) for bone in rig.bones]
    moved = np.einsum('jab,jbc->jac', poses[order], binds)
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    skin = np.einsum('vk,vkab,vb->va', weights, moved[joints], homogeneous)[:, :3]
    assert np.abs(skin - points[:, [2, 0, 1]]).max() < 2e-6


def doll(**changes):
    bones = (Bone('a', Sphere(0.1), 1, (0, 0, 0)), Bone('b', Sphere(0.1), 1, (0, 0, 1)))
    joints = (Joint('a', 'b', 'fixed', (0, 0, 0.5)),)
    riders = (SkeletonFrame('a', 'a', (0, 0, -0.1)),
              SkeletonFrame('tip', 'b', (0, 0.1, 0.2), (0, 0, 1, 1)))
    return dataclasses.replace(Ragdoll('d', bones, joints, riders=riders), **changes)


def test_round_trip(tmp_path):
    save_doll(doll(), tmp_path / 'd.yaml')
    assert load_doll(str(tmp_path / 'd.yaml')) == doll()
    assert 'riders' not in doll_data(doll(riders=()))


def test_names_with_one_doll_and_with_several():
    assert rider_names(Scene('s', (Placement(doll()),))) == ('a', 'tip')
    two = Scene('s', (Placement(doll(), 'one'), Placement(doll(riders=()), 'none'),
                      Placement(doll(), 'two', (5, 0, 0))), gravity=(0, 0, 0))
    assert rider_names(two) == ('one/a', 'one/tip', 'two/a', 'two/tip')
    with Simulation(two) as simulation:
        positions, _ = Riders(two).poses(simulation.state)
    assert np.allclose(positions, [(0, 0, -.1), (0, .1, 1.2), (5, 0, -.1), (5, .1, 1.2)])


def test_no_riders_give_empty_arrays():
    scene = Scene('s', (Placement(doll(riders=())),), gravity=(0, 0, 0))
    with Simulation(scene) as simulation:
        positions, turns = Riders(scene).poses(simulation.state)
    assert positions.shape == (0, 3)
    assert turns.shape == (0, 4)


def test_wrong_riders_are_refused():
    with pytest.raises(errors.UnknownBone, match=r'riders\[0\].bone'):
        doll(riders=(SkeletonFrame('x', 'nobody', (0, 0, 0)),))
    with pytest.raises(errors.DuplicateName, match=r'riders\[1\].name'):
        doll(riders=(SkeletonFrame('x', 'a', (0, 0, 0)), SkeletonFrame('x', 'b', (0, 0, 0))))
    data = doll_data(doll())
    data['riders'][0].update(bone='nobody', mass=3)
    data['riders'][1]['position'] = [0, 0]
    _, found = build_doll(data)
    assert {error.path for error in found} >= {'riders[0].bone', 'riders[0]', 'riders[1].position'}
