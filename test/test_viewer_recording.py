"""A run recorded, written, read and asked for poses."""
import numpy as np
import pytest
from bags import BagWriter
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ragdoll_ros.files.run_scene import run_scene_text
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.scene import SECOND
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.mcap_file import load_recording, recording_bytes
from ragdoll_ros.recordings.recording import RecordedPose, Recorder, Recording

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
                pose = RecordedPose(state.positions, state.orientations, rods)
                recorder.add(simulation.time / SECOND, pose)
                states.append(state)
    return recorder.recording(), states


@pytest.fixture
def written(run, tmp_path):
    (tmp_path / 'run.mcap').write_bytes(recording_bytes(run[0]))
    return tmp_path / 'run.mcap'


def assert_equal(one, other):
    """Poses to the bit; instants to the ns; rods, which are made of the masses, to rounding."""
    assert one.scene == other.scene
    for key in ('positions', 'orientations'):
        np.testing.assert_array_equal(getattr(one, key), getattr(other, key))
    np.testing.assert_allclose(one.times, other.times, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.rods, other.rods, rtol=0, atol=1e-14)


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
        recorder.add(time, RecordedPose(np.zeros((10, 3)), UNTURNED))
    assert recorder.recording().times.tolist() == [0, 0.5]
    assert (len(recorder), recorder.duration) == (2, 0.5)


def test_round_trip_is_exact(run, written):
    assert_equal(load_recording(written), run[0])


def test_others_can_read_it(run, written):
    """By mcap's reader, which wants an index, and by the definitions that the file has with it."""
    store, poses = get_typestore(Stores.EMPTY), []
    with written.open('rb') as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == 'ros2'
        for schema, channel, message in reader.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ('ros2msg', 'cdr')
            store.register(get_types_from_msg(schema.data.decode(), schema.name))
            told = store.deserialize_cdr(message.data, schema.name)
            if channel.topic == '/ragdoll/poses':
                assert told.header.stamp.sec * SECOND + told.header.stamp.nanosec == (
                    message.log_time)
                poses.append([(p.position.x, p.position.y, p.position.z) for p in told.poses])
    np.testing.assert_array_equal(poses, run[0].positions)


@pytest.mark.parametrize('suffix', ['.mcap', '.db3'])
def test_what_was_recorded_of_a_node_is_a_recording(run, tmp_path, suffix):
    """Its stamps are ROS time, and what it says while paused comes twice."""
    recording, _ = run
    begin = 1_700_000_000 * SECOND + 3
    with BagWriter(tmp_path / 'bag', suffix) as bag:
        bag.write('/stage/ragdoll/scene', run_scene_text(recording.scene))
        bag.write('/stage/robot_description', '<robot/>')
        for index in (*range(len(recording)), len(recording) - 1):
            pose, stamp = recording.pose(index), begin + round(recording.times[index] * SECOND)
            masses = pose.rods[:, 1]
            bag.write_poses('/stage/ragdoll/poses', stamp,
                            np.hstack([pose.positions, pose.orientations]))
            bag.write_poses('/stage/ragdoll/swings', stamp,
                            np.hstack([masses, np.tile((0, 0, 0, 1), (len(masses), 1))]))
    assert_equal(load_recording(tmp_path / 'bag'), recording)


