"""The compiled core against what knows nothing of it: Jacobians, PyBullet, numpy, conservation."""
from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import math
import os
import subprocess
import sys
from pathlib import Path as File

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing is compiled')
pytest.importorskip('scipy')

from ragdoll_ros.accuracy.motions.motion import without_damping, without_limits
from ragdoll_ros.accuracy.references.articulated import Articulated
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Sphere
from ragdoll_ros.model.state import State
from ragdoll_ros.physics import backend
from ragdoll_ros.physics.conservation import CompiledProjection
from ragdoll_ros.physics.dynamics import CompiledDynamics
from ragdoll_ros.physics.engine.bullet import BulletEngine
from ragdoll_ros.physics.engine.protocol import GROUND, AppliedWrench
from ragdoll_ros.physics.kernels import SWITCH, kernels
from ragdoll_ros.physics.limits import CompiledLimits
from ragdoll_ros.physics.mechanics import CompiledMechanics
from ragdoll_ros.physics.plain.conservation import ConservationProjection
from ragdoll_ros.physics.plain.flight import EngineDynamics
from ragdoll_ros.physics.plain.limits import JointLimits
from ragdoll_ros.physics.plain.mechanics import Mechanics
from ragdoll_ros.physics.plain.reach import MARGIN, Reach
from ragdoll_ros.physics.reach import CompiledReach
from ragdoll_ros.physics.settings import EXACT, NORMAL, resolve_accuracy
from ragdoll_ros.physics.simulation import Simulation

GRAVITY = (0.3, -0.2, -9.8)
TURN = tuple(rotation.normalized((.1, .5, -.3, .8)))
AT_ONCE = dataclasses.replace(NORMAL, flight_error=1e9)
"""Any error will do: a path's first step is as long as it may be."""


def every_kind(damping=.2):
    """All kinds of joints and shapes, two branches, nothing aligned, nothing in a tree's order."""
    bones = (Bone('double', Cylinder(.05, .3), 1.5, (.6, 0, 1.1), (0, .6, 0, .8)),
             Bone('hinged', Capsule(.05, .2), 1.0, (.3, .1, 1.1), TURN),
             Bone('root', Box((.1, .2, .4)), 4.0, (0, .1, 1), TURN),
             Bone('tip', Box((.1, .1, .2)), .7, (.7, .1, 1.4), TURN),
             Bone('free_ball', Box((.1, .3, .05)), 2.0, (-.3, .2, .9), (.6, 0, 0, .8)),
             Bone('ball', Sphere(.07), .8, (-.3, .5, .9), TURN),
             Bone('glued', Capsule(.05, .1), .5, (-.3, .7, .9)),
             Bone('on_glued', Cylinder(.05, .1), .6, (-.3, .9, .8), TURN))
    joints = (Joint('glued', 'on_glued', 'ball', (-.3, .8, .9), ((1, 0, 2),), damping=damping / 4),
              Joint('double', 'tip', 'ball', (.6, .1, 1.3), ((0, 1, 1),), ((-1.4, 1.4), None)),
              Joint('hinged', 'double', 'universal', (.45, 0, 1.1), ((0, 0, 1), (1, -1, 0)),
                    damping=damping / 2),
              Joint('root', 'hinged', 'hinge', (.15, .1, 1.0), ((1, 1, 0),), damping=damping),
              Joint('root', 'free_ball', 'ball', (-.15, .1, 1), ((0, 1, 1),), damping=damping),
              Joint('free_ball', 'ball', 'ball', (-.3, .4, .9), ((0, 1, 0),),
                    ((-1.4, 1.4), (-1, 1)), damping=damping / 3),
              Joint('ball', 'glued', 'fixed', (-.3, .6, .9)))
    return Ragdoll('every_kind', bones, joints)


def scene_of(*dolls, **settings):
    """Dolls, turned, far enough from each other not to touch."""
    turns = np.random.default_rng(len(dolls)).normal(size=(len(dolls), 4))
    return Scene('flying', tuple(
        Placement(doll, f'doll_{k}', (10.0 * k, -3.0 * k, k), tuple(turns[k]))
        for k, doll in enumerate(dolls)), **{'gravity': GRAVITY, 'self_collision': False,
                                             **settings})


PLATE = Ragdoll('plate', (Bone('plate', Box((.5, .3, .1)), 10.0, (.1, .2, .3), TURN),))
SCENES = [pytest.param(scene_of(*dolls), id='+'.join(doll.name for doll in dolls)) for dolls in (
    (every_kind(),), (load_doll('doll'),), (PLATE,), (every_kind(), PLATE, load_doll('doll')))]


