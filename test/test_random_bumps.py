"""A robot bumps into people who stand, sit, lie, or stand at a wall: no energy from nothing,
nothing passed, and figures of blows within their uncertainty.
"""
from __future__ import annotations

import dataclasses
import math
from collections import Counter

import numpy as np
import pytest
from loose_bodies import box
from random_bumps import (
    COVERED,
    DEEPEST,
    EXCESS,
    FIGURES,
    SITUATIONS,
    SPEEDS,
    Found,
    blows,
    bump,
    covered,
    deepest,
    is_within,
    run,
)

pytest.importorskip('numba')

from ragdoll_ros import Ground, Placement, Scene, Simulation, State
from ragdoll_ros.physics.impact_uncertainty import (
    ImpactUncertainty,
    UncertainImpact,
)
from ragdoll_ros.physics.sensors.impacts import Impact

BUMPS, CHUNK = 1000, 50


@pytest.mark.parametrize('number', range(len(SITUATIONS)))
def test_a_bump_of_each_situation_is_good(number):
    found = run(number)
    assert not found.is_bad, found


@pytest.mark.slow
@pytest.mark.parametrize('first', range(0, BUMPS, CHUNK))
def test_none_of_a_thousand_bumps_is_bad(first):
    """Energy to EXCESS of that at work, depth to DEEPEST."""
    found = {number: run(number) for number in range(first, first + CHUNK)}
    assert {number: one for number, one in found.items() if one.is_bad} == {}
    assert not any(one.overlaps for one in found.values())
    assert sum(one.speed > 0 for one in found.values()) > CHUNK / 2, 'most of them are blows'


@pytest.mark.slow
def test_figures_of_blows_are_within_their_uncertainty():
    """Of those with a sixteenth of the step, in COVERED of the cases."""
    count: Counter = Counter()
    for number in range(100):
        count += covered(number)
    assert count['stated'] > count['blows'] / 3
    assert sum(count[name] for name in FIGURES) >= COVERED * len(FIGURES) * count['stated']


def test_the_bumps_are_of_all_kinds():
    made = [bump(number) for number in range(80)]
    robots = [one.scene.dolls[1] for one in made]
    assert {one.situation for one in made} == set(SITUATIONS)
    assert {len(robot.doll.root.shape.parts) for robot in robots} == {1, 3}
    assert {one.is_held for one in made} == {True, False}
    assert all(SPEEDS[0] <= one.twist[0] <= SPEEDS[1] for one in made)
    for one, robot in zip(made, robots, strict=True):
        # What follows exactly squeezes nobody against what never moves.
        assert not (robot.is_kinematic and one.scene.bodies)
        assert one.situation != 'wall' or one.scene.bodies


def test_nobody_begins_in_anything():
    for number in range(8):
        with Simulation(bump(number).scene, engine='rigid') as simulation:
            assert simulation.initial_overlaps == ()


def test_depths_are_those_of_boxes():
    """A box 7 mm deep in another one, which is 3 mm deep in the ground."""
    assert 3e-3 < DEEPEST < 7e-3 and EXCESS <= 1e-3
    cube = box((0.2,) * 3, 1.0)
    low = Placement(cube, 'low', (0, 0, 0.097))
    for beside, depth in ((0.193, 7e-3), (0.3, 3e-3)):
        scene = Scene('boxes', (low, Placement(cube, 'other', (beside, 0, 0.15))), Ground())
        rows = np.zeros((2, 13))
        rows[:, 6] = 1.0
        rows[:, :3] = [placement.position for placement in scene.dolls]
        assert deepest(scene, State.of(rows))[0] == pytest.approx(depth, abs=1e-12)


def test_what_is_bad():
    good = Found(0.9 * EXCESS, 0.9 * DEEPEST, 'head in robot', False, 1.0)
    assert not good.is_bad
    for change in ({'excess': 1.1 * EXCESS}, {'excess': math.inf}, {'excess': math.nan},
                   {'depth': 1.1 * DEEPEST}):
        assert dataclasses.replace(good, **change).is_bad
    assert not dataclasses.replace(good, overlaps=True, depth=1.0).is_bad, 'it is none'


def hit(milliseconds, speed, bone='person/head', against='robot/robot'):
    """A pulse of 16 ms."""
    return Impact(round(1e6 * milliseconds), 'person', bone, 'skull', against, (0.0,) * 3,
                  (1.0, 0.0, 0.0), speed, 4.0, 4.0 * speed, 0.25, 150e3, 130.0)


def test_what_follows_within_the_pulse_is_the_same_blow():
    own = [hit(10, 2.0), hit(20, 0.5), hit(20, 0.5, 'person/chest'), hit(30, 1.0), hit(31, 3.0),
           hit(10, 9.0, against='wall')]
    assert blows(own) == [own[0], own[2], own[4]]


def test_what_is_within():
    one = UncertainImpact(hit(10, 1.0), None, ImpactUncertainty(time=1e-3, speed=0.1))
    assert is_within(one, hit(10.9, 1.09), 'time') and is_within(one, hit(10.9, 1.09), 'speed')
    assert not is_within(one, hit(11.1, 1.0), 'time')
    assert not is_within(one, hit(10, 0.89), 'speed')
    assert math.isnan(one.uncertainty.impulse)
    assert not is_within(one, hit(10, 1.0), 'impulse'), 'it has none'