def test_of_a_torn_file_the_whole_instants_are_read(run, written, capsys):
    """Written as one chunk, compressed, nothing; so the file is made anew as rosbag2 does."""
    recording, _ = run
    with BagWriter(written.parent / 'bag') as bag:
        bag.write('/ragdoll/scene', run_scene_text(recording.scene))
        for index in range(len(recording)):
            pose = recording.pose(index)
            bag.write_poses('/ragdoll/poses', index, np.hstack([pose.positions, pose.orientations]))
    file = next((written.parent / 'bag').glob('*.mcap'))
    file.write_bytes(file.read_bytes()[:file.stat().st_size // 2])
    read = load_recording(file)
    assert 10 < len(read) < len(recording) and 'is truncated' in capsys.readouterr().err
    np.testing.assert_array_equal(read.positions, recording.positions[:len(read)])


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


def poses(count=10, **changed):
    """Poses (count, 7), some numbers of which are ``changed``: _0 is the first."""
    rows = np.tile((0.0, 0, 1, 0, 0, 0, 1), (count, 1))
    for place, value in changed.items():
        rows[0, int(place[1:])] = value
    return rows


RUBBISH = {
    'no scene': (['poses'], '0 scenes, 1 instants'),
    'no poses': (['scene'], '1 scenes, 0 instants'),
    'two scenes': (['scene', 'another', 'poses'], '2 scenes'),
    'a scene that is none': ([('scene', 'dolls: 3'), 'poses'], 'versions'),
    'a scene with an error': ([('scene', '# versions: x\ndolls: []'), 'poses'], 'dolls'),
    'a pose too few': (['scene', ('poses', poses(9))], '9 poses'),
    'no number': (['scene', ('poses', poses(_1=np.nan))], 'positions: NotFinite'),
    'quaternions of another length': (['scene', ('poses', poses(_6=2))], 'orientations: NotUnit'),
    'masses of no swing': (['scene', 'poses', ('swings', poses(3))], '3 masses'),
    'poses that are texts': (['scene', ('poses', 'up')], '0 instants')}


@pytest.mark.parametrize(('written', 'told'), RUBBISH.values(), ids=RUBBISH)
def test_rubbish_is_refused(tmp_path, written, told):
    plain = {'scene': run_scene_text(load_scene('drop')), 'poses': poses(),
             'another': run_scene_text(load_scene('flight'))}
    with BagWriter(tmp_path / 'bag') as bag:
        for entry in written:
            last, content = entry if isinstance(entry, tuple) else (entry, plain[entry])
            topic = '/ragdoll/' + last.replace('another', 'scene')
            if isinstance(content, str):
                bag.write(topic, content)
            else:
                bag.write_poses(topic, 0, content)
    with pytest.raises(errors.ModelErrors) as caught:
        load_recording(tmp_path / 'bag')
    assert told in str(caught.value) and 'expected' in str(caught.value)


@pytest.mark.parametrize('name', ['run.mcap', 'run.db3', 'run.json'])
@pytest.mark.parametrize('content', [b'', b'{', b'\xff\xfe' * 100])
def test_a_file_that_is_no_recording_is_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(errors.ModelErrors, match='1 error'):
        load_recording(tmp_path / name)


def test_a_missing_file_is_refused(tmp_path):
    for path in (tmp_path / 'nowhere.mcap', tmp_path):
        with pytest.raises(errors.ModelErrors, match=r'expected a folder of `ros2 bag record`'):
            load_recording(path)


@pytest.fixture
def panel():
    """A recording's panel on a server, its button, and a click on that."""
    viser = pytest.importorskip('viser')
    from ragdoll_ros.viewer.recording_panel import RecordingPanel
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    panel = RecordingPanel(server, lambda: None)
    yield panel, panel.button, lambda: panel.toggle(None)
    server.stop()


def frame(scene, time):
    from ragdoll_ros.viewer.sources.source import Frame
    still = np.zeros((len(scene.bones), 3))
    return Frame(scene, time, State(still, np.tile((0, 0, 0, 1.0), (len(still), 1)), still, still))


def test_the_button_tells_that_another_scene_has_ended_a_recording(panel):
    panel, button, click = panel
    scenes = load_scene('drop'), load_scene('drop')
    panel.add(frame(scenes[0], 0.0))
    click()
    panel.add(frame(scenes[0], 0.1))
    assert panel.recording and button.label == 'Stop and download'
    panel.add(frame(scenes[1], 0.0))
    assert not panel.recording and button.label == 'Download (scene has changed)'
    # Ended is ended, even where the first scene comes back.
    panel.add(frame(scenes[0], 0.2))
    assert len(panel.recorder) == 2
    click()
    assert button.label == 'Record'
    click()
    assert panel.recording and button.label == 'Stop and download'


def test_the_button_tells_that_a_recording_is_full(panel, monkeypatch):
    """Ten bones are 70 numbers an instant: three of them are within 279, a fourth is not."""
    from ragdoll_ros.viewer import recording_panel
    monkeypatch.setattr(recording_panel, 'MAX_NUMBERS', 279)
    panel, button, click = panel
    scene = load_scene('drop')
    panel.add(frame(scene, 0.0))
    click()
    for tick in range(1, 5):
        panel.add(frame(scene, tick / 100))
    assert len(panel.recorder) == 3 and button.label == 'Download (recording is full)'
