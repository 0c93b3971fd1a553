"""Fitted dolls fall for five seconds, get no energy from nothing, and come to rest."""
import math

import fit_rigs
import numpy as np
import pytest
import wild_rigs
from fit_rigs import RIGS, fitted
from wild_rigs import WILD

from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import joint_axes
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation

QUICK = ('mixamo', 'four_legs_unnamed_centimetres', 'snake', 'star', 'one_bone')

GRAVITY = 9.8

SLOW = 0.1
"""m/s: a slow roll."""

HANGING = {'four_legs': ('Neck', 'Head')}
"""Bodies that still swing after five seconds: the trunk lies on its side, neck and head touch
nothing. Both are bent to the limits of their swing, so that they swing as one about the twist axis
of the first one's joint, on its damping alone."""


def energy(doll, state, gravity):
    """Energy above the ground, J: of the bodies as the state has them, by the textbook."""
    total = 0.0
    for k, bone in enumerate(doll.bones):
        spin = rotation.rotate(rotation.inverse(state.orientations[k]), state.angular_velocities[k])
        velocity = state.linear_velocities[k]
        total += bone.mass * (gravity * state.positions[k, 2] + velocity @ velocity / 2)
        total += spin @ (np.array(bone.inertia) * spin) / 2
    return total


def time_to_slow(doll, state, names):
    """Seconds after which the bodies of HANGING move slower than SLOW, from their energy now.

    They are a physical pendulum, J a'' + c a' + k sin a = 0: c is the damping of their joint, J
    their inertia about its twist axis u, and k = m g r sin(u, up), with their centre of mass at r
    from the axis. Its energy is E = J a'^2 / 2 + k (1 - cos a). With d = c / 2J and w^2 = k / J,
    a(t) = A exp(-d t) cos(sqrt(w^2 - d^2) t + p) for small a, so that |a'| <= A w exp(-d t) and
    E(0) >= k A^2 / 2 (1 - d / w). What is farthest from the axis, at R, is thus slower than
    R sqrt(2 E(0) / J / (1 - d / w)) exp(-d t).
    """
    joint = next(joint for joint in doll.joints if joint.child == names[0])
    rows = [k for k, bone in enumerate(doll.bones) if bone.name in names]
    bones = [doll.bones[k] for k in rows]
    first = next(k for k in rows if doll.bones[k].name == names[0])
    pose = doll.bones[first].pose
    axis = rotation.rotate(rotation.multiply(state.orientations[first], rotation.inverse(
        pose.orientation)), joint_axes(joint)[-1])
    anchor = state.positions[first] + rotation.rotate(
        state.orientations[first], pose.apply_inverse(np.reshape(joint.anchor, (1, 3)))[0])
    masses = np.array([bone.mass for bone in bones])
    across = state.positions[rows] - anchor
    across = across - np.outer(across @ axis, axis)
    own = [rotation.rotate(rotation.inverse(state.orientations[k]), axis) for k in rows]
    inertia = masses @ (across ** 2).sum(axis=1) + sum(
        each ** 2 @ np.array(bone.inertia) for each, bone in zip(own, bones, strict=True))
    # m r, from the axis to the centre of mass: at rest it points down as far as it can.
    moment = masses @ across
    stiffness = GRAVITY * np.linalg.norm(moment) * np.linalg.norm(np.cross(axis, (0, 0, 1)))
    rate = np.mean(state.angular_velocities[rows] @ axis)
    total = inertia * rate ** 2 / 2 + GRAVITY * moment[2] + stiffness
    decay = joint.damping / (2 * inertia)
    bound = math.sqrt(2 * total / inertia / (1 - decay / math.sqrt(stiffness / inertia)))
    return math.log(bound * np.linalg.norm(across, axis=1).max() / SLOW) / decay


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


def falls_in_one_piece(doll, hanging=()):
    """Let a doll fall for five seconds, or until what is ``hanging`` is slow; the last state."""
    scene = above_ground(doll)
    with Simulation(scene) as simulation:
        energies = [energy(doll, simulation.state, GRAVITY)]

        def fall_on(seconds):
            for _ in range(math.ceil(round(seconds / scene.step, 6))):
                state = simulation.advance()
                energies.append(energy(doll, state, GRAVITY))
            return state

        state = fall_on(5)
        if hanging:
            # All else has settled.
            others = [k for k, bone in enumerate(doll.bones) if bone.name not in hanging]
            assert np.abs(state.linear_velocities[others]).max() < SLOW
            state = fall_on(time_to_slow(doll, state, hanging))
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


def falls_and_settles(doll, hanging=()):
    state = falls_in_one_piece(doll, hanging)
    # Settled: nothing moves faster than a slow roll.
    assert np.abs(state.linear_velocities).max() < SLOW
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
    falls_and_settles(fitted(name).doll, HANGING.get(name, ()))


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
