"""A sensor reads impacts for as long as the contact law's pulse: against an integrated spring."""
import dataclasses
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_imu_response import MOUNT, rows_of

from ragdoll_ros import load_limits
from ragdoll_ros.falls.fall import fall_samples
from ragdoll_ros.falls.recipe import load_recipe, recipe_of
from ragdoll_ros.falls.simulate import generate
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.sensors.contact_pulse import PulseLaw, PulseLog, spread
from ragdoll_ros.physics.sensors.imu import imu_samples
from ragdoll_ros.physics.sensors.joint_stop import JointStops
from ragdoll_ros.physics.sensors.soft_joints import SoftJoints
from ragdoll_ros.physics.simulation import Simulation

MASS, STIFFNESS, SPEED = 5.0, 25e3, 2.0
HALF_PERIOD = math.pi * math.sqrt(MASS / STIFFNESS)
STILL = np.zeros(3)


@pytest.mark.parametrize('restitution', [0.0, 0.3, 1.0])
def test_a_mass_that_meets_a_spring(restitution):
    """The half-sine has the spring's peak v sqrt(k m), and the impulse (1 + e) m v; of an elastic
    spring it is the very course of the force, here by scipy.
    """
    step = 1e-5
    times = np.arange(8000) * step
    rigid = np.where(times > 0, restitution * SPEED, -SPEED)
    velocities, pulses = np.zeros((len(times), 3)), np.zeros((len(times) - 1, 2))
    velocities[:, 0], pulses[0, 1] = rigid, (1 + restitution) / 2 * HALF_PERIOD
    read = spread(velocities, step, STILL, pulses)[:, 0]
    assert read[-1] == pytest.approx(restitution * SPEED)
    assert (np.diff(read) / step).max() == pytest.approx(SPEED * math.sqrt(STIFFNESS / MASS),
                                                         rel=1e-5)
    if restitution == 1:
        spring = solve_ivp(lambda _, y: [y[1], -STIFFNESS / MASS * min(y[0], 0)], (0, times[-1]),
                           [0.0, -SPEED], t_eval=times[::100], rtol=1e-10, atol=1e-12,
                           max_step=1e-3)
        assert read[::100] == pytest.approx(spring.y[1], abs=1e-7)


def test_nothing_is_lost_and_gravity_goes_on():
    """Samples add up to the bone's change of velocity, also of pulses that overlap; in free fall
    beside them they are 0.
    """
    step, gravity = 0.01, (0.0, 0.0, -9.8)
    velocities = np.random.default_rng(1).normal(size=(60, 3)).cumsum(axis=0)
    velocities[30:] = velocities[30] + np.outer(np.arange(30) * step, gravity)
    pulses = np.zeros((59, 2))
    pulses[[3, 5, 8, 12]] = (0, 0.03), (0, 0.08), (0, 0.004), (0.033, 0.05)
    rows = np.zeros((60, 13))
    rows[:, 6], rows[:, 7:10] = 1, velocities
    rigid, soft = (imu_samples(rows, MOUNT, step, gravity, pulses=each)[:, :3]
                   for each in (None, pulses))
    assert soft.sum(axis=0) == pytest.approx(rigid.sum(axis=0), rel=1e-12)
    assert np.abs(soft[31:]).max() < 1e-10
    assert (soft[:3] == rigid[:3]).all()
    assert np.abs(soft - rigid).max() > 10, 'the pulses are long'


def test_a_pulse_within_a_sample_changes_nothing():
    velocities = np.array([0.0, 0.0, 3.0, 3.0])
    pulses = np.array([(0.0, 0.0), (0.0, 0.009), (0.0, 0.0)])
    read, rigid = (imu_samples(rows_of(velocities), MOUNT, 0.01, STILL, pulses=each)
                   for each in (pulses, None))
    assert (read == rigid).all()


def ball(name='pelvis', mass=MASS):
    return Ragdoll('ball', (Bone(name, Sphere(0.1), mass, (0, 0, 0)),))


def test_the_pulse_of_a_free_ball_is_that_of_the_law():
    """A ball of the pelvis' stiffness, 25 kN/m, e = 1/4: a pulse of 5/8 of the spring's, with the
    peak v sqrt(k / m), to 1 % by samples of 1 ms.
    """
    scene = Scene('ball', (Placement(ball(), position=(0, 0, 0.1001), velocity=(0, 0, -SPEED)),),
                  Ground(), Material(0.5, 0.0, 0.25), step=1e-3)
    limits = load_limits()
    with Simulation(scene, accuracy='exact', engine='rigid') as simulation:
        simulation.record_impacts(limits)
        log, rows = PulseLog(PulseLaw(scene, limits), 60, scene.step), [simulation.state.rows[0]]
        for _ in range(60):
            rows.append(simulation.advance().rows[0])
            log.add(simulation.impacts)
    durations = log.pulses[:, 1]
    assert durations[durations > 0][0] == pytest.approx(1.25 / 2 * HALF_PERIOD, rel=1e-6)
    read = imu_samples(np.array(rows), MOUNT, scene.step, scene.gravity, pulses=log.pulses)
    assert read[:, 2].max() == pytest.approx(SPEED * math.sqrt(STIFFNESS / MASS), rel=0.01)


