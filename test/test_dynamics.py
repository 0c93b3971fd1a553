"""The compiled dynamics against what knows nothing of them: Jacobians, PyBullet, conservation."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing is compiled')
pytest.importorskip('scipy')

from conserved import conserved
from samples import (
    GRAVITY,
    PLATE,
    SCENES,
    apart,
    each_tree,
    every_kind,
    layout_of,
    random_coordinates,
    scene_of,
)

from ragdoll_ros.accuracy.motions.motion import without_damping
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.shapes import Box, Capsule
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.dynamics import CompiledDynamics
from ragdoll_ros.physics.engine.bullet import BulletEngine
from ragdoll_ros.physics.engine.protocol import AppliedWrench
from ragdoll_ros.physics.plain.flight import EngineDynamics
from ragdoll_ros.physics.settings import EXACT, NORMAL

AT_ONCE = dataclasses.replace(NORMAL, flight_error=1e9)
"""Any error will do: a path's first step is as long as it may be."""


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


def flown(dynamics, start, tolerance, times, loads=(), longest=.05):
    """States along a path; asked for every 2 ms, as it goes 40 steps at once at the most."""
    accuracy = dataclasses.replace(NORMAL, flight_error=tolerance)
    path = dynamics.path(start, longest, accuracy, 50.0, loads)
    found = []
    for begin, end in zip((0, *times), times, strict=False):
        for time in np.linspace(begin, end, math.ceil((end - begin) / .002) + 1):
            here = path.at(time)
        found.append(here)
    return path, found


@pytest.mark.parametrize('far', [0.0, 1e4])
@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_bones_are_where_jacobians_and_the_engine_see_them(scene, seed, far):
    """Through some five joints: ten roundings of 1e-16 of the place, and of 30 m/s and rad/s."""
    placed = random_coordinates(scene, seed, far=far)
    state = CompiledDynamics(scene).state(placed)
    engine = BulletEngine(scene, free=True)
    engine.place(placed)
    bounds = (max(1e-14, far * 1e-15), 1e-14, 1e-13, 1e-13)
    assert np.less(apart(state, truth(scene, placed)), bounds).all()
    assert np.less(apart(state, engine.read()), bounds).all()
    engine.close()


@pytest.mark.parametrize('make', [CompiledDynamics, layout_of])
@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_a_small_way_leads_where_velocities_point(scene, make):
    """10 us on and back: the difference over the time is the velocity, to h^2 w^3 l = 1e-8."""
    here, dynamics, h = random_coordinates(scene, 1), CompiledDynamics(scene), 1e-5
    ends = [dynamics.state(make(scene).integrate_configuration(here, way))
            for way in (here.v * h, -here.v * h)]
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
    found = CompiledDynamics(scene).acceleration(placed, loads)
    placing = BulletEngine(scene)
    engine = EngineDynamics(scene, BulletEngine, placing.layout)
    placing.close()
    asked = engine.acceleration(placed, loads)
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
    dynamics, shares, gains = CompiledDynamics(scene), np.array([.3, .6, 1]), []
    for seed in range(4):
        start, loads = random_coordinates(scene, seed), random_loads(scene, seed)
        (tree, q, v), = each_tree(scene, start, GRAVITY)
        errors = []
        for h in (length, length / 2):
            right = tree.trajectory(q, v, [0, *shares * h],
                                    lambda _, state, loads=loads: wrenches(scene, loads, state))
            path = dynamics.path(start, h, AT_ONCE, 1e-9, loads)
            missed = [max(apart(dynamics.state(path.at(time)), right.at(k + 1)))
                      for k, time in [(2, h), *enumerate(shares[:2] * h)]]
            assert path.count == 1
            errors.append((missed[0], max(missed[1:])))
        gains.append(np.log2(np.divide(*errors)))
    end, within = np.mean(gains, axis=0)
    assert end > 8.4
    assert within > 7.4


