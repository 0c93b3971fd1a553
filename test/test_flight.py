"""Flights of a simulation: against the equations of motion at 1e-12, and what they must keep."""
from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing flies')
pytest.importorskip('scipy')

from conserved import conserved
from oracles import unlimited
from samples import GRAVITY, PLATE, each_tree, every_kind, random_coordinates, scene_of

from ragdoll_ros.accuracy.motions.motion import without_damping
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.physics.accuracy import resolve_accuracy
from ragdoll_ros.physics.simulation import Simulation

FREE = unlimited(scene_of(load_doll('doll')))
START = random_coordinates(FREE, 1)


@functools.cache
def true_end():
    """Where it is after 0.4 s, m."""
    (tree, q, v), = each_tree(FREE, START, GRAVITY)
    return tree.trajectory(q, v, (0, .4)).positions[-1]


@pytest.mark.parametrize('tick', [.01, .1, .2])
@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_long_tick_is_flown_as_well_as_a_short_one(accuracy, tick):
    """The tolerance is each step's; 100 times that is what many, and chaos, may make of it in
    0.4 s.
    """
    tolerance = max(resolve_accuracy(accuracy).flight_error, 1e-14)
    with Simulation(FREE, step=tick, accuracy=accuracy) as simulation:
        simulation.place(START)
        for _ in range(round(.4 / tick)):
            state = simulation.advance()
    assert np.abs(state.positions - true_end()).max() < 100 * tolerance


@pytest.mark.parametrize(('doll', 'ticks'), [(every_kind(), 18), (load_doll('doll'), 50),
                                             (PLATE, 50)], ids=['every_kind', 'doll', 'plate'])
def test_a_flight_keeps_momentum_and_energy(doll, ticks):
    """To the tolerance of 1e-13 a step, which is of some 100 steps rounded at random.

    The limited ball joints of every_kind, whose angles want their limits, meet none before 0.18 s.
    """
    scene = unlimited(scene_of(without_damping(doll)))
    masses = np.array([bone.mass for bone in scene.bones])
    with Simulation(scene, accuracy='exact') as simulation:
        simulation.place(random_coordinates(scene, 1, bend=.4))
        first = conserved(scene, simulation.state)
        size = masses @ np.linalg.norm(simulation.state.linear_velocities, axis=1)
        for tick in range(1, ticks + 1):
            then = conserved(scene, simulation.advance())
            due = first.momentum + doll.mass * np.array(GRAVITY) * .01 * tick
            assert np.abs(then.momentum - due).max() < 1e-12 * size
            assert then.angular_momentum == pytest.approx(
                first.angular_momentum, abs=1e-12 * np.linalg.norm(first.angular_momentum))
            assert abs(then.energy - first.energy) < 1e-12 * first.kinetic
        assert simulation.measures()['impacts'] == 0


def test_damping_only_takes_energy():
    """And nothing else: momentum is none of its business."""
    scene = scene_of(every_kind(.5))
    with Simulation(scene) as simulation:
        simulation.place(random_coordinates(scene, 3, bend=.4))
        motions = [conserved(scene, simulation.state), *(
            conserved(scene, simulation.advance()) for _ in range(30))]
    energies = [motion.energy for motion in motions]
    assert np.diff(energies).max() < 0
    assert energies[-1] < energies[0] - .05 * motions[0].kinetic
    assert motions[-1].angular_momentum == pytest.approx(motions[0].angular_momentum, rel=1e-9)


@pytest.mark.parametrize(('engine', 'damping'), [('auto', 1e3), ('auto', 1e6), ('bullet', 1.0)])
def test_a_stiffly_damped_joint_stops_at_once(engine, damping):
    """Damping of 1e3 ends this motion at 10^6 / s, of which explicit steps make energy: PyBullet
    takes as many substeps as that wants, and is asked for less.
    """
    box = Box((.1, .1, .1))
    pair = Ragdoll('pair', (Bone('a', box, 1.0, (0, 0, 0)), Bone('b', box, 1.0, (.1, 0, 0))),
                   (Joint('a', 'b', 'hinge', (.05, 0, 0), ((0, 0, 1),), damping=damping),))
    scene = scene_of(pair)
    with Simulation(scene, engine=engine) as simulation:
        here = simulation.coordinates
        v = here.v.copy()
        v[6] = 5.0
        simulation.place(dataclasses.replace(here, v=v))
        before = conserved(scene, simulation.state)
        simulation.advance()
        after, rate = conserved(scene, simulation.state), simulation.coordinates.v[6]
    assert abs(rate) < 1e-3 * 5.0
    assert after.angular_momentum == pytest.approx(before.angular_momentum, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_limb_that_is_flung_at_its_limit_stops_there(accuracy):
    """The knee at 30 rad/s, 40 degrees before its limit, in the air: the touch is located, and from
    then on it is past by what is promised.
    """
    scene = scene_of(load_doll('doll'), self_collision=False)
    names = [name for joint in scene.dolls[0].doll.joints_depth_first()
             for name in joint.angle_names]
    at = names.index('left_shin')
    with Simulation(scene, accuracy=accuracy) as simulation:
        here, worst = simulation.coordinates, 0.0
        q, v = here.q.copy(), here.v.copy()
        q[7 + at], v[6 + at] = 1.5, 30.0
        simulation.place(dataclasses.replace(here, q=q, v=v))
        furthest = 0.0
        for _ in range(30):
            simulation.advance()
            worst = max(worst, simulation.measures()['limit_overshoot_rad'])
            furthest = max(furthest, simulation.coordinates.q[7 + at])
    assert furthest > math.radians(125)
    assert math.degrees(worst) < 0.2
