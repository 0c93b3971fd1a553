"""What acts on a simulation, told and done again: the same bits, through JSON, by every engine."""
from __future__ import annotations

import dataclasses
import hashlib
import json
import struct
from pathlib import Path

import pytest
from digests import disturb

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.run_scene import SceneTexts, read_run_scene, run_scene_text, versions
from ragdoll_ros.files.scene import load_scene, scene_text
from ragdoll_ros.model import errors
from ragdoll_ros.model.drive import Drive
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.accuracy import NORMAL, Accuracy
from ragdoll_ros.physics.logged_simulation import (
    LoggedSimulation,
    accuracy_from,
    apply_event,
    state_digest,
)
from ragdoll_ros.physics.simulation import Simulation

QUIET = {'checkpoint', 'advance', 'run', 'measures', 'ledger', 'close', 'swings', 'contacts',
         'body_pose', 'coordinates', 'starts', 'parts', 'trail', 'record_impacts', 'prepare_add',
         'prepare_remove', 'add', 'remove'}
"""Public names of Simulation that change nothing, or only by the ticks that are counted, its
deprecated names, which lead to new ones, and those of which carry_out() is told."""


def disturb_more(simulation, tick):
    """What disturb() leaves out, with numbers that no short decimal gives."""
    disturb(simulation, tick)
    if tick == 30:
        simulation.push(Push('head', (1 / 3, 0.1, -2e-7), duration=1 / 7), 'keys')
    elif tick == 33:
        simulation.release('keys')
    elif tick == 60:
        simulation.push(Drive('torso', (0.1, 1 / 3, 0), duration=1 / 7), 'cmd_vel')
    elif tick == 100:
        simulation.accuracy = 'draft'
    elif tick == 120:
        simulation.step = 1 / 240
    elif tick == 130:
        simulation.place(simulation.coordinates)
    elif tick == 170:
        simulation.accuracy = dataclasses.replace(NORMAL, step=1 / 300)
    elif tick == 40 and simulation.engine_name == 'rigid':
        simulation.hold('left_shin', 1000 / 3, 0.1)
    elif tick == 55 and simulation.engine_name == 'rigid':
        simulation.go_limp(['left_shin'])
    elif tick == 175:
        simulation.samples_per_tick = 3
    elif tick == 180:
        simulation.reset()


def recorded_run(scene, engine, ticks):
    """Digests of all states, and all acts as lines of JSON, each with its tick."""
    lines, digests = [], []
    with LoggedSimulation(scene, engine=engine) as simulation:
        simulation.on_event = lambda name, given: lines.append(
            json.dumps([len(digests), name, given]))
        for tick in range(ticks):
            disturb_more(simulation, tick)
            digests.append(state_digest(simulation.advance()))
    return digests, lines


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
def test_the_same_acts_give_the_same_bits(engine):
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet', 'mujoco': 'mujoco'}[engine])
    scene = load_scene('drop')
    digests, lines = recorded_run(scene, engine, 220)
    acts = [json.loads(line) for line in lines]
    kinds = 13 if engine == 'rigid' else 11  # the others hold no joints
    assert len({name for _, name, _ in acts}) == kinds, 'every kind of act'
    again, _ = read_run_scene(run_scene_text(scene))
    with Simulation(again, engine=engine) as simulation:
        for tick, digest in enumerate(digests):
            for _, name, arguments in [act for act in acts if act[0] == tick]:
                apply_event(simulation, name, arguments)
            assert state_digest(simulation.advance()) == digest, tick


def test_every_way_to_act_is_told():
    """A method that is added to Simulation must be told, or stand among the quiet ones."""
    ways = {name for name, value in vars(Simulation).items() if not name.startswith('_') and (
        callable(value) or getattr(value, 'fset', None))}
    assert ways - QUIET == {name for name in vars(LoggedSimulation) if name in ways}