def test_a_foot_is_as_stiff_as_the_shin():
    doll = Ragdoll('leg', (Bone('left_shin', Sphere(0.05), 3.0, (0, 0, 0.5)),
                           Bone('left_foot', Sphere(0.05), 1.0, (0, 0, 0.2))),
                   (Joint('left_shin', 'left_foot', 'hinge', (0, 0, 0.3), ((0, 1, 0),),
                          ((-0.5, 0.5),)),))
    scene = Scene('leg', (Placement(doll, position=(0, 0, -0.1), velocity=(0, 0, -1)),), Ground(),
                  Material(0.5, 0.0, 0.0))
    limits = load_limits()
    with Simulation(scene, engine='rigid') as simulation:
        simulation.record_impacts(limits)
        for _ in range(10):
            simulation.advance()
            if simulation.impacts:
                break
        hit, = simulation.impacts
        duration = PulseLaw(scene, limits).duration(hit)
    assert hit.bone == 'left_foot'
    assert math.isnan(hit.stiffness)
    assert duration == pytest.approx(math.pi / 2 * math.sqrt(hit.effective_mass / 60e3), rel=1e-6)


def test_what_has_no_region_has_no_pulse():
    scene = load_scene('drop')
    bare = dataclasses.replace(load_limits(), regions={})
    with Simulation(scene, engine='rigid') as simulation:
        simulation.record_impacts(load_limits())
        while not simulation.impacts:
            simulation.advance()
        assert not PulseLaw(scene, bare).duration(simulation.impacts[0])


def test_a_fall_reads_pulses_and_moves_as_before():
    """Where the pelvis meets the ground first, of fall 2, the peak is half as high."""
    data = load_recipe('faint').data
    sensor = {key: value for key, value in data['record']['imus'][0].items()
              if key != 'contact_pulse'}
    rigid, soft = (next(iter(generate(recipe_of({**data, 'record': {
        **data['record'], 'imus': [{**sensor, **more}]}}), [2])))
        for more in ({}, {'contact_pulse': True}))
    assert (rigid.states == soft.states).all()
    instant, spread_out = (np.linalg.norm(fall_samples(fall, 0)[:, :3], axis=1)
                           for fall in (rigid, soft))
    assert spread_out.max() < 0.7 * instant.max()
    assert (soft.pulses[:, 1] > 0.01).any()


def test_a_stop_lasts_as_long_as_tissue_takes():
    """A knee that a torque M exp(q / w) stops, by scipy, with any inertia: a half-sine of the same
    peak has the found duration. It is found from the values at the ends of a tick.
    """
    width, rate = 0.088, 8.0
    for inertia in (0.1, 0.5):
        stopped = solve_ivp(lambda _, y, most=10 / inertia: [y[1], -most * np.exp(y[0] / width)],
                            (0, 0.4), [-1.0, rate], rtol=1e-10, atol=1e-12, max_step=1e-4)
        peak = -np.gradient(stopped.y[1], stopped.t).min()
        assert math.pi / 2 * rate / peak == pytest.approx(math.pi * width / rate, rel=1e-3)
    doll = Ragdoll('leg', (Bone('thigh', Sphere(0.05), 3.0, (0, 0, 0.9)),
                           Bone('shin', Sphere(0.05), 2.0, (0, 0, 0.2))),
                   (Joint('thigh', 'shin', 'hinge', (0, 0, 0.5), ((0, 1, 0),), ((-0.1, 2.0),)),))
    stops = JointStops(Scene('leg', (Placement(doll),)), {'shin': (0.03, width)})
    here, there = (np.array([1.95]), np.array([rate])), (np.array([2.0]), np.array([-0.2]))
    found, = stops.find(here, there, 0.01)
    assert found.duration == pytest.approx(math.pi * width / rate)
    # 2 kg at 0.3 m, and the sphere's own inertia.
    assert found.impulse == pytest.approx(rate * 2 * math.sqrt(0.3 ** 2 * 2 / 3 + 0.4 * 0.05 ** 2))
    lower, = stops.find((np.array([-0.05]), -here[1]), (np.array([-0.1]), there[1]), 0.01)
    assert lower.duration == pytest.approx(math.pi * 0.03 / rate)
    assert not stops.find(here, (np.array([2.0]), here[1]), 0.01), 'it goes on'
    assert not stops.find((np.array([1.0]), here[1]), there, 0.01), 'it is far from the end'


STEP = 0.01


