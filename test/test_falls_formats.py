"""Each format, read by a library that is not ours, holds what the simulation gave."""
import io
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from falls_recipes import DROP, SHOVE, file_bytes, recipe

from ragdoll_ros import load_doll
from ragdoll_ros.falls import generate, load_recipe
from ragdoll_ros.falls.command import main
from ragdoll_ros.falls.fall import fall_samples, samples_by_frame
from ragdoll_ros.falls.formats.registry import FORMATS, resolve_format
from ragdoll_ros.falls.formats.settled import ALIKE, different
from ragdoll_ros.falls.manifest import build_dataset
from ragdoll_ros.falls.shard import DatasetJob, make_shard
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.fit.command import main as fit
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import OutOfRange, WrongForm
from ragdoll_ros.physics.sensors.imu import ImuMount, imu_samples
from ragdoll_ros.physics.sensors.response import ImuResponse, ResponseFilter

parquet = pytest.importorskip('pyarrow.parquet')
COUNT = 3
IMU = {'name': 'low_back', 'bone': 'torso', 'position': [-0.05, 0, -0.15]}


def here(job, shards):
    return (make_shard(job, shard) for shard in shards)


@pytest.fixture(scope='module')
def pandas():
    return pytest.importorskip('pandas')


@pytest.fixture(scope='module')
def shoved():
    """A recipe of falls of the doll, and three of them."""
    made = recipe({**SHOVE, 'start': {'lean_deg': {'uniform': [0, 5]}},
                   'duration': 1.2, 'record': {'imus': [IMU], 'what': [
                       'poses', 'velocities', 'angles', 'rates', 'touching']}})
    return made, list(generate(made, range(COUNT)))


@pytest.fixture
def written(shoved, tmp_path):
    """Write those falls in a format; the folder."""
    def write(name):
        build_dataset(DatasetJob(shoved[0], COUNT, name), tmp_path, here)
        return tmp_path
    return write


def frames_of(rows, name):
    return np.array(rows[f'observation.{name}'].tolist())


