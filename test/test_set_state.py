"""Simulation.set_state: pose and velocities of a doll's root are set while time goes on."""
from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from ragdoll_ros import Simulation, load_doll, load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene, above_ground
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.logged_simulation import LoggedSimulation, apply_event, state_digest

RADIUS, GRAVITY = 0.1, 9.8
BALL = Ragdoll('ball', (Bone('ball', Sphere(RADIUS), 1.0, (0, 0, 0)),))


def with_ball(*dolls):
    """A scene of a ball 20 m to the side, and dolls."""
    return Scene('balls', (Placement(BALL, position=(0, 20, RADIUS)), *dolls), Ground())


def falling(count):
    """Default dolls, 3 m apart, that fall."""
    return [Placement(load_doll('doll'), name=f'doll{k}', position=(3.0 * k, 0, 0.5),
                      spin=(0, 0.3, 0)) for k in range(count)]


@pytest.mark.parametrize(('engine', 'tolerance'), [
    ('rigid', 1e-12),  # rounding
    # semi-implicit Euler: g t h / 2, with substeps h of 2.5 ms
    ('bullet', GRAVITY * 0.5 * 0.0025 / 2), ('mujoco', GRAVITY * 0.5 * 0.0025 / 2)])
def test_a_ball_flies_along_its_parabola(engine, tolerance):
    """From where it was put, while another doll falls."""
    if engine == 'mujoco':
        pytest.importorskip('mujoco')
    with Simulation(with_ball(*falling(1)), engine=engine) as simulation:
        for _ in range(20):
            simulation.advance()
        place, velocity = np.array([1.0, 18, 3]), np.array([2.0, -1, 4])
        before = simulation.energy_excess
        simulation.set_state('ball', place, velocity=velocity, spin=(0, 0, 3))
        assert simulation.time == 200_000_000
        assert abs(simulation.energy_excess - before) < 1e-9
        for _ in range(50):
            state = simulation.advance()
        time = 0.5
        expected = place + velocity * time - [0, 0, GRAVITY * time ** 2 / 2]
        assert np.abs(state.positions[0] - expected).max() < 1.01 * tolerance
        assert state.angular_velocities[0] == pytest.approx([0, 0, 3], abs=1e-9)


def test_axes_and_order_of_quaternions():
    """x, y, z, w; a quarter turn about z brings the root's x axis to y; joints stay."""
    with Simulation(load_scene('flight')) as simulation:
        for _ in range(30):
            simulation.advance()
        angles, rates = simulation.joint_angles, simulation.joint_rates
        s = math.sqrt(0.5)
        state = simulation.set_state(simulation.scene.dolls[0].name, (1, 2, 3),
                                     (0, 0, 2 * s, 2 * s), (4, 5, 6), (0.1, 0.2, 0.3))
        root = simulation.scene.bone_index(simulation.scene.dolls[0].doll.root.name)
        assert state.rotation_matrices[root][:, 0] == pytest.approx([0, 1, 0], abs=1e-12)
        assert state.rows[root] == pytest.approx([1, 2, 3, 0, 0, s, s, 4, 5, 6, 0.1, 0.2, 0.3])
        assert np.abs(simulation.joint_angles - angles).max() == 0
        assert simulation.joint_rates == pytest.approx(rates, abs=1e-12)


@pytest.mark.parametrize('count', [1, 2, 3, 5, 6, 8, 12, 40])
def test_others_keep_their_bits(count):
    """Those that the doll does not come near, in flight and on the ground, at 1 to 40 dolls."""
    dolls = falling(count)
    with Simulation(with_ball(*dolls)) as one, Simulation(with_ball(*dolls)) as other:
        for k in range(80):
            if k % 25 == 20:
                one.set_state('ball', (k / 10, 15, 1), velocity=(0, -k / 30, 0))
            assert (one.advance().rows[1:] == other.advance().rows[1:]).all()
        assert not (one.state.rows[0] == other.state.rows[0]).all()


