"""The planar doll's reference against closed forms, other integrators and conservation laws; the
engine against it.
"""
import dataclasses
import functools
import math

import numpy as np
import pytest

pytest.importorskip('scipy')

from scipy.optimize import nnls

from ragdoll_ros.accuracy.motions import planar_doll
from ragdoll_ros.accuracy.references import contact_modes, event_driven, impacts
from ragdoll_ros.accuracy.references.planar_chain import PlanarChain
from ragdoll_ros.accuracy.references.planar_rods import PlanarRods
from ragdoll_ros.physics.accuracy import NORMAL
from ragdoll_ros.physics.simulation import Simulation

G, LENGTH, MASS = 9.8, 1.0, 2.0
MOMENT = MASS * LENGTH ** 2 / 12


@functools.cache
def motion_and_truth(name):
    """A motion of the planar doll and what is true of it, which takes some 2 s, once for all."""
    motion = next(motion for motion in planar_doll.planar_motions() if motion.name == name)
    return motion, motion.truth(motion.trial.times())


def rod(friction, restitution=0.0):
    """One thin rod whose lower end alone may touch."""
    return PlanarRods((LENGTH,), (MASS,), (MOMENT,), (0.0,), (-1,), (0,), ((0, -1),), G, friction,
                      restitution)


@pytest.mark.parametrize(('friction', 'restitution'), [(0.0, 0.5), (0.1, 0.5), (2.0, 0.5),
                                                       (0.0, 1.0)])
def test_one_rod_is_thrown_back_as_the_formula_says(friction, restitution):
    """Its end strikes after 0.1 s; rates and velocities to rounding of the event's time."""
    lean, speed = 0.5, 0.4
    foot = LENGTH / 2 * np.array((-math.sin(lean), -math.cos(lean)))
    strike = G * 0.1
    start = (0.0, G * 0.1 ** 2 / 2 - foot[1])
    rows = event_driven.rows(rod(friction, restitution), np.array([*start, lean, speed, 0, 0]),
                             np.array([0, 0.101]))
    along, up = impacts.planar_impulse(foot, MASS, MOMENT, (speed, -strike), restitution, friction)
    assert rows[-1, 3:5] == pytest.approx(
        (speed + along / MASS, up / MASS - strike - G * 0.001), abs=1e-9)
    assert rows[-1, 5] == pytest.approx((foot[1] * along - foot[0] * up) / MOMENT, abs=1e-9)


def test_a_rod_whose_foot_sticks_is_a_pendulum_upside_down():
    """Against one equation of one variable; at 0.2 rad friction of 1 still holds it."""
    times = np.linspace(0, 0.3, 7)
    lean = 0.1
    start = LENGTH / 2 * np.array((math.sin(lean), math.cos(lean)))
    rows = event_driven.rows(rod(1.0), np.array([*start, lean, 0, 0, 0]), times)
    truth = impacts.edge_angle(0.0, LENGTH / 2, lean, G, times, rocks=False)
    assert rows[:, 2] == pytest.approx(truth, abs=1e-9)


def test_a_rod_on_ice_falls_straight_down():
    """(1/4 sin^2 + 1/12) L^2 rate^2 = g L (cos of the start less cos), and x stays."""
    lean = 0.3
    rows = event_driven.rows(rod(0.0), np.array([0, LENGTH / 2 * math.cos(lean), lean, 0, 0, 0]),
                         np.linspace(0, 0.4, 5))
    angle, rate = rows[1:, 2], rows[1:, 5]
    left = (np.sin(angle) ** 2 / 4 + 1 / 12) * LENGTH ** 2 * rate ** 2
    assert left == pytest.approx(G * LENGTH * (math.cos(lean) - np.cos(angle)), rel=1e-9)
    assert np.abs(rows[:, 0]).max() < 1e-12


def test_the_slide_of_a_rod_comes_to_a_stop_and_turns_about():
    """Upright on its foot, sliding: -mu g on the foot until it stands, then it falls over it.

    While it slides, the centre's acceleration is along the cone: x'' = -mu (z'' + g).
    """
    figure = rod(0.2)
    times = np.linspace(0, 0.2, 2001)
    rows = event_driven.rows(figure, np.array([0, LENGTH / 2, 0, 0.3, 0, 0]), times)
    ways = rows[:, 3] - LENGTH / 2 * np.cos(rows[:, 2]) * rows[:, 5]
    pushes = np.gradient(rows[:, 3:5], times, axis=0) + np.array((0, G))
    slides = (ways > 1e-3)[1:-1]
    assert slides.any() and not slides.all()
    share = (pushes[1:-1, 0] / pushes[1:-1, 1])[slides]
    # a central difference of 0.1 ms leaves 1e-7
    assert share[1:-1] == pytest.approx(-0.2, abs=1e-5)
    assert np.abs(ways[-1]) < 1e-9


def test_a_chain_in_flight_agrees_with_lagrange_in_other_angles():
    """Rods hung end to end, against PlanarChain, whose angles begin at the other axis."""
    n, length, moment = 3, 0.4, 0.03
    figure = PlanarRods((length,) * n, (MASS,) * n, (moment,) * n, (0.0,) * n, (-1, 0, 1),
                        (0, -1, -1), ((0, 1),), 0.0)
    angles, rates = np.array((0.2, 0.9, 1.4)), np.array((1.0, -2.0, 3.0))
    times = np.linspace(0, 0.3, 4)
    centres, phi = PlanarChain(n, length, MASS, moment).motion(angles, rates, times)
    start = np.concatenate([(0, 9), -math.pi / 2 - angles, (0, 0), -rates])
    found = event_driven.rows(figure, start, times)
    moved = figure.centres(found)
    assert found[:, 2:5] == pytest.approx(-math.pi / 2 - phi, abs=1e-9)
    ours, theirs = (array - array.mean(axis=1, keepdims=True) for array in (moved, centres))
    assert ours == pytest.approx(theirs, abs=1e-9)


