"""Uncertainties of impacts cover the distance to closed forms, and are NaN where none is known."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from loose_bodies import WEIGHTLESS, G, ball, box

from ragdoll_ros import (
    Box,
    Follow,
    Ground,
    Placement,
    Scene,
    StaticBody,
    impacts_with_uncertainty,
    load_limits,
    load_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.biomechanical_limits import BiomechanicalLimits, BodyRegion
from ragdoll_ros.model.errors import OutOfRange
from ragdoll_ros.model.scene import Material
from ragdoll_ros.physics.accuracy import ACCURACIES, Accuracy
from ragdoll_ros.physics.impact_uncertainty import (
    FACTOR,
    WINDOW,
    halved,
    partners_of,
    uncertainty_of,
)
from ragdoll_ros.physics.sensors.impacts import Impact

pytest.importorskip('numba')

HARD = BiomechanicalLimits('of this test', {
    'hit': BodyRegion(150, 300.0, 40e3, ('ball', 'bar'), head=True)})
DEAD = Material(restitution=0)


@pytest.mark.parametrize('height', [0.02, 0.5, 2.0])
def test_what_flies_is_known_to_rounding(height):
    """A ball that falls on a plate: no step is in its way."""
    plate = StaticBody('plate', Box((0.5, 0.5, 0.02)), (0, 0, -0.01))
    scene = Scene('plate', (Placement(ball(mass=2.0), 'ball', (0, 0, 0.1 + height)),), None, DEAD,
                  bodies=(plate,))
    found = impacts_with_uncertainty(scene, 0.8, HARD)
    (hit,) = found.impacts
    speed, mass, unsure = math.sqrt(2 * G * height), 2.0, hit.uncertainty
    assert abs(hit.impact.time * 1e-9 - speed / G) <= unsure.time < 1e-5
    assert abs(hit.impact.speed - speed) <= unsure.speed < 1e-5 * speed
    assert abs(hit.impact.impulse - mass * speed) <= unsure.impulse < 1e-5 * mass * speed
    peak = speed * math.sqrt(mass * 40e3)
    assert abs(hit.impact.peak_force - peak) <= unsure.peak_force < 1e-5 * peak
    assert abs(hit.impact.ratio - peak / 300) <= unsure.ratio < 1e-5 * peak / 300
    assert found.apart == math.inf and found.dropped == 0


def bar_that_tips(start, post):
    """A bar of 1 m that tips over its front lower edge, from rest at the angle ``start``, rad from
    upright, on to a post whose edge is at ``post``, x and z: the scene, and time, speed and
    effective mass of the impact.
    """
    length, thick, mass = 1.0, 0.06, 3.0
    arm = np.array((-thick / 2, 0, length / 2))
    turn = rotation.from_axis_angle((0.0, 1.0, 0.0), start)
    bar = Placement(box((thick, 0.2, length), mass, 'bar'), 'bar',
                    tuple(rotation.rotate(turn, arm)), tuple(turn))
    x, z = post
    scene = Scene('tips', (bar,), Ground(), DEAD, bodies=(
        StaticBody('post', Box((0.1, 0.4, z)), (x + 0.05, 0, z / 2)),))

    def rate(angle):
        """rad/s: the energy of its fall is that of its turn about the edge."""
        high = (math.cos(angle) * length + math.sin(angle) * thick) / 2
        fallen = (math.cos(start) * length + math.sin(start) * thick) / 2 - high
        return math.sqrt(2 * mass * G * fallen / (mass * (length ** 2 + thick ** 2) / 3))

    end, reach = math.atan2(x, z), math.hypot(x, z)
    # With angle = start + (end - start) u^2 nothing is infinite at the start: midpoint rule in u.
    u = (np.arange(20000) + 0.5) / 20000
    time = sum(2 * (end - start) * w / rate(start + (end - start) * w * w) for w in u) / len(u)
    own = mass * (length ** 2 + thick ** 2) / 12
    return scene, time, rate(end) * reach, 1 / (1 / mass + (reach - length / 2) ** 2 / own)


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
@pytest.mark.parametrize('start', [0.1, 0.3, 0.5])
def test_the_error_of_steps_is_within_the_uncertainty(start, accuracy):
    """A bar turns about its edge on the ground, in steps of order 2, until it meets a post."""
    scene, time, speed, mass = bar_that_tips(start, (0.5, 0.3))
    found = impacts_with_uncertainty(scene, time + 0.05, HARD, accuracy=accuracy)
    hit = next(one for one in found.impacts if one.impact.against == 'post')
    unsure = hit.uncertainty
    for true, seen, width in ((time, hit.impact.time * 1e-9, unsure.time),
                              (speed, hit.impact.speed, unsure.speed),
                              (mass, hit.impact.effective_mass, unsure.effective_mass)):
        assert abs(seen - true) <= width < 0.01 * true


def test_what_is_done_to_it_is_done_in_both_runs():
    """A robot at 1.5 m/s into a ball of 3 kg: the speed is that of the robot."""
    robot = dataclasses.replace(Placement(box((0.2,) * 3, 1.0, 'robot'), 'robot', (-0.3, 0, 0)),
                                follow=Follow())
    scene = Scene('bump', (robot, Placement(ball(mass=3.0), 'person')), None, DEAD,
                  gravity=WEIGHTLESS)
    found = impacts_with_uncertainty(scene, 0.3, HARD, lambda simulation: simulation.drive_body(
        'robot', twist=(1.5, 0, 0, 0, 0, 0)))
    robots, persons = found.impacts
    assert (robots.impact.doll, persons.impact.doll) == ('robot', 'person')
    assert abs(persons.impact.speed - 1.5) <= persons.uncertainty.speed < 1e-5
    assert persons.finer.speed == pytest.approx(1.5, rel=1e-6)
    assert math.isnan(robots.uncertainty.peak_force), 'it has no region'
    assert robots.uncertainty.speed == persons.uncertainty.speed


def test_a_fall_that_has_become_another_one_has_no_uncertainty():
    found = impacts_with_uncertainty(load_scene('man_faints'), 1.3, load_limits())
    assert 0 < found.apart < 1.3
    before = [one for one in found.impacts if one.impact.time < found.apart * 1e9]
    later = [one for one in found.impacts if one.impact.time >= found.apart * 1e9]
    assert any(one.finer for one in before) and later
    for one in found.impacts:
        assert one.finer is not None or math.isnan(one.uncertainty.speed)
        assert not one.uncertainty.speed >= one.impact.speed
    assert all(one.finer is None and math.isnan(one.uncertainty.time) for one in later)


def impact(milliseconds, bone='head', against='ground', speed=1.0):
    return Impact(round(1e6 * milliseconds), 'man', bone, 'skull', against, (0.0, 0.0, 0.0),
                  (0.0, 0.0, 1.0), speed, 4.0, 4.0 * speed, 0.25, 150e3, 130.0)


def test_partners_are_those_of_the_same_bone_and_the_most_similar():
    own = [impact(1), impact(5), impact(6, 'chest'), impact(30), impact(50, speed=3.0)]
    others = [impact(1.2), impact(5, against='wall'), impact(6.1, 'chest'),
              impact(31 + 1e3 * WINDOW), impact(50, speed=0.9)]
    assert partners_of(own, others) == [others[0], None, others[2], None, None]
    assert partners_of(own, []) == [None] * len(own) and partners_of([], own) == []


def test_a_small_impact_is_no_partner_of_the_blow_before_it():
    """Which is farther from its own partner in time."""
    own = [impact(41.6, speed=2.242), impact(42.3, speed=0.09)]
    others = [impact(41.3, speed=2.241), impact(41.5, speed=0.08)]
    assert partners_of(own, others) == others


def test_one_of_two_has_no_partner():
    """What is one impact in one run and two in the other; the nearer one is the partner."""
    one, two = impact(10), (impact(9), impact(10.2))
    assert partners_of([one], two) == [two[1]]
    assert partners_of(two, [one]) == [None, one]


def test_the_uncertainty_is_the_factor_times_the_difference():
    hit = impact(10, speed=2.0)
    unsure = uncertainty_of(hit, impact(10.5, speed=2.1))
    # Beside 1e-6 of each, and 1e-6 m over the speed.
    assert unsure.speed == pytest.approx(FACTOR * 0.1, rel=1e-4)
    assert unsure.impulse == pytest.approx(FACTOR * 0.4, rel=1e-4)
    assert unsure.time == pytest.approx(FACTOR * 0.5e-3, rel=1e-3)
    assert unsure.peak_force == pytest.approx(FACTOR * 0.1 * math.sqrt(4 * 150e3), rel=1e-4)
    assert unsure.ratio == pytest.approx(unsure.peak_force / 130, rel=1e-9)
    assert unsure.duration == pytest.approx(0, abs=1e-6)


def test_a_difference_is_no_less_than_that_of_the_motions():
    """Both runs have the same figures by chance, 20 um and 0.01 m/s apart."""
    hit = impact(10, speed=2.0)
    unsure = uncertainty_of(hit, hit, place=2e-5, velocity=0.01)
    assert unsure.time == pytest.approx(FACTOR * 1e-5, rel=0.01)
    assert unsure.speed == pytest.approx(FACTOR * 0.01, rel=1e-3)
    assert unsure.effective_mass == pytest.approx(FACTOR * 4.0 * 2e-4, rel=0.01)
    assert unsure.impulse == pytest.approx(FACTOR * 8.0 * (0.005 + 2e-4), rel=1e-3)
    assert unsure.ratio == pytest.approx(FACTOR * hit.ratio * (0.005 + 1e-4), rel=1e-3)


def test_what_may_not_happen_and_what_has_no_partner_is_unknown():
    hit = impact(10, speed=0.1)
    for finer, velocity in ((None, 0.0), (impact(10, speed=0.11), 0.02),
                            (impact(10, speed=0.12), 0.0)):
        unsure = uncertainty_of(hit, finer, velocity=velocity)
        assert all(map(math.isnan, dataclasses.astuple(unsure)))


@pytest.mark.parametrize('accuracy', ACCURACIES.values())
@pytest.mark.parametrize('tick', [0.0005, 0.001, 0.01, 0.05])
def test_half_the_step_is_twice_as_many_steps_in_a_tick(accuracy, tick):
    """The engine divides a tick into equal steps that are not longer than that of its accuracy."""
    def steps(of: Accuracy) -> int:
        return math.ceil(tick / of.step - 1e-9)

    finer = halved(accuracy, tick)
    assert steps(finer) == 2 * steps(accuracy)
    assert finer.flight_error <= accuracy.flight_error


@pytest.mark.parametrize('duration', [0.0, -1.0, math.nan, math.inf])
def test_a_bad_duration_is_named(duration):
    with pytest.raises((OutOfRange, ValueError), match='duration'):
        impacts_with_uncertainty(load_scene('drop'), duration, HARD)
