"""Large heaps and clusters: what is solved without W, and touches that steps find as they go."""
import dataclasses

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: there is no rigid engine')

from conserved import conserved

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.accuracy import ACCURACIES, NORMAL
from ragdoll_ros.physics.engine.rigid.engine import RigidEngine
from ragdoll_ros.physics.simulation import Simulation

G = 9.8
BOX = Ragdoll('box', (Bone('box', Box((0.4, 0.4, 0.2)), 2.0, (0, 0, 0)),))
BALL = Ragdoll('ball', (Bone('ball', Sphere(0.1), 2.0, (0, 0, 0)),))


@pytest.mark.parametrize('count', [5, 14])
def test_a_stack_bears_its_weight(count):
    """Each contact all that is above it: 60 rows by W, 168 by a sparse factor."""
    boxes = tuple(Placement(BOX, f'box_{k}', (0, 0, 0.1 + 0.2 * k)) for k in range(count))
    scene = Scene('stack', boxes, Ground(), Material(0.7, 0.0, 0.0))
    with Simulation(scene, accuracy=dataclasses.replace(NORMAL, sleep=False)) as simulation:
        for _ in range(200):
            state = simulation.advance()
        found = simulation.contacts
        forces = np.bincount(np.maximum(found.a, found.b), found.forces)
    weights = 2.0 * G * np.arange(count, 0, -1)
    # GOOD, 1e-6 m/s, in a step of 2.5 ms: 1e-6 / (g h) is 4e-5 of the weight of a box.
    assert forces == pytest.approx(weights, rel=1e-3)
    assert state.positions[:, 2] == pytest.approx(0.1 + 0.2 * np.arange(count), abs=5e-4)
    # The tolerance, 1e-5 m/s, for 2 s.
    assert state.positions[:, :2] == pytest.approx(0, abs=1e-6 if count == 5 else 2e-5)


@pytest.mark.slow
def test_a_heap_of_ten_dolls_comes_to_rest_and_is_solved():
    """A pile of the scene `pile`, where half the solves were left unsolved."""
    scene = load_scene('pile')
    scene = dataclasses.replace(scene, dolls=scene.dolls[::16])
    with Simulation(scene, accuracy='draft') as simulation:
        for _ in range(700):
            simulation.advance()
        before = simulation.measures()['unsolved_total']
        for _ in range(100):
            state = simulation.advance()
        assert simulation.measures()['unsolved_total'] <= before + 6, '2 % of 300 steps'
        assert simulation.measures()['energy_excess_J'] < 1e-5 * 17_000
    assert np.linalg.norm(state.linear_velocities, axis=1).max() < 0.01


@pytest.mark.parametrize(('accuracy', 'error'), [('draft', 0.06), ('normal', 0.03),
                                                 ('exact', 0.015)])
def test_many_near_each_other_bounce_to_the_height_that_restitution_says(accuracy, error):
    """E^2 h, where touches are not sought: to the first order of the step."""
    falls = 0.5 + 0.01 * np.arange(8)
    balls = tuple(Placement(BALL, f'ball_{k}', (0.25 * k, 0, 0.1 + fall))
                  for k, fall in enumerate(falls))
    scene = Scene('balls', balls, Ground(), Material(0.3, 0.0, 0.5))
    with Simulation(scene, accuracy=accuracy) as simulation:
        assert len(simulation._engine._clusters.members) == 8
        heights = np.array([simulation.advance().positions[:, 2] for _ in range(60)])
    landed = heights.argmin(axis=0)
    apexes = np.array([heights[first:, k].max() for k, first in enumerate(landed)]) - 0.1
    assert apexes / falls == pytest.approx(0.25, rel=error)


def momenta(scene, state):
    """Linear and angular momentum (6,) about the world's origin of all dolls together."""
    dolls = [conserved(scene, state, doll) for doll in range(len(scene.dolls))]
    return np.sum([np.concatenate([doll.momentum, doll.angular_momentum
                                   + np.cross(doll.centre, doll.momentum)])
                   for doll in dolls], axis=0)


@pytest.mark.parametrize('accuracy', list(ACCURACIES))
def test_dolls_that_meet_in_a_crowd_keep_their_momentum(accuracy):
    """Six that fly at each other in free space, at 2 to 4 m/s: linear and angular, to rounding, and
    energy only falls.
    """
    rng, doll = np.random.default_rng(3), load_doll('doll')
    placements = []
    for k in range(6):
        place = np.array([(-1) ** k * 0.5, 0.6 * (k // 2), 0.0])
        speed = -np.sign(place[0]) * rng.uniform(2, 4)
        placements.append(Placement(
            doll, f'doll_{k}', tuple(place), tuple(rotation.normalized(rng.normal(size=4))),
            velocity=(speed, 0.0, 0.0)))
    scene = Scene('crowd', tuple(placements), None, gravity=(0, 0, 0))
    engine = RigidEngine(scene, ACCURACIES[accuracy])
    first, energy, met = momenta(scene, engine.state), float(engine.doll_totals.energy.sum()), 0
    for _ in range(60):
        engine.advance(0.01)
        met = max(met, len(engine.contacts()) + engine.measures()['impacts'])
        now = float(engine.doll_totals.energy.sum())
        assert now <= energy * (1 + 1e-9)
        energy = now
    assert met
    # 330 kg at 4 m/s, 1 m from the origin.
    assert momenta(scene, engine.state) == pytest.approx(first, abs=1e-9 * 330 * 4)