def each_tree(scene, coordinates, gravity=(0, 0, 0)):
    """Give the equations of motion of each doll with its part of q and of v."""
    q = v = 0
    for placement in scene.dolls:
        tree = Articulated(placement.doll, gravity)
        yield tree, coordinates.q[q:q + tree.nq], coordinates.v[v:v + tree.nv]
        q, v = q + tree.nq, v + tree.nv


def random_coordinates(scene, seed, speed=3.0, far=0.0):
    """Any pose that leaves limited balls their three angles, ``far`` m from the origin."""
    rng, q, v = np.random.default_rng(seed), [], []
    for placement in scene.dolls:
        tree = Articulated(placement.doll)
        own = tree.bind(placement.position, placement.orientation)
        own[:3] += far * rotation.normalized(rng.normal(size=3))
        own[3:7] = rng.normal(size=4)
        own[7:] += rng.uniform(-1, 1, size=own.size - 7)
        q.append(own)
        v.append(rng.normal(size=tree.nv) * speed)
        turns, at = [3], 7
        for joint in placement.doll.joints_depth_first():
            free = joint.kind == 'ball' and not any(joint.limits)
            turns += [at] if free else []
            at += 4 if free else joint.dof
        for at in turns:
            own[at:at + 4] = rotation.normalized(own[at:at + 4])
    return GeneralizedState(np.concatenate(q), np.concatenate(v))


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


def apart(state, other):
    """How far states are from each other: m, rad, m/s, rad/s."""
    return (np.abs(state.positions - other.positions).max(),
            2 * np.abs(rotation.multiply(state.orientations, rotation.inverse(
                other.orientations))[:, :3]).max(),
            np.abs(state.linear_velocities
                   - other.linear_velocities).max(), np.abs(state.angular_velocities
                                                            - other.angular_velocities).max())


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
@pytest.mark.parametrize('scene', SCENES)
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


@pytest.mark.parametrize('far', [0.0, 1e4])
@pytest.mark.parametrize('loaded', [False, True])
@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('scene', SCENES)
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
    end = path.at(.01)
    assert path.count < 1000
    assert end is None or np.isfinite(np.concatenate([end.q, end.v])).all()


@pytest.mark.parametrize('doll', [every_kind(), load_doll('doll'), PLATE], ids=lambda d: d.name)
def test_a_path_keeps_momentum_and_energy(doll):
    """To the tolerance of 1e-13 a step, which is of some 100 steps rounded at random."""
    scene = scene_of(without_damping(doll))
    dynamics, mechanics, times = CompiledDynamics(scene), Mechanics(scene), np.linspace(0, .5, 11)
    for seed in range(2):
        start = random_coordinates(scene, seed)
        _, found = flown(dynamics, start, 1e-13, times[1:])
        motions = [mechanics.motion(dynamics.state(here)) for here in (start, *found)]
        first = motions[0]
        speeds = np.linalg.norm(dynamics.state(start).linear_velocities, axis=1)
        for time, motion in zip(times, motions, strict=True):
            due = first.momentum[0] + doll.mass * np.array(GRAVITY) * time
            assert np.abs(motion.momentum[0] - due).max() < 1e-12 * (mechanics.masses @ speeds)
            assert np.abs(motion.angular_momentum[0]
                          - first.angular_momentum[0]).max() < 1e-12 * np.linalg.norm(
                first.angular_momentum[0])
            assert abs(motion.energy[0] - first.energy[0]) < 1e-12 * first.kinetic[0]


def test_damping_only_takes_energy():
    """And nothing else: momentum is none of its business."""
    scene = scene_of(every_kind(.5))
    dynamics, mechanics, times = CompiledDynamics(scene), Mechanics(scene), np.linspace(0, .3, 31)
    start = random_coordinates(scene, 3)
    _, found = flown(dynamics, start, 1e-11, times[1:])
    motions = [mechanics.motion(dynamics.state(here)) for here in (start, *found)]
    energies = [motion.energy[0] for motion in motions]
    assert np.diff(energies).max() < 0
    assert energies[-1] < energies[0] - .1 * motions[0].kinetic[0]
    assert motions[-1].angular_momentum[0] == pytest.approx(motions[0].angular_momentum[0],
                                                            rel=1e-9)


def random_state(scene, seed, height=0.0):
    """Bones anywhere, in no relation to each other, as sums over them need none."""
    rng, count = np.random.default_rng(seed), len(scene.bones)
    return State(rng.normal(size=(count, 3)) + np.array((0, 0, height)),
                 rotation.normalized(rng.normal(size=(count, 4))),
                 rng.normal(size=(count, 3)) * 5, rng.normal(size=(count, 3)) * 10)


