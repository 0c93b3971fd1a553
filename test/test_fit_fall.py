"""Fitted dolls fall for five seconds, get no energy from nothing, and come to rest."""
import fit_rigs
import numpy as np
import pytest
import wild_rigs
from fit_rigs import RIGS, fitted
from wild_rigs import WILD

from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation

QUICK = ('mixamo', 'four_legs_unnamed_centimetres', 'snake', 'star', 'one_bone')


def energy(doll, state, gravity):
    """Energy above the ground, J: of the bodies as the state has them, by the textbook."""
    total = 0.0
    for k, bone in enumerate(doll.bones):
        spin = rotation.rotate(rotation.inverse(state.orientations[k]), state.angular_velocities[k])
        velocity = state.linear_velocities[k]
        total += bone.mass * (gravity * state.positions[k, 2] + velocity @ velocity / 2)
        total += spin @ (np.array(bone.inertia) * spin) / 2
    return total


def gaps(doll, state):
    """How far the anchor of each joint is from itself as its two bones see it, m."""
    places = []
    for joint in doll.joints:
        for name in (joint.parent, joint.child):
            k = [bone.name for bone in doll.bones].index(name)
            at = doll.bones[k].pose.apply_inverse(np.reshape(joint.anchor, (1, 3)))[0]
            places.append(state.positions[k] + rotation.rotate(state.orientations[k], at))
    places = np.reshape(places, (-1, 2, 3))
    return np.linalg.norm(places[:, 0] - places[:, 1], axis=1)


def falls_in_one_piece(doll):
    """Let a doll fall for five seconds; gives the last state."""
    scene = above_ground(doll)
    with Simulation(scene) as simulation:
        energies = [energy(doll, simulation.state, 9.8)]
        for _ in range(round(5 / scene.step)):
            state = simulation.advance()
            energies.append(energy(doll, state, 9.8))
    energies = np.array(energies)
    # What the fall has to give: the energy at the start above what is left at the end.
    fall = energies[0] - energies[-1]
    assert fall > 0
    # Never more than at the start, to the 0.1 % that the engine itself is held to.
    assert (energies - energies[0]).max() < 0.001 * energies[0]
    # A contact that has sunk in gives back a little of what it took in the ticks before.
    assert (energies - np.minimum.accumulate(energies)).max() < 0.05 * fall
    # Anchors stay in their bodies: both bodies of each have it in one place, to rounding.
    assert gaps(doll, state).max(initial=0) < 1e-9
    return state


def falls_and_settles(doll):
    state = falls_in_one_piece(doll)
    # Settled: nothing moves faster than a slow roll.
    assert np.abs(state.linear_velocities).max() < 0.1
    assert state.positions[:, 2].max() < max(bone.position[2] for bone in doll.bones) + 0.4


def test_a_person_whose_feet_hung_from_nothing_falls_in_one_piece():
    falls_in_one_piece(wild_rigs.fitted('feet_of_nothing-smooth').doll)


@pytest.mark.slow
@pytest.mark.parametrize('name', QUICK)
def test_it_falls_without_energy_from_nothing_and_settles(name):
    falls_and_settles(fitted(name).doll)


@pytest.mark.slow
@pytest.mark.parametrize('name', [name for name in RIGS if name not in QUICK])
def test_all_others_fall_and_settle_too(name):
    falls_and_settles(fitted(name).doll)


@pytest.mark.slow
@pytest.mark.parametrize('name', WILD)
def test_rigs_made_for_animation_fall_in_one_piece(name):
    falls_in_one_piece(wild_rigs.fitted(name).doll)


@pytest.mark.slow
def test_the_mannequin_falls(tmp_path):
    pytest.importorskip('mannequin')
    path = tmp_path / 'mannequin.glb'
    path.write_bytes(fit_rigs.mannequin().glb())
    # It lies on one leg; the other's shin and toe swing free, for longer than this fall.
    falls_in_one_piece(fit_character(read_character(path)).doll)
