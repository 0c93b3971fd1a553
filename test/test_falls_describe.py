"""The page and the pictures say what is in a data set."""
import math
import re

import numpy as np
import pytest
from falls_recipes import SHOVE, recipe

from ragdoll_ros.falls import describe, generate
from ragdoll_ros.falls.command import main
from ragdoll_ros.falls.dataset_summary import summarize
from ragdoll_ros.falls.fall import fall_samples
from ragdoll_ros.falls.manifest import build_dataset
from ragdoll_ros.falls.peaks import Peaks
from ragdoll_ros.falls.pictures import _outlines, hull
from ragdoll_ros.falls.shard import DatasetJob, make_shard
from ragdoll_ros.people.real_falls import bones_of

pytest.importorskip('pyarrow')
pytest.importorskip('matplotlib')
COUNT = 12


@pytest.fixture(scope='module')
def thrown():
    """Falls that go where the doll faces."""
    start = {'heading_deg': {'uniform': [0, 360]}, 'clearance': 0.3, 'velocity': [2, 0, 0]}
    return recipe({**SHOVE, 'start': start, 'pushes': [], 'duration': 1.0})


def here(job, shards):
    return (make_shard(job, shard) for shard in shards)


@pytest.fixture(scope='module')
def folder(thrown, tmp_path_factory):
    folder = tmp_path_factory.mktemp('thrown')
    build_dataset(DatasetJob(thrown, COUNT), folder, here)
    return folder


def test_page_says_what_the_falls_say(thrown, folder, capsys):
    assert main(['describe', str(folder)]) == 0
    page = (folder / 'README.md').read_text()
    falls = list(generate(thrown, range(COUNT)))
    assert f'{COUNT} falls of 1 s at 100 Hz' in page and '| fall forwards | 100.0% |' in page
    torso = falls[0].scene.bone_index('torso')
    descents = np.array([fall.touching[:, torso].argmax() - fall.phases.onset for fall in falls
                         if fall.touching[:, torso].any()]) / 100
    assert len(descents)
    assert f'| {descents.mean():.2f} ± {descents.std():.2f} | 0.58 ± 0.26 |' in page
    for name in ('head', 'torso', 'left_thigh'):
        speeds = np.array([-fall.impact_velocities[fall.scene.bone_index(name), 2]
                           for fall in falls])
        speeds = speeds[np.isfinite(speeds)]
        row = re.search(rf'\| {name} \| (\d+)% \| (.*) \|', page)
        assert int(row[1]) == round(100 * len(speeds) / COUNT)
        if len(speeds):
            assert row[2] == f'{speeds.mean():.2f} ± {speeds.std():.2f}'
    chest = [fall.worst_impacts.by_region['chest'] for fall in falls]
    forces = np.array([impact.peak_force for impact in chest if impact])
    row = re.search(r'\| chest \| (\d+)% \| (.*?) \|', page)
    assert int(row[1]) == round(100 * len(forces) / COUNT) > 0
    assert row[2] == f'{forces.mean():.0f} ± {forces.std():.0f}'
    from matplotlib import pyplot
    for name in re.findall(r'!\[.*?\]\((.*?)\)', page):
        pixels = pyplot.imread(folder / name)
        assert pixels.shape[0] > 200 and np.ptp(pixels[..., :3]) > 0.5, name


@pytest.mark.parametrize(('velocity', 'direction'), [
    ([2, 0, 0], 0), ([0, 2, 0], 90), ([0, -2, 0], -90), ([-2, 1e-9, 0], 180)])
def test_direction_is_as_the_doll_sees_it(velocity, direction):
    made = recipe(start={'heading_deg': 130, 'clearance': 0.4, 'velocity': velocity})
    fall = next(generate(made, [0]))
    assert abs((fall.direction - direction + 180) % 360 - 180) < 1e-6


def test_a_fall_without_an_impact_has_no_direction():
    fall = next(generate(recipe(start={'clearance': 5}), [0]))
    assert math.isnan(fall.direction) and np.isnan(fall.impact_velocities).all()


def test_outlines_are_convex_hulls():
    spatial = pytest.importorskip('scipy.spatial')
    points = np.random.default_rng(2).normal(size=(60, 2))
    reference = spatial.ConvexHull(points)
    np.testing.assert_allclose(np.sort(hull(points), axis=0),
                               np.sort(points[reference.vertices], axis=0))


