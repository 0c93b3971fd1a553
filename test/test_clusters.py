"""Dolls that may touch go on together, others by themselves; none feels how work is split."""
from __future__ import annotations

import dataclasses
import hashlib
from collections import Counter

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: there is no rigid engine')

import loose_bodies
from conserved import conserved

from ragdoll_ros import Push, Simulation, load_scene
from ragdoll_ros.accuracy.crowds import crowd_digests
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.accuracy import NORMAL

APART = 2.5
"""m between dolls that never touch."""


def field(count, apart=APART, heights=(0.0,), **changed):
    """The default doll so many times in a row along x."""
    drop = load_scene('drop')
    doll = drop.dolls[0].doll
    return dataclasses.replace(drop, name='field', dolls=tuple(
        Placement(doll, f'doll_{k}', (apart * k, 0.0, heights[k % len(heights)]))
        for k in range(count)), **changed)


def rows(scene, ticks, workers=1, pushes=()):
    """States (t, n, 13) of a scene, tick by tick."""
    with Simulation(scene, engine='rigid', workers=workers) as simulation:
        for push in pushes:
            simulation.push(push)
        return np.array([simulation.advance().rows for _ in range(ticks)])


def own(scene, states, doll):
    """Those of a doll, as if it stood at the origin; x is rounded otherwise there."""
    part = states[:, scene.bone_slices[doll]].copy()
    part[..., 0] -= scene.dolls[doll].position[0]
    return part


def test_a_doll_in_a_crowd_that_it_does_not_touch_moves_to_the_bit_as_by_itself():
    crowd = field(5)
    lone = dataclasses.replace(crowd, dolls=crowd.dolls[:1])
    push = Push('doll_3/torso', (0.0, 300.0, 0.0), start=0.3, duration=0.1)
    many = rows(crowd, 150, pushes=[push])
    assert (many[:, crowd.bone_slices[0]] == rows(lone, 150)).all()
    assert own(crowd, many, 2)[:60] == pytest.approx(own(crowd, many, 0)[:60], abs=1e-9)
    assert np.abs(own(crowd, many, 3) - own(crowd, many, 0)).max() > 0.1, 'the pushed one'


def test_states_are_the_same_to_the_bit_for_any_number_of_workers():
    """Some collide, one is pushed; heights differ, so that they land at different times."""
    crowd = field(9, 1.3, (0.0, 0.4, 0.1))
    pushes = [Push('doll_4/torso', (400.0, 0.0, 0.0), start=0.2, duration=0.2)]
    digests = {hashlib.sha256(rows(crowd, 200, workers, pushes).tobytes()).hexdigest()
               for workers in (1, 2, 3, 1)}
    assert len(digests) == 1


def balls_in_a_box():
    """A cluster that falls into islands all the time: 100 balls that meet, and their box."""
    balls, side = loose_bodies.contained_balls(100)
    return balls.scene(Material(0.0, 0.0, 1.0), others=(
        Placement(loose_bodies.container(side), 'container'),))


def test_islands_of_a_cluster_move_the_same_to_the_bit_for_any_workers_and_when_restored():
    scene = balls_in_a_box()
    runs = {rows(scene, 6, workers).tobytes() for workers in (1, 2)}
    assert len(runs) == 1
    with Simulation(scene, engine='rigid') as simulation:
        engine, shown = simulation._engine, []
        for _ in range(3):
            simulation.advance()
        assert max(np.bincount(engine.cluster_of_doll)) > 62
        snapshot = engine.save()
        for _ in range(2):
            simulation.advance()
            shown.append((engine.state.rows.tobytes(), engine.contacts().positions.tobytes()))
            if len(shown) == 1:
                engine.restore(snapshot)
    assert shown[0] == shown[1]


def test_islands_of_a_cluster_have_all_their_contacts():
    """Eighty balls that lie side by side, 2 cm apart: each touches the ground."""
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.1), 2.0, (0, 0, 0)),))
    balls = tuple(Placement(ball, f'ball_{k}', (0.22 * k, 0.0, 0.1)) for k in range(80))
    scene = Scene('balls', balls, Ground(), Material(0.5, 0.0, 0.0))
    accuracy = dataclasses.replace(NORMAL, sleep=False)
    with Simulation(scene, engine='rigid', accuracy=accuracy) as simulation:
        for _ in range(3):
            simulation.advance()
        assert max(np.bincount(simulation._engine.cluster_of_doll)) > 62
        contacts = simulation._engine.contacts()
        assert sorted(contacts.a.tolist()) == list(range(80))
        assert contacts.forces == pytest.approx(2.0 * 9.8, rel=1e-3)
        assert simulation._engine.bones_on_ground().all()