@pytest.mark.parametrize(('doll', 'time'), [(every_kind(), .1), (load_doll('doll'), .3)])
def test_equal_steps_are_of_order_eight(doll, time):
    """Twice as many err 2^8 times less; four times as many stand for the truth."""
    scene = scene_of(doll)
    dynamics, gains = CompiledDynamics(scene), []
    for seed in range(4):
        start, loads = random_coordinates(scene, seed), random_loads(scene, seed)
        ends = [dynamics.state(dynamics.fly(start, time, count, loads)) for count in (8, 16, 32)]
        gains.append(math.log2(max(apart(ends[0], ends[2])) / max(apart(ends[1], ends[2]))))
    assert np.mean(gains) > 7.5


@pytest.mark.parametrize('doll', [every_kind(), load_doll('doll'), PLATE], ids=lambda d: d.name)
def test_a_path_errs_by_its_tolerance(doll):
    """Within a step by some ten times as much, which does not add up; 1e-13 are for rounding."""
    scene = scene_of(doll)
    dynamics, times = CompiledDynamics(scene), (.05, .1)
    start, loads = random_coordinates(scene, 1), random_loads(scene, 1)
    (tree, q, v), = each_tree(scene, start, GRAVITY)
    right = tree.trajectory(q, v, (0, *times), lambda _, state: wrenches(scene, loads, state))
    counts = []
    for tolerance in (1e-7, 1e-9, 1e-11, 1e-13):
        path, found = flown(dynamics, start, tolerance, times, loads)
        for k, here in enumerate(found):
            missed = apart(dynamics.state(here), right.at(k + 1))
            assert max(missed[:2]) < 10 * tolerance + 2e-13
        counts.append(path.count)
    assert counts == sorted(counts)


def test_a_path_is_the_same_however_it_is_looked_at():
    """To the bit: at each tick or at once, back within the last stretch, and once more."""
    scene = scene_of(every_kind(), load_doll('doll'))
    start, dynamics = random_coordinates(scene, 1), CompiledDynamics(scene)
    paths = [dynamics.path(start, .05, NORMAL, 30.0) for _ in range(3)]
    ticks = np.arange(1, 11) * .01
    first = [paths[0].at(time) for time in ticks]
    at_once = [paths[1].at(time) for time in ticks[1::2]]
    for here, there in zip(first[1::2], at_once, strict=True):
        assert (here.q == there.q).all()
        assert (here.v == there.v).all()
    last = 0.0
    for early, time in zip(first, ticks, strict=True):
        before = paths[2].at(last)
        seen = [paths[2].at(time), paths[2].at((time + last) / 2), paths[2].at(last),
                paths[2].at(time)]
        assert (seen[0].q == early.q).all()
        assert (seen[3].v == early.v).all()
        assert np.abs(seen[2].q - before.q).max() < 1e-14  # a step begins where the last one ended
        assert np.abs(seen[2].v - before.v).max() < 1e-13
        last = time
    assert (random_coordinates(scene, 1).q == start.q).all()


def test_a_long_path_leads_where_equal_steps_do():
    scene = scene_of(load_doll('doll'))
    dynamics, start = CompiledDynamics(scene), random_coordinates(scene, 0)
    _, (here,) = flown(dynamics, start, 1e-13, (1.0,))
    there = dynamics.fly(start, 1.0, 400)
    assert max(apart(dynamics.state(here), dynamics.state(there))) < 1e-10


@pytest.mark.parametrize('rate', [1e5, 1e20, 1e100, 1e200])
def test_what_takes_too_many_steps_is_no_path(rate):
    scene = scene_of(every_kind())
    path = CompiledDynamics(scene).path(random_coordinates(scene, 0, rate), .05, EXACT, 3 * rate)
    assert path.at(.01) is None
    assert path.count < 1000


