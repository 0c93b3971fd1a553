"""The whole, compiled or not: the same flight, the same long tick, a plausible fall."""
from __future__ import annotations

import dataclasses
import functools
import json
import math
import os
import subprocess
import sys
from pathlib import Path as File

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing is compiled')
pytest.importorskip('scipy')

from conserved import conserved
from samples import GRAVITY, TURN, each_tree, every_kind, random_coordinates, scene_of

from ragdoll_ros.accuracy.motions.motion import without_limits
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.physics import backend
from ragdoll_ros.physics.kernels import SWITCH
from ragdoll_ros.physics.settings import resolve_accuracy
from ragdoll_ros.physics.simulation import Simulation


def tick_by_tick(name, ticks):
    """What the whole does: states, energies over the account, and measures, as plain numbers.

    'flight': all kinds of joints, no limit near, nothing to touch. 'fall': onto the ground.
    """
    fall = name == 'fall'
    doll = load_doll('doll') if fall else every_kind()
    settings = {'ground': Ground(), 'self_collision': True} if fall else {}
    placement = Placement(doll, position=(0, 0, .3))
    if fall:
        placement = dataclasses.replace(placement, orientation=TURN, spin=(1, 2, 3))
    scene = Scene(name, (placement,), **{'self_collision': False, **settings})
    rows, excess, told = [], [], []
    with Simulation(scene, accuracy='normal' if fall else 'exact') as simulation:
        start = simulation.coordinates
        if not fall:
            v = np.random.default_rng(7).uniform(-2, 2, start.v.size)
            start = GeneralizedState(start.q, v)
            simulation.place(start)
        lowest = conserved(scene, simulation.state).energy
        for _ in range(ticks):
            state = simulation.advance()
            motion = conserved(scene, state)
            excess.append((motion.energy - lowest) / motion.kinetic)
            lowest = min(lowest, motion.energy)
            rows.append(np.concatenate([state.positions, state.orientations], axis=1).tolist())
            told.append(simulation.measures())
    told = {'ready': backend.ready(), 'rows': rows, 'excess': excess, 'measures': told}
    return told, scene, start


@pytest.fixture(scope='module')
def plainly():
    """The same, without anything compiled, in a process of its own."""
    root = File(__file__).resolve().parent.parent
    code = ('import json, test_compiled as test\n'
            'runs = [test.tick_by_tick(*run)[0] for run in (("flight", 28), ("fall", 100))]\n'
            'print(json.dumps(runs))')
    path = os.pathsep.join([str(root), str(root / 'test'), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True,
                          env={**os.environ, SWITCH: '0', 'PYTHONPATH': path})
    flight, fall = json.loads(done.stdout.splitlines()[-1])
    assert not flight['ready']
    return {'flight': flight, 'fall': fall}


def test_a_flight_is_the_same_compiled_or_not(plainly, monkeypatch):
    """Compiled it is the reference's, measured: to 2e-15 m; an angle is told to 1e-8.

    The plain one errs as it says in each tick, and what it errs grows with the motion; a bone of
    5 cm that twists against its damping errs by 3e-5 rad about its middle.
    """
    monkeypatch.setattr(backend, 'ready', lambda: True)
    (found, scene, start), plain = tick_by_tick('flight', 28), plainly['flight']
    assert all(told['error_trusted'] for told in found['measures'] + plain['measures'])
    assert max(told['error_estimate_m'] for told in found['measures']) < 1e-12
    (tree, q, v), = each_tree(scene, start, scene.gravity)
    right = tree.trajectory(q, v, np.arange(29) * .01)
    here, there = np.array(found['rows']), np.array(plain['rows'])
    assert np.abs(here[..., :3] - right.positions[1:]).max() < 1e-11
    assert rotation.angle_between(here[..., 3:], right.orientations[1:]).max() < 1e-7
    errors = np.cumsum([told['error_estimate_m'] for told in plain['measures']])
    missed = np.linalg.norm(here[..., :3] - there[..., :3], axis=2).max(axis=1)
    assert (missed < 5 * errors).all()
    assert rotation.angle_between(here[..., 3:], there[..., 3:]).max() < 1e-4


FREE = scene_of(without_limits(load_doll('doll')))
START = random_coordinates(FREE, 1)


@functools.cache
def true_end():
    """Where it is after 0.4 s, m."""
    (tree, q, v), = each_tree(FREE, START, GRAVITY)
    return tree.trajectory(q, v, (0, .4)).positions[-1]


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_long_tick_is_flown_as_well_as_a_short_one(accuracy, monkeypatch):
    """All of it: by the engine's own steps it would err by centimetres.

    The tolerance is each step's; 100 times that is what many, and chaos, may make of it in 0.4 s.
    """
    monkeypatch.setattr(backend, 'ready', lambda: True)
    tolerance = max(resolve_accuracy(accuracy).flight_error, 1e-14)
    for tick in (.01, .1, .2):
        with Simulation(FREE, step=tick, accuracy=accuracy) as simulation:
            simulation.place(START)
            for _ in range(round(.4 / tick)):
                state = simulation.advance()
                assert simulation.stats.substeps == 0
        assert np.abs(state.positions - true_end()).max() < 100 * tolerance


@pytest.mark.parametrize('ready', [True, False], ids=['compiled', 'plain'])
def test_a_fall_is_plausible_compiled_or_not(ready, plainly, monkeypatch):
    """Bounds are those of the whole: 0.1 % of the energy, 1 cm, 5 degrees."""
    monkeypatch.setattr(backend, 'ready', lambda: True)
    found = tick_by_tick('fall', 100)[0] if ready else plainly['fall']
    places, turns = np.split(np.array(found['rows']), [3], axis=-1)
    # 2.5 m: it starts within 1.5 m of the origin and lands beside it.
    assert np.abs(places).max() < 2.5
    assert np.linalg.norm(turns, axis=-1) == pytest.approx(np.ones(turns.shape[:-1]), abs=1e-9)
    assert max(found['excess']) < 1e-3
    for told in found['measures']:
        assert -55 * 9.8 * 2 < told['energy_excess_J'] < 1
        assert 0 <= told['error_estimate_m'] < .001
        assert told['joint_gap_m'] < 1e-9
        assert told['sinking_m'] < .01
        assert math.degrees(told['limit_overshoot_rad']) < 5
        assert told['stopped_total'] == 0
    assert sum(told['flights'] for told in found['measures']) > 3
    assert sum(told['substeps'] for told in found['measures']) > 100
    assert places[-1, :, 2].max() < .5  # it is down
