"""Simulation.add and remove: dolls come and go while time goes on."""
from __future__ import annotations

import dataclasses
import gc
import random
import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from ragdoll_ros import Push, Simulation, load_doll
from ragdoll_ros.model import errors
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import SECOND, Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.model.static_body import StaticBody
from ragdoll_ros.model.swing import Swing, strand
from ragdoll_ros.physics.guard import Guard
from ragdoll_ros.physics.logged_simulation import LoggedSimulation, apply_event, state_digest

RADIUS, GRAVITY = 0.1, 9.8
BALL = Ragdoll('ball', (Bone('ball', Sphere(RADIUS), 1.0, (0, 0, 0)),))
DOLL = load_doll('doll')
BONES = len(DOLL.bones)


def ball(name='ball', position=(0, 20, RADIUS), **fields):
    return Placement(BALL, name, position, **fields)


def dolls(count, apart=3.0, doll=DOLL):
    """Dolls that fall; those 0.3 m apart fall on each other."""
    return Scene('dolls', tuple(
        Placement(doll, f'doll{k}', (apart * k, 0, 0.5), spin=(0, 0.3, 0))
        for k in range(count)), Ground())


@pytest.mark.parametrize(('count', 'apart'), [(1, 3.0), (2, 0.3), (3, 3.0), (8, 0.3), (12, 3.0)])
def test_others_keep_their_bits(count, apart):
    """In flight and on the ground, of whatever size and weight is what comes and goes."""
    with Simulation(dolls(count, apart)) as one, Simulation(dolls(count, apart)) as other:
        for k in range(80):
            if k == 20:
                one.add(ball())
                one.add(Placement(DOLL, position=(0, 9, 0.5), spin=(1, 0, 0)))
            if k == 50:
                one.remove('ball')
            assert (one.advance().rows[:count * BONES] == other.advance().rows).all()
        assert one.time == other.time


def test_what_is_prepared_beside_ticks_is_what_is_done_at_once():
    """Prepared in a thread while ticks are made, also several at once; and told as one by one."""
    newcomers = [Placement(DOLL, f'new{k}', (0.2 * k, 0.1, 1.5), spin=(1, 0, 0), angles={
        'left_shin': 0.1}) for k in range(3)]
    told = []
    with LoggedSimulation(dolls(4, 0.3)) as one, Simulation(dolls(4, 0.3)) as other:
        one.on_event = lambda name, given: told.append((name, given))
        with ThreadPoolExecutor() as threads:
            for prepare in (lambda: one.prepare_add(newcomers),
                            lambda: one.prepare_remove('doll2')):
                waiting = threads.submit(prepare)
                while not waiting.done() or one.time < SECOND:
                    assert (one.advance().rows == other.advance().rows).all()
                one.carry_out(waiting.result())
                while told:
                    apply_event(other, *told.pop(0))
        for _ in range(100):
            assert (one.advance().rows == other.advance().rows).all()
        assert one.energy_excess == other.energy_excess
        stale = one.prepare_remove('doll0')
        one.remove('doll1')
        with pytest.raises(errors.WrongForm, match='another scene'):
            one.carry_out(stale)


def test_others_fall_asleep_and_sleep_on_as_without():
    """By their own size: a pebble that comes does not hold them awake. A pair of them touch."""
    scene = dataclasses.replace(dolls(3), dolls=(
        *dolls(3).dolls, Placement(DOLL, 'on_top', (3, 0, 1.5))))
    pebble = Ragdoll('pebble', (Bone('pebble', Sphere(0.01), 0.01, (0, 0, 0)),))
    with Simulation(scene) as one, Simulation(scene) as other:
        while not other.asleep:
            name = f'pebble{one.time}'
            one.add(Placement(pebble, name, (9, 9, 0.05)))
            assert (one.advance().rows[:4 * BONES] == other.advance().rows).all()
            one.advance()
            other.advance()
            one.remove(name)
        assert one.asleep
        at_rest = one.state.rows
        one.add(ball(position=(0, 9, 2)))
        assert not one.asleep
        for _ in range(30):
            one.advance()
        assert (one.state.rows[:4 * BONES] == at_rest).all()
        one.remove('ball')
        assert one.asleep


def test_what_hits_others_changes_no_third():
    """Balls fall on one doll, while two others roll over each other far away."""
    scene = dataclasses.replace(dolls(3), dolls=(
        *dolls(2).dolls, Placement(DOLL, 'on_top', (3.1, 0, 1.5))))
    with Simulation(scene) as one, Simulation(scene) as other:
        for k in range(100):
            if k % 20 == 7:
                above = one.state.positions[0] + (0.1, 0, 0.6)
                one.add(ball(f'ball{k}', tuple(above.tolist()), velocity=(0, 0, -3)))
            if k % 20 == 19:
                one.remove(f'ball{k - 12}')
            rows, alone = one.advance().rows, other.advance().rows
            assert (rows[BONES:3 * BONES] == alone[BONES:]).all()
        assert not (rows[:BONES] == alone[:BONES]).all()


