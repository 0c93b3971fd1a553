"""Who may meet soon: nobody is missed, and falling fast side by side is no meeting."""
import dataclasses
import itertools

import numpy as np
import pytest

from ragdoll_ros import Bone, Ground, Placement, Ragdoll, Scene, Simulation
from ragdoll_ros.model.scene import Material
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.engine.rigid.broad_phase import BroadPhase
from ragdoll_ros.physics.kernels.collision.sweep_and_prune import IMPACT_SPEEDUP, MARGIN

RADIUS, AHEAD = 0.1, 0.02
BALL = Ragdoll('ball', (Bone('ball', Sphere(RADIUS), 2.0, (0, 0, 0)),))


def balls(positions, velocities, ground=None, **settings):
    """Balls, none of which turns."""
    return Scene('balls', tuple(
        Placement(BALL, f'ball_{k}', tuple(position), velocity=tuple(velocity))
        for k, (position, velocity) in enumerate(zip(positions, velocities, strict=True))),
        ground, **settings)


def found(scene, groups=None):
    """Pairs that may touch within AHEAD, as a set."""
    rows = np.zeros((len(scene.dolls), 13))
    rows[:, :3] = [placement.position for placement in scene.dolls]
    rows[:, 6] = 1
    rows[:, 7:10] = [placement.velocity for placement in scene.dolls]
    count = len(rows)
    pairs = BroadPhase(scene, np.full(count, RADIUS)).pairs(
        rows, AHEAD, *(np.ones(count, bool),) * 2, np.arange(count) if groups is None else groups)
    return {tuple(pair) for pair in pairs.tolist()}


def by_pairs(scene):
    """The same, pair by pair: as near as both come by their speed against each other, or by both
    speeds where the ground is no farther from one than its own.
    """
    def at_ground(placement):
        height = placement.position[2] - RADIUS - MARGIN / 2
        way = IMPACT_SPEEDUP * AHEAD * np.linalg.norm(placement.velocity)
        return bool(scene.ground) and height < way

    pairs = set()
    for (a, one), (b, other) in itertools.combinations(enumerate(scene.dolls), 2):
        u, v = np.array(one.velocity), np.array(other.velocity)
        speed = (np.linalg.norm(u) + np.linalg.norm(v) if at_ground(one) or at_ground(other)
                 else np.linalg.norm(u - v))
        way = np.linalg.norm(np.subtract(one.position, other.position))
        if way < 2 * RADIUS + MARGIN + IMPACT_SPEEDUP * AHEAD * speed:
            pairs.add((a, b))
    return pairs


@pytest.mark.parametrize('ground', [None, Ground()])
@pytest.mark.parametrize('speed', [0.0, 3.0, 60.0])
def test_the_sweep_finds_what_a_look_at_each_pair_finds(ground, speed):
    rng = np.random.default_rng(int(speed))
    positions = rng.uniform((0, 0, 0.1), (3, 4, 6), (150, 3))
    velocities = rng.normal(size=(150, 3)) * speed / 4 - (0, 0, speed)
    scene = balls(positions, velocities, ground)
    assert found(scene) == by_pairs(scene)
    assert len(found(scene)) > 5


def test_without_ground_a_common_velocity_changes_nothing():
    rng = np.random.default_rng(0)
    positions, velocities = rng.uniform(0, 3, (80, 3)), rng.normal(size=(80, 3)) * 3
    expected = found(balls(positions, velocities))
    assert len(expected) > 10
    assert found(balls(positions, np.add(velocities, (40.0, -300.0, 7.0)))) == expected


def test_the_ground_throws_those_that_it_may_reach_and_what_they_touch():
    """Two of 60 m/s side by side, 1 m apart: not in the air, but where the ground may throw one,
    be it by a third one of its group that is below it.
    """
    fast = [(0, 0, -60.0)] * 3

    def side_by_side(height):
        return balls([(0, 0, height), (1, 0, height), (9, 0, 1)], fast, Ground())

    assert found(side_by_side(1.0)) == {(0, 1)}
    assert not found(side_by_side(9.0))
    assert found(side_by_side(9.0), groups=np.array([0, 1, 0])) == {(0, 1)}


def test_dolls_that_fall_side_by_side_go_their_own_ways():
    """At 60 m/s, 2.5 m apart and high over the ground, as long as they fall."""
    places = [(2.5 * x, 2.5 * y, 500) for x in range(3) for y in range(3)]
    with Simulation(balls(places, [(0, 0, -60.0)] * 9, Ground()), engine='rigid') as simulation:
        for _ in range(100):
            simulation.advance()
            assert len(set(simulation._engine.cluster_of_doll.tolist())) == 9


@pytest.mark.parametrize('ground', [None, Ground()])
@pytest.mark.parametrize('restitution', [0.0, 0.4, 1.0])
def test_balls_that_close_at_3_m_s_as_they_fall_at_60_bounce_as_they_do_at_rest(
        ground, restitution):
    """Central impact of equal masses, 0.3 m apart: 0.1 s later the speed against each other is
    turned and has the restitution's share; a third, beside them, falls as a stone.
    """
    speed, gap, end = 3.0, 0.3, 0.25
    scene = balls([(0, 0, 500), (2 * RADIUS + gap, 0, 500), (0, 2, 500)],
                  [(2.0, 0, -60), (-1.0, 0, -60), (0, 0, -60)], ground,
                  material=Material(restitution=restitution))
    with Simulation(scene, engine='rigid') as simulation:
        groups = set()
        for _ in range(round(end / simulation.step)):
            state = simulation.advance()
            groups.add(tuple(simulation._engine.cluster_of_doll.tolist()))
    after = end - gap / speed
    mean, share = 0.5, restitution * speed / 2
    assert state.linear_velocities[:, 0] == pytest.approx([mean - share, mean + share, 0], abs=1e-6)
    middle = RADIUS + gap / 2 + mean * end
    assert state.positions[:, 0] == pytest.approx(
        [middle - RADIUS - share * after, middle + RADIUS + share * after, 0], abs=1e-4)
    assert state.positions[:, 2] == pytest.approx(500 - 60 * end - 4.9 * end ** 2)
    assert len({one for one, _, _ in groups}) == 1 and (0, 0, 1) in groups and (0, 1, 2) in groups


def test_one_that_overtakes_another_is_found():
    """Thrown down onto a slower one: they meet 0.1 s later, and go on with exchanged speeds."""
    scene = balls([(0, 0, 500), (0, 0, 499.5)], [(0, 0, -63.0), (0, 0, -60.0)],
                  material=Material(restitution=1.0))
    with Simulation(dataclasses.replace(scene, gravity=(0, 0, 0)), engine='rigid') as simulation:
        for _ in range(20):
            state = simulation.advance()
    assert state.linear_velocities[:, 2] == pytest.approx([-60, -63], abs=1e-6)
