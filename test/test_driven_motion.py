"""Simulation.drive_body: how driven bodies move, give way, jump, stop, sleep and are repeated."""
from __future__ import annotations

import math

import numpy as np
import pytest
from test_driven_bodies import ACCURACIES, EXACT, G, body, run, scene, wall

from ragdoll_ros import (
    Follow,
    Ground,
    Placement,
    Push,
    RagdollError,
    Simulation,
    load_scene,
    save_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.physics.logged_simulation import LoggedSimulation, apply_event

pytest.importorskip('numba')

DROP = load_scene('drop')
ROBOT = ('{name: robot, shapes: [{box: {size: [0.4, 0.6, 0.3]}}, {sphere: {radius: 0.1}, '
         'position: [0.2, 0, 0.1]}], position: [-1.2, 0, 0.16], follow: exact}')


def read(tmp_path, *bodies, doll='{doll: doll, position: [0, 0, 0.05]}'):
    file = tmp_path / 'scene.yaml'
    file.write_text('ground: {}\nmaterial: {friction: 0.6, restitution: 0}\n'
                    f'dolls: [{doll}]\nbodies: [{", ".join(bodies)}]\n')
    return load_scene(str(file))


def pose(x, y=0.0, z=0.0, yaw=0.0):
    return x, y, z, 0, 0, math.sin(yaw / 2), math.cos(yaw / 2)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_what_gives_way_pushes_with_its_greatest_force(accuracy):
    """40 N against the friction of 14 kg, until both have the speed of 1 m/s."""
    mu, force = 0.2, 40.0
    arm = body('arm', Box((0.2, 0.2, 0.2)), 4.0, position=(0, 0, 0.1), follow=Follow(force, 30.0))
    block = body('block', Box((0.2, 0.4, 0.2)), 10.0, position=(0.2, 0, 0.1))
    made = scene(arm, block, ground=Ground(), gravity=G, friction=mu, restitution=0.0)
    with Simulation(made, accuracy=accuracy) as simulation:
        rows = run(simulation, 1.5, arm=1.0)
        excess, (work, _) = simulation.energy_excess, simulation.work
    acceleration = force / 14 - mu * G
    assert rows[99, :, 7] == pytest.approx(acceleration * 1.0, rel=1e-7)
    assert rows[-1, :, 7] == pytest.approx(1.0, abs=0.01)
    kinetic = 7 * rows[-1, 1, 7] ** 2
    heat = mu * G * (4 * rows[-1, 0, 0] + 10 * (rows[-1, 1, 0] - 0.2))
    assert work == pytest.approx(kinetic + heat, rel=1e-6)
    assert excess == pytest.approx(-heat, rel=1e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_wall_pushes_away_what_gives_way(accuracy):
    """It yields by 150 N, without accelerating: wall and drive do opposite work."""
    arm = body('arm', Box((0.2, 0.2, 0.2)), 4.0, follow=Follow(150.0, 1000.0))
    made = scene(arm, wall('wall', -0.2), restitution=0.0)
    with Simulation(made, accuracy=accuracy) as simulation:
        run(simulation, 0.3, wall=0.5)
        before = simulation.contact_impulses[0, 0]
        row = run(simulation, 0.5, wall=0.5)[-1, 0]
        impulse = simulation.contact_impulses[0, 0] - before
        excess = simulation.energy_excess
    assert row[0] == pytest.approx(0.4, abs=1e-6)
    assert row[7] == pytest.approx(0.5, abs=1e-6)
    assert impulse == pytest.approx(150 * 0.5, rel=1e-4)
    # The impact at the start takes half of m u^2.
    assert excess == pytest.approx(-4 * 0.25 / 2, rel=1e-4)


def test_what_gives_way_is_held_where_it_stands_or_goes():
    """Gravity makes it sag by g times the drive's time and the time to catch up."""
    arm = body('arm', Box((0.2, 0.2, 0.2)), 4.0, position=(0, 0, 0.5), follow=Follow(150.0, 30.0))
    with Simulation(scene(arm, gravity=G)) as simulation:
        held = simulation.run(50)[-1, 0]
        assert simulation.stale_bodies == ('arm',)
        for tick in range(100):
            simulation.drive_body('arm', pose(0.005 * tick, 0, 0.5, 0.01 * tick),
                                  (0.5, 0, 0, 0, 0, 1))
            simulation.advance()
        row, excess = simulation.state.rows[0], simulation.energy_excess
        assert simulation.stale_bodies == ()
        work = simulation.work[0]
    sag = G * 1e-3 * 0.1
    assert held[:3] == pytest.approx((0, 0, 0.5 - sag), abs=1e-5)
    assert row[:3] == pytest.approx((0.5, 0, 0.5 - sag), abs=1e-4)
    assert rotation.rotation_vector(row[3:7]) == pytest.approx((0, 0, 1), abs=1e-4)
    assert abs(excess) < 1e-6 * abs(work)


def test_an_exact_body_is_where_its_poses_are(tmp_path):
    """At the end of each tick, also where twists are wrong, and about a frame off its centre."""
    with Simulation(read(tmp_path, ROBOT, doll='{doll: doll, position: [9, 0, 1]}')) as simulation:
        center = simulation.scene.dolls[-1].doll.root.position
        for tick in range(60):
            yaw = 0.02 * tick
            there = np.array((-1.2 + 0.01 * tick, 0.1 * math.sin(0.1 * tick), 0.16))
            simulation.drive_body('robot', pose(*there, yaw), (0, 0, 0, 0, 0, 0))
            state = simulation.advance()
            turn = rotation.from_axis_angle((0, 0, 1), yaw)
            expected = there + rotation.rotate(turn, np.array(center))
            assert state.positions[-1] == pytest.approx(expected, abs=1e-12)
        # Without a pose it goes on from there: its origin straight on, its centre around it.
        simulation.drive_body('robot', twist=(1, 0, 0, 0, 0, 2))
        for _ in range(10):
            state = simulation.advance()
        turn = rotation.from_axis_angle((0, 0, 1), yaw + 0.2)
        expected = there + np.array((0.1, 0, 0)) + rotation.rotate(turn, np.array(center))
        assert state.positions[-1] == pytest.approx(expected, abs=1e-9)
        assert simulation.measures()['body_jumps_total'] == 0


def test_it_stands_after_a_fifth_of_a_second_and_is_stale():
    with Simulation(scene(body('robot', Box((0.4, 0.4, 0.4)), follow=EXACT))) as simulation:
        assert simulation.stale_bodies == ('robot',)
        simulation.drive_body('robot', twist=(2, 0, 0, 0, 0, 0))
        simulation.run(19)
        assert (simulation.stale_bodies, simulation.measures()['stale_bodies']) == ((), 0)
        rows = simulation.run(30)
        assert simulation.measures()['stale_bodies'] == 1
    assert rows[-1, 0, 0] == pytest.approx(0.4, abs=1e-12)
    assert rows[-1, 0, 7] == 0


@pytest.mark.parametrize('rate', [1000, 50, 5])
def test_it_goes_on_evenly_however_often_it_is_told(rate):
    """Poses and twists of one motion, ten in a tick or one in twenty ticks."""
    made = scene(body('robot', Box((0.4, 0.4, 0.4)), follow=EXACT))
    with Simulation(made) as simulation:
        for tick in range(60):
            here = 0.02 * tick
            for _ in range(max(1, rate // 100) if tick % max(1, 100 // rate) == 0 else 0):
                simulation.drive_body('robot', pose(here), (2, 0, 0, 0, 0, 0))
            row = simulation.advance().rows[0]
            assert row[0] == pytest.approx(here + 0.02, abs=1e-9)
            assert row[7] == pytest.approx(2, abs=1e-6)
        assert simulation.measures()['body_jumps_total'] == 0


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_jump_gives_no_blow_and_is_counted(tmp_path, accuracy):
    """It lands in the legs of the doll, which are moved out of it, gain no speed, and give way."""
    made = read(tmp_path, ROBOT)
    with Simulation(made, accuracy=accuracy) as simulation:
        simulation.drive_body('robot', pose(-1.2, 0, 0.16))
        simulation.run(100)
        simulation.drive_body('robot', pose(-0.25, 0, 0.16))
        assert simulation.state.positions[-1, 0] > -0.3
        rows = simulation.run(50)
        assert simulation.measures()['body_jumps_total'] == 1
        # In a tenth of a second they fall at less than a tenth of what gravity gives.
        assert np.abs(rows[:10, :-1, 7:10]).max() < 0.1
        assert simulation.contacts.depths.max(initial=0.0) < 5e-3


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_robot_bumps_into_a_doll_and_does_no_more_work_than_it_says(tmp_path, accuracy):
    made = read(tmp_path, ROBOT)
    with Simulation(made, accuracy=accuracy) as simulation:
        simulation.run(60)
        start, lost = simulation.state.positions[:-1].mean(axis=0), simulation.energy_excess
        for tick in range(120):
            simulation.drive_body('robot', pose(-1.2 + 0.015 * tick, 0, 0.16), (1.5, 0, 0, 0, 0, 0))
            simulation.advance()
            assert simulation.contacts.depths.max(initial=0.0) < 5e-3
            assert simulation.energy_excess < lost + 1e-6
            lost = simulation.energy_excess
        state = simulation.state
        assert simulation.measures()['unsolved_total'] == 0
    assert state.positions[-1, 0] == pytest.approx(-1.2 + 1.8, abs=0.03)
    assert state.positions[:-1, 0].mean() > start[0] + 0.5, 'the doll was pushed along'


def test_a_conveyor_may_jump_back_under_what_it_carries():
    """Every 0.2 s it is put where it was; the box slides for u / mu g and goes on at its speed."""
    u, mu = 1.5, 0.4
    belt = body('belt', Box((8, 2, 0.2)), position=(0, 0, -0.1), follow=EXACT)
    made = scene(body('box', Box((0.2, 0.3, 0.2)), 3.0, position=(0, 0, 0.1)), belt, gravity=G,
                 friction=mu, restitution=0.0)
    with Simulation(made) as simulation:
        for _ in range(5):
            simulation.drive_body('belt', pose(0, 0, -0.1), (u, 0, 0, 0, 0, 0))
            row = simulation.run(20)[-1]
        assert simulation.measures()['body_jumps_total'] == 4
    assert row[0, 0] == pytest.approx(u * 1.0 - u * u / (2 * mu * G), rel=1e-5)
    assert row[0, 7] == pytest.approx(u, abs=1e-9)
    assert row[1, 0] == pytest.approx(0.3, abs=1e-9)


def test_it_sleeps_with_what_lies_on_it_and_wakes_it():
    lift = body('lift', Box((1, 1, 0.2)), position=(0, 0, 0.5), follow=EXACT)
    made = scene(body('box', Box((0.4, 0.4, 0.4)), 5.0, position=(0, 0, 0.8)), lift, gravity=G,
                 ground=Ground(), friction=0.5, restitution=0.0)
    with Simulation(made) as simulation:
        simulation.run(100)
        assert simulation.asleep
        simulation.drive_body('lift', twist=(0, 0, 0, 0, 0, 0))
        simulation.advance()
        assert simulation.asleep, 'it has not moved'
        simulation.drive_body('lift', twist=(0, 0, 1e-3, 0, 0, 0))
        simulation.run(19)
        assert not simulation.asleep
        simulation.run(100)
        assert simulation.asleep
        assert simulation.state.positions[0, 2] == pytest.approx(0.8002, abs=1e-5)


def test_events_repeat_it_to_the_bit(tmp_path):
    made = read(tmp_path, ROBOT, '{name: arm, shape: {box: {size: [0.1, 0.1, 0.1]}}, mass: 4, '
                'position: [0, 0.4, 0.3], follow: {max_force: 150, max_torque: 30}}')
    log, runs = [], []
    with LoggedSimulation(made) as simulation:
        simulation.on_event = lambda name, arguments: log.append((simulation.time, name, arguments))
        for tick in range(80):
            if tick % 3 == 0:
                simulation.drive_body('robot', pose(-1 + 0.015 * tick, 0, 0.16), (1, 0, 0, 0, 0, 0))
                simulation.drive_body('arm', twist=(0, -1, 0, 0, 0, 0))
            if tick == 40:
                simulation.drive_body('robot', pose(-1, 0, 0.16))
            runs.append(simulation.advance().rows.copy())
    for engine in range(2):
        with Simulation(made) as simulation:
            for reset in range(1 + engine):
                if reset:
                    simulation.reset()
                assert_repeated(simulation, log, runs)


def assert_repeated(simulation, log, runs):
    """Events ``log`` of (time, ...) give the states of ``runs``, tick by tick, to the bit."""
    events = iter(log)
    event = next(events)
    for rows in runs:
        while event and event[0] == simulation.time:
            apply_event(simulation, *event[1:])
            event = next(events, None)
        assert np.array_equal(simulation.advance().rows, rows)


def test_a_checkpoint_goes_back_to_where_it_was():
    with Simulation(scene(body('robot', Box((0.4, 0.4, 0.4)), follow=EXACT))) as simulation:
        simulation.drive_body('robot', twist=(2, 0, 0, 0, 0, 0))
        simulation.run(5)
        here = simulation.checkpoint()
        ahead = simulation.run(10)
        simulation.go_back(here)
        assert simulation.run(10)[:, 0, 0] == pytest.approx(ahead[:, 0, 0], abs=1e-12)


def test_forces_do_not_move_what_follows_exactly():
    made = scene(body('robot', Box((0.4, 0.4, 0.4)), follow=EXACT), gravity=G)
    with Simulation(made) as simulation:
        simulation.push(Push('robot', force=(1e4, 0, 0)))
        simulation.grab('hand', 'robot', target=(1, 0, 0))
        rows = simulation.run(20)
        assert not rows[:, 0, [0, 1, 2, 7, 8, 9]].any()
        assert simulation.work == (0, 0)


def test_a_scene_with_driven_bodies_is_written_and_read(tmp_path):
    made = read(tmp_path, ROBOT, '{name: arm, shape: {sphere: {radius: 0.1}}, mass: 4, '
                'follow: {max_force: 150, max_torque: .inf}}')
    assert [placement.follow for placement in made.dolls] == [
        None, Follow(), Follow(150.0, math.inf)]
    save_scene(made, tmp_path / 'copy.yaml')
    assert load_scene(str(tmp_path / 'copy.yaml')) == made


@pytest.mark.parametrize('entry, told', [
    ('follow: slowly', "bodies[0].follow: WrongForm: 'slowly'"),
    ('follow: {max_force: 3}', 'bodies[0].follow: WrongForm'),
    ('follow: {max_force: 3, max_torque: -1}, mass: 2', 'bodies[0].follow.max_torque: NotPositive'),
    ('follow: {max_force: 3, max_torque: 1}', 'a mass as well'),
    ('follow: exact, velocity: [1, 0, 0]', 'bodies[0].velocity: WrongForm: (1.0, 0.0, 0.0)')])
def test_what_is_wrong_with_follow_is_named(tmp_path, entry, told):
    with pytest.raises(ValueError) as error:
        read(tmp_path, f'{{name: a, shape: {{sphere: {{radius: 1}}}}, {entry}}}')
    assert told in str(error.value)


def test_a_doll_of_several_bones_does_not_follow():
    with pytest.raises(RagdollError, match='a doll of one bone'):
        Placement(DROP.dolls[0].doll, follow=EXACT)


@pytest.mark.parametrize('name, pose, twist, told', [
    ('robots', None, (0,) * 6, "UnknownDoll: 'robots'"),
    ('robot', (0, 0, math.nan, 0, 0, 0, 1), (0,) * 6, 'pose: NotFinite'),
    ('robot', (0, 0, 0, 0, 0, 0, 0), (0,) * 6, 'pose: NotUnit'),
    ('robot', (0, 0, 0), (0,) * 6, 'pose: WrongForm'),
    ('robot', (0, 1e9, 0, 0, 0, 0, 1), (0,) * 6, 'pose: OutOfRange'),
    ('robot', None, (math.inf, 0, 0, 0, 0, 0), 'twist: NotFinite'),
    ('robot', None, (1, 2, 3), 'twist: WrongForm'),
    ('robot', None, (0, 0, 0, 0, 0, 2e3), 'twist: OutOfRange')])
def test_a_wrong_motion_is_refused_and_nothing_changes(name, pose, twist, told):
    with Simulation(scene(body('robot', Box((0.4, 0.4, 0.4)), follow=EXACT))) as simulation:
        with pytest.raises(ValueError) as error:
            simulation.drive_body(name, pose, twist)
        assert told in str(error.value)
        assert simulation.stale_bodies == ('robot',)


def test_a_scene_without_driven_bodies_says_so():
    with Simulation(DROP) as simulation, pytest.raises(RagdollError, match='the scene has none'):
        simulation.drive_body('robot')


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_refuse_driven_bodies(engine):
    pytest.importorskip(engine.replace('bullet', 'pybullet'))
    with pytest.raises(RagdollError, match='rigid, which moves bodies with follow'):
        Simulation(scene(body('robot', Box((0.4, 0.4, 0.4)), follow=EXACT)), engine=engine)
