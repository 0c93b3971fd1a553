"""A sensor on soft tissue: its samples against the closed forms of a damped oscillator."""
import math

import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.physics.sensors.imu import ImuMount, imu_samples, tick_samples
from ragdoll_ros.physics.sensors.response import ImuResponse, ResponseFilter
from ragdoll_ros.physics.simulation import Simulation

W, DAMPING = 2 * math.pi * 25, 0.3
SOFT = ImuResponse(25.0, DAMPING)
DECAY, TURN = DAMPING * W, W * math.sqrt(1 - DAMPING ** 2)
MOUNT = ImuMount('bone')
STILL = (0.0, 0.0, 0.0)
FINE = 2e-7
"""s: a velocity that is linear within so short a sample differs from a half-sine's, or from an
impulse's, by less than 1e-9 of the response: dt^2 / 12 W pi / 0.01 = 2e-10, (W dt)^2 / 24 = 4e-11.
"""


def rows_of(velocities):
    """States of a bone that does not turn and has these velocities (t,) along x."""
    rows = np.zeros((len(velocities), 13))
    rows[:, 6], rows[:, 7] = 1, velocities
    return rows


def read(velocities, step, response=SOFT, gravity=STILL):
    """Samples along x of a sensor on that bone."""
    return imu_samples(rows_of(velocities), MOUNT, step, gravity, ResponseFilter(response))[:, 0]


def means(velocities, step):
    """Mean accelerations between velocities ``step`` s apart."""
    return np.diff(velocities) / step


def step_rate(t):
    """Rate of the deflection from rest under a specific force of 1 m/s^2 from t = 0 on."""
    return np.where(t > 0, -np.exp(-DECAY * t) * np.sin(TURN * t) / TURN, 0)


def sine_rate(t, w):
    """The same under sin(w t): the forced vibration, and a free one that starts it from rest."""
    amplitude = -1 / complex(W ** 2 - w ** 2, 2 * DAMPING * W * w)
    u, rate = amplitude.imag, (1j * w * amplitude).imag
    t = np.maximum(t, 0)
    free = np.exp(-DECAY * t) * (rate * np.cos(TURN * t) - (W ** 2 * u + DECAY * rate) / TURN
                                 * np.sin(TURN * t))
    return (1j * w * amplitude * np.exp(1j * w * t)).imag - free


def test_a_step_on_the_bone():
    step = 1e-3
    t = np.arange(-1, 400) * step
    bone = 30 * np.maximum(t, 0)
    expected = means(bone + 30 * step_rate(t), step)
    assert read(bone, step) == pytest.approx(expected, abs=30e-9)
    assert expected.max() > 1.4 * 30, 'it swings'


def test_a_half_sine_on_the_bone():
    length = 0.01
    w = math.pi / length
    t = np.arange(-1, round(0.03 / FINE)) * FINE
    inside = np.clip(t, 0, length)
    bone = 100 * (1 - np.cos(w * inside)) / w
    expected = means(bone + 100 * (sine_rate(t, w) + sine_rate(t - length, w)), FINE)
    assert np.abs(read(bone, FINE) - expected).max() < 100e-9


def test_an_impulse_on_the_bone():
    t = np.arange(-1.5, round(0.03 / FINE)) * FINE
    bone = 2.0 * (t > 0)
    rate = np.where(t > 0, np.exp(-DECAY * t) * (DECAY / TURN * np.sin(TURN * t)
                                                 - np.cos(TURN * t)), 0)
    expected = means(bone + 2 * rate, FINE)
    # The sample of the impulse itself has half of it: where it lies in it is not known.
    assert np.abs((read(bone, FINE) - expected)[2:]).max() < 1e-9 * expected[2:].max()
    # The damper passes 2 z w J on at once.
    assert expected[2] == pytest.approx(2 * 2 * DECAY, rel=1e-3)


def test_an_impact_acts_evenly_over_the_sample_that_contains_it():
    for rate, within in ((1000, 0.001), (250, 0.02)):
        step = 1 / rate
        t = np.arange(-1, 0.2 * rate) * step
        bone = 2.0 * (t > 0)
        steps = (step_rate(t) - step_rate(t - step)) * 2 / step
        assert read(bone, step) == pytest.approx(means(bone + steps, step), abs=1e-7)
        # An impulse in the middle would take the sensor to this speed.
        after = np.arange(1, 0.2 * rate) * step
        late = after - step / 2
        speed = 2 + 2 * np.exp(-DECAY * late) * (DECAY / TURN * np.sin(TURN * late)
                                                 - np.cos(TURN * late))
        gone = np.cumsum(read(bone, step))[1:] * step
        assert np.abs(gone[:len(speed)] - speed).max() < within * 2


