"""The compiled dynamics against what knows nothing of them: Jacobians, PyBullet, conservation."""
from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing is compiled')
pytest.importorskip('scipy')

from kernel_dynamics import KernelDynamics
from oracles import PLAIN, bullet_acceleration, unlimited
from samples import (
    GRAVITY,
    PLATE,
    SCENES,
    apart,
    each_tree,
    every_kind,
    random_coordinates,
    scene_of,
)

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.engine.protocol import AppliedWrench
from ragdoll_ros.physics.engine.substepped.bullet import BulletEngine


def random_loads(scene, seed):
    """A push on every other bone, along the world's axes and the bone's in turns."""
    rng = np.random.default_rng(seed)
    return [AppliedWrench(bone, *rng.normal(size=(2, 3)) * ((20,), (2,)), rng.normal(size=3) * .1,
                 local=bone % 4 == 0) for bone in range(0, len(scene.bones), 2)]


def wrenches(scene, loads, state):
    """Forces and torques (n, 3) on the centres of mass, along the world's axes."""
    forces, torques = np.zeros((2, len(scene.bones), 3))
    for load in loads:
        turn = state.rotation_matrices[load.bone]
        force, torque = ((turn @ load.force, turn @ load.torque) if load.local
                         else (load.force, load.torque))
        forces[load.bone] += force
        torques[load.bone] += torque + np.cross(turn @ load.point, force)
    return forces, torques


def truth(scene, coordinates):
    """State as the kinematics of the reference has it."""
    states = [tree.state(q, v) for tree, q, v in each_tree(scene, coordinates)]
    return State(*(np.concatenate([getattr(state, field) for state in states])
                   for field in ('positions', 'orientations', 'linear_velocities',
                                 'angular_velocities')))


@pytest.mark.parametrize('far', [0.0, 1e4])
@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_bones_are_where_jacobians_and_the_engine_see_them(scene, seed, far):
    """Through some five joints: ten roundings of 1e-16 of the place, and of 30 m/s and rad/s."""
    placed = random_coordinates(scene, seed, far=far)
    state = KernelDynamics(scene).state(placed)
    engine = BulletEngine(scene, PLAIN)
    engine.set_coordinates(placed)
    bounds = (max(1e-14, far * 1e-15), 1e-14, 1e-13, 1e-13)
    assert np.less(apart(state, truth(scene, placed)), bounds).all()
    assert np.less(apart(state, engine.state), bounds).all()
    engine.close()


@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_a_short_time_leads_where_velocities_point(scene):
    """10 us on and back: the difference over the time is the velocity, to h^2 w^3 l = 1e-8."""
    here, dynamics, h = random_coordinates(scene, 1), KernelDynamics(scene), 1e-5
    ends = [dynamics.state(dynamics.moved(here, time)) for time in (h, -h)]
    state = dynamics.state(here)
    assert (ends[0].positions - ends[1].positions) / (2 * h) == pytest.approx(
        state.linear_velocities, abs=1e-7)
    turned = rotation.multiply(ends[0].orientations, rotation.inverse(ends[1].orientations))
    assert rotation.rotation_vector(turned) / (2 * h) == pytest.approx(
        state.angular_velocities, abs=1e-7)


@pytest.mark.parametrize('far', [0.0, 1e4])
@pytest.mark.parametrize('loaded', [False, True])
@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_acceleration_is_that_of_jacobians_and_of_the_engine(scene, seed, loaded, far):
    """To rounding, of each doll's largest, times the ratio of its inertias, some 100: 1e-14 each.

    The engine takes the point of a force in the world, where 10 km leave 1e-12 m of an arm.
    """
    placed = random_coordinates(scene, seed, far=far)
    loads = random_loads(scene, seed) if loaded else []
    forces, torques = wrenches(scene, loads, truth(scene, placed))
    found = KernelDynamics(scene).acceleration(placed, loads)
    engine = BulletEngine(unlimited(scene), PLAIN)
    asked = bullet_acceleration(engine, placed, loads)
    engine.close()
    bone = first = 0
    for tree, q, v in each_tree(scene, placed, GRAVITY):
        own, last = slice(bone, bone + len(tree.doll.bones)), first + tree.nv
        right = tree.acceleration(q, v, forces[own], torques[own])
        size = np.abs(right).max()
        assert np.abs(found[first:last] - right).max() < 1e-12 * size
        assert np.abs(asked[first:last] - found[first:last]).max() < 1e-10 * size
        bone, first = own.stop, last


@pytest.mark.parametrize(('doll', 'length'), [(every_kind(), .012), (load_doll('doll'), .04),
                                              (PLATE, .15)])
def test_a_step_is_of_order_eight_and_leads_through_what_it_passes(doll, length):
    """Half as long it errs 2^9 times less at its end, as do all methods of order 8, and 2^8 times
    within. The mean of four motions: in each the next order still has a say of 2^1 or 2^2.

    What is left is above 1e-11, a hundred times what the reference errs by.
    """
    scene = scene_of(doll)
    dynamics, shares, gains = KernelDynamics(scene), np.array([.3, .6, 1]), []
    for seed in range(4):
        start, loads = random_coordinates(scene, seed), random_loads(scene, seed)
        (tree, q, v), = each_tree(scene, start, GRAVITY)
        errors = []
        for h in (length, length / 2):
            right = tree.trajectory(q, v, [0, *shares * h],
                                    lambda _, state, loads=loads: wrenches(scene, loads, state))
            at = dynamics.step(start, h, loads)
            missed = [max(apart(dynamics.state(at(share)), right.at(k + 1)))
                      for k, share in [(2, 1.0), *enumerate(shares[:2])]]
            errors.append((missed[0], max(missed[1:])))
        gains.append(np.log2(np.divide(*errors)))
    end, within = np.mean(gains, axis=0)
    assert end > 8.4
    assert within > 7.4


@pytest.mark.parametrize(('doll', 'time'), [(every_kind(), .1), (load_doll('doll'), .3)])
def test_equal_steps_are_of_order_eight(doll, time):
    """Twice as many err 2^8 times less; four times as many stand for the truth."""
    scene = scene_of(doll)
    dynamics, gains = KernelDynamics(scene), []
    for seed in range(4):
        start, loads = random_coordinates(scene, seed), random_loads(scene, seed)
        ends = [dynamics.state(dynamics.fly(start, time, count, loads)) for count in (8, 16, 32)]
        gains.append(math.log2(max(apart(ends[0], ends[2])) / max(apart(ends[1], ends[2]))))
    assert np.mean(gains) > 7.5