def test_a_doll_falls_asleep_as_it_does_alone():
    """Also where others become still before it: they have no part in when it counts as still."""
    scene = crowd_digests.sixty()
    crowd = dataclasses.replace(scene, dolls=scene.dolls[:12])
    alone = dataclasses.replace(scene, dolls=scene.dolls[:1])
    with Simulation(crowd) as one, Simulation(alone) as other:
        while not other.asleep:
            rows = other.advance().rows
            assert (one.advance().rows[:len(rows)] == rows).all(), other.time
        assert one._engine.sleeping[0]


@pytest.mark.slow
def test_sixty_dolls_have_the_same_bits_for_any_workers_after_a_reset_and_alone():
    """As `python -m ragdoll_ros.accuracy.crowds --part digests`, over fewer ticks."""
    ticks, seen = 200, Counter()
    (crowd, lone), again = crowd_digests.of_workers(1, ticks, 2, seen)
    assert again == (crowd, lone)
    assert {run for workers in (2, 3) for run in crowd_digests.of_workers(workers, ticks)} == {
        (crowd, lone)}
    assert crowd_digests.of_first_alone(ticks) == lone
    assert seen['joined'] and seen['slept'] and seen['woke']


def test_a_reset_repeats_a_crowd_to_the_bit():
    crowd = field(4, 1.0, (0.0, 0.5))
    with Simulation(crowd, engine='rigid') as simulation:
        runs = []
        for _ in range(2):
            runs.append([simulation.advance().rows.tobytes() for _ in range(150)])
            simulation.reset()
    assert runs[0] == runs[1]


def test_dolls_that_meet_in_the_air_keep_momentum_as_they_meet_and_part():
    """Two fly at each other at 4 m/s and a third passes by; sums from their definitions."""
    crowd = field(3, 3.0, gravity=(0.0, 0.0, 0.0), ground=None)
    thrown = [dataclasses.replace(crowd.dolls[0], velocity=(4.0, 0.1, 0.0)),
              dataclasses.replace(crowd.dolls[1], velocity=(-4.0, 0.0, 0.1)),
              dataclasses.replace(crowd.dolls[2], velocity=(0.0, 0.0, 3.0))]
    crowd = dataclasses.replace(crowd, dolls=tuple(thrown))
    with Simulation(crowd, engine='rigid') as simulation:
        def sums():
            return [conserved(crowd, simulation.state, doll) for doll in range(3)]
        first, groups = sums(), set()
        for _ in range(120):
            simulation.advance()
            groups.add(tuple(simulation._engine.cluster_of_doll.tolist()))
        last = sums()
    total = sum(one.momentum for one in first)
    assert sum(one.momentum for one in last) == pytest.approx(total, abs=1e-9)
    assert abs(last[0].momentum[0] - first[0].momentum[0]) > 10, 'they did meet'
    assert last[2].momentum == pytest.approx(first[2].momentum, abs=1e-9)
    assert sum(one.energy for one in last) <= sum(one.energy for one in first) * (1 + 1e-9)
    assert {len(set(labels)) for labels in groups} == {2, 3}, 'together, and by themselves'