def test_at_rest_it_reads_1_g_and_in_free_fall_nothing():
    response, gravity = ImuResponse(25.0, DAMPING, 50.0), (-9.8, 0.0, 0.0)
    assert read(np.zeros(500), 0.01, response, gravity) == pytest.approx(9.8, abs=1e-12)
    falling = -9.8 * 0.01 * np.arange(500)
    assert np.abs(read(falling, 0.01, response, gravity)).max() < 1e-10


def test_the_tissue_does_not_turn_with_the_bone():
    """On a bone that spins steadily it is forced at the rate of the spin, in the world."""
    spin, step, arm = 8.0, 1e-3, 0.3
    t = np.arange(1001) * step
    rows = np.zeros((len(t), 13))
    rows[:, 5], rows[:, 6], rows[:, 12] = np.sin(spin * t / 2), np.cos(spin * t / 2), spin
    samples = imu_samples(rows, ImuMount('bone', (arm, 0, 0)), step, STILL, ResponseFilter(SOFT))
    passed = complex(W ** 2, 2 * DAMPING * W * spin) / complex(W ** 2 - spin ** 2,
                                                              2 * DAMPING * W * spin)
    expected = -spin ** 2 * arm * passed
    # The mean of a force that turns within a sample is less by (spin dt)^2 / 12 = 5e-6 of it.
    assert samples[-1, :2] == pytest.approx([expected.real, expected.imag],
                                            abs=1e-5 * abs(expected))
    assert samples[:, 3:] == pytest.approx(np.tile([0, 0, spin], (1000, 1)), abs=1e-9)


def test_the_low_pass_is_butterworths_of_order_2():
    chip, rate = ImuResponse(bandwidth=40.0), 1e-3
    w = 2 * math.pi * 40 / math.sqrt(2)
    t = np.arange(-1, 200) * rate
    expected = 5 * (1 - np.exp(-w * t) * (np.cos(w * t) + np.sin(w * t)))[1:]
    assert read(5 * np.maximum(t, 0), rate, chip) == pytest.approx(expected, abs=5e-9)
    for frequency, gain in ((4.0, 1.0), (40.0, math.sqrt(0.5)), (400.0, 0.01)):
        t = np.arange(round(0.6 / 2e-5)) * 2e-5
        bone = -np.cos(2 * math.pi * frequency * t) / (2 * math.pi * frequency)
        passed = read(bone, 2e-5, chip)[len(t) // 2:].max()
        assert passed == pytest.approx(gain, rel=1e-3)


def test_of_the_rate_it_passes_the_bandwidth_alone():
    rows = rows_of(np.zeros(300))
    rows[:, 5:7] = np.transpose([np.sin(np.arange(300) * 0.005), np.cos(np.arange(300) * 0.005)])
    soft, slow = (imu_samples(rows, MOUNT, 1e-3, STILL, ResponseFilter(response))
                  for response in (SOFT, ImuResponse(bandwidth=20.0)))
    assert (soft == imu_samples(rows, MOUNT, 1e-3, STILL)).all()
    assert slow[:, 5] == pytest.approx(10.0, abs=1e-9), 'steady: it passes'


def test_the_state_is_carried_from_tick_to_tick_and_rigid_changes_no_bit():
    """A woman who falls: one call for each tick, or one for all."""
    scene = load_scene('woman_faints')
    mount, bone = ImuMount('pelvis', (-0.1, 0, 0.05)), scene.bone_index('pelvis')
    response = ImuResponse(25.0, DAMPING, 100.0)
    rows, by_tick, rigid, kept = [], [], [], ResponseFilter(response)
    with Simulation(scene) as simulation:
        simulation.samples_per_tick = 4
        rows.append(simulation.state.rows[bone])
        for _ in range(60):
            simulation.advance()
            given = simulation.substates, bone, mount, simulation.step, scene.gravity
            by_tick.append(tick_samples(*given, kept))
            rigid.append((tick_samples(*given), tick_samples(*given, ResponseFilter())))
            rows += [state.rows[bone] for state in simulation.substates[1:]]
    whole = imu_samples(np.array(rows), mount, simulation.step / 4, scene.gravity,
                        ResponseFilter(response))
    assert (np.concatenate(by_tick) == whole).all()
    assert all((one == other).all() for one, other in rigid)
    assert np.abs(whole - np.concatenate([one for one, _ in rigid])).max() > 1, 'it does matter'


@pytest.mark.parametrize('wrong', [{'mount_frequency': -1.0}, {'mount_damping': math.nan},
                                   {'bandwidth': 1e4}])
def test_wrong_numbers_are_refused(wrong):
    with pytest.raises(errors.OutOfRange, match=next(iter(wrong))):
        ImuResponse(**wrong)