def test_a_ball_wakes_what_it_hits():
    """It sleeps itself, flies, hits a sleeping doll, and nothing gains energy."""
    with Simulation(with_ball(falling(1)[0])) as simulation:
        while not simulation.asleep:
            simulation.advance()
        torso = simulation.state.positions[1 + simulation.scene.dolls[1].doll.bones.index(
            simulation.scene.dolls[1].doll.root)]
        before, time = simulation.energy_excess, 1 / 6
        # From where no limb lies that it would only press to the ground.
        velocity = np.array([0, -12, -0.5 / time + GRAVITY * time / 2])
        simulation.set_state('ball', torso + np.array((0, 2, 0.5)), velocity=velocity)
        assert not simulation.asleep
        # Of 1 kg.
        assert simulation.work[0] == pytest.approx(
            velocity @ velocity / 2 + GRAVITY * (torso[2] + 0.5 - RADIUS), rel=1e-6)
        resting = simulation.state.positions[1:]
        for _ in range(60):
            simulation.advance()
        # What sleeps does not move at all; the ground's friction has no limit, so it is not much.
        assert np.abs(simulation.state.positions[1:] - resting).max() > 1e-4
        assert simulation.energy_excess < before + 1e-6 * simulation.work[0]


def test_a_doll_of_a_heap_is_taken_out():
    """Of two that lie on each other; the other goes on, awake."""
    dolls = [dataclasses.replace(doll, position=(0, 0, 0.5 + k)) for k, doll in
             enumerate(falling(2))]
    with Simulation(with_ball(*dolls)) as simulation:
        for _ in range(150):
            simulation.advance()
        state = simulation.set_state('doll1', (0, 9, 2), velocity=(0, 0, 0), spin=(0, 0, 0))
        own = simulation.scene.bone_slices[2]
        root = own.start + simulation.scene.dolls[2].doll.bones.index(
            simulation.scene.dolls[2].doll.root)
        assert state.positions[root] == pytest.approx([0, 9, 2])
        for _ in range(100):
            simulation.advance()
        assert abs(simulation.state.positions[own, 1] - 9).max() < 2
        assert simulation.measures()['joint_gap_m'] < 1e-6
        assert simulation.energy_excess < 1e-6


@pytest.mark.parametrize('engine', ['rigid', 'bullet'])
def test_a_doll_is_lifted_out_of_the_ground(engine):
    """And no other one is moved."""
    with Simulation(with_ball(falling(1)[0]), engine=engine) as simulation:
        other = simulation.state.positions[1:]
        state = simulation.set_state('ball', (0, 20, -3))
        assert state.positions[0, 2] == pytest.approx(RADIUS, abs=0.2 * RADIUS)
        assert np.abs(state.positions[1:] - other).max() < 1e-12


def test_a_reset_restores_the_start():
    with Simulation(above_ground(load_doll('doll'))) as simulation:
        start = state_digest(simulation.state)
        simulation.set_state('doll', (5, 5, 5))
        simulation.advance()
        assert state_digest(simulation.reset()) == start


def test_events_repeat_it_to_the_bit():
    scene, log = with_ball(*falling(2)), []
    with LoggedSimulation(scene) as simulation, Simulation(scene) as twin:
        simulation.on_event = lambda name, arguments: log.append((tick, name, arguments))
        for tick in range(100):
            if tick == 30:
                simulation.set_state('ball', (0, 5, 1), velocity=(0, -12, 1))
            if tick == 50:
                simulation.set_state('doll1', orientation=(1, 0, 0, 1))
            if tick == 60:
                simulation.set_state('doll1', joint_angles={'left_shin': 1 / 3},
                                     joint_rates={'left_shin': -1 / 7})
            if tick == 80:
                simulation.reset(keep_time=True)
            simulation.advance()
        assert [entry[1] for entry in log] == ['set_state'] * 3 + ['reset']
        log = [(at, name, json.loads(json.dumps(arguments))) for at, name, arguments in log]
        for tick in range(100):
            for at, name, arguments in log:
                if at == tick:
                    apply_event(twin, name, arguments)
            twin.advance()
        assert state_digest(twin.state) == state_digest(simulation.state)
        assert twin.time == simulation.time == 100 * simulation.tick


@pytest.mark.parametrize(('given', 'error', 'text'), [
    ({'doll': 'bal'}, errors.UnknownDoll, "'bal'; expected one of ball, doll0"),
    ({'position': (0, math.nan, 0)}, errors.NotFinite, 'position'),
    ({'velocity': (0, 1)}, errors.WrongForm, 'velocity'),
    ({'spin': 'fast'}, errors.WrongForm, 'spin'),
    ({'orientation': (0, 0, 0, 0)}, errors.NotUnit, 'orientation')])