def test_pushes_hands_and_springs_go_on():
    """From one doll, whose bones have no prefix, to three, and back."""
    with Simulation(dolls(1)) as one, Simulation(dolls(1)) as other:
        for k in range(60):
            if k == 5:
                for simulation in (one, other):
                    simulation.push(Push('torso', (100, 0, 0), duration=0.3), 'keys')
                    simulation.push(Push('head', (0, 50, 0), start=0.3))
                    simulation.grab('hand', 'left_forearm', target=(0, 0, 1))
                    simulation.hold('left_shin', 300, 5)
            if k == 10:
                one.add(ball())
                one.add(ball('second', (0, 25, 1)))
                assert [push.bone for push in one.pushes] == ['doll0/torso']
                assert [grab.bone for grab in one.grabs] == ['doll0/left_forearm']
                assert [spring.angle for spring in one.holds] == ['doll0/left_shin']
                one.grab('other', 'ball/ball', target=(0, 20, 2))
                one.push(Push('second/ball', (0, 9, 0), duration=9), 'keys of the ball')
            if k == 40:
                one.remove('ball')
                assert [grab.hand for grab in one.grabs] == ['hand']
                one.remove('second')
                assert one.pushes == other.pushes and one.holds == other.holds
            assert (one.advance().rows[:BONES] == other.advance().rows).all()


@pytest.mark.parametrize('mode', ['spring', 'free'])
def test_swings_go_on(mode):
    """To the bit where none comes or goes; else from where they are, with their velocities."""
    links = strand(3, 0.3, 0.1, (0.5, 0.05), 0.4) if mode != 'free' else strand(1, 0.1)
    tailed = dataclasses.replace(DOLL, swings=(Swing(
        'tail', 'torso', (-0.05, 0, 0.95), (-1, 0, 0), links, mode=mode),))
    with Simulation(dolls(2, doll=tailed)) as one, Simulation(dolls(2, doll=tailed)) as other:
        for k in range(40):
            if k == 10:
                one.add(ball())
            if k == 20:
                one.remove('ball')
            one.advance(), other.advance()
            assert (one.swings.positions == other.swings.positions).all()
        one.add(dataclasses.replace(dolls(1, doll=tailed).dolls[0], name='c', position=(0, 9, 1)))
        one.remove('doll0')
        masses = len(links)
        for _ in range(20):
            # what is normalised again differs by rounding
            assert one.swings.positions[:masses] == pytest.approx(
                other.swings.positions[masses:], abs=1e-9)
            assert one.swings.velocities[:masses] == pytest.approx(
                other.swings.velocities[masses:], abs=1e-8)
            one.advance(), other.advance()
        one.remove('c')
        one.add(ball())
        one.remove('doll1')
        assert one.swings is None
        one.add(dolls(1, doll=tailed).dolls[0])
        assert len(one.swings.positions) == masses


def test_what_comes_flies_along_its_parabola():
    with Simulation(dolls(1)) as simulation:
        simulation.run(20)
        place, velocity, time = np.array([0.0, 5, 2]), np.array([2.0, -1, 4]), 0.5
        state = simulation.add(ball('b', tuple(place), velocity=tuple(velocity)))
        assert state.positions[-1] == pytest.approx(place)
        simulation.run(50)
        assert simulation.state.positions[-1] == pytest.approx(
            place + velocity * time - [0, 0, GRAVITY * time ** 2 / 2], abs=1e-9)


def test_the_account_of_energy_stays_closed():
    """Excess and work are the same after each change; in flight nothing is lost: energy is that at
    the start, what came, less what went, and the work of a push on what is gone.
    """
    flying = Scene('flying', dolls(2).dolls, None)
    with Simulation(flying) as simulation, Simulation(flying) as other:
        guard = Guard(simulation)

        def account():
            return np.array([simulation.energy_excess, *simulation.work])

        before = account()
        for k in range(5):
            simulation.add(ball(f'ball{k}', (0, 9 + k, 3), velocity=(k, 0, 0)))
            assert account() == pytest.approx(before, abs=1e-9)
            simulation.push(Push(f'ball{k}/ball', (10, 0, 0), duration=0.05))
            for _ in range(10):
                assert guard.advance() is None
            before = account()
            simulation.remove(f'ball{k}')
            assert account() == pytest.approx(before, abs=1e-9)
        # 5 balls of 1 kg at speed k gain 0.5 m/s each: sum of (k + 0.25) / 2
        assert simulation.work[0] == pytest.approx(sum((k + 0.25) / 2 for k in range(5)), rel=1e-6)
        other.run(50)
        assert simulation.energy_excess == pytest.approx(other.energy_excess, abs=1e-6)
        simulation.go_back(simulation.checkpoint())
        assert account() == pytest.approx(before, abs=1e-9)
        simulation.reset()
        assert np.abs(account()).max() < 1e-12


