"""Worn inertial sensors: what they read against closed forms, and the motion back from samples."""
import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.physics.sensors.imu import ImuErrors, ImuMount, sensor_motion, tick_samples
from ragdoll_ros.physics.simulation import Simulation

G = 9.8
PLACES = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (-0.1, 0.2, 0.25)]
UP = np.array([0.0, 0.0, 1.0])
TILTED = (0.0, math.sin(0.3), 0.0, math.cos(0.3))


def arm(**placement):
    """A bar in the air, long along x, without ground."""
    doll = Ragdoll('arm', (Bone('bar', Box((0.8, 0.1, 0.1)), 2.0, (0, 0, 0)),))
    return Scene('arm', (Placement(doll, **placement),), gravity=(0, 0, -G))


def samples_of(simulation, mount, ticks):
    """Samples of so many ticks, and the rows of the bone at their ends, the start's first."""
    scene = simulation.scene
    bone = scene.bone_index(mount.bone)
    rows, read = [simulation.state.rows[bone]], []
    for _ in range(ticks):
        simulation.advance()
        read.append(tick_samples(simulation.substates, bone, mount, simulation.step, scene.gravity))
        rows += [state.rows[bone] for state in simulation.substates[1:]]
    return np.concatenate(read), np.array(rows)


def test_at_rest_it_reads_g_upwards():
    doll = arm().dolls[0]
    scene = dataclasses.replace(arm(), ground=Ground((0, 0, 1), 0.0), dolls=(
        dataclasses.replace(doll, position=(0, 0, 0.05)),))
    with Simulation(scene) as simulation:
        read, _ = samples_of(simulation, ImuMount('bar'), 50)
        assert read == pytest.approx(np.tile([0, 0, G, 0, 0, 0], (50, 1)), abs=1e-6)
        # Turned by 0.6 rad about y, its x points down: gravity's reaction is -sin, cos.
        read, _ = samples_of(simulation, ImuMount('bar', (0.1, 0, 0), TILTED), 5)
        assert read[-1] == pytest.approx(
            [-G * math.sin(0.6), 0, G * math.cos(0.6), 0, 0, 0], abs=1e-6)


@pytest.mark.parametrize('parts', [1, 10])
def test_in_free_fall_it_reads_nothing(parts):
    with Simulation(arm(velocity=(1, 2, 3))) as simulation:
        simulation.samples_per_tick = parts
        for place in PLACES:
            read, _ = samples_of(simulation, ImuMount('bar', place), 30)
            assert np.abs(read).max() < 1e-6


@pytest.mark.parametrize('place', PLACES)
def test_a_spinning_arm_in_flight_reads_the_centripetal_term(place):
    rate = 5.0
    with Simulation(arm(spin=(0, 0, rate))) as simulation:
        simulation.samples_per_tick = 10
        read, _ = samples_of(simulation, ImuMount('bar', place, (0, 0, 0, 1)), 30)
    x, y, _ = place
    expected = [-rate ** 2 * x, -rate ** 2 * y, 0, 0, 0, rate]
    assert np.abs(read - expected).max() < 1e-6


@pytest.mark.parametrize('place', PLACES)
def test_an_arm_that_spins_up_reads_the_centripetal_and_the_euler_term(place):
    """By a steady torque: a = -w^2 r + w' z x r at the middle of each sample of 1 ms; the mean over
    one differs by w'^2 dt^2 / 12 r = 1e-7 m/s^2.
    """
    growth, scene = 2.0, arm(spin=(0, 0, 1.0))
    with Simulation(scene) as simulation:
        simulation.samples_per_tick = 10
        simulation.push(Push('bar', torque=(0, 0, growth * scene.bones[0].inertia[2]), duration=1))
        read, _ = samples_of(simulation, ImuMount('bar', place), 50)
    speed = 1.0 + growth * (np.arange(500) + 0.5) * 1e-3
    x, y, _ = place
    expected = np.zeros((500, 6))
    expected[:, 0], expected[:, 1] = -speed ** 2 * x - growth * y, -speed ** 2 * y + growth * x
    expected[:, 5] = speed
    assert np.abs(read - expected).max() < 1e-6


def integrated(read, step, position, orientation, velocity):
    """Positions of a sensor by its samples alone, each steady: a fine Euler of another library."""
    turn, places, fine = Rotation.from_quat(orientation), [position], 20
    for sample in read:
        for _ in range(fine):
            h = step / fine
            middle = turn * Rotation.from_rotvec(sample[3:] * h / 2)
            gained = (middle.apply(sample[:3]) - UP * G) * h
            position = position + velocity * h + gained * h / 2
            velocity = velocity + gained
            turn = turn * Rotation.from_rotvec(sample[3:] * h)
        places.append(position)
    return np.array(places), turn