@pytest.mark.parametrize('seed', range(5))
def test_contacts_without_friction_are_least_squares(seed):
    """A linear complementarity of a positive matrix is a quadratic programme: scipy's nnls."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(7, 7))
    mass, jacobian = root @ root.T + np.eye(7), rng.normal(size=(4, 2, 7))
    speeds = rng.normal(size=7)
    free = jacobian @ speeds
    modes, found = contact_modes.solve(mass, jacobian, free, 0.0,
                                       [contact_modes.choices(0.0)] * 4)
    lower = np.linalg.cholesky(mass)
    least, _ = nnls(np.linalg.solve(lower, jacobian[:, 0].T), -lower.T @ speeds)
    assert found[:, 0] == pytest.approx(least, abs=1e-9)
    assert [mode == contact_modes.OPEN for mode in modes] == (least < 1e-12).tolist()


@pytest.mark.parametrize('seed', range(8))
def test_contacts_with_friction_keep_every_law(seed):
    """Responses anew from the forces: no pull, no sinking, within the cone, against the slip."""
    rng, friction = np.random.default_rng(seed), 0.5
    root = rng.normal(size=(7, 7))
    mass, jacobian = root @ root.T + np.eye(7), rng.normal(size=(3, 2, 7))
    free = rng.normal(size=(3, 2))
    _, found = contact_modes.solve(mass, jacobian, free, friction,
                                   [contact_modes.choices(friction)] * 3)
    impulse = sum(row.T @ force for row, force in zip(jacobian, found, strict=True))
    response = free + jacobian @ np.linalg.inv(mass) @ impulse
    (normal, tangent), (away, along) = found.T, response.T
    assert normal.min() >= -1e-9 and away.min() >= -1e-9
    assert np.abs(normal * away).max() < 1e-9
    assert (np.abs(tangent) <= friction * normal + 1e-9).all()
    slides = np.abs(along) > 1e-9
    assert tangent[slides] == pytest.approx((-friction * normal * np.sign(along))[slides], abs=1e-9)


@pytest.mark.parametrize(('friction', 'restitution'), [(0.0, 0.5), (0.3, 0.0), (0.8, 0.5)])
def test_a_doll_keeps_its_energy_between_touches_and_never_gains(friction, restitution):
    """Rises are rounding; without friction nothing pushes it along the ground."""
    figure, start = planar_doll.figure(friction, restitution), planar_doll.initial_rows()
    rows = event_driven.rows(figure, start, np.linspace(0, 0.3, 301))
    energy = figure.energy(rows)
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert energy[-1] < 0.95 * energy[0]
    assert min(figure.gaps(row).min() for row in rows) > -1e-9
    if not friction:
        centres = figure.centres(rows[[0, 150, 300]])
        steps = np.diff(np.einsum('i,ti->t', planar_doll.MASSES, centres[:, :, 0]))
        assert steps[0] == pytest.approx(steps[1], rel=1e-9)


def test_the_scene_begins_as_its_truth_does():
    """By the articulated reference's own kinematics, and by 1 us of flight."""
    from ragdoll_ros.accuracy.references.articulated import Articulated
    motion = planar_doll.planar_motions()[0]
    truth = motion.truth(np.array([0.0, 1e-6]))
    tree = Articulated(motion.trial.scene.dolls[0].doll)
    state = tree.state(motion.trial.start.q, motion.trial.start.v)
    assert state.positions == pytest.approx(truth.positions[0], abs=1e-12)
    assert np.abs((state.orientations * truth.orientations[0]).sum(axis=1)) == pytest.approx(1)
    moved = np.diff(truth.positions, axis=0)[0] / 1e-6
    assert state.linear_velocities == pytest.approx(moved, abs=1e-4)


@pytest.mark.parametrize(('name', 'bound'), [('planar_ice', 3e-3), ('planar_stick', 1e-3)])
def test_pybullet_without_restitution_comes_to_the_same(name, bound):
    """An outside check: of order 1, so within ten times what 2 m/s go in a step of 0.16 ms.

    Bounces are left out: PyBullet's do not converge.
    """
    from ragdoll_ros.accuracy.methods import bullet, run
    from ragdoll_ros.accuracy.metrics import compare
    motion, truth = motion_and_truth(name)
    coarse, fine = (compare(run(bullet(count), motion.trial).trajectory, truth)['position_worst_m']
                    for count in (4, 64))
    assert fine < bound and fine < coarse / 5


@pytest.mark.parametrize('name', ['planar_ice', 'planar_slide', 'planar_stick'])
def test_steps_with_lasting_contacts_are_of_order_two(name):
    """Against the event-driven truth: a quarter of the step errs by a sixteenth, of which half is
    left to what contacts that begin and end add.
    """
    motion, truth = motion_and_truth(name)
    errors = []
    for step in (2.5e-3, 6.25e-4):
        fine = dataclasses.replace(NORMAL, step=step, sleep=False)
        with Simulation(motion.trial.scene, accuracy=fine) as simulation:
            simulation.place(motion.trial.start)
            errors.append(max(np.abs(simulation.advance().positions - positions).max()
                              for positions in truth.positions[1:]))
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 8
