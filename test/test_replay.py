"""ragdoll_replay: recordings are read, whole or torn, repeated to the bit, and compared."""
from __future__ import annotations

import dataclasses
import json
import sys

import numpy as np
import pytest
from bags import messages_of_a_run, write_bag
from digests import disturb
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.run_scene import run_scene_text, versions
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Placement
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.save import FORMATS
from ragdoll_ros.replay.command import main

TICKS = 200


def act(simulation, tick):
    disturb(simulation, tick)
    if tick == 120:
        simulation.step = 1 / 150
    elif tick == 140:
        simulation.accuracy = 'draft'
    elif tick == 160:
        simulation.reset()


@pytest.fixture(scope='module')
def messages():
    return messages_of_a_run(load_scene('drop'), TICKS, act)


@pytest.fixture
def replay(capsys):
    """Run the command; give its exit code, what it prints and what it warns of."""
    def run(*arguments):
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        return code, *capsys.readouterr()
    return run


def events(messages):
    return [json.loads(text) for topic, text in messages if topic.endswith('/events')]


def with_events(messages, changed):
    """The messages with other events."""
    scenes = [each for each in messages if not each[0].endswith('/events')]
    return [*scenes, *(('/ragdoll/events', json.dumps(event)) for event in changed)]


@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_a_run_is_repeated_to_the_bit_from_a_folder_or_a_file(tmp_path, replay, messages, suffix):
    file = write_bag(tmp_path / 'bag', messages, suffix)
    for path in (tmp_path / 'bag', file):
        code, said, warned = replay(path)
        assert (code, warned) == (0, '')
        assert '/ragdoll: scene drop' in said
        assert f'{TICKS} ticks' in said and '21 of 21 hashes equal' in said
    (tmp_path / 'bag/metadata.yaml').unlink()  # as where the recorder was killed
    assert replay(tmp_path / 'bag')[0] == 0


def test_dolls_that_come_and_go_do_so_again(tmp_path, replay):
    def come_and_go(simulation, tick):
        if tick == 10:
            simulation.add(Placement(load_doll('doll'), 'second', (0.1, 0.2, 1.3), spin=(0, 1, 0),
                                     angles={'left_shin': 0.1}))
        if tick == 50:
            simulation.remove('doll')

    code, said, warned = replay(write_bag(tmp_path / 'bag', messages_of_a_run(
        load_scene('drop'), 80, come_and_go)))
    assert (code, warned) == (0, '') and '2 events repeated, 9 of 9 hashes equal' in said


def test_one_number_that_is_another_is_found_at_the_next_hash(tmp_path, replay, messages):
    changed = events(messages)
    push = next(event for event in changed if event['kind'] == 'push' and event['tick'] == 20)
    push['force'][1] += 1e-9
    code, said, _ = replay(write_bag(tmp_path / 'bag', with_events(messages, changed)))
    assert code == 1
    assert 'differ after tick 20, at tick 30 at the latest' in said
    # The reset brings both to the same start: 160 to 200 are equal again, as was 0 to 20.
    assert '7 of 21 hashes equal' in said


def test_a_state_that_is_another_from_the_start_is_said(tmp_path, replay, messages):
    changed = events(messages)
    changed[0]['state'] = '0' * 64
    code, said, _ = replay(write_bag(tmp_path / 'bag', with_events(messages, changed)))
    assert code == 1 and 'differ at tick 0' in said