def test_what_is_nearer_to_the_viewer_is_drawn_over_what_is_behind():
    start = {'lean_deg': 30, 'lean_towards_deg': 90}
    fall = next(generate(recipe(SHOVE, start=start, pushes=[], duration=0.1), [0]))
    # With forwards, x, to the right and up upwards, the viewer is at the doll's right side, at -y.
    behind = fall.states[0, np.argsort(fall.states[0, :, 1]), 2]
    heights = [(outline[:, 1].min() + outline[:, 1].max()) / 2
               for outline in _outlines(fall, 0, np.array((1.0, 0.0, 0.0)))]
    assert abs(behind[0] - behind[-1]) > 0.1
    np.testing.assert_allclose(heights, behind[::-1], atol=0.02)


def test_bones_that_stand_for_parts():
    names = ['torso', 'head', 'left_forearm', 'left_hand', 'right_hand']
    assert bones_of('pelvis', names) == [0] and bones_of('hand', names) == [3, 4]
    assert bones_of('hand', names[:3]) == [2] and bones_of('head', ['ball']) == []


def test_what_cannot_be_described_is_refused(tmp_path, thrown, capsys):
    assert main(['describe', str(tmp_path)]) == 2
    assert 'manifest' in capsys.readouterr().err
    build_dataset(DatasetJob(thrown, 1, 'amass'), tmp_path, here)
    assert main(['describe', str(tmp_path)]) == 2
    assert 'lerobot' in capsys.readouterr().err


def test_a_peak_is_as_high_and_wide_as_it_is():
    """Half-sines of known height and width at 1 kHz, over 1 g."""
    time = np.arange(1000) / 1000
    forces = []
    for height, width in ((50.0, 0.06), (200.0, 0.03)):
        pulse = np.where(abs(time - 0.5) < width / 2,
                         height * np.cos((time - 0.5) / width * math.pi), 9.80665)
        forces.append(np.stack([0 * time, pulse, 0 * time], axis=1))
    forces[1][100:103] = [0, 0, -7 * 9.80665]
    peaks = Peaks.of({'name': 'a', 'bone': 'b'}, [*forces, np.full((9, 3), np.nan)],
                     np.array([0.47, 0.48, 0.1]), np.array([np.nan, 0.501, 0.1]), 0.001)
    np.testing.assert_allclose(peaks.largest, [50 / 9.80665, 200 / 9.80665, np.nan])
    # A half-sine is above half its height for two thirds of its width; to a sample at each end.
    np.testing.assert_allclose(peaks.widths, [0.04, 0.02, np.nan], atol=0.002)
    np.testing.assert_allclose(peaks.before_impact, [1, 7, np.nan])
    np.testing.assert_allclose(peaks.before_pelvis, [np.nan, 200 / 9.80665, np.nan])
    assert peaks.shares_early == (0.5, 1.0)


def test_describe_prints_directions_and_peaks_and_warns_beyond_published_ranges(
        tmp_path, capsys):
    start = {'clearance': 0.5, 'velocity': [2, 0, 0]}
    made = recipe({**SHOVE, 'start': start, 'pushes': [], 'duration': 0.8},
                  record={'rate': 100, 'imu_rate': 200, 'imus': [
                      {'name': 'low_back', 'bone': 'torso'}]})
    build_dataset(DatasetJob(made, 3), tmp_path, here)
    assert main(['describe', str(tmp_path)]) == 0
    out, errors = capsys.readouterr()
    assert 'directions: forwards 100%, to the left 0%' in out
    forces = [np.linalg.norm(fall_samples(fall, 0)[:, :3], axis=1)
              for fall in generate(made, range(3))]
    middle = np.median([force.max() for force in forces]) / 9.80665
    assert f'peaks at low_back: {middle:.1f} g in the median' in out
    # The torso drops by half a metre and more.
    warned = [line for line in errors.splitlines() if line.startswith('warning: ')]
    peak, = (line for line in warned if 'peak acceleration' in line)
    assert f'{middle:.1f}; real falls: 3.8 to 8.1 (' in peak and middle > 8.1
    page = (tmp_path / 'README.md').read_text()
    assert page.count('| **outside** |') == len(warned)


def test_a_data_set_without_a_known_part_is_described(tmp_path):
    build_dataset(DatasetJob(recipe(), 3), tmp_path, here)
    summary = summarize(tmp_path)
    assert '| ball | 100% |' in describe.page_text(summary, [])
    assert describe.main([str(tmp_path)]) == 0
