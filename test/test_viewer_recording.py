"""A run recorded, written, read and asked for poses."""
import json
import math

import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.scene import SECOND
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.viewer.sources.recording import Pose, Recorder, Recording
from ragdoll_ros.viewer.sources.recording_file import load_recording, recording_text

UNTURNED = np.tile((0, 0, 0, 1.0), (10, 1))


@pytest.fixture(scope='module')
def run():
    """Half a second of a fall with one reset, and what the simulation said at each tick."""
    scene = load_scene('ponytail')
    recorder = Recorder(scene)
    states = []
    with Simulation(scene) as simulation:
        for count in (30, 20):
            simulation.reset()
            for _ in range(count):
                state = simulation.advance()
                tail = simulation.swings
                rods = np.stack([tail.roots, tail.positions], axis=1)
                pose = Pose(state.positions, state.orientations, rods)
                recorder.add(simulation.time / SECOND, pose)
                states.append(state)
    return recorder.recording(), states


@pytest.fixture
def written(run, tmp_path):
    (tmp_path / 'run.json').write_text(recording_text(run[0]), encoding='utf-8')
    return tmp_path / 'run.json'


def assert_equal(one, other):
    assert one.scene == other.scene
    for key in ('times', 'positions', 'orientations', 'rods'):
        np.testing.assert_array_equal(getattr(one, key), getattr(other, key))


def test_holds_every_state_to_the_bit(run):
    recording, states = run
    np.testing.assert_array_equal(recording.positions[:30], [s.positions for s in states[:30]])
    np.testing.assert_array_equal(recording.orientations[:30],
                                  [s.orientations for s in states[:30]])


def test_time_goes_on_over_a_reset(run):
    """Ticks of 0.01 s from 0 on; the reset's first state falls on the instant that was there."""
    recording, _ = run
    assert recording.times == pytest.approx(np.arange(49) / 100, abs=1e-12)


def test_same_instant_again_is_left_out():
    recorder = Recorder(load_scene('drop'))
    for time in (5.0, 5.0, 5.5, 5.5):
        recorder.add(time, Pose(np.zeros((10, 3)), UNTURNED))
    assert recorder.recording().times.tolist() == [0, 0.5]
    assert (len(recorder), recorder.duration) == (2, 0.5)


def test_round_trip_is_exact(run, written):
    assert_equal(load_recording(written), run[0])


def test_any_json_reader_can_read_it(run, written):
    """No NaN, no Infinity: RFC 8259; the scene has a friction without limit."""
    def refuse(text):
        raise AssertionError(text)
    data = json.loads(written.read_text(), parse_constant=refuse)
    assert run[0].scene.material.friction == math.inf
    assert data['scene']['material']['friction'] == '.inf'
    assert data['names'] == list(run[0].scene.bone_names)
    assert np.shape(data['positions']) == (49, 10, 3)