@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_a_torn_file_is_read_up_to_the_tear(tmp_path, replay, messages, suffix):
    """At every tenth of it: never more than is there, never a traceback, less the earlier."""
    file = write_bag(tmp_path / 'whole', messages, suffix)
    whole, read = file.read_bytes(), []
    for tenth in range(1, 10):
        torn = tmp_path / f'{tenth}{suffix}'
        torn.write_bytes(whole[:len(whole) * tenth // 10])
        code, said, warned = replay(torn)
        if code == 0:
            assert 'is truncated' in warned
            count, of = said.split(' repeated, ')[1].split(' hashes')[0].split(' of ')
            assert count == of
            read.append(int(count))
        else:
            assert code == 2 and 'recording' in warned and read == []
    assert read == sorted(read) and 5 < read[-1] <= 21


def test_chunks_that_are_compressed_are_read_up_to_the_last_whole_one(tmp_path, replay, messages):
    """As ros2 bag record makes them with the preset zstd_small; each record is a chunk here."""
    path = tmp_path / 'small.mcap'
    with path.open('wb') as stream:
        writer = McapWriter(stream, chunk_size=1, compression=CompressionType.ZSTD)
        writer.start('ros2', 'test')
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
        ids = {}
        for topic, text in messages:
            if topic not in ids:
                ids[topic] = writer.register_channel(topic, 'cdr', schema)
            data = text.encode() + b'\0'
            writer.add_message(ids[topic], 0, b'\0\1\0\0' + len(data).to_bytes(4, 'little') + data,
                               0)
        writer.finish()
    assert '21 of 21' in replay(path)[1]
    whole = path.read_bytes()
    path.write_bytes(whole[:len(whole) // 2])
    code, said, warned = replay(path)
    assert code == 0 and 'is truncated' in warned and '0 of 0' not in said


def test_damage_within_a_file_is_no_traceback(tmp_path, replay, messages):
    file = write_bag(tmp_path / 'bag', messages)
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle:middle + 40] = b'\xff' * 40
    file.write_bytes(data)
    code, _, warned = replay(file)
    assert code in (0, 2) and ('is truncated' in warned or 'expected' in warned)


def test_the_scene_of_another_run_is_no_scene_of_this_one(tmp_path, replay, messages):
    other = run_scene_text(load_scene('flight'))
    swapped = [('/ragdoll/scene', other), *messages[1:]]
    code, _, warned = replay(write_bag(tmp_path / 'bag', swapped))
    assert code == 2 and 'another scene' in warned and 'flight' in warned
    code, _, warned = replay(write_bag(tmp_path / 'none', messages[1:]))
    assert code == 2 and 'lacks ~/scene' in warned and 'ros2 bag record' in warned


def test_a_scene_that_was_edited_is_another_scene(tmp_path, replay, messages):
    edited = messages[0][1].replace('-9.8', '-9.9')
    assert edited != messages[0][1]
    code, _, warned = replay(write_bag(tmp_path / 'bag', [(messages[0][0], edited), *messages[1:]]))
    assert code == 2 and 'another scene' in warned


def test_a_run_of_another_version_says_so_and_is_repeated(tmp_path, replay, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr('ragdoll_ros.files.run_scene.versions', lambda: 'ragdoll_ros 0.0.1, m68k')
        older = messages_of_a_run(load_scene('drop'), 20, act)
    code, said, warned = replay(write_bag(tmp_path / 'bag', older))
    assert code == 0 and '3 of 3' in said
    assert 'recorded by ragdoll_ros 0.0.1, m68k' in warned and versions() in warned


def test_where_events_are_missing_the_run_goes_on_at_the_next_reset(tmp_path, replay, messages):
    told = events(messages)
    gone = next(index for index, event in enumerate(told) if event['kind'] == 'push')
    code, said, warned = replay(write_bag(
        tmp_path / 'bag', with_events(messages, told[:gone] + told[gone + 1:])))
    assert code == 0 and f'before event {gone + 1}, ' in warned and 'missing' in warned
    assert '40 ticks' in said and '5 of 5 hashes' in said  # those from the reset at 160 on


def test_a_recording_that_begins_at_a_reset_is_enough(tmp_path, replay, messages):
    told = events(messages)
    late = [event for event in told if event['tick'] >= 160 and event['kind'] != 'state']
    assert late[0]['kind'] == 'reset'
    late += [event for event in told if event['tick'] > 160 and event['kind'] == 'state']
    late = [{**event, 'number': 7 + index} for index, event in enumerate(late)]
    code, said, _ = replay(write_bag(tmp_path / 'bag', with_events(messages, late)))
    assert code == 0 and '40 ticks' in said and '4 of 4 hashes' in said


def test_a_recording_without_a_start_says_what_to_do(tmp_path, replay, messages):
    told = [event for event in events(messages) if event['tick'] < 160][1:]
    code, _, warned = replay(write_bag(tmp_path / 'bag', with_events(messages, told)))
    assert code == 2 and '~/reset' in warned


def test_of_several_nodes_one_is_to_be_named(tmp_path, replay, messages):
    other = messages_of_a_run(load_scene('flight'), 10, lambda *_: None, node='/east/ragdoll')
    file = write_bag(tmp_path / 'bag', [*messages, *other])
    code, _, warned = replay(file)
    assert code == 2 and '/east/ragdoll' in warned and '--node' in warned
    code, said, _ = replay(file, '--node', '/east/ragdoll')
    assert code == 0 and 'scene flight' in said
    assert replay(file, '--node', '/west')[0] == 2


def test_a_finer_run_parts_from_the_recorded_one(tmp_path, replay, messages):
    file = write_bag(tmp_path / 'bag', messages)
    code, said, _ = replay(file, '--accuracy', 'exact')
    rows = [line.split() for line in said.splitlines() if line.split()[1:2] == ['m']]
    assert code == 0 and rows
    gaps, ticks = [float(row[0]) for row in rows], [int(row[2]) for row in rows]
    assert gaps == sorted(gaps) and ticks == sorted(ticks)
    assert rows[0][5] in load_scene('drop').bone_names
    farthest = float(said.split('farthest: ')[1].split()[0])
    assert gaps[-1] < farthest < 5, 'a doll that falls from 1 m'


def test_the_same_accuracy_parts_nowhere(tmp_path, replay):
    flight = messages_of_a_run(load_scene('flight'), 30, lambda *_: None)
    code, said, _ = replay(write_bag(tmp_path / 'bag', flight), '--accuracy', 'normal')
    assert code == 0 and 'never apart' in said and 'farthest: 0 m' in said


def test_engines_fly_alike_and_part_at_the_touch(tmp_path, replay):
    pytest.importorskip('pybullet')
    drop = messages_of_a_run(load_scene('drop'), 60, lambda *_: None)
    code, said, _ = replay(write_bag(tmp_path / 'bag', drop), '--engine', 'bullet')
    rows = {float(line.split()[0]): int(line.split()[2]) for line in said.splitlines()
            if line.split()[1:2] == ['m']}
    # It falls 0.4 m: 0.29 s; substeps of 1 ms err by less than 1 cm until then.
    assert code == 0 and rows[1e-2] >= 25


@pytest.mark.parametrize('content', [b'', b'no recording', b'\x89MCAP0\r\n', b'SQLite format 3\0'])
@pytest.mark.parametrize('suffix', ['.mcap', '.db3', '.txt'])
def test_what_is_no_recording_is_refused(tmp_path, replay, content, suffix):
    path = tmp_path / f'run{suffix}'
    path.write_bytes(content)
    code, _, warned = replay(path)
    assert code == 2 and 'expected' in warned
    assert replay(tmp_path / 'nowhere')[0] == 2


@pytest.mark.parametrize('text', ['', '[]', '{}', '{"number": 0}', '[' * 100000, 'NaN',
                                  '{"number": -1, "tick": 0, "kind": "start"}',
                                  '{"number": 0, "tick": 0.5, "kind": "start"}',
                                  '{"number": 0, "tick": 0, "kind": "start"}',
                                  '{"number": 0, "tick": 0, "kind": "explode"}'])
def test_an_event_that_is_none_is_refused_with_its_place(tmp_path, replay, messages, text):
    file = write_bag(tmp_path / 'bag', [*messages[:2], ('/ragdoll/events', text)])
    code, _, warned = replay(file)
    assert code == 2 or 'missing' in warned
    assert 'event' in warned


@pytest.mark.parametrize('key', ['engine', 'accuracy', 'step'])
@pytest.mark.parametrize('value', [None, 'x', [], {}, -1.0, 1e300])
def test_a_start_with_wrong_conditions_is_refused(tmp_path, replay, messages, key, value):
    told = events(messages)
    told[0][key] = value
    code, _, warned = replay(write_bag(tmp_path / 'bag', with_events(messages, told)))
    assert code == 2 and 'expected' in warned and 'Traceback' not in warned


def test_an_act_that_cannot_be_is_told_with_its_event(tmp_path, replay, messages):
    told = events(messages)
    push = next(event for event in told if event['kind'] == 'push')
    push['bone'] = 'tail'
    code, _, warned = replay(write_bag(tmp_path / 'bag', with_events(messages, told)))
    assert code == 2 and f'event {push["number"]}' in warned and "'tail'" in warned


def test_without_mcap_it_says_how_to_get_it(tmp_path, replay, messages, monkeypatch):
    file = write_bag(tmp_path / 'bag', messages)
    monkeypatch.setitem(sys.modules, 'mcap.records', None)
    code, _, warned = replay(file)
    assert code == 2 and "pip install 'ragdoll_ros[replay]'" in warned


def test_a_crowd_is_repeated_by_any_number_of_threads(tmp_path, replay):
    scene = dataclasses.replace(load_scene('crowd'), name='ten')
    crowd = messages_of_a_run(scene, 40, disturb)
    code, said, _ = replay(write_bag(tmp_path / 'bag', crowd))
    assert code == 0 and 'scene ten' in said and '5 of 5' in said


@pytest.mark.parametrize(('words', 'told'), [
    (['--pace', '0'], '0.001 to 100'), (['--publish', '--engine', 'rigid'], 'not with --engine'),
    (['--ros-args', '-r', '__ns:=/stage'], 'only with --publish')])
def test_a_call_that_cannot_be_says_why(tmp_path, capsys, words, told):
    with pytest.raises(SystemExit) as ended:
        main([str(tmp_path), *words])
    assert ended.value.code == 2 and told in capsys.readouterr().err


def test_a_run_is_saved_as_it_was_repeated(tmp_path, replay, messages):
    """Every tick's poses as a simulation here has them, over the reset; in each format a file."""
    with Simulation(load_scene('drop')) as simulation:
        expected = []
        for tick in range(TICKS):
            act(simulation, tick)
            expected.append(simulation.advance().positions[0].tolist())
    write_bag(tmp_path / 'bag', messages)
    files = [tmp_path / f'run{suffix}' for suffix in FORMATS]
    code, said, warned = replay(tmp_path / 'bag', *(f'--save={file}' for file in files))
    assert (code, warned) == (0, '') and all(f'{file}: ' in said for file in files)
    table = np.genfromtxt(tmp_path / 'run.csv', delimiter=',', skip_header=1)
    # The start comes first; the instant of the reset is the one that was there.
    kept = {tuple(row) for row in table[:, 1:4].tolist()}
    assert {tuple(row) for row in expected} <= kept and len(kept) <= TICKS + 1
    code, said, _ = replay(tmp_path / 'run.mcap', '--save', tmp_path / 'again.csv')
    assert code == 0 and (tmp_path / 'again.csv').read_text().splitlines()[5] == (
        tmp_path / 'run.csv').read_text().splitlines()[5]


def test_a_name_without_a_format_is_refused_at_once(tmp_path, replay):
    code, said, warned = replay(tmp_path / 'nowhere', '--save', 'run.fbx')
    assert (code, said) == (2, '') and 'run.fbx' in warned and '.glb' in warned