def test_rounding_does_not_end_a_path():
    """A chain of rods of 0.2 m and 1 mm: thin as they are, accelerations are good to 1e-9 only,
    so that no step is short enough to err by 1e-13, and none need be.
    """
    turn = tuple(rotation.from_axis_angle((0, 1, 0), math.pi / 2))
    rods = tuple(Bone(f'rod_{k}', Capsule(.001, .198), 1.0, (.2 * k, 0, 0), turn)
                 for k in range(20))
    joints = tuple(Joint(f'rod_{k}', f'rod_{k + 1}', 'ball', (.2 * k + .1, 0, 0), ((1, 0, 0),))
                   for k in range(19))
    scene = scene_of(Ragdoll('chain', rods, joints))
    start, dynamics = random_coordinates(scene, 0, 1.0), CompiledDynamics(scene)
    end = dynamics.path(start, .05, EXACT, 10.0).at(.01)
    assert end is not None
    right = dynamics.fly(start, .01, 5)
    assert max(apart(dynamics.state(end), dynamics.state(right))[:2]) < 1e-9


@pytest.mark.parametrize('where', [0, 4, 9])
def test_what_is_no_number_is_no_path(where):
    """Whether a place, a turn or an angle, and whether at the start or in the midst of a step."""
    scene = scene_of(every_kind())
    start = random_coordinates(scene, 0)
    start.v[where] = math.nan
    path = CompiledDynamics(scene).path(start, .05, NORMAL, 10.0)
    assert path.at(.01) is None
    assert path.count < 1000


@pytest.mark.parametrize('force, damping', [(1e10, 0), (1e200, 0), (0, 1e3), (0, 1e9)])
def test_a_step_that_breaks_down_is_not_taken(force, damping):
    """Damping ends this motion at 10^6 / s and more, which explicit steps of 50 ms blow up until
    they overflow: too much for a path, but that must be told.
    """
    box = Box((.1, .1, .1))
    pair = Ragdoll('pair', (Bone('a', box, 1.0, (0, 0, 0)), Bone('b', box, 1.0, (.1, 0, 0))),
                   (Joint('a', 'b', 'hinge', (.05, 0, 0), ((0, 0, 1),), damping=damping),))
    scene = scene_of(pair)
    start = random_coordinates(scene, 0, .5)
    load = AppliedWrench(1, np.array([force, 0, 0]), np.zeros(3), np.array([0, .01, 0]))
    path = CompiledDynamics(scene).path(start, .05, NORMAL, .5, [load])
    assert path.at(.01) is None
    assert path.count < 1000


@pytest.mark.parametrize('doll', [every_kind(), load_doll('doll'), PLATE], ids=lambda d: d.name)
def test_a_path_keeps_momentum_and_energy(doll):
    """To the tolerance of 1e-13 a step, which is of some 100 steps rounded at random."""
    scene = scene_of(without_damping(doll))
    dynamics, times = CompiledDynamics(scene), np.linspace(0, .5, 11)
    masses = np.array([bone.mass for bone in scene.bones])
    for seed in range(2):
        start = random_coordinates(scene, seed)
        _, found = flown(dynamics, start, 1e-13, times[1:])
        first, *later = (conserved(scene, dynamics.state(here)) for here in (start, *found))
        size = masses @ np.linalg.norm(dynamics.state(start).linear_velocities, axis=1)
        for time, then in zip(times[1:], later, strict=True):
            due = first.momentum + doll.mass * np.array(GRAVITY) * time
            assert np.abs(then.momentum - due).max() < 1e-12 * size
            assert then.angular_momentum == pytest.approx(
                first.angular_momentum, abs=1e-12 * np.linalg.norm(first.angular_momentum))
            assert abs(then.energy - first.energy) < 1e-12 * first.kinetic


def test_damping_only_takes_energy():
    """And nothing else: momentum is none of its business."""
    scene = scene_of(every_kind(.5))
    dynamics, times = CompiledDynamics(scene), np.linspace(0, .3, 31)
    start = random_coordinates(scene, 3)
    _, found = flown(dynamics, start, 1e-11, times[1:])
    motions = [conserved(scene, dynamics.state(here)) for here in (start, *found)]
    energies = [motion.energy for motion in motions]
    assert np.diff(energies).max() < 0
    assert energies[-1] < energies[0] - .1 * motions[0].kinetic
    assert motions[-1].angular_momentum == pytest.approx(motions[0].angular_momentum, rel=1e-9)