def test_pose_at_an_instant(run):
    """At a pose that pose; in the middle of two, the middle of way and turn; outside, the end."""
    recording, _ = run
    for index in (0, 7, 48):
        pose = recording.at(recording.times[index])
        np.testing.assert_array_equal(pose.positions, recording.positions[index])
        np.testing.assert_array_equal(pose.orientations, recording.orientations[index])
    between = recording.at(0.075)
    np.testing.assert_allclose(between.positions, recording.positions[7:9].mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(between.rods, recording.rods[7:9].mean(axis=0), atol=1e-9)
    angles = [rotation.angle_between(between.orientations, recording.orientations[index])
              for index in (7, 8)]
    np.testing.assert_allclose(*angles, atol=1e-6)
    for time, index in ((-1, 0), (99, -1)):
        np.testing.assert_array_equal(recording.at(time).positions, recording.positions[index])


def test_turns_take_the_shorter_arc():
    """The same turn as q and -q: the pose between is that turn, not a whole turn's middle."""
    scene = load_scene('drop')
    turn = np.tile(rotation.from_rotation_vector(np.array((0.3, 0.2, 0.1))), (10, 1))
    recording = Recording(scene, np.array((0.0, 1.0)), np.zeros((2, 10, 3)),
                          np.stack((turn, -turn)))
    assert rotation.angle_between(recording.at(0.5).orientations, turn).max() < 1e-7


def test_a_single_pose_can_be_played():
    recording = Recording(load_scene('drop'), np.zeros(1), np.ones((1, 10, 3)), UNTURNED[None])
    assert recording.duration == 0
    assert recording.at(3.0).positions.tolist() == np.ones((10, 3)).tolist()


def test_nothing_taken_is_no_recording():
    with pytest.raises(errors.OutOfRange, match='at least one pose'):
        Recorder(load_scene('drop')).recording()


def change(key, value):
    return lambda data: data.__setitem__(key, value)


def change_first(key, value):
    def apply(data):
        data[key][1][2] = value
    return apply


RUBBISH = {
    'another format': (change('format', 'rosbag'), 'format: WrongForm'),
    'a newer version': (change('version', 2), 'version: OutOfRange: 2; expected 1'),
    'another frame': (change('frame', 'map'), 'frame: OutOfRange'),
    'a key too many': (change('extra', 1), 'extra'),
    'a key too few': (lambda data: data.pop('times'), 'times'),
    'unknown bones': (change('names', ['a']), 'names: UnknownBone'),
    'names of no text': (change('names', 5), 'names: UnknownBone'),
    'times as text': (change('times', ['0'] * 49), 'times: WrongForm'),
    'one number too few': (lambda data: data['positions'][3][4].pop(), 'positions: WrongForm'),
    'one pose too few': (lambda data: data['positions'].pop(), 'positions: WrongForm'),
    'null for a number': (change_first('positions', None), 'positions: WrongForm'),
    'a number beyond float': (change_first('positions', [10 ** 400] * 3), 'positions: WrongForm'),
    'no number': (change_first('positions', [math.nan] * 3), 'NotFinite'),
    'infinity by exponent': (change('times', '1e999'), 'times'),
    'time that goes back': (lambda data: data['times'].reverse(), 'times: OutOfRange'),
    'no poses': (lambda data: data.update(times=[], positions=[], orientations=[]), 'positions'),
    'one rod too few': (lambda data: data['rods'][3].pop(), 'rods: WrongForm'),
    'rods of no kind': (change('rods', 7), 'rods: WrongForm'),
    'quaternions of another length': (change_first('orientations', [0, 0, 0, 2]),
                                      'orientations: NotUnit'),
    'a scene with an error': (lambda data: data['scene'].update(step=-1), 'scene.step: OutOfRange'),
    'a scene of no kind': (change('scene', [1]), 'scene'),
}


@pytest.mark.parametrize(('spoil', 'told'), RUBBISH.values(), ids=RUBBISH)
def test_rubbish_is_refused_where_it_stands(written, spoil, told):
    data = json.loads(written.read_text())
    spoil(data)
    written.write_text(json.dumps(data).replace('"1e999"', '[1e999]'))
    with pytest.raises(errors.ModelErrors) as caught:
        load_recording(written)
    assert told in str(caught.value) and 'run.json: 1 error' in str(caught.value)


@pytest.mark.parametrize('content', [b'', b'{', b'\xff\xfe', b'[' * 100_000, b'[]', b'{}', b'3'])
def test_a_file_that_is_no_recording_is_refused(tmp_path, content):
    (tmp_path / 'run.json').write_bytes(content)
    with pytest.raises(errors.ModelErrors, match=r'run\.json: 1 error'):
        load_recording(tmp_path / 'run.json')


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(errors.ModelErrors, match='No such file'):
        load_recording(tmp_path / 'nowhere.json')
    with pytest.raises(errors.ModelErrors, match='directory'):
        load_recording(tmp_path)


@pytest.fixture
def panel():
    """A recording's panel on a server, its button, and a click on that."""
    viser = pytest.importorskip('viser')
    from ragdoll_ros.viewer.recording_panel import RecordingPanel
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    panel = RecordingPanel(server)
    yield panel, panel.button, lambda: panel.toggle(None)
    server.stop()


def frame(scene, time):
    from ragdoll_ros.viewer.sources.source import Frame
    still = np.zeros((len(scene.bones), 3))
    return Frame(scene, time, State(still, np.tile((0, 0, 0, 1.0), (len(still), 1)), still, still))


def test_the_button_tells_that_another_scene_has_ended_a_recording(panel):
    panel, button, click = panel
    scenes = load_scene('drop'), load_scene('drop')
    panel.take(frame(scenes[0], 0.0))
    click()
    panel.take(frame(scenes[0], 0.1))
    assert panel.recording and button.label == 'Stop and download'
    panel.take(frame(scenes[1], 0.0))
    assert not panel.recording and button.label == 'Download (scene has changed)'
    # Ended is ended, even where the first scene comes back.
    panel.take(frame(scenes[0], 0.2))
    assert len(panel.recorder) == 2
    click()
    assert button.label == 'Record'
    click()
    assert panel.recording and button.label == 'Stop and download'


def test_the_button_tells_that_a_recording_is_full(panel, monkeypatch):
    """Ten bones are 70 numbers an instant: three of them are within 279, a fourth is not."""
    from ragdoll_ros.viewer import recording_panel
    monkeypatch.setattr(recording_panel, 'MOST_NUMBERS', 279)
    panel, button, click = panel
    scene = load_scene('drop')
    panel.take(frame(scene, 0.0))
    click()
    for tick in range(1, 5):
        panel.take(frame(scene, tick / 100))
    assert len(panel.recorder) == 3 and button.label == 'Download (recording is full)'
