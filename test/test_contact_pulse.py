"""A sensor reads impacts for as long as the contact law's pulse: against an integrated spring."""
import dataclasses
import math

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
from ragdoll_ros.physics.sensors.contact_pulse import ContactPulse, PulseLaw, PulseLog, spread
from ragdoll_ros.physics.sensors.imu import imu_samples
from ragdoll_ros.physics.simulation import Simulation

MASS, STIFFNESS, SPEED = 5.0, 25e3, 2.0
HALF_PERIOD = math.pi * math.sqrt(MASS / STIFFNESS)
STILL = np.zeros(3)


def spring_velocities(restitution, times):
    """Velocity of a mass on the spring of Walton and Braun, which is stiffer by 1/e^2 when it
    unloads, by scipy.
    """
    if not restitution:
        loaded = times < HALF_PERIOD / 2
        return np.where(loaded, -SPEED * np.cos(math.pi * times / HALF_PERIOD), 0.0)

    def rates(stiffness, rest):
        return lambda _, y: [y[1], -stiffness / MASS * (y[0] - rest)]

    def turns(_, y):
        return y[1]

    def leaves(_, y):
        return y[0] - rest
    turns.terminal = leaves.terminal = True
    exactly = {'rtol': 1e-11, 'atol': 1e-13, 'dense_output': True, 'max_step': 1e-3}
    loading = solve_ivp(rates(STIFFNESS, 0.0), (0, 1), [0.0, -SPEED], events=turns, **exactly)
    deepest, steep = loading.y[0, -1], STIFFNESS / restitution ** 2
    # The force is the same at the turn: k x = k / e^2 (x - rest).
    rest = deepest * (1 - restitution ** 2)
    unloading = solve_ivp(rates(steep, rest), (loading.t[-1], 1), [deepest, 0.0], events=leaves,
                          **exactly)
    end = unloading.t[-1]
    return np.select([times <= loading.t[-1], times < end], [
        loading.sol(np.minimum(times, loading.t[-1]))[1],
        unloading.sol(np.clip(times, loading.t[-1], end))[1]], unloading.y[1, -1])


@pytest.mark.parametrize('restitution', [0.0, 0.3, 1.0])
def test_a_mass_that_meets_a_spring(restitution):
    """The rigid velocity changes at once by (1 + e) v; what is read is that of the spring."""
    step = 1e-3
    times = np.arange(80) * step
    rigid = np.where(times > 0, restitution * SPEED, -SPEED)
    pulses = [ContactPulse(HALF_PERIOD, restitution)] + [None] * (len(times) - 2)
    velocities = np.zeros((len(times), 3))
    velocities[:, 0] = rigid
    read = spread(velocities, step, STILL, pulses)[:, 0]
    assert read == pytest.approx(spring_velocities(restitution, times), abs=1e-8)


def test_nothing_is_lost_and_gravity_goes_on():
    """Samples add up to the bone's change of velocity, also of pulses that overlap; in free fall
    beside them they are 0.
    """
    step, gravity = 0.01, (0.0, 0.0, -9.8)
    velocities = np.random.default_rng(1).normal(size=(60, 3)).cumsum(axis=0)
    velocities[30:] = velocities[30] + np.outer(np.arange(30) * step, gravity)
    pulses = [None] * 59
    pulses[3], pulses[5], pulses[8] = (ContactPulse(t, e) for t, e in
                                       ((0.05, 0.2), (0.16, 0.0), (0.004, 0.5)))
    rows = np.zeros((60, 13))
    rows[:, 6], rows[:, 7:10] = 1, velocities
    rigid, soft = (imu_samples(rows, MOUNT, step, gravity, pulses=each)[:, :3]
                   for each in ((), pulses))
    assert soft.sum(axis=0) == pytest.approx(rigid.sum(axis=0), rel=1e-12)
    assert np.abs(soft[31:]).max() < 1e-10
    assert (soft[:3] == rigid[:3]).all()
    assert np.abs(soft - rigid).max() > 10, 'the pulses are long'


def test_a_pulse_within_a_sample_changes_nothing():
    velocities = np.array([0.0, 0.0, 3.0, 3.0])
    pulses = [None, ContactPulse(0.009, 0.1), None]
    read, rigid = (imu_samples(rows_of(velocities), MOUNT, 0.01, STILL, pulses=each)
                   for each in (pulses, ()))
    assert (read == rigid).all()


def ball(name='pelvis', mass=MASS):
    return Ragdoll('ball', (Bone(name, Sphere(0.1), mass, (0, 0, 0)),))


def test_the_pulse_of_a_free_ball_is_that_of_the_law():
    """A ball of the pelvis' stiffness, 25 kN/m: T = pi sqrt(m / k), peak v sqrt(k / m) to 1 %."""
    scene = Scene('ball', (Placement(ball(), position=(0, 0, 0.1001), velocity=(0, 0, -SPEED)),),
                  Ground(), Material(0.5, 0.0, 0.25), step=1e-3)
    limits = load_limits()
    with Simulation(scene, accuracy='exact', engine='rigid') as simulation:
        simulation.record_impacts(limits)
        log, rows = PulseLog(PulseLaw(scene, limits), 60, scene.step), [simulation.state.rows[0]]
        for _ in range(60):
            rows.append(simulation.advance().rows[0])
            log.add(simulation.impacts)
    pulse = next(each for each in log.pulses if each)
    assert pulse.half_period == pytest.approx(HALF_PERIOD, rel=1e-6)
    assert pulse.restitution == pytest.approx(0.25, abs=1e-6)
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
        pulse = PulseLaw(scene, limits).pulse(simulation.impacts)
    assert hit.bone == 'left_foot'
    assert math.isnan(hit.stiffness)
    assert pulse.half_period == pytest.approx(math.pi * math.sqrt(hit.effective_mass / 60e3))


def test_what_has_no_region_has_no_pulse():
    scene = load_scene('drop')
    bare = dataclasses.replace(load_limits(), regions={})
    with Simulation(scene, engine='rigid') as simulation:
        simulation.record_impacts(load_limits())
        while not simulation.impacts:
            simulation.advance()
        assert PulseLaw(scene, bare).pulse(simulation.impacts) is None
    assert PulseLaw(scene, load_limits()).pulse(()) is None


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
    assert any(soft.pulses)
    assert not rigid.pulses