def test_a_train_of_samples_gives_a_flight_of_a_second_back():
    scene = dataclasses.replace(load_scene('flight'), gravity=(0, 0, -G))
    mount = ImuMount('left_forearm', (0.02, 0.05, -0.01), (0.5, 0.5, 0.5, 0.5))
    with Simulation(scene) as simulation:
        simulation.samples_per_tick = 10
        simulation.push(Push('left_forearm', force=(60, -40, 80), torque=(1, 2, -1)))
        read, rows = samples_of(simulation, mount, 100)
    where, turns, velocities = sensor_motion(rows, mount)
    found, turn = integrated(read, 1e-3, where[0], turns[0], velocities[0])
    assert np.ptp(where, axis=0).max() > 0.5, 'it has moved'
    # 1 mm is asked for; a steady force within a sample misses (jerk) dt^3 / 12 of each.
    assert np.linalg.norm(found - where, axis=1).max() < 1e-5
    assert (turn.inv() * Rotation.from_quat(turns[-1])).magnitude() < 1e-8


def test_an_impact_gives_all_that_it_changed_at_any_rate():
    """Sum of force times time = the change of velocity less gravity's, in the world."""
    doll = arm().dolls[0]
    sums = []
    for parts in (1, 10):
        scene = dataclasses.replace(arm(), ground=Ground((0, 0, 1), 0.0), dolls=(
            dataclasses.replace(doll, position=(0, 0, 0.3)),))
        with Simulation(scene) as simulation:
            simulation.samples_per_tick = parts
            read, rows = samples_of(simulation, ImuMount('bar'), 60)
            step = simulation.step / parts
            sums.append(read[:, 2].sum() * step)
            assert sums[-1] == pytest.approx(rows[-1, 9] - rows[0, 9] + G * 0.6, abs=1e-9)
            # A blow of 2 to 3 m/s within one sample: its peak goes with the rate.
            assert read[:, 2].max() > (200 if parts == 1 else 2000)
    assert sums[0] == pytest.approx(sums[1], abs=1e-3)


def test_the_tick_is_the_same_whether_anybody_reads():
    rows = []
    for listens in (False, True):
        with Simulation(load_scene('drop')) as simulation:
            for _ in range(80):
                simulation.advance()
                if listens:
                    tick_samples(simulation.substates, 1, ImuMount('head'), simulation.step,
                                 (0, 0, -G))
            rows.append(simulation.state.rows)
    assert (rows[0] == rows[1]).all()


def test_noise_bias_and_range():
    flaws = ImuErrors(0.05, 0.01, bias=(1, 0, 0, 0, 0, 0.5))
    true = np.tile([0, 0, G, 0, 0, 0], (100_000, 1))
    read = flaws(true, np.random.default_rng(7)) - true
    # Of 300 000 values a variance is known to 0.26 %, a mean to 0.06 % of the deviation.
    assert (read[:, :3] - (1, 0, 0)).var() == pytest.approx(0.05 ** 2, rel=0.02)
    assert (read[:, 3:] - (0, 0, 0.5)).var() == pytest.approx(0.01 ** 2, rel=0.02)
    assert read.mean(axis=0) == pytest.approx([1, 0, 0, 0, 0, 0.5], abs=1e-3)
    again = flaws(true, np.random.default_rng(7)) - true
    assert (read == again).all()
    clipped = ImuErrors(range=(5.0, 0.0))(np.array([[1, -9, G, 8, 0, 0]]), np.random.default_rng(0))
    assert clipped.tolist() == [[1, -5, 5, 8, 0, 0]]
    assert (ImuErrors()(true, np.random.default_rng(0)) == true).all()


def test_wrong_numbers_are_refused():
    for wrong in ({'noise_rate': -1.0}, {'bias': (0, 0, math.nan, 0, 0, 0)}, {'range': (-1, 0)}):
        with pytest.raises(errors.ModelError):
            ImuErrors(**wrong)
    with pytest.raises(errors.ModelError):
        ImuMount('head', orientation=(0, 0, 0, 0))
    with Simulation(arm()) as simulation, pytest.raises(errors.OutOfRange, match='samples_per'):
        simulation.samples_per_tick = 0
