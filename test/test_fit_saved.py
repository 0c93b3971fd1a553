"""A fitted doll is written, read back equal, and stands in the engine as it was fitted."""
import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS, fitted

from ragdoll_ros.files.doll import load_doll, save_doll
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.report import fit_report
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation


@pytest.mark.parametrize('name', RIGS)
def test_load_of_save_is_equal(tmp_path, name):
    fit = fitted(name)
    path = tmp_path / 'doll.yaml'
    save_doll(fit.doll, path, fit_report(fit))
    assert load_doll(str(path)) == fit.doll


@pytest.mark.parametrize('name', ['mixamo', 'bird', 'unnamed'])
def test_the_same_file_gives_the_same_yaml(tmp_path, name):
    again = fit_character(read_character(fit_rigs.write(RIGS[name], tmp_path)))
    texts = []
    for fit in (fitted(name), again):
        save_doll(fit.doll, tmp_path / 'doll.yaml', fit_report(fit))
        texts.append((tmp_path / 'doll.yaml').read_bytes())
    assert texts[0] == texts[1]


@pytest.mark.parametrize('name', RIGS)
def test_joint_error_in_the_bind_pose(name):
    """Both ends of each joint meet, as the engine has placed the bodies, and all angles are 0."""
    doll = fitted(name).doll
    scene = above_ground(doll)
    with Simulation(scene) as simulation:
        state = simulation.state
        for joint in doll.joints:
            ends = []
            for name_ in (joint.parent, joint.child):
                bone, k = doll.bone(name_), scene.bone_index(name_)
                back = rotation.inverse(np.array(bone.orientation))
                local = rotation.rotate(back, np.subtract(joint.anchor, bone.position))
                ends.append(state.positions[k] + rotation.rotate(state.orientations[k], local))
            assert np.abs(ends[0] - ends[1]).max() < 1e-9
        if doll.joints:
            assert np.abs(simulation.joint_angles).max(initial=0.0) < 1e-9
        turns = np.array([bone.orientation for bone in doll.bones])
        assert rotation.angle_between(state.orientations, turns).max() < 1e-9
