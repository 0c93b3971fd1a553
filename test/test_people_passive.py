"""Passive torques of a person's joints: the published curves, in this package's signs."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ragdoll_ros.falls import generate, load_recipe
from ragdoll_ros.falls.recipe import recipe_of
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.model.anthropometry import MEN
from ragdoll_ros.people.command import main
from ragdoll_ros.people.joints import MEAN_MASS
from ragdoll_ros.people.passive import GUARD_TORQUE, end_widths
from ragdoll_ros.people.person import person
from ragdoll_ros.physics.simulation import Simulation

SOURCE = {'hip_flexion': ((-2.44, 5.05, 1.51, -21.88), (-0.6981, 1.81)),
          'hip_adduction': ((-0.03, 14.94, 0.03, -14.94), (-0.5, 0.5)),
          'hip_rotation': ((-0.03, 14.94, 0.03, -14.94), (-0.92, 0.92)),
          'knee_angle': ((-6.09, 33.94, 11.03, -11.33), (-2.4, 0.13)),
          'ankle_angle': ((-2.03, 38.11, 0.18, -12.12), (-0.74, 0.52)),
          'subtalar_angle': ((-60.21, 16.32, 60.21, -16.32), (-0.65, 0.65)),
          'lumbar_extension': ((-0.35, 30.72, 0.25, -20.36), (-math.pi / 6, 0.17)),
          'lumbar_bending': ((-0.25, 20.36, 0.25, -20.36), (-math.pi / 9, math.pi / 9)),
          'lumbar_rotation': ((-0.25, 20.36, 0.25, -20.36), (-math.pi / 9, math.pi / 9))}
"""k and theta as published with Falisse et al. 2019, in OpenSim's signs: flexion of hip, extension
of knee and trunk, dorsiflexion of the ankle positive. Torque: k1 exp(k2 (q - theta2)) +
k3 exp(k4 (q - theta1)), N m."""

ANGLES = {'l_p_hip': ('hip_flexion', -1, 1), 'r_p_hip': ('hip_flexion', -1, 1),
          'l_r_hip': ('hip_adduction', 1, 1), 'r_y_hip': ('hip_rotation', 1, 1),
          'l_knee': ('knee_angle', -1, 1), 'r_knee': ('knee_angle', -1, 1),
          'r_p_ankle': ('ankle_angle', -1, 1), 'l_r_ankle': ('subtalar_angle', 1, 1),
          'waist': ('lumbar_extension', -1, 2), 'p_chest': ('lumbar_extension', -1, 2),
          'r_waist': ('lumbar_bending', 1, 2), 'y_chest': ('lumbar_rotation', 1, 2)}
"""Coordinate of the source, its sign here, and how many joints here share it in series."""

WITHOUT = {'p_head', 'r_head', 'y_head', 'l_elbow', 'r_p_shoulder', 'l_y_wrist'}


def published(coordinate, q):
    """N m at rad, in the source's signs."""
    (k1, k2, k3, k4), (theta1, theta2) = SOURCE[coordinate]
    return k1 * math.exp(k2 * (q - theta2)) + k3 * math.exp(k4 * (q - theta1))


def angles(doll):
    """Limits and passive torque of each angle by its name."""
    return {name: (joint.limits[k], joint.passive[k] if joint.passive else None)
            for joint in doll.joints for k, name in enumerate(joint.angle_names)}


@pytest.fixture(scope='module')
def man():
    """Of the mass and height of the table's."""
    return person(MEN.height, MEAN_MASS, 'male', passive=True)


@pytest.mark.parametrize('name', ANGLES)
def test_torques_are_those_of_the_source(man, name):
    """Rounding of angles to 1e-9 degrees is below 1e-8 of a torque."""
    coordinate, sign, joints = ANGLES[name]
    (lower, upper), passive = angles(man)[name]
    for q in np.linspace(lower, upper, 57):
        expected = sign * published(coordinate, sign * joints * q)
        assert passive.torque(q) == pytest.approx(expected, rel=1e-7, abs=1e-9)


def test_hard_limits_guard_where_the_torque_is_beyond_all_measure(man):
    found = angles(man)
    for name, (limits, passive) in found.items():
        if passive is not None:
            assert [abs(passive.torque(each)) for each in limits] == pytest.approx(
                [GUARD_TORQUE, GUARD_TORQUE], rel=1e-6), name
    rigid = angles(person(MEN.height, MEAN_MASS, 'male'))
    assert all(found[name] == (rigid[name][0], None) for name in WITHOUT)


def test_torques_scale_with_mass_and_height_squared(man):
    """As the damping of the same source, and so that ranges stay."""
    other = angles(person(1.5, 50, 'female', passive=True))
    scale = 50 / MEAN_MASS * (1.5 / MEN.height) ** 2
    for name, (limits, passive) in angles(man).items():
        assert other[name][0] == limits
        if passive is not None:
            assert other[name][1].torque(0.3) == pytest.approx(scale * passive.torque(0.3))