def test_what_is_wrong_is_named_and_changes_nothing(given, error, text):
    with Simulation(with_ball(*falling(1))) as simulation:
        before = state_digest(simulation.state)
        with pytest.raises(error, match=text):
            simulation.set_state(**{'doll': 'ball', 'position': (1, 1, 1), **given})
        assert state_digest(simulation.state) == before


def some_angles(doll, share):
    """Each angle of a doll at a share of its range, or at 0.4 rad where it has none."""
    return {name: pair[0] + share * (pair[1] - pair[0]) if pair else 0.4
            for joint in doll.joints
            for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True)}


@pytest.mark.parametrize(('engine', 'tolerance'), [
    ('rigid', 1e-9), ('bullet', 1e-6), ('mujoco', 1e-9)])
def test_joint_angles_and_rates_are_set_about_the_root(engine, tolerance):
    """Bones are where a placement with these angles has them; the root and others stay."""
    if engine == 'mujoco':
        pytest.importorskip('mujoco')
    doll = load_doll('doll')
    with Simulation(with_ball(*falling(2)), engine=engine) as simulation:
        simulation.run(20)
        before, excess = simulation.state.rows, simulation.energy_excess
        angles = some_angles(doll, 0.6)
        rates = {name: 0.1 * count for count, name in enumerate(angles)}
        rows = simulation.set_state('doll1', joint_angles=angles, joint_rates=rates).rows
        names = [f'doll1/{name}' for name in angles]
        own = [simulation.scene.angle_names.index(name) for name in names]
        assert simulation.joint_angles[own] == pytest.approx(list(angles.values()), abs=tolerance)
        assert simulation.joint_rates[own] == pytest.approx(
            list(rates.values()), abs=100 * tolerance)
        first = simulation.scene.bone_slices[2].start
        root = first + doll.bones.index(doll.root)
        assert rows[root] == pytest.approx(before[root], abs=tolerance)
        placed = Placement(doll, angles=angles)
        here = simulation.state.poses(root)
        for index, bone in enumerate(doll.bones):
            expected = placed.bone_pose(doll.root).relative(placed.bone_pose(bone))
            found = here.relative(simulation.state.poses(first + index))
            assert found.position == pytest.approx(expected.position, abs=tolerance)
            assert rotation.angle_between(found.orientation, expected.orientation) < 1e-6
        assert rows[:first] == pytest.approx(before[:first], abs=tolerance)
        assert abs(simulation.energy_excess - excess) < 1e-6
        some = names[0].split('/')[1]
        simulation.set_state('doll1', joint_angles={some: 0.0})
        angles[some] = 0.0
        assert simulation.joint_angles[own] == pytest.approx(list(angles.values()), abs=tolerance)
        assert simulation.joint_rates[own] == pytest.approx(
            list(rates.values()), abs=100 * tolerance)


@pytest.mark.parametrize('share', [0.0, 1.0])
def test_a_doll_that_is_folded_into_itself_does_not_burst(share):
    """At the ends of all ranges bones overlap; in flight no energy comes of it."""
    doll = load_doll('man')
    scene = Scene('flying', (Placement(doll), Placement(doll, 'other', (9, 0, 0))), None)
    with Simulation(scene) as simulation:
        simulation.run(5)
        other = simulation.scene.bone_slices[1]
        with Simulation(scene) as twin:
            simulation.set_state('man', joint_angles=some_angles(doll, share))
            twin.run(5)
            before = simulation.energy_excess
            for _ in range(50):
                state, beside = simulation.advance(), twin.advance()
                assert (state.rows[other] == beside.rows[other]).all()
        scale = doll.mass * GRAVITY
        assert simulation.energy_excess < before + 1e-6 * scale
        assert simulation.measures()['joint_gap_m'] < 1e-6


@pytest.mark.parametrize(('given', 'error', 'text'), [
    ({'joint_angles': {'left_sin': 0.1}}, errors.UnknownJoint, 'left_sin.*left_shin'),
    ({'joint_rates': {'left_shin': math.inf}}, errors.NotFinite, 'joint_rates.left_shin'),
    ({'joint_angles': {'left_shin': -9.0}}, errors.OutOfRange, 'its limits')])
def test_wrong_joints_are_named_and_change_nothing(given, error, text):
    with Simulation(with_ball(*falling(1))) as simulation:
        before = state_digest(simulation.state)
        with pytest.raises(error, match=text):
            simulation.set_state('doll0', position=(1, 1, 1), **given)
        assert state_digest(simulation.state) == before