def test_lerobot_by_pandas(pandas, shoved, written):
    _, falls = shoved
    folder = written('lerobot')
    info = json.loads((folder / 'meta/info.json').read_text())
    assert (info['codebase_version'], info['fps'], info['total_episodes'], info['total_frames']) \
        == ('v3.0', 100, COUNT, 120 * COUNT)
    data = pandas.read_parquet(folder / info['data_path'].format(chunk_index=0, file_index=0))
    assert list(data['index']) == list(range(120 * COUNT))
    for fall in falls:
        rows = data[data['episode_index'] == fall.number]
        assert list(rows['frame_index']) == list(range(120))
        # Numbers are float32: half a unit in the last of 24 places.
        close = {'rtol': 2 ** -24, 'atol': 1e-37}
        np.testing.assert_allclose(rows['timestamp'], fall.times, **close)
        for name, values in (('poses', fall.states[:, :, :7]),
                             ('velocities', fall.states[:, :, 7:]),
                             ('angles', fall.angles), ('rates', fall.rates),
                             ('imu.low_back', fall_samples(fall, 0))):
            np.testing.assert_allclose(frames_of(rows, name), values.reshape(120, -1), **close)
        np.testing.assert_array_equal(frames_of(rows, 'touching'), fall.touching)
        assert rows['observation.valid'].all()
    poses = info['features']['observation.poses']
    assert poses['shape'] == [70] and poses['names'][:7] == [
        f'torso.{part}' for part in ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')]
    assert set(info['features']) == set(data.columns)


def test_lerobots_episodes_tasks_and_statistics(pandas, shoved, written):
    _, falls = shoved
    folder = written('lerobot')
    data = parquet.read_table(folder / 'data/chunk-000/file-000.parquet')
    rows = parquet.read_table(folder / 'meta/episodes/chunk-000/file-000.parquet').to_pylist()
    for row, fall in zip(rows, falls, strict=True):
        assert (row['dataset_from_index'], row['dataset_to_index']) == (
            120 * fall.number, 120 * fall.number + 120)
        assert (row['onset'], row['impact'], row['rest']) == (
            fall.phases.onset, fall.phases.impact, fall.phases.rest)
        assert json.loads(row['drawn']) == fall.drawn and row['tasks'] == ['shove']
        assert row['impact_frames'] == [
            next((k for k in range(1, 120) if fall.touching[:k + 1, bone].tolist()
                  == [False] * k + [True]), None) for bone in range(10)]
    tasks = pandas.read_parquet(folder / 'meta/tasks.parquet')
    assert tasks.loc['shove', 'task_index'] == 0
    stats = json.loads((folder / 'meta/stats.json').read_text())
    values = np.array(data.column('observation.velocities').to_pylist())
    for name in ('min', 'max', 'mean', 'std'):
        # The statistics are of float64, the file holds float32 of up to some 10 rad/s.
        np.testing.assert_allclose(stats['observation.velocities'][name],
                                   getattr(values, name)(axis=0), atol=1e-5)
    assert stats['observation.velocities']['count'] == [120 * COUNT]


def test_bytes_name_pyarrows_version_and_nothing_of_the_machine(written):
    folder = written('lerobot')
    metadata = parquet.read_metadata(folder / 'data/chunk-000/file-000.parquet')
    assert re.fullmatch(r'parquet-cpp-arrow version [\d.]+', metadata.created_by)
    assert set(metadata.metadata) == {b'ARROW:schema', b'names'}


def kfall_name(label):
    """Path of the samples of a row of the first subject's labels."""
    task = int(re.fullmatch(r'F\d\d \((\d+)\)', label['Task Code (Task ID)'])[1])
    return f'sensor_data/SA000000/S000000T{task:02d}R{label["Trial ID"]:02d}.csv'


def test_kfall_by_pandas(pandas, shoved, written):
    _, falls = shoved
    folder = written('kfall')
    labels = pandas.read_csv(folder / 'label_data/SA000000_label.csv')
    assert list(labels['Fall_onset_frame']) == [fall.phases.onset for fall in falls]
    assert list(labels['Fall_impact_frame']) == [fall.phases.impact for fall in falls]
    for (_, label), fall in zip(labels.iterrows(), falls, strict=True):
        table = pandas.read_csv(folder / kfall_name(label))
        assert list(table.columns) == ['TimeStamp(s)', 'FrameCounter', 'AccX', 'AccY', 'AccZ',
                                       'GyrX', 'GyrY', 'GyrZ', 'EulerX', 'EulerY', 'EulerZ']
        # Six digits behind the point.
        close = {'rtol': 0, 'atol': 0.6e-6}
        samples = fall_samples(fall, 0)
        np.testing.assert_allclose(table['TimeStamp(s)'], fall.times, **close)
        np.testing.assert_allclose(table.iloc[:, 2:5], samples[:, :3] / 9.80665, **close)
        np.testing.assert_allclose(table.iloc[:, 5:8], np.degrees(samples[:, 3:]), **close)
        turns = [rotation.from_rpy(*np.radians(row)) for row in table.iloc[:, 8:].to_numpy()]
        torso = fall.states[:, fall.scene.bone_index('torso'), 3:7]
        assert rotation.angle_between(np.array(turns), torso).max() < 1e-7


def test_kfall_wants_a_sensor():
    with pytest.raises(WrongForm, match=r'record\.imus'):
        DatasetJob(recipe(), 1, 'kfall')
    with pytest.raises(OutOfRange, match='lerobot'):
        DatasetJob(recipe(), 1, 'xml')


# Quarters: forwards, to the left, backwards, to the right. KFall's table 2, SisFall's table 1.
CODES = {'faint': ([28] * 4, [6] * 4), 'faint_sitting': ([25, 26, 27, 26], [13, 15, 14, 15]),
         'trip': ([30] * 4, [4] * 4), 'slip': ([32, 33, 34, 33], [1, 3, 2, 3]),
         None: ([30, 33, 34, 33], [4, 3, 2, 3])}


@pytest.mark.parametrize('cause', CODES)
def test_a_fall_has_the_codes_of_its_cause_and_direction(pandas, cause):
    """Balls thrown to each side, twice; no two falls of a subject have the same name."""
    made = recipe({**DROP, **({'cause': cause} if cause else {}), 'duration': 0.4}, start={
        'clearance': 0.1, 'heading_deg': 70}, record={
            'rate': 100, 'imu_rate': 200, 'imus': [{'name': 'a', 'bone': 'ball'}]})
    falls = []
    for number, towards in enumerate([0, 90, 180, 270] * 2):
        angle = math.radians(towards)
        made.data['start']['velocity'] = [math.cos(angle), math.sin(angle), 0.0]
        falls += generate(made, [number])
    kfall, sisfall = (resolve_format(name).shard_files(made, falls, 7)
                      for name in ('kfall', 'sisfall'))
    labels = pandas.read_csv(io.BytesIO(kfall['label_data/SA000007_label.csv']))
    assert list(labels['Task Code (Task ID)']) == [
        f'F{code - 19:02d} ({code})' for code in CODES[cause][0] * 2]
    assert len(kfall) == len(sisfall) == 9
    assert ('KFall' in labels['Description'][0]) == (cause is None)
    names = pandas.read_csv(io.BytesIO(sisfall['labels/SA000007.csv']))['file']
    assert [int(name[1:3]) for name in names] == CODES[cause][1] * 2
    assert {f'SisFall_dataset/SA000007/{name}' for name in names} < set(sisfall)


def test_what_has_no_impact_is_no_task_of_a_fall(pandas, shoved):
    """Readers take KFall's tasks 20 to 34, and SisFall's names with F, for falls."""
    made = recipe({**SHOVE, 'pushes': [], 'duration': 0.2, 'record': {
        'imu_rate': 200, 'imus': [IMU]}})
    stands = list(generate(made, range(2)))
    assert all(fall.phases.impact is None for fall in stands)
    kfall, sisfall = (resolve_format(name).shard_files(made, stands, 0)
                      for name in ('kfall', 'sisfall'))
    assert 'sensor_data/SA000000/S000000T00R02.csv' in kfall
    assert 'SisFall_dataset/SA000000/D00_SA000000_R02.txt' in sisfall
    labels = pandas.read_csv(io.BytesIO(kfall['label_data/SA000000_label.csv']))
    assert list(labels['Task Code (Task ID)']) == ['D00 (0)'] * 2
    assert set(labels['Description']) == {'no fall'} and labels['Fall_impact_frame'].isna().all()


def test_formats_of_one_run_are_the_bytes_of_each(tmp_path, shoved):
    """Several formats at once simulate once and hold what each alone holds."""
    names = ['lerobot', 'kfall', 'amass']
    for name in [*names, ','.join(names)]:
        build_dataset(DatasetJob(shoved[0], 2, name), tmp_path / name, here)
    together = file_bytes(tmp_path / ','.join(names))
    alone = {path: content for name in names
             for path, content in file_bytes(tmp_path / name).items()}
    assert set(alone) == set(together)
    assert [path for path in alone if alone[path] != together[path]] == ['manifest.jsonl']
    assert main(['describe', str(tmp_path / ','.join(names))]) == 0


@pytest.mark.parametrize('given', ['xml', 'lerobot,', 'kfall,mp4'])
def test_an_unknown_format_is_named(tmp_path, given, capsys):
    with pytest.raises(SystemExit):
        main(['shove', '-o', str(tmp_path), '--format', given])
    said = capsys.readouterr().err
    assert repr(given.split(',')[-1]) in said and 'lerobot, kfall' in said


def test_sisfall_by_numpy(pandas, tmp_path):
    made = recipe({**SHOVE, 'duration': 1.2, 'record': {'imu_rate': 200, 'imus': [IMU]}})
    build_dataset(DatasetJob(made, 2, 'sisfall'), tmp_path, here)
    labels = pandas.read_csv(tmp_path / 'labels/SA000000.csv')
    for fall, (_, label) in zip(generate(made, range(2)), labels.iterrows(), strict=True):
        path = tmp_path / 'SisFall_dataset/SA000000' / label['file']
        counts = np.loadtxt(io.StringIO(path.read_text().replace(';', '')), delimiter=',')
        # As in SisFall's read-me: value = count times twice the range over 2 ** bits.
        units = np.repeat([2 * 16 / 2 ** 13, 2 * 2000 / 2 ** 16, 2 * 8 / 2 ** 14], 3)
        samples = fall_samples(fall, 0)
        force, rate = samples[:, :3] / 9.80665, np.degrees(samples[:, 3:])
        expected = np.concatenate([np.clip(force, -16, 16 - units[0]), rate,
                                   np.clip(force, -8, 8 - units[-1])], axis=1)
        assert len(counts) == 2 * 119 + 1 and (counts == counts.round()).all()
        np.testing.assert_allclose(counts, expected / units, rtol=0, atol=0.5 + 1e-9)
        assert label['impact_sample'] == 2 * fall.phases.impact
    with pytest.raises(WrongForm, match='200 for the format sisfall'):
        DatasetJob(recipe({**SHOVE, 'record': {'imus': [IMU]}}), 1, 'sisfall')


def test_mcap_by_mcap_ros2_support(shoved, written):
    reader = pytest.importorskip('mcap_ros2.reader')
    _, falls = shoved
    folder = written('mcap')
    for fall in falls:
        messages = {}
        for message in reader.read_ros2_messages(folder / f'mcap/fall_{fall.number:07d}.mcap'):
            messages.setdefault(message.channel.topic, []).append(message)
        poses = messages['/ragdoll/poses']
        assert [message.log_time_ns for message in poses] == [10_000_000 * k for k in range(120)]
        assert poses[7].ros_msg.header.frame_id == 'world'
        rows = [[(p.position.x, p.position.y, p.position.z, p.orientation.x, p.orientation.y,
                  p.orientation.z, p.orientation.w) for p in message.ros_msg.poses]
                for message in poses]
        np.testing.assert_array_equal(rows, fall.states[:, :, :7])
        joints = [message.ros_msg for message in messages['/ragdoll/joint_states']]
        assert tuple(joints[0].name) == fall.scene.angle_names
        np.testing.assert_array_equal([joint.position for joint in joints], fall.angles)
        np.testing.assert_array_equal([joint.velocity for joint in joints], fall.rates)
        imus = [message.ros_msg for message in messages['/ragdoll/imu/low_back/data_raw']]
        force = [(m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z)
                 for m in imus]
        np.testing.assert_array_equal(force, fall_samples(fall, 0)[:, :3])
        assert imus[0].orientation_covariance[0] == -1
        description, = messages['/ragdoll/robot_description']
        assert '<robot name="doll">' in description.ros_msg.data


def test_mcaps_labels_by_mcap(shoved, written):
    mcap = pytest.importorskip('mcap.reader')
    _, falls = shoved
    content = (written('mcap') / 'mcap/fall_0000001.mcap').read_bytes()
    record, = mcap.make_reader(io.BytesIO(content)).iter_metadata()
    assert int(record.metadata['impact']) == falls[1].phases.impact
    assert json.loads(record.metadata['bone_names']) == list(falls[1].scene.bone_names)


def test_mcap_has_the_definitions_of_ros():
    """Those of the messages that ROS's own packages bring."""
    store = pytest.importorskip('rosbags.typesys')
    from ragdoll_ros.falls.formats.mcap import DEFINITIONS
    ros = store.get_typestore(store.Stores.ROS2_JAZZY)
    for kind, text in DEFINITIONS.items():
        ours = store.get_types_from_msg(text, kind)
        for name, fields in ours.items():
            assert fields[1] == ros.fielddefs[name][1], name


def test_amass_by_numpy(shoved, written):
    """The poses of all bones, from the root down, are those of the simulation."""
    _, falls = shoved
    folder = written('amass')
    for fall in falls:
        with np.load(folder / f'amass/fall_{fall.number:07d}.npz') as file:
            assert file['mocap_framerate'] == 100 and file['trans'].shape == (120, 3)
            names = list(file['joint_names'])
            vectors = file['poses'].reshape(120, len(names), 3)
            trans, impact = file['trans'], int(file['impact'])
        assert impact == fall.phases.impact
        doll = fall.scene.dolls[0].doll
        parents = {joint.child: joint.parent for joint in doll.joints}
        turns = {}
        for name, vector in zip(names, vectors.transpose(1, 0, 2), strict=True):
            own = rotation.from_rotation_vector(vector)
            turns[name] = rotation.multiply(turns[parents[name]], own) if name in parents else own
            there = rotation.multiply(turns[name], doll.bone(name).orientation)
            place = fall.scene.bone_index(name)
            # Some turns of float64, one after the other.
            assert rotation.angle_between(there, fall.states[:, place, 3:7]).max() < 1e-7
        np.testing.assert_array_equal(trans, fall.states[:, 0, :3])


def test_settled_states_are_those_that_rest(tmp_path):
    made = recipe({**SHOVE, 'start': {'lean_deg': {'uniform': [0, 5]}}})
    build_dataset(DatasetJob(made, 5, 'settled'), tmp_path, here)
    falls = [fall for fall in generate(made, range(5)) if fall.phases.rest is not None]
    with np.load(tmp_path / 'settled.npz') as file:
        numbers = file['fall'].tolist()
        assert numbers and set(numbers) <= {fall.number for fall in falls}
        for place, number in enumerate(numbers):
            fall, = (fall for fall in falls if fall.number == number)
            np.testing.assert_array_equal(file['joint_positions'][place], fall.angles[-1])
            np.testing.assert_array_equal(file['bone_poses'][place], fall.states[-1, :, :7])
            # At rest no bone moves faster than 5 cm/s.
            assert np.abs(fall.states[-1, :, 7:10]).max() <= 0.05
        up = rotation.rotate(file['root_orientations'], file['gravity'])
        np.testing.assert_allclose(up, [[0, 0, -1]] * len(numbers), atol=1e-12)


def test_a_robots_urdf_comes_to_rest(tmp_path, monkeypatch):
    """By ragdoll_fit, as any that it takes."""
    monkeypatch.chdir(tmp_path)
    Path('robot.urdf').write_text(to_urdf(load_doll('doll')))
    assert fit(['robot.urdf', '-o', 'limp.yaml']) == 0
    Path('get_up.yaml').write_text("""
who: {dolls: [limp.yaml]}
start: {tumbled: true, clearance: 0.1, other_angles: {uniform: [0.3, 0.7]}}
duration: 3
""")
    assert main(['get_up.yaml', '-o', 'states', '--count', '4', '--settled', '--workers', '1']) == 0
    with np.load('states/settled.npz') as file:
        assert len(file['fall']) >= 1 and file['joint_positions'].shape[1] == 14
        assert set(file['bone_names']) == {bone.name for bone in load_doll('doll').bones}


def test_states_that_are_alike_are_kept_once():
    """Beside the plain way: each compared with all that are kept."""
    rows = np.random.default_rng(1).uniform(-0.3, 0.3, (400, 4))
    plain = []
    for index, row in enumerate(rows):
        if not any(np.abs(rows[other] - row).max() <= ALIKE for other in plain):
            plain.append(index)
    assert different(rows) == plain and 10 < len(plain) < 390


def test_every_format_is_tested_here():
    assert set(FORMATS) == {'lerobot', 'kfall', 'sisfall', 'mcap', 'amass', 'settled'}


def test_a_sensor_in_free_fall_reads_nothing_and_at_rest_gravity():
    made = recipe({**DROP, 'duration': 1.5, 'start': {'clearance': 0.3}},
                  record={'rate': 100, 'imus': [{'name': 'a', 'bone': 'ball',
                                                 'orientation': [math.sqrt(0.5), 0, 0,
                                                                 math.sqrt(0.5)]}]})
    fall = next(generate(made, [0]))
    samples = fall_samples(fall, 0)
    # The ball falls for 0.247 s; velocities of up to 3 m/s in float64 over 0.01 s.
    np.testing.assert_allclose(samples[:24], 0, atol=1e-11)
    # Turned by 90 degrees about x: the world's up is the sensor's y.
    np.testing.assert_allclose(samples[-1], [0, 9.8, 0, 0, 0, 0], atol=1e-9)
    # What the impact took: all of m v, within the frame that it is in.
    assert samples[25, 1] == pytest.approx(math.sqrt(2 * 9.8 * 0.3) / 0.01, rel=0.05)


def test_a_turning_arm_feels_its_centripetal_acceleration():
    """A ball that spins in the air about z at 4 rad/s, the sensor 0.08 m off its axis."""
    made = recipe({**DROP, 'duration': 0.2, 'start': {'clearance': 5, 'spin': [0, 0, 4]}},
                  record={'rate': 1000, 'imus': [{'name': 'a', 'bone': 'ball',
                                                  'position': [0.08, 0, 0]}]})
    fall = next(generate(made, [0]))
    samples = fall_samples(fall, 0)
    # The mean over an angle a of 0.004 rad is sin(a / 2) / (a / 2) of it: 7e-7 less.
    np.testing.assert_allclose(samples, [[-4 ** 2 * 0.08, 0, 0, 0, 0, 4]] * 200, atol=2e-6)


def test_a_sensors_flaws_are_added_to_what_it_should_read():
    """At 1 kHz on a ball that falls, rests and sleeps: white, of the recipe, the fall's number and
    the sensor's place alone, and not there unless asked for.
    """
    flawed = {'noise_acceleration': 0.2, 'noise_rate': 0.03, 'bias': [1, 0, 0, 0, 0, 0.5]}

    def noise_of(number, sensors, seconds=2.0, **changes):
        fall = next(generate(recipe({**DROP, 'duration': seconds, **changes}, record={
            'rate': 100, 'imu_rate': 1000, 'imus': [
                {'name': f'a{k}', 'bone': 'ball', **own} for k, own in enumerate(sensors)]}),
            [number]))
        read = [fall_samples(fall, k)[1:] for k in range(len(sensors))]
        true = imu_samples(fall.imu_states[:, 0], ImuMount('ball'), 0.001, fall.scene.gravity)
        return [samples - true for samples in read]

    many = np.concatenate([noise_of(k, [flawed])[0] for k in range(25)]) - flawed['bias']
    # 49 750 samples of three axes each: a variance is known to 0.37 %.
    assert many[:, :3].var() == pytest.approx(0.2 ** 2, rel=0.02)
    assert many[:, 3:].var() == pytest.approx(0.03 ** 2, rel=0.02)
    one, other = noise_of(3, [flawed, flawed])
    again, = noise_of(3, [flawed])
    np.testing.assert_array_equal(one, again)
    np.testing.assert_array_equal(noise_of(3, [flawed], seconds=1.0)[0], one[:990])
    for another in (other, noise_of(4, [flawed])[0], noise_of(3, [flawed], seed=1)[0]):
        # Of 1990 pairs of white numbers a correlation is 0 +- 0.022.
        assert abs(np.corrcoef(one[:, 0], another[:, 0])[0, 1]) < 0.1
    clean, = noise_of(3, [{}])
    assert not clean.any()
    clipped = recipe({**DROP, 'duration': 0.6}, record={
        'imus': [{'name': 'a', 'bone': 'ball', 'range': [5, 0]}]})
    assert fall_samples(next(generate(clipped, [0])), 0)[-1].tolist() == [0, 0, 5, 0, 0, 0]


def test_a_sensor_on_soft_tissue_swings_before_its_range_clips():
    soft = {'mount_frequency': 30, 'mount_damping': 0.2, 'bandwidth': 200}
    made = recipe({**DROP, 'duration': 0.6}, record={'rate': 100, 'imu_rate': 1000, 'imus': [
        {'name': 'a', 'bone': 'ball'}, {'name': 'b', 'bone': 'ball', **soft},
        {'name': 'c', 'bone': 'ball', **soft, 'range': [50, 0]}]})
    fall = next(generate(made, [0]))
    rigid, swings, clipped = (fall_samples(fall, imu)[:, :3] for imu in range(3))
    expected = imu_samples(fall.imu_states[:, 1], ImuMount('ball'), 0.001, fall.scene.gravity,
                           ResponseFilter(ImuResponse(30.0, 0.2, 200.0)))
    np.testing.assert_array_equal(swings[1:], expected[:, :3])
    np.testing.assert_array_equal(clipped, np.clip(swings, -50, 50))
    assert np.abs(rigid).max() > 3 * np.abs(swings).max() > 150
    # All that the ball's velocity changes by goes through the mount, by 0.6 s.
    assert swings.sum() == pytest.approx(rigid.sum(), rel=1e-2)


def test_mcap_tells_a_sensors_noise(tmp_path):
    reader = pytest.importorskip('mcap_ros2.reader')
    made = recipe(DROP, record={'imus': [{'name': 'a', 'bone': 'ball', 'noise_rate': 0.03}]})
    build_dataset(DatasetJob(made, 1, 'mcap'), tmp_path, here)
    message = next(iter(reader.read_ros2_messages(
        tmp_path / 'mcap/fall_0000000.mcap', topics=['/ragdoll/imu/a/data_raw']))).ros_msg
    assert list(message.angular_velocity_covariance) == pytest.approx(
        (0.03 ** 2 * np.eye(3)).ravel().tolist())
    assert not any(message.linear_acceleration_covariance)


def test_a_fast_sensor_has_several_samples_a_frame(pandas, tmp_path):
    """A ball that falls for 0.247 s, frames at 100 Hz, the sensor at 1 kHz."""
    made = recipe({**DROP, 'duration': 0.6, 'start': {'clearance': 0.3}}, record={
        'rate': 100, 'imu_rate': 1000, 'imus': [{'name': 'a', 'bone': 'ball'}]})
    fall = next(generate(made, [0]))
    samples = fall_samples(fall, 0)
    assert samples.shape == (591, 6) and samples_by_frame(fall, 0).shape == (60, 10, 6)
    np.testing.assert_array_equal(samples_by_frame(fall, 0)[1:].reshape(-1, 6), samples[1:])
    # Velocities of up to 3 m/s in float64 over 0.001 s.
    np.testing.assert_allclose(samples[:247], 0, atol=1e-10)
    # The bounce is within one sample, and takes what the frame's velocity changes by.
    assert np.flatnonzero(samples[:, 2] > 100).tolist() == [248]
    velocity = np.cumsum(samples[1:, 2] - 9.8) / 1000
    np.testing.assert_allclose(velocity[9::10], fall.states[1:, 0, 9], atol=1e-9)
    files = make_shard(DatasetJob(made, 1, 'kfall'), 0).files
    labels = pandas.read_csv(io.BytesIO(files['label_data/SA000000_label.csv']))
    table = pandas.read_csv(io.BytesIO(files[kfall_name(labels.iloc[0])]))
    assert len(table) == 591 and table['TimeStamp(s)'].iloc[-1] == 0.59
    assert labels['Fall_impact_frame'][0] == 10 * fall.phases.impact == 250
    build_dataset(DatasetJob(made, 1), tmp_path, here)
    info = json.loads((tmp_path / 'meta/info.json').read_text())
    assert info['features']['observation.imu.a']['shape'] == [60]


def test_phases_of_a_hundred_falls_are_as_defined():
    """Told again here, frame by frame, from the definitions alone."""
    made = recipe({**load_recipe('tumble').data, 'start': {
        'tumbled': True, 'clearance': {'uniform': [0.05, 0.4]}}}, duration=0.8,
        feet=['left_shin', 'right_shin'])
    hits = 0
    for fall in generate(made, range(100)):
        own = [name not in ('left_shin', 'right_shin') for name in fall.scene.bone_names]
        impact = next((k for k in range(80) if fall.touching[k, own].any()), None)
        assert fall.phases.impact == impact
        if impact is None:
            assert fall.phases.onset is None
            continue
        hits += 1
        down = [-(fall.masses @ fall.states[k, :, 9]) / fall.masses.sum() for k in range(impact)]
        onset = next((k for k in range(impact)
                      if min(down[k:k + 10]) > 0.1), impact)
        assert fall.phases.onset == onset
    assert hits > 90