def test_the_command_writes_them_and_says_what_is_left_out(tmp_path, capsys):
    path = tmp_path / 'soft.yaml'
    assert main(['--sex', 'female', '--passive', '-o', str(path)]) == 0
    said = capsys.readouterr().out
    assert 'passive torques: r_waist, waist' in said
    assert 'none known, hard limits: r_head, p_head, y_head, l_p_shoulder' in said
    assert '--passive' in path.read_text()
    assert {name for name, (_, passive) in angles(load_doll(path)).items() if passive} == {
        name for name, (_, passive) in angles(person(1.7, 60, 'male', passive=True)).items()
        if passive}


def test_trunks_stop_as_those_of_relaxed_living_people():
    """Mean stiffness in successive quarters of the range of lateral bending, N m/degree, to the
    left and right (Gombatto, in table 3 of Watt et al. 2022; of the last quarter to the left
    alone): it grows e-fold in a quarter, to the 3 % in which an exponential fits four means with
    standard deviations of half their size.
    """
    measured = (0.245, 0.625, 1.725, 5.19)
    growth = np.polyfit(range(4), np.log(measured), 1)[0]
    widths = end_widths(person(1.7, 70, 'male'))
    side = (17.5, 17.5)
    for name, ends in (('r_waist', side), ('r_chest', side), ('waist', (12.5, 40))):
        assert np.degrees(widths[name]) == pytest.approx(np.array(ends) / 4 / growth, rel=0.03)
    assert end_widths(load_doll('doll')) == {}
    simulated = end_widths(person(1.7, 70, 'male', passive=True))
    assert simulated['r_waist'] == pytest.approx([1 / 20.36 / 2] * 2), 'of its own torques'
    assert simulated['l_r_hip'] == widths['l_r_hip']


def riener_edrich(joint, angle):
    """N m towards a smaller angle at degrees, the other joints of the leg at 0, in the signs of the
    package; Riener and Edrich 1999 have flexion of hip and knee, and plantarflexion, positive.
    """
    if joint == 'hip':
        return -(math.exp(1.4655 + 0.0750 * angle) - math.exp(1.3403 - 0.0305 * angle) + 8.072)
    if joint == 'knee':
        return (math.exp(1.800 - 0.0352 * angle) - math.exp(-3.971 + 0.0495 * angle) - 4.820
                + math.exp(2.220 - 0.150 * angle))
    return math.exp(2.1016 - 0.0843 * angle) - math.exp(-7.9763 + 0.1949 * angle) - 1.792


@pytest.mark.parametrize('joint', ['hip', 'knee', 'ankle'])
@pytest.mark.parametrize('end', [0, 1])
def test_legs_stop_as_those_of_relaxed_living_people(joint, end):
    """Far beyond an end one term of the published curve is left, whose slope over its value is the
    growth; 90 degrees beyond, others are less than 1 % of it.
    """
    width = math.degrees(end_widths(person(1.7, 70, 'male'))[
        'l_knee' if joint == 'knee' else f'l_p_{joint}'][end])
    at = (-1, 1)[end] * {'hip': 220, 'knee': 220, 'ankle': 140}[joint]
    slope = (riener_edrich(joint, at + 0.5) - riener_edrich(joint, at - 0.5)) / riener_edrich(
        joint, at)
    assert 1 / abs(slope) == pytest.approx(width, rel=0.02)


def test_a_person_with_them_falls_and_keeps_the_account():
    """From a height onto the feet, limp; nothing put energy in."""
    scene = load_scene('woman_faints')
    doll = person(1.62, 67, 'female', passive=True)
    scene = dataclasses.replace(scene, dolls=(dataclasses.replace(scene.dolls[0], doll=doll),))
    with Simulation(scene) as simulation:
        worst = -math.inf
        for _ in range(250):
            state = simulation.advance()
            worst = max(worst, simulation.energy_excess)
        assert np.isfinite(state.rows).all()
        # 67 kg that fall by 0.9 m: 590 J; the account closes to 1e-5 of that.
        assert worst < 6e-3
    with pytest.raises(errors.RagdollError, match='passive'):
        Simulation(scene, engine='bullet')


def test_people_of_a_recipe_have_them_on_request():
    data = load_recipe('faint').data
    for passive in (False, True):
        groups = [{**group, 'passive': passive} for group in data['who']['people']]
        recipe = recipe_of({**data, 'who': {'people': groups}, 'duration': 1.0})
        fall, = generate(recipe, range(1))
        joints = fall.scene.dolls[0].doll.joints
        assert not fall.failure and any(joint.passive for joint in joints) == passive