def test_what_rested_on_it_wakes_and_falls():
    """A box on a box; the lower one goes. With a static body near, which stays a contact."""
    box = Ragdoll('box', (Bone('box', Box((0.2, 0.2, 0.2)), 2.0, (0, 0, 0)),))
    table = StaticBody('table', Box((2, 2, 0.5)), (0, 0, 0.25))
    scene = Scene('boxes', tuple(Placement(box, name, position) for name, position in (
        ('low', (0, 0, 0.61)), ('high', (0, 0, 0.83)), ('far', (0, 5, 0.11)))),
        Ground(), bodies=(table,))
    with Simulation(scene) as simulation:
        while not simulation.asleep:
            simulation.advance()
        far = simulation.state.rows[2]
        simulation.remove('low')
        assert not simulation.asleep
        while not simulation.asleep:
            simulation.advance()
        assert simulation.state.positions[0, 2] == pytest.approx(0.6, abs=1e-3)
        assert (simulation.state.rows[1] == far).all()


def test_a_reset_restores_the_start_of_the_scene_after():
    """That of a simulation that is made with it, whatever has been placed."""
    with Simulation(dolls(2)) as simulation:
        simulation.run(10)
        simulation.add(ball())
        simulation.remove('doll0')
        simulation.run(10)
        with Simulation(simulation.scene) as fresh:
            assert state_digest(simulation.reset()) == state_digest(fresh.state)
            assert state_digest(simulation.advance()) == state_digest(fresh.advance())
        coordinates = simulation.coordinates
        start = state_digest(simulation.place(coordinates))
        simulation.add(ball('other'))
        simulation.remove('other')
        simulation.run(10)
        assert state_digest(simulation.reset()) == start


@pytest.mark.parametrize(('change', 'error', 'text'), [
    (lambda s: s.add(ball('doll0')), errors.DuplicateName, "'doll0'; expected a unique name"),
    (lambda s: s.remove('dol'), errors.UnknownDoll, "'dol'; expected one of doll0"),
    (lambda s: s.remove('doll0'), errors.WrongForm, 'at least one doll')])
def test_what_is_wrong_is_named_and_changes_nothing(change, error, text):
    with Simulation(dolls(1)) as simulation, Simulation(dolls(1)) as other:
        with pytest.raises(error, match=text):
            change(simulation)
        assert (simulation.run(3) == other.run(3)).all()
    with pytest.raises(errors.Closed):
        simulation.add(ball())


def test_other_engines_say_that_they_do_not():
    with Simulation(dolls(1), engine='bullet') as simulation:
        with pytest.raises(errors.WrongForm, match='rigid, which adds and removes'):
            simulation.add(ball())
        simulation.advance()


def random_action(chance, simulation, count):
    """A spawn, a delete, a set of a state, a reset or a push; at most 8 dolls."""
    names = [placement.name for placement in simulation.scene.dolls]
    place = (chance.uniform(-1, 1), chance.uniform(-1, 1), chance.uniform(0.3, 2))
    kind = chance.choice(['add', 'add', 'remove', 'set_state', 'push', 'grab', 'reset'])
    if kind == 'add' and len(names) < 8:
        simulation.add(chance.choice([ball(f'ball{count}', place), Placement(
            DOLL, f'doll{count}', place, spin=(0, chance.uniform(-3, 3), 0))]))
    elif kind == 'remove' and len(names) > 2:
        simulation.remove(chance.choice(names[1:]))
    elif kind == 'set_state' and names[1:]:
        simulation.set_state(chance.choice(names[1:]), place,
                             velocity=(chance.uniform(-3, 3), 0, 0))
    elif kind == 'push' and names[1:]:
        simulation.push(Push(chance.choice(simulation.scene.bone_names[BONES:]),
                             (chance.uniform(-200, 200), 0, 99)), 'keys')
    elif kind == 'grab' and names[1:]:
        simulation.grab('hand', chance.choice(simulation.scene.bone_names[BONES:]),
                        target=(0, 0, 1))
    elif kind == 'reset' and chance.random() < 0.3:
        simulation.reset(keep_time=chance.random() < 0.5)
        return True
    return False


@pytest.mark.slow
def test_many_random_changes():
    """200: finite, memory flat, a doll far away keeps its bits, and the log repeats the run."""
    chance, scene, log = random.Random(7), Scene('far', (Placement(
        DOLL, 'far', (50, 0, 0.5), spin=(0, 0.3, 0)),), Ground()), []
    tracemalloc.start()
    with LoggedSimulation(scene) as one, Simulation(scene) as alone, Simulation(scene) as twin:
        one.on_event = lambda name, arguments: log.append((tick, name, arguments))
        tick, memory, digests = 0, [], []
        for count in range(200):
            if random_action(chance, one, count):
                alone.reset()
            for _ in range(chance.randrange(12)):
                state = one.advance()
                tick += 1
                digests.append(state_digest(state))
                assert np.isfinite(state.rows).all()
                assert (state.rows[:BONES] == alone.advance().rows).all()
            if count % 50 == 49:
                gc.collect()
                memory.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.stop()
        # what eight dolls, the log and the digests take, of 2 MB a doll of the start
        assert memory[-1] < memory[0] + 8e6, memory
        events = iter(log)
        event = next(events, None)
        for tick, digest in enumerate(digests):
            while event and event[0] == tick:
                apply_event(twin, *event[1:])
                event = next(events, None)
            assert state_digest(twin.advance()) == digest