def test_a_digest_is_that_of_the_rows_of_doubles():
    with Simulation(load_scene('crowd')) as simulation:
        state = simulation.advance()
    numbers = [value for row in state.rows.tolist() for value in row]
    packed = struct.pack(f'<{len(numbers)}d', *numbers)
    assert state_digest(state) == hashlib.sha256(packed).hexdigest()


def test_what_ends_no_push_is_not_told():
    told = []
    with LoggedSimulation(load_scene('flight')) as simulation:
        simulation.on_event = lambda name, given: told.append(name)
        simulation.release('keys')
        simulation.push(Push('head', (1, 0, 0)), 'keys')
        simulation.release('keys')
    assert told == ['push', 'release']


def test_what_is_refused_is_not_told():
    told = []
    with LoggedSimulation(load_scene('flight')) as simulation:
        simulation.on_event = lambda name, given: told.append(name)
        with pytest.raises(errors.UnknownBone):
            simulation.push(Push('tail', (1, 0, 0)))
        with pytest.raises(errors.OutOfRange):
            simulation.step = 10.0
    assert told == []


@pytest.mark.parametrize(('name', 'arguments'), [
    ('explode', {}), ('__class__', {}), ('push', {'bone': 'head'}), ('grab', {'hand': 'a'}),
    ('push', {'bone': 'head', 'channel': None, 'x': 1}),
    ('push', {'bone': 'head', 'channel': None, 'force': 'abc'}),
    ('drag', {'hand': 'a', 'target': ['x', 0, 0], 'within': 0.1}), ('step', {'step': 'a'}),
    ('accuracy', {'step': 'a'}), ('place', {'q': [], 'v': []})])
def test_what_is_no_act_is_refused_by_name(name, arguments):
    with Simulation(load_scene('flight')) as simulation, pytest.raises(errors.ModelError) as caught:
        apply_event(simulation, name, arguments)
    assert 'expected' in str(caught.value)


@pytest.mark.parametrize('wrong', [{'step': 'a'}, {'stride': 1}, {},
                                   {**dataclasses.asdict(NORMAL), 'step': 'a'},
                                   {**dataclasses.asdict(NORMAL), 'step': -1}])
def test_an_accuracy_that_is_none_is_refused(wrong):
    assert accuracy_from(dataclasses.asdict(NORMAL)) == NORMAL
    assert isinstance(accuracy_from(dataclasses.asdict(NORMAL)), Accuracy)
    with pytest.raises(errors.ModelError, match='accuracy'):
        accuracy_from(wrong)


@pytest.mark.parametrize('name', ['drop', 'crowd', 'ponytail', 'field'])
def test_a_scene_is_read_again_as_it_was(name):
    scene = dataclasses.replace(load_scene(name), ground=Ground((0.1, 0.2, 1 / 3), 1 / 3))
    text = run_scene_text(scene)
    again, told = read_run_scene(text)
    assert again == scene and told == versions()
    assert len({id(each.doll) for each in again.dolls}) == len({id(e.doll) for e in scene.dolls})
    assert text.count('bones:') == 1, 'equal dolls are written once'


def test_texts_of_dolls_are_kept_and_make_the_same_text():
    """As dolls come and go, shared in any order: that of the writer of files, to the letter."""
    texts, each = SceneTexts(), [load_doll(name) for name in ('man', 'doll', 'woman')]
    for order in ([0], [0, 1], [0, 1, 1, 2, 0, 2, 2], [1, 2, 1], [2]):
        scene = Scene('one', tuple(Placement(each[k], f'doll {n}') for n, k in enumerate(order)))
        texts.keep(scene)
        assert run_scene_text(scene, texts) == scene_text(
            scene, Path('/'), f'versions: {versions()}')
    zeros = [Ragdoll('a', (Bone('b', Sphere(1.0), 1.0, (x, 0, 0)),)) for x in (0.0, -0.0)]
    assert zeros[0] == zeros[1]
    assert [('-0.0' in texts.dolls[doll]) for doll in zeros] == [False, True]


def test_a_text_without_versions_is_no_scene_of_a_run():
    with pytest.raises(errors.RagdollError, match='versions'):
        read_run_scene('dolls: []')
