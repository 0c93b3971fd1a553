"""What is put into an engine from outside, and what a guard makes of it."""
from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from poison import POISONS, poison

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.push import Push
from ragdoll_ros.physics.engine.registry import resolve_engine
from ragdoll_ros.physics.guard import Guard
from ragdoll_ros.physics.simulation import Simulation


def all_of(simulation):
    return simulation.state.rows.copy(), simulation.time, simulation.measures()['energy_excess_J']


@pytest.mark.parametrize('ticks', [5, 60], ids=['in flight', 'on the ground'])
@pytest.mark.parametrize('engine, kind', [
    (engine, kind) for engine in ('rigid', 'bullet', 'mujoco') for kind in POISONS
    # By PyBullet the account takes out by itself what nothing has put in.
    if (engine, kind) != ('bullet', 'energy')])
def test_a_bad_state_is_taken_back_and_the_doll_goes_on(engine, ticks, kind):
    if engine == 'mujoco':
        pytest.importorskip('mujoco')
    with Simulation(load_scene('drop'), engine=engine) as simulation:
        guard = Guard(simulation)
        simulation.push(Push('torso', (300, 0, 0)))
        for _ in range(ticks):
            assert guard.advance() is None
        rows, time, excess = all_of(simulation)
        reason = poison(simulation, kind)
        bad = guard.advance()
        assert bad is not None and (reason in bad.reason or engine != 'rigid')
        # Forward kinematics round anew.
        np.testing.assert_allclose(simulation.state.rows, rows, rtol=1e-12, atol=1e-9)
        assert simulation.time == time
        assert simulation.measures()['energy_excess_J'] == pytest.approx(excess, abs=1e-6)
        for _ in range(200):
            assert guard.advance() is None
        assert simulation.time == time + 200 * simulation.tick
        # Whatever it was, the doll still is one, and lies.
        assert simulation.measures()['joint_gap_m'] < 1e-3
        assert abs(simulation.state.positions[:, 2]).max() < 2


def test_after_it_the_doll_goes_on_as_if_nothing_had_been():
    """In flight nothing is known of contacts that could be lost: to rounding."""
    paths = []
    for spoilt in (False, True):
        with Simulation(load_scene('flight')) as simulation:
            guard = Guard(simulation)
            for tick in range(60):
                if spoilt and tick == 30:
                    poison(simulation, '1e12 m')
                    assert guard.advance() is not None
                guard.advance()
            paths.append(simulation.state.positions)
    np.testing.assert_allclose(*paths, atol=1e-6)  # a path of flight begins anew: its error


def test_one_bad_doll_of_a_crowd_is_found():
    with Simulation(load_scene('crowd'), workers=2) as simulation:
        guard, found = Guard(simulation), 0
        for tick in range(150):
            doll = tick % 10
            if tick % 15 == 7 and not simulation._engine.sleeping[doll]:
                poison(simulation, 'a NaN of speed', slice(doll, doll + 1))
                assert guard.advance() is not None
                found += 1
            assert guard.advance() is None
            assert np.isfinite(simulation.state.rows).all()
        assert found > 3


def test_a_start_elsewhere_is_no_jump():
    """A reset, and a place with ten times the energy, are what somebody wanted."""
    with Simulation(load_scene('drop')) as simulation:
        guard = Guard(simulation)
        for _ in range(50):
            guard.advance()
        simulation.reset()
        assert guard.advance() is None and simulation.time == simulation.tick
        here = simulation.coordinates
        simulation.place(GeneralizedState(here.q, np.full_like(here.v, 3.0)))
        assert guard.advance() is None and simulation.time == simulation.tick


@pytest.mark.parametrize('engine', ['rigid', 'bullet'])
def test_hard_pushes_and_grabs_are_no_bad_states(engine):
    """The strongest that the node lets through: 10 kN and 1 kN m, on any bone."""
    rng = np.random.default_rng(7)
    with Simulation(load_scene('drop'), engine=engine) as simulation:
        guard, names = Guard(simulation), simulation.scene.bone_names
        for tick in range(600 if engine == 'rigid' else 200):
            if tick % 10 == 0:
                force, torque = rng.normal(size=(2, 3))
                simulation.push(Push(names[rng.integers(10)],
                                     tuple(10_000 * force / np.linalg.norm(force)),
                                     tuple(1000 * torque / np.linalg.norm(torque)),
                                     duration=0.02, local=bool(tick % 20)))
            if tick % 50 == 0:
                simulation.grab('hand', names[rng.integers(10)], target=(0.0, 0.0, 2.0))
            if tick % 50 == 25:
                simulation.let_go('hand')
            assert guard.advance() is None


def test_energy_is_judged_by_cluster():
    """Of a hundred dolls that are apart, one gains 30 J: a fifth of its own scale, and less than a
    hundredth of that of all.
    """
    scene = load_scene('drop')
    scene = dataclasses.replace(scene, dolls=tuple(
        dataclasses.replace(scene.dolls[0], name=f'doll_{k}', position=(2.5 * k, 0.0, 1.0))
        for k in range(100)))
    with Simulation(scene, engine='rigid') as simulation:
        guard = Guard(simulation)
        assert guard.advance() is None
        engine = simulation._engine
        engine._clusters.v[engine.layout.doll_v[7]][:3] += (1.0, 0.0, 0.0)
        engine._clusters.gather_state()
        engine._clusters.invalidate()
        bad = guard.advance()
        assert bad is not None and 'energy rose' in bad.reason


def test_a_guard_leaves_the_simulation_its_bits():
    rows = []
    for guarded in (False, True):
        with Simulation(load_scene('crowd')) as simulation:
            step = Guard(simulation).advance if guarded else simulation.advance
            for _ in range(100):
                step()
            rows.append(simulation.state.rows)
    np.testing.assert_array_equal(*rows)


def test_every_engine_says_what_error_of_energy_is_its_own():
    for name in ('rigid', 'bullet'):
        assert 0 < resolve_engine(name).make.energy_error < 1


def test_no_other_thread_works_on_after_a_look_at_a_crowd():
    """OpenBLAS's spin for 0.1 s after each sum of more than 10 000 numbers: a core, at 100 Hz."""
    scene = load_scene('crowd')
    scene = dataclasses.replace(scene, dolls=tuple(
        dataclasses.replace(scene.dolls[0], name=f'doll_{k}', position=(2.5 * k, 0.0, 1.0))
        for k in range(100)))
    with Simulation(scene) as simulation:
        guard, others = Guard(simulation), -thread_times()
        for _ in range(30):
            assert guard.advance() is None
            time.sleep(0.005)  # what does nothing takes none of a processor's time
        assert others + thread_times() < 0.03, 's, of 0.15'


def thread_times():
    """Time, s, that this process's other threads had of processors."""
    return time.process_time() - time.thread_time()
