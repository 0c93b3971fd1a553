"""Passive elastic torques: their curve, their energy, and a knee that swings between its ends."""
import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ragdoll_ros.files.doll import build_doll, doll_data
from ragdoll_ros.model import errors
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.passive import Passive, PassiveEnd
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.physics.simulation import Simulation

KNEE = {'lower': {'torque': 6.09, 'angle_deg': -7.45, 'width_deg': 1.688},
        'upper': {'torque': 11.03, 'angle_deg': 137.5, 'width_deg': 5.057}}
"""Of a knee, flexion positive, in the units of a doll's file."""


def published(flexion):
    """N m, flexion positive: k and theta of the knee (Anderson 1999) as published by Falisse et al.
    2019, extension positive.
    """
    q = -flexion
    return 6.09 * math.exp(33.94 * (q - 0.13)) - 11.03 * math.exp(-11.33 * (q + 2.4))


def doll(damping=0.0):
    """Two bars on a hinge through both centres of mass."""
    bones = (Bone('thigh', Box((0.1, 0.1, 0.4)), 4.0, (0, 0, 0)),
             Bone('shin', Box((0.1, 0.1, 0.3)), 3.0, (0, 0, 0)))
    joint = {'parent': 'thigh', 'child': 'shin', 'kind': 'hinge', 'anchor': [0, 0, 0],
             'axes': [[0, 1, 0]], 'limits_deg': [[-30, 170]], 'damping': damping, 'passive': [KNEE]}
    made, found = build_doll({**doll_data(Ragdoll('knee', bones, (
        Joint('thigh', 'shin', 'hinge', (0, 0, 0), ((0, 1, 0),)),))), 'joints': [joint]})
    assert not found, found
    return made


@pytest.fixture(scope='module')
def knee():
    return doll().joints[0].passive[0]


def test_the_torque_is_the_published_one_within_2_percent(knee):
    for degrees in range(-20, 160):
        expected = published(math.radians(degrees))
        assert knee.torque(math.radians(degrees)) == pytest.approx(expected, rel=0.02, abs=1e-3)


def test_the_energy_is_the_integral_of_the_torque(knee):
    for start, end in ((-0.3, 0.5), (0.5, 2.7), (-0.3, 2.7)):
        work, _ = quad(knee.torque, start, end, epsabs=1e-10, limit=200)
        assert knee.energy(start) - knee.energy(end) == pytest.approx(work, abs=1e-8)


def test_it_is_written_to_a_file_and_read_again():
    made = doll(0.1)
    again, found = build_doll(doll_data(made))
    assert not found and again.joints == made.joints


@pytest.mark.parametrize(('change', 'path'), [
    ({'torque': -1}, 'joints[0].passive[0].upper.torque'),
    ({'width_deg': 0}, 'joints[0].passive[0].upper.width_deg')])
def test_wrong_numbers_are_refused_with_their_place(change, path):
    data = doll_data(doll())
    data['joints'][0]['passive'][0]['upper'].update(change)
    _, found = build_doll(data)
    assert [error.path for error in found] == [path]
    with pytest.raises(errors.WrongForm, match='passive'):
        dataclasses.replace(doll().joints[0], passive=(None, None))


def swing(speed, damping=0.0):
    """A simulation of the bars in the air, whose knee begins at 1 rad with ``speed`` rad/s."""
    scene = Scene('knee', (Placement(doll(damping)),), gravity=(0, 0, 0))
    simulation = Simulation(scene, engine='rigid')
    start = simulation.coordinates
    q, v = start.q.copy(), start.v.copy()
    q[7], v[6] = 1.0, speed
    simulation.place(GeneralizedState(q, v))
    return simulation


def reference(simulation, speed, times, damping=0.0):
    """Angles of the knee by another integrator: both bars turn about the same axis."""
    ease = sum(1 / bone.inertia[1] for bone in simulation.scene.bones)
    torque = simulation.scene.dolls[0].doll.joints[0].passive[0].torque
    return solve_ivp(lambda t, y: (y[1], ease * (torque(y[0]) - damping * y[1])),
                     (0, times[-1]), (1.0, speed), 'Radau', times, rtol=1e-11, atol=1e-12).y[0]


@pytest.mark.parametrize('damping', [0.0, 0.1])
def test_a_knee_swings_into_its_ends_as_by_another_integrator(damping):
    speed = -12.0
    with swing(speed, damping) as simulation:
        angles = [simulation.joint_angles[0]]
        for _ in range(60):
            simulation.advance()
            angles.append(simulation.joint_angles[0])
        expected = reference(simulation, speed, np.arange(61) * simulation.step, damping)
    assert expected.min() < math.radians(-7.5), 'into its end'
    assert np.abs(np.array(angles) - expected).max() < 1e-6


def test_steps_in_contact_have_the_torques_too():
    """A joint spring without stiffness keeps the doll from flight: steps of second order."""
    with swing(-12.0) as simulation:
        simulation.accuracy = 'exact'
        simulation.hold('shin', 0.0)
        angles, start = [simulation.joint_angles[0]], simulation.kinetic_energy
        for _ in range(30):
            simulation.advance()
            angles.append(simulation.joint_angles[0])
        expected = reference(simulation, -12.0, np.arange(31) * simulation.step)
        # In 0.5 ms the knee turns by a fifth of the width of its lower end: 0.06 % of the energy.
        assert np.abs(np.array(angles) - expected).max() < 2e-3
        assert -1e-3 * start < simulation.energy_excess < 1e-9 * start


@pytest.mark.parametrize('accuracy', ['draft', 'normal'])
def test_long_steps_in_contact_make_no_energy(accuracy):
    """Steps of 4 and 2.5 ms, in which the knee turns by one or two widths, lose some."""
    with swing(-12.0) as simulation:
        simulation.accuracy = accuracy
        simulation.hold('shin', 0.0)
        start = simulation.kinetic_energy
        for _ in range(30):
            simulation.advance()
            assert -0.05 * start < simulation.energy_excess < 1e-9 * start


def test_the_energy_account_closes_over_many_swings():
    with swing(-20.0) as simulation:
        start, turns, rate = simulation.kinetic_energy, 0, -20.0
        while turns < 1000:
            simulation.advance()
            if simulation.joint_rates[0] * rate < 0:
                turns, rate = turns + 1, simulation.joint_rates[0]
            assert simulation.time < 300e9
        assert abs(simulation.energy_excess) < 1e-6 * start


def test_other_engines_refuse_them():
    pytest.importorskip('mujoco')
    with pytest.raises(errors.WrongForm, match='passive'):
        Simulation(Scene('knee', (Placement(doll()),)), engine='mujoco')


def test_an_end_is_finite():
    with pytest.raises(errors.NotFinite):
        PassiveEnd(1.0, math.inf, 0.1)
    end = PassiveEnd(1.0, 0.0, 0.01)
    assert math.isfinite(Passive(end, end).torque(-100.0))