def test_each_doll_sleeps_and_wakes_by_itself():
    """A push wakes the pushed one alone, one that is dropped onto a sleeper wakes that alone.

    They begin with a spin: even ones come to stand, and stay so.
    """
    crowd = field(4)
    falling = [dataclasses.replace(doll, spin=(0.4, 0.3, 0.0)) for doll in crowd.dolls]
    # above where the second lies then: it falls to its right
    high = dataclasses.replace(falling[3], position=(APART, -0.4, 3.0))
    far = dataclasses.replace(falling[2], position=(10.0, 0.0, 0.0))  # whatever falls on the second
    crowd = dataclasses.replace(crowd, dolls=(*falling[:2], far, high))
    first, second, third, above = crowd.bone_slices
    with Simulation(crowd, engine='rigid') as simulation:
        resting = simulation._engine.sleeping

        def advance_until(met):
            end = simulation.time + 20e9
            while not met():
                simulation.advance()
                assert simulation.time < end

        simulation.grab('hand', 'doll_3/torso')
        advance_until(lambda: resting[:3].all())
        assert not simulation.asleep and not resting[3]
        here = simulation.state.rows.copy()
        simulation.push(Push('doll_0/torso', (0.0, 0.0, 900.0), duration=0.05))
        simulation.advance()
        assert resting.tolist() == [False, True, True, False]
        advance_until(lambda: resting[0])
        assert np.abs(simulation.state.rows[first] - here[first]).max() > 0.01
        simulation.let_go('hand')
        advance_until(lambda: not resting[1])
        now = simulation.state
        assert now.positions[above, 2].min() - now.positions[second, 2].max() < 1.0
        advance_until(lambda: simulation.asleep)
        assert (simulation.state.rows[third] == here[third]).all()
        assert np.abs(simulation.state.rows[second] - here[second]).max() > 0.01


def test_dolls_that_pile_up_do_not_go_through_each_other():
    """Four dropped onto each other lie higher than one, and no bone is deep in another's."""
    pytest.importorskip('mujoco')
    from ragdoll_ros.accuracy.crowds.depth import BoneDepth
    crowd = field(4, 0.0, (0.0, 1.6, 3.2, 4.8))
    with Simulation(crowd, engine='rigid') as simulation:
        scales, deepest = BoneDepth(crowd), 0.0
        for tick in range(500):
            simulation.advance()
            if tick % 20 == 0:
                deepest = max(deepest, scales.depths(
                    simulation.state.positions, simulation.state.orientations).max())
        assert simulation.measures()['sinking_m'] < 1e-3
    assert deepest < 2e-3


def test_workers_out_of_range_are_refused():
    with pytest.raises(ValueError, match='workers'):
        Simulation(field(1), workers=0)


def test_dolls_at_the_ends_of_a_row_that_closes_touch_each_other_too():
    """Three in one cluster, of which the outer two were far apart: the middle one is pulled out
    from between them, and they meet; momentum is kept, and none goes through the other.
    """
    pytest.importorskip('mujoco')
    from ragdoll_ros.accuracy.crowds.depth import BoneDepth
    crowd = field(3, 1.0, gravity=(0.0, 0.0, 0.0), ground=None)
    speeds = (1.5, 0.0, 0.0), (0.0, 6.0, 0.0), (-1.5, 0.0, 0.0)
    crowd = dataclasses.replace(crowd, dolls=tuple(
        dataclasses.replace(placement, velocity=speed)
        for placement, speed in zip(crowd.dolls, speeds, strict=True)))
    scales = BoneDepth(crowd)
    with Simulation(crowd, engine='rigid') as simulation:
        first = sum(conserved(crowd, simulation.state, doll).momentum for doll in range(3))
        start, deepest = conserved(crowd, simulation.state, 0).momentum[0], 0.0
        for _ in range(120):
            simulation.advance()
            deepest = max(deepest, scales.depths(
                simulation.state.positions, simulation.state.orientations).max())
        last = [conserved(crowd, simulation.state, doll).momentum for doll in range(3)]
    assert sum(last) == pytest.approx(first, abs=1e-9)
    assert last[0][0] < start - 10 and last[1][1] > 100
    assert deepest < 1e-3


@pytest.mark.parametrize('wait', [1, 6])
def test_a_push_on_one_of_two_that_sleep_on_each_other_acts_at_once(wait):
    """On the second in the scene's order, however long ago their cluster was made."""
    for height in np.arange(1.6, 4.0, 0.2):
        crowd = field(2, 0.0, (0.0, height))
        with Simulation(crowd, engine='rigid') as simulation:
            engine, mass = simulation._engine, crowd.dolls[1].doll.mass
            while not simulation.asleep:
                simulation.advance()
                assert simulation.time < 60e9
            if len(set(engine.cluster_of_doll.tolist())) > 1:
                continue  # they do not lie on each other
            engine._age[:] = wait
            simulation.push(Push('doll_1/torso', (0.0, 0.0, 30.0 * mass), duration=0.05))
            simulation.advance()
            assert conserved(crowd, simulation.state, 1).momentum[2] > 0.1 * mass
            return
    pytest.fail('in no fall did they come to lie on each other')
