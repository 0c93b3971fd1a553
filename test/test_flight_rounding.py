"""Flights of light roots with heavy tips: the work of a tick is bounded, and energy kept.

Accelerations there are differences of large numbers, so that rounding leaves more error in a step
than the tolerance allows. Nothing touches anything, and a force is constant: what a doll's energy
must be is its start and force times distance.
"""
from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing flies')
pytest.importorskip('scipy')

from conserved import conserved

from ragdoll_ros import Bone, Placement, Push, Ragdoll, Scene, Simulation, Sphere
from ragdoll_ros.accuracy.references.articulated import Articulated
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Joint
from ragdoll_ros.model.shapes import Box, Capsule

PUSHED = 0.2
"""s, for which the root is pushed."""

DURATION = 0.4
"""s."""

ENERGY = 1e-5
"""Error of the energy relative to that at hand, which the report allows."""

MOST_CONTACT_STEPS = 500
"""Trials of contact steps of a tick of 10 ms: of 2.5 ms, none shorter than a hundredth of that."""


def most_steps(bodies):
    """Bound on the steps of a tick: two budgets of flight, of which the last step may be tried 30
    times, and contact steps.
    """
    return 2 * max(100, 7000 // bodies) + 2 * 30 + MOST_CONTACT_STEPS


def chain(count, masses, spacing=0.1):
    """Balls on ball joints along x."""
    bones = tuple(Bone(f'bone_{k}', Sphere(0.4 * spacing), float(mass), (spacing * k, 0, 0))
                  for k, mass in enumerate(masses))
    joints = tuple(Joint(f'bone_{k}', f'bone_{k + 1}', 'ball', (spacing * (k + 0.5), 0, 0),
                         ((0, 0, 1),)) for k in range(count - 1))
    return Ragdoll('chain', bones, joints)


def random_tree(rng, decades=6.0):
    """A chain or a tree of 2 to 30 bones of any shape, on joints of all kinds without damping or
    limits; masses over so many decades, of the root as well.
    """
    count, forks = int(rng.integers(2, 31)), rng.random() < 0.5
    bones, joints = [], []
    for k in range(count):
        size = rng.uniform(0.03, 0.1)
        shape = (Sphere(size), Box((size, 2 * size, 3 * size)), Capsule(size, size))[
            rng.integers(3)]
        mass = float(10 ** rng.uniform(-decades / 2, decades / 2))
        turn = tuple(rotation.normalized(rng.normal(size=4)))
        if not bones:
            bones.append(Bone('bone_0', shape, mass, (0, 0, 0), turn))
            continue
        parent = bones[rng.integers(k) if forks else k - 1]
        way = rotation.normalized(rng.normal(size=3))
        anchor = np.array(parent.position) + 0.1 * way
        bones.append(Bone(f'bone_{k}', shape, mass, tuple(anchor + 0.1 * way), turn))
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        kind = ('ball', 'ball', 'hinge', 'universal')[rng.integers(4)]
        joints.append(Joint(parent.name, f'bone_{k}', kind, tuple(anchor), tuple(
            tuple(axis) for axis in axes[:2 if kind == 'universal' else 1])))
    return Ragdoll('tree', tuple(bones), tuple(joints))


def in_space(doll):
    return Scene('space', (Placement(doll),), None, gravity=(0, 0, 0), self_collision=False)


class Flight:
    """A flight whose root is pushed by ``force`` (3,) N for PUSHED s, and what became of it."""

    def __init__(self, doll, force, accuracy='normal', duration=DURATION):
        scene = in_space(doll)
        root = doll.root.name
        place = scene.bone_index(root)
        self.work = self.kinetic = self.error = self.gain = 0.0
        self.most_steps = 0
        with Simulation(scene, accuracy=accuracy) as simulation:
            simulation.push(Push(root, force=tuple(force), duration=PUSHED))
            state, before = simulation.state, 0
            for tick in range(round(duration / scene.step)):
                start = state.positions[place].copy()
                state = simulation.advance()
                if tick < round(PUSHED / scene.step):
                    self.work += float(force @ (state.positions[place] - start))
                now = conserved(scene, state)
                self.kinetic = max(self.kinetic, now.kinetic)
                self.error = max(self.error, abs(now.energy - self.work))
                self.gain = max(self.gain, now.energy - self.work)
                stats = simulation._engine._clusters.totals()
                steps = int(stats['flight_steps'] + stats['steps'])
                self.most_steps, before = max(self.most_steps, steps - before), steps
            self.cut = simulation.measures()['flights_cut_total']
            self.state, self.momentum = state, now.momentum


@pytest.mark.parametrize(('count', 'ratio', 'light'), [
    (30, 1e3, 1.0), (10, 1e4, 1.0), (3, 1e6, 1.0), (3, 1e6, 0.1), (3, 1e8, 1.0)])
@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_light_root_with_a_heavy_tip_flies_in_few_steps(count, ratio, light, accuracy):
    """Where the tolerance is below rounding, steps are as long as that allows."""
    masses = light * np.array([1.0] * (count - 1) + [ratio])
    force = np.array((5.0, 20.0, 3.0))
    flight = Flight(chain(count, masses), force, accuracy, 0.5)
    assert flight.most_steps <= 60
    assert flight.cut == 0
    assert flight.error <= ENERGY * flight.kinetic
    # The tip moves by as much as rounding makes of the root's velocity, of some 5 m/s.
    assert flight.momentum == pytest.approx(PUSHED * force, abs=1e-8 * masses.sum() * 5)


def test_a_light_root_with_a_heavy_tip_goes_where_the_equations_of_motion_say():
    """Runge and Kutta's method of order 4 on the mass matrix in fixed steps of 0.5 ms: DOP853 at
    1e-12 would ask for less than rounding as well.
    """
    doll, force = chain(3, (1.0, 1.0, 1e6)), np.array((5.0, 20.0, 3.0))
    tree, forces, h = Articulated(doll), np.zeros((3, 3)), 5e-4
    forces[0] = force

    def rate(y):
        return tree._derivative(0.0, y, 0.0, lambda *_: (forces, np.zeros((3, 3))))

    y = start = np.concatenate([tree.bind(), np.zeros(tree.nv)])
    for _ in range(round(PUSHED / h)):
        one = rate(y)
        two = rate(y + h / 2 * one)
        three = rate(y + h / 2 * two)
        y = y + h / 6 * (one + 2 * two + 2 * three + rate(y + h * three))
    due = tree.state(y[:tree.nq], y[tree.nq:]).positions
    found = Flight(doll, force, duration=PUSHED)
    assert found.state.positions == pytest.approx(due, abs=1e-6)
    assert np.abs(due - tree.state(start[:tree.nq], start[tree.nq:]).positions).max() > 0.05


def assert_bounded(number):
    """Fly a random tree in bounded ticks, with its energy; returns how many were cut short. Those
    may lose some of it, of whips at thousands of rad/s, but gain none.
    """
    rng = np.random.default_rng([33, 4, number])
    doll = random_tree(rng)
    away = rotation.normalized(rng.normal(size=3))
    flight = Flight(doll, away * doll.root.mass * 10 ** rng.uniform(0.5, 2.5))
    assert flight.most_steps <= most_steps(len(doll.bones))
    assert math.isfinite(flight.error)
    assert flight.gain <= ENERGY * flight.kinetic
    assert flight.cut or flight.error <= ENERGY * flight.kinetic
    return flight.cut


@pytest.mark.parametrize('first', range(0, 30, 10))
def test_random_chains_and_trees_fly_in_bounded_ticks(first):
    for number in range(first, first + 10):
        assert_bounded(number)


@pytest.mark.slow
def test_a_thousand_random_chains_and_trees_fly_in_bounded_ticks():
    """Those that are cut short turn so fast that a tick has more steps than its budget."""
    cut = sum(assert_bounded(number) > 0 for number in range(1000))
    assert cut <= 50, 'one in twenty'