def chain_of_tissue(masses, width, gap, second_width, speed):
    """Largest mean acceleration within STEP of the middle one of three masses in line, by scipy.
    The first comes with ``speed``; torques that grow e-fold in a width, and give nothing back, stop
    it at the second, and that one, after a gap, at the third.
    """
    first = masses[0] * masses[1] / (masses[0] + masses[1]) * speed ** 2 / 2 / width
    together, pushed = sum(masses[:2]), masses[0] / sum(masses[:2]) * speed
    second = together * masses[2] / sum(masses) * pushed ** 2 / 2 / second_width

    def force(most, depth, approach):
        return most * math.exp(min(depth, 5)) / (1 + math.exp(-50 * approach / speed))

    def motion(_, y):
        a = force(first, (y[0] - y[1]) / width, y[3] - y[4])
        b = force(second, (y[1] - y[2] - gap) / second_width, y[4] - y[5])
        return [*y[3:], -a / masses[0], (a - b) / masses[1], b / masses[2]]

    times = np.arange(0, 0.6, STEP)
    found = solve_ivp(motion, (0, times[-1]), [-6 * width, 0, 0, speed, 0, 0], t_eval=times,
                      rtol=1e-7, atol=1e-9, max_step=1e-3)
    return np.abs(np.diff(found.y[4])).max() / STEP


def chain_of_pulses(masses, width, gap, second_width, speed, late):
    """The same as a sensor reads it on rigid bodies; ``late``: the second stop waits."""
    pushed = masses[0] / sum(masses[:2]) * speed
    stopped = masses[0] / sum(masses) * speed
    at, lasts = int(gap / pushed / STEP), math.pi * width / speed
    velocities, pulses = np.zeros((61, 3)), np.zeros((60, 2))
    velocities[1:, 0], velocities[at + 1:, 0] = pushed, stopped
    soft = SoftJoints(61, 1, STEP)
    soft.advance(np.array([pushed]), 0, lasts)
    for _ in range(1, at):
        soft.advance(np.zeros(1), 0, 0)
    delay, more = soft.arrival(0, 1, pushed) if late else (0, 0)
    pulses[0], pulses[at] = (0, lasts), (delay, math.pi * second_width / pushed + more)
    return np.abs(np.diff(spread(velocities, STEP, STILL, pulses)[:, 0])).max() / STEP


def test_a_stop_waits_for_the_rate_that_causes_it():
    """A knee that stops gives the pelvis a rate that the waist stops in turn: against tissue at
    both, integrated, for masses and widths about those of legs, pelvis and trunk. Peaks are too
    large by half in the middle of the cases, and three times if the second stop does not wait.
    """
    random, cases = np.random.default_rng(0), []
    for _ in range(40):
        masses = random.uniform(5, 20), random.uniform(8, 12), random.uniform(15, 40)
        width = random.uniform(0.008, 0.03)
        cases.append((masses, 0.35, width * random.uniform(1, 6), width, 8.0))
    real = np.array([chain_of_tissue(*case) for case in cases])
    waiting, at_once = (np.array([chain_of_pulses(*case, late) for case in cases]) / real
                        for late in (True, False))
    assert 0.8 < np.median(waiting) < 1.8
    assert np.percentile(waiting, 10) > 0.6
    assert np.percentile(waiting, 90) < 2.8
    assert np.median(at_once) > 3


def test_a_stop_without_a_cause_comes_at_once():
    """Also long after a pulse, which leaves nothing behind."""
    soft = SoftJoints(50, 1, STEP)
    assert soft.arrival(0, 1, 8.0) == (0, 0)
    soft.advance(np.array([5.0]), 0.02, 0.1)
    delay, more = soft.arrival(0, 1, 5.0)
    assert delay > 0
    assert more > 0
    for _ in range(12):
        soft.advance(np.zeros(1), 0, 0)
    assert soft.arrival(0, -1, 3.0) == (0, 0)


def test_what_is_handed_on_lasts_as_long_as_its_cause():
    """A foot that meets the ground slowly, while a stop presses it down: its own impulse is at most
    2 mu v.
    """
    scene, limits = load_scene('man_faints'), load_limits()
    with Simulation(scene, engine='rigid') as simulation:
        simulation.record_impacts(limits)
        while not simulation.impacts:
            simulation.advance()
        hit = next(iter(simulation.impacts))
    pressed = dataclasses.replace(hit, time=0, impulse=20 * hit.effective_mass * hit.speed)
    law = PulseLaw(scene, limits)
    log = PulseLog(law, 1, STEP)
    log.add([pressed])
    log.enter(0, 0.15, 2 * hit.effective_mass * hit.speed)
    assert log.pulses[0] == pytest.approx((0, (law.duration(pressed) + 0.15) / 2))


def test_stops_are_the_same_in_every_process():
    """Names are hashed with another seed in each; sums of masses must not depend on it."""
    code = ('from ragdoll_ros import load_scene\n'
            'from ragdoll_ros.physics.sensors.joint_stop import JointStops\n'
            'print(JointStops(load_scene("man_faints"), {})._masses.tobytes().hex())')
    first, second = (subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                                    check=True, env={**os.environ, 'PYTHONHASHSEED': seed}).stdout
                     for seed in ('1', '2'))
    assert first == second != ''
