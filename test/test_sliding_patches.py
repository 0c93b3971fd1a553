"""Faces and lines that slide and spin: friction as that of all their points, not of a few."""
import dataclasses
import functools
import math

import numpy as np
import planar_sliding
import pytest

pytest.importorskip('numba', reason='numba is not installed: there is no rigid engine')

from ragdoll_ros import Bone, Box, Capsule, Cylinder, Ground, Placement, Ragdoll, Scene, Simulation
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import Material
from ragdoll_ros.physics.accuracy import ACCURACIES, EXACT

MU, TICK, ROLLED = 0.3, 0.01, 0.5
LYING = rotation.from_axis_angle((0, 1, 0), math.pi / 2)
BODIES = {
    'disc': (Cylinder(0.2, 0.002), planar_sliding.disc(0.2, 0.002)),
    'square': (Box((0.4, 0.4, 0.002)), planar_sliding.box((0.4, 0.4, 0.002))),
    'board': (Box((0.6, 0.2, 0.002)), planar_sliding.box((0.6, 0.2, 0.002))),
    'drum': (Cylinder(0.2, 0.12), planar_sliding.disc(0.2, 0.12)),
    'crate': (Box((0.6, 0.3, 0.2)), planar_sliding.box((0.6, 0.3, 0.2))),
    'capsule': (Capsule(0.03, 0.4), planar_sliding.capsule(0.03, 0.4)),
}
RATES = {'slow spin': (1.0, 1.0), 'both': (1.0, 5.0), 'fast spin': (0.3, 8.0)}
"""Speed, m/s, and spin, rad/s: v / (w r) of some 5, 1 and 0.2."""

HEADINGS = (0.0, 0.5, 1.2)


@functools.cache
def truth(name, rates, heading):
    """A roller stops slipping across its axis long before it stops, which takes fine steps."""
    body, (speed, spin) = BODIES[name][1], RATES[rates]
    if body.rolls:
        return planar_sliding.slide(body, MU, speed, heading, spin, ROLLED, 1000)
    return planar_sliding.slide(body, MU, speed, heading, spin, 2.0)


def scene_of(name, rates, heading):
    shape, reference = BODIES[name]
    speed, spin = RATES[rates]
    doll = Ragdoll('body', (Bone('body', shape, 1.0, (0, 0, 0)),))
    turn = LYING if reference.rolls else rotation.IDENTITY
    place = Placement(doll, position=(0, 0, reference.height), orientation=tuple(turn),
                      velocity=(speed * math.cos(heading), speed * math.sin(heading), 0),
                      spin=(0, 0, spin))
    return Scene('slides', (place,), Ground(), Material(MU, 0.0, 0.0))


def simulated(scene, accuracy, duration):
    """Places (k, 2), angles (k,) and speeds (k,) at ticks."""
    with Simulation(scene, accuracy=accuracy) as simulation:
        states = [simulation.state, *(simulation.advance() for _ in range(round(duration / TICK)))]
    axes = np.array([rotation.rotate(state.orientations[0], np.array((0, 0, 1.0)))
                     if abs(scene.dolls[0].orientation[1]) > 0.1 else
                     rotation.rotate(state.orientations[0], np.array((1.0, 0, 0)))
                     for state in states])
    angles = np.unwrap(np.arctan2(axes[:, 1], axes[:, 0]))
    return (np.array([state.positions[0, :2] for state in states]), angles,
            np.array([np.linalg.norm(state.linear_velocities[0]) + 0.2 * np.linalg.norm(
                state.angular_velocities[0]) for state in states]))


def errors(name, rates, heading, accuracy):
    """Of the way, its component aside, the angle and the duration, each over its truth."""
    times, states = truth(name, rates, heading)
    rolls = BODIES[name][1].rolls
    end = ROLLED if rolls else math.ceil(times[-1] / TICK) * TICK + 5 * TICK
    places, angles, speeds = simulated(scene_of(name, rates, heading), accuracy, end)
    ticks = np.arange(len(places)) * TICK
    x, y, turned = (np.interp(ticks[-1], times, states[:, k]) for k in range(3))
    way = math.hypot(x, y)
    along = (places[-1, 0] * x + places[-1, 1] * y) / way
    aside = (places[-1, 0] * y - places[-1, 1] * x) / way
    lasted = 0.0
    if not rolls:
        moving = np.flatnonzero(speeds > 1e-3)[-1]
        lasted = max(0.0, abs(ticks[moving] + TICK / 2 - times[-1]) - TICK / 2) / times[-1]
    return along / way - 1, aside / way, angles[-1] / turned - 1, lasted


@pytest.mark.parametrize('heading', HEADINGS)
@pytest.mark.parametrize('rates', RATES)
@pytest.mark.parametrize('name', BODIES)
def test_what_slides_and_spins_stops_where_coulomb_says(name, rates, heading):
    assert np.abs(errors(name, rates, heading, EXACT)).max() < 0.01


@pytest.mark.parametrize('accuracy', ['draft', 'normal'])
@pytest.mark.parametrize('name', BODIES)
def test_coarser_steps_are_not_far_off(name, accuracy):
    for rates in RATES:
        assert np.abs(errors(name, rates, 0.5, ACCURACIES[accuracy])).max() < 0.005


@pytest.mark.parametrize('name', BODIES)
def test_the_error_falls_with_the_step(name):
    """With its first power, from 20 um at 4 ms: slip is opposed as it is at the end of a step."""
    ends = []
    for step in (4e-3, 1e-3, 2.5e-4, 1.5625e-5):
        places, angles, _ = simulated(scene_of(name, 'fast spin', 0.5),
                                      dataclasses.replace(EXACT, step=step), 0.1)
        ends.append(np.array([*places[-1], 0.2 * angles[-1]]))
    coarse, middle, fine = (np.abs(end - ends[-1]).max() for end in ends[:-1])
    assert coarse < 4e-5
    assert middle < 1e-5
    assert fine < middle / 3