def layout_of(scene):
    engine = BulletEngine(scene, free=True)
    engine.close()
    return engine.layout


def same(motion, other):
    """Whether all sums are equal to rounding: 1e-14 of terms of up to 1e4."""
    return np.abs(motion.sums - other.sums).max() < 1e-12 * np.abs(other.sums).max()


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('scene', SCENES)
def test_sums_are_those_of_numpy(scene, seed):
    state = random_state(scene, seed)
    found, plain = CompiledMechanics(scene).motion(state), Mechanics(scene).motion(state)
    assert same(found, plain)


MANY = scene_of(every_kind(), load_doll('doll'), every_kind())


@pytest.mark.parametrize('touched', [None, (), (0,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize('moment', ['none', 'zero', 'given'])
@pytest.mark.parametrize('scene', [MANY, SCENES[-1].values[0]], ids=['dolls', 'with_a_plate'])
def test_momentum_is_kept_as_by_numpy(scene, moment, touched):
    """A plate is turned, by 0.01 rad at the most: so its states are next to each other."""
    mechanics, layout, rng = Mechanics(scene), layout_of(scene), np.random.default_rng(4)
    was, little = random_state(scene, 1), 1e-3 * rng.normal(size=(4, len(scene.bones), 1))
    now = State(was.positions + little[0], rotation.normalized(was.orientations + little[1]),
                was.linear_velocities + little[2], was.angular_velocities + little[3])
    given = rng.normal(size=(2, len(scene.dolls), 3))
    chosen = None if touched is None else np.isin(np.arange(len(scene.dolls)), touched)
    arguments = (.01, *{'none': (given[0], None), 'zero': (), 'given': given}[moment], )
    (found, found_motion, found_turn), (plain, plain_motion, plain_turn) = (
        conservation(scene, sums, layout).keep_momentum(
            now, sums.motion(was), sums.motion(now), *arguments, touched=chosen)
        for conservation, sums in ((CompiledProjection, CompiledMechanics(scene)),
                                   (ConservationProjection, mechanics)))
    assert max(apart(found, plain)) < 1e-12
    assert same(found_motion, plain_motion)
    # A turn by nothing is none; the plain one may tell of it.
    nothing = np.tile(rotation.IDENTITY, (len(scene.dolls), 1))
    turns = [nothing if turn is None else turn for turn in (found_turn, plain_turn)]
    assert np.abs(turns[0] - turns[1]).max() < 1e-14
    # And what is told of the motion is that of the bones, where numpy's tells no less.
    told, right = mechanics.motion(found), plain_motion
    assert np.abs(told.momentum - right.momentum).max() < 1e-12 * np.abs(right.momentum).max()
    assert np.abs(told.angular_momentum
                  - right.angular_momentum).max() < 1e-12 * np.abs(right.angular_momentum).max()


GROUNDS = {'none': None, 'level': Ground(), 'slope': Ground((.3, -.5, .8), -.7)}


@pytest.mark.parametrize('ground', GROUNDS)
@pytest.mark.parametrize('height', [.2, 1.5, 20.0])
def test_what_bones_can_reach_is_what_numpy_finds(ground, height):
    """To rounding; ``clearance`` of the plain one may tell less where nothing is near."""
    scene = dataclasses.replace(MANY, ground=GROUNDS[ground])
    found, plain = CompiledReach(scene), Reach(scene)
    falls = []
    for seed in range(5):
        state = random_state(scene, seed, height)
        assert found.heights(state) == pytest.approx(plain.heights(state), abs=1e-13)
        assert found.clearance(state) == pytest.approx(plain.heights(state).min(), abs=1e-13)
        assert plain.clearance(state) <= found.clearance(state) + 1e-13
        for soon in (.001, .015, .1):
            falls.append(plain.falling(state, soon))
            assert found.falling(state, soon) == pytest.approx(falls[-1], rel=1e-13)
        assert found.closing(state) == pytest.approx(plain.closing(state), rel=1e-14)
        assert found.max_angular_speed(state) == pytest.approx(plain.max_angular_speed(state),
                                                               rel=1e-14)
        assert found.ccd_steps(state, .01) == plain.ccd_steps(state, .01)
        again = random_state(scene, seed + 100, height)
        found.heights(again)
        assert found.clearance(state) == pytest.approx(plain.heights(state).min(), abs=1e-13)
    if ground == 'level':
        assert (max(falls) > 0) is (height < 20)


@pytest.mark.parametrize('ground', GROUNDS)
def test_dolls_that_reach_the_ground_are_near_it(ground):
    """Each bone's lowest point, at the speed of the doll's fastest, and what it may gain.

    Twice that speed is what is looked at; what is not told is farther than that.
    """
    scene = dataclasses.replace(MANY, ground=GROUNDS[ground])
    reach, mechanics = CompiledReach(scene), Mechanics(scene)
    radii = np.array([math.hypot(*bone.shape.half_extents) for bone in scene.bones])
    found = set()
    for seed in range(20):
        state = random_state(scene, seed, .4 * seed)
        near = {doll for doll,
                other in reach.broadphase_pairs(state, .02, 9.8, set()) if other == GROUND}
        speeds = (np.linalg.norm(state.linear_velocities, axis=1)
                  + radii * np.linalg.norm(state.angular_velocities, axis=1))
        for doll in range(3):
            own = mechanics.doll_of == doll
            low, fast = Reach(scene).heights(state)[own].min(), speeds[own].max()
            way = 2 * .02 * (fast + .02 * 9.8) + MARGIN
            assert (doll in near) is bool(low < way)
        found |= {len(near)}
    assert found == {0} if ground == 'none' else len(found) > 1


def test_dolls_are_as_near_to_each_other_as_numpy_finds():
    scene = dataclasses.replace(MANY, ground=None)
    for seed in range(5):
        state = random_state(scene, seed)
        moved = np.repeat([0, 1.5 * seed, 3.0 * seed], np.bincount(Mechanics(scene).doll_of))
        state = dataclasses.replace(state, positions=state.positions + moved[:, None])
        near = [reach(scene).broadphase_pairs(state, .01, 9.8, set()) for reach in (CompiledReach,
                                                                                    Reach)]
        assert near[0] == near[1]


@pytest.mark.parametrize('duration', [0.0, .01])
@pytest.mark.parametrize('scene', [SCENES[1].values[0], SCENES[2].values[0], MANY],
                         ids=['doll', 'no_limits', 'dolls'])
def test_joint_limits_are_told_of_as_by_numpy(scene, duration):
    """To the bit: there is one difference, and one product. Over 200 moments, as what was held
    once counts for what comes; one limit in twenty is within 3 mrad.
    """
    layout = layout_of(scene)
    found, plain = CompiledLimits(layout), JointLimits(layout)
    lower, upper = layout.limits
    ends = np.where(np.isfinite(upper), upper, lower)
    rng, pressed = np.random.default_rng(2), []
    for moment in range(200):
        here = random_coordinates(scene, moment, .3)
        here.q[layout.limited[0]] = ends + np.where(
            rng.random(len(ends)) < .05, rng.uniform(-3e-3, 3e-3, len(ends)),
            -.2 * np.sign(ends))
        pressed.append(plain.is_active(here, duration))
        assert found.is_active(here, duration) == pressed[-1]
        assert found.max_violation(here) == plain.max_violation(here)
        assert found.fastest(here) == plain.fastest(here)
        assert found.approach(here, .015) == pytest.approx(plain.approach(here, .015), rel=1e-15)
        if moment % 7 == 0:
            found.hold(here)
            plain.hold(here)
    assert len(set(pressed)) == (2 if len(ends) else 1)


def tick_by_tick(name, ticks):
    """What the whole does: states, energies over the account, and measures, as plain numbers.

    'flight': all kinds of joints, no limit near, nothing to touch. 'fall': onto the ground.
    """
    fall = name == 'fall'
    doll = load_doll('doll') if fall else every_kind()
    settings = {'ground': Ground(), 'self_collision': True} if fall else {}
    placement = Placement(doll, position=(0, 0, .3))
    if fall:
        placement = dataclasses.replace(placement, orientation=TURN, spin=(1, 2, 3))
    scene = Scene(name, (placement,), **{'self_collision': False, **settings})
    mechanics, rows, excess, told = Mechanics(scene), [], [], []
    with Simulation(scene, accuracy='normal' if fall else 'exact') as simulation:
        start = simulation.coordinates
        if not fall:
            v = np.random.default_rng(7).uniform(-2, 2, start.v.size)
            start = GeneralizedState(start.q, v)
            simulation.place(start)
        lowest = mechanics.energy(simulation.state)[0]
        for _ in range(ticks):
            state = simulation.advance()
            motion = mechanics.motion(state)
            excess.append((motion.energy[0] - lowest) / motion.kinetic[0])
            lowest = min(lowest, motion.energy[0])
            rows.append(np.concatenate([state.positions, state.orientations], axis=1).tolist())
            told.append(simulation.measures())
    told = {'ready': backend.ready(), 'rows': rows, 'excess': excess, 'measures': told}
    return told, scene, start


@pytest.fixture(scope='module')
def plainly():
    """The same, without anything compiled, in a process of its own."""
    root = File(__file__).resolve().parent.parent
    code = ('import json, test_compiled as test\n'
            'runs = [test.tick_by_tick(*run)[0] for run in (("flight", 28), ("fall", 100))]\n'
            'print(json.dumps(runs))')
    path = os.pathsep.join([str(root), str(root / 'test'), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True,
                          env={**os.environ, SWITCH: '0', 'PYTHONPATH': path})
    flight, fall = json.loads(done.stdout.splitlines()[-1])
    assert not flight['ready']
    return {'flight': flight, 'fall': fall}


def test_a_flight_is_the_same_compiled_or_not(plainly, monkeypatch):
    """Compiled it is the reference's, measured: to 2e-15 m; an angle is told to 1e-8.

    The plain one errs as it says in each tick, and what it errs grows with the motion; a bone of
    5 cm that twists against its damping errs by 3e-5 rad about its middle.
    """
    monkeypatch.setattr(backend, 'ready', lambda: True)
    (found, scene, start), plain = tick_by_tick('flight', 28), plainly['flight']
    assert all(told['error_trusted'] for told in found['measures'] + plain['measures'])
    assert max(told['error_estimate_m'] for told in found['measures']) < 1e-12
    (tree, q, v), = each_tree(scene, start, scene.gravity)
    right = tree.trajectory(q, v, np.arange(29) * .01)
    here, there = np.array(found['rows']), np.array(plain['rows'])
    assert np.abs(here[..., :3] - right.positions[1:]).max() < 1e-11
    assert rotation.angle_between(here[..., 3:], right.orientations[1:]).max() < 1e-7
    errors = np.cumsum([told['error_estimate_m'] for told in plain['measures']])
    missed = np.linalg.norm(here[..., :3] - there[..., :3], axis=2).max(axis=1)
    assert (missed < 5 * errors).all()
    assert rotation.angle_between(here[..., 3:], there[..., 3:]).max() < 1e-4


FREE = scene_of(without_limits(load_doll('doll')))
START = random_coordinates(FREE, 1)


@functools.cache
def true_end():
    """Where it is after 0.4 s, m."""
    (tree, q, v), = each_tree(FREE, START, GRAVITY)
    return tree.trajectory(q, v, (0, .4)).positions[-1]


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_long_tick_is_flown_as_well_as_a_short_one(accuracy, monkeypatch):
    """All of it: by the engine's own steps it would err by centimetres.

    The tolerance is each step's; 100 times that is what many, and chaos, may make of it in 0.4 s.
    """
    monkeypatch.setattr(backend, 'ready', lambda: True)
    tolerance = max(resolve_accuracy(accuracy).flight_error, 1e-14)
    for tick in (.01, .1, .2):
        with Simulation(FREE, step=tick, accuracy=accuracy) as simulation:
            simulation.place(START)
            for _ in range(round(.4 / tick)):
                state = simulation.advance()
                assert simulation.stats.substeps == 0
        assert np.abs(state.positions - true_end()).max() < 100 * tolerance


@pytest.mark.parametrize('ready', [True, False], ids=['compiled', 'plain'])
def test_a_fall_is_plausible_compiled_or_not(ready, plainly, monkeypatch):
    """Bounds are those of the whole: 0.1 % of the energy, 1 cm, 5 degrees."""
    monkeypatch.setattr(backend, 'ready', lambda: True)
    found = tick_by_tick('fall', 100)[0] if ready else plainly['fall']
    assert np.isfinite(found['rows']).all()
    assert max(found['excess']) < 1e-3
    for told in found['measures']:
        assert all(math.isfinite(value) for value in told.values())
        assert told['joint_gap_m'] < 1e-9
        assert told['sinking_m'] < .01
        assert math.degrees(told['limit_overshoot_rad']) < 5
        assert told['stopped_total'] == 0
    assert sum(told['flights'] for told in found['measures']) > 3
    assert sum(told['substeps'] for told in found['measures']) > 100
    assert np.array(found['rows'])[-1, :, 2].max() < .5  # it is down


def test_the_kernels_name_the_numbers_that_are_frozen_into_them():
    """Else numba would go on with the old ones after a change, see kernels.py."""
    source = File(kernels.__file__).with_name('dop853.py').read_bytes()
    assert hashlib.sha256(source).hexdigest()[:16] == kernels.NUMBERS
