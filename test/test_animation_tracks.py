"""Tracks of glTF's animations against SciPy's splines and slerp, and their derivatives."""
from __future__ import annotations

import math

import fit_rigs
import numpy as np
import pytest

from ragdoll_ros.files.gltf import tracks
from ragdoll_ros.files.gltf.gltf_file import GltfFile
from ragdoll_ros.files.gltf.nodes import read_nodes
from ragdoll_ros.files.gltf.tracks import read_animations
from ragdoll_ros.files.key_track import KeyTrack
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelError

TIMES = np.array((0.0, 0.5, 0.8, 2.0))

RNG = np.random.default_rng(3)


def track(values, kind, is_rotation=False):
    """A track over TIMES; ``values`` (4, w), or (4, 3, w) of a spline."""
    values = np.asarray(values, float)
    if values.ndim == 2:
        values = np.stack([np.zeros_like(values), values, np.zeros_like(values)], axis=1)
    return KeyTrack(TIMES, values, kind, is_rotation)


def slope(made, time, h=1e-4):
    """Derivative by centred differences of order 4, within an interval."""
    ends = [made.at(time + k * h)[0] for k in (-2, -1, 1, 2)]
    return (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * h)


@pytest.mark.parametrize('time', [0.0, 0.1, 0.5, 0.7, 1.3, 2.0])
def test_a_spline_is_scipys(time):
    interpolate = pytest.importorskip('scipy.interpolate')
    points, slopes = RNG.normal(size=(2, 4, 3))
    made = track(np.stack([slopes, points, slopes], axis=1), 'CUBICSPLINE')
    due = interpolate.CubicHermiteSpline(TIMES, points, slopes)
    value, rate = made.at(time)
    assert value == pytest.approx(due(time), abs=1e-12)
    assert rate == pytest.approx(due(time, 1), abs=1e-12)


@pytest.mark.parametrize('time', [0.1, 0.7, 1.3])
def test_a_slerp_is_scipys(time):
    """On the shorter arc, whichever of q and -q a key has; its speed is constant."""
    scipy_rotation = pytest.importorskip('scipy.spatial.transform')
    keys = rotation.normalized(RNG.normal(size=(4, 4)))
    due = scipy_rotation.Slerp(TIMES, scipy_rotation.Rotation.from_quat(keys))(time).as_quat()
    for signs in (np.ones(4), np.array((1, -1, -1, 1))):
        made = track(keys * signs[:, None], 'LINEAR', is_rotation=True)
        value, rate = made.at(time)
        assert rotation.angle_between(value, due) < 1e-12
        assert rate == pytest.approx(slope(made, time), abs=1e-9)


@pytest.mark.parametrize('kind', ['LINEAR', 'STEP', 'CUBICSPLINE'])
@pytest.mark.parametrize('is_rotation', [False, True])
@pytest.mark.parametrize('time', [0.2, 0.65, 1.1])
def test_the_rate_is_the_derivative_of_the_value(kind, is_rotation, time):
    values = RNG.normal(size=(4, 3, 4))
    made = track(values if kind == 'CUBICSPLINE' else values[:, 1], kind, is_rotation)
    assert made.at(time)[1] == pytest.approx(slope(made, time), abs=1e-8)


def test_at_a_key_the_rate_is_the_mean_of_both_sides():
    """So that of equal steps it is the centred difference, exact for a parabola."""
    points = np.array([(9.8 * t * t / 2,) for t in TIMES])
    made = track(points, 'LINEAR')
    sides = np.diff(points[:, 0]) / np.diff(TIMES)
    assert made.at(0.5)[1] == pytest.approx([(sides[0] + sides[1]) / 2])
    assert made.at(0.8)[1] == pytest.approx([(sides[1] + sides[2]) / 2])
    assert made.at(0.5 + 1e-8)[1] == made.at(0.5)[1]
    assert made.at(0.0)[1] == pytest.approx(sides[:1])
    assert made.at(2.0)[1] == pytest.approx(sides[2:])


def test_a_step_holds_until_the_next_key():
    made = track([(1.0,), (2.0,), (3.0,), (4.0,)], 'STEP')
    assert [made.at(time)[0][0] for time in (0.0, 0.49, 0.5, 1.9, 2.0, 3.0)] == [1, 1, 2, 3, 4, 4]
    assert made.at(0.7)[1] == 0.0


def test_a_track_stands_before_its_first_key_and_after_its_last():
    made = KeyTrack(TIMES + 1.0, track(RNG.normal(size=(4, 3)), 'LINEAR').values, 'LINEAR', False)
    for time, key in ((0.3, 0), (4.0, 3)):
        value, rate = made.at(time)
        assert value == pytest.approx(made.values[key, 1])
        assert not rate.any()


def test_one_key_is_a_pose():
    made = KeyTrack(np.array([0.4]), np.ones((1, 3, 3)), 'LINEAR', False)
    for time in (0.0, 0.4, 1.0):
        assert made.at(time)[0] == pytest.approx((1, 1, 1))
        assert not made.at(time)[1].any()


def written(tmp_path, change=lambda data: None, times=(0.0, 1.0), turns=((0, 0, 0, 1),) * 2):
    """A file of two nodes, the second a child, that turns."""
    made = fit_rigs.Document()
    made.data['nodes'] = [{'name': 'a', 'translation': [0, 1, 0], 'children': [1]},
                          {'name': 'b', 'translation': [0, 0, 2], 'scale': [2, 2, 2]}]
    clock = made.accessor(np.reshape(times, (-1, 1)), 'f4', 'SCALAR')
    made.data['animations'] = [{
        'name': 'turn',
        'samplers': [{'input': clock, 'output': made.accessor(turns, 'f4', 'VEC4')}],
        'channels': [{'sampler': 0, 'target': {'node': 0, 'path': 'rotation'}},
                     {'sampler': 9, 'target': {'node': 0, 'path': 'weights'}}]}]
    change(made.data)
    path = tmp_path / 'turn.glb'
    path.write_bytes(made.glb())
    return GltfFile(path)


def test_a_child_turns_with_its_parent(tmp_path):
    """A quarter of a turn a second about x: the child, 2 before it, moves on a circle."""
    half = math.sqrt(0.5)
    file = written(tmp_path, turns=((0, 0, 0, 1), (half, 0, 0, half)))
    animation, = read_animations(file)
    worlds, rates = animation.worlds(read_nodes(file), 0.5)
    angle, speed = math.pi / 4, math.pi / 2
    # Keys are float32.
    assert worlds[1, :3, 3] == pytest.approx(
        (0, 1 - 2 * math.sin(angle), 2 * math.cos(angle)), abs=1e-6)
    assert rates[1, :3, 3] == pytest.approx(
        (0, -2 * speed * math.cos(angle), -2 * speed * math.sin(angle)), abs=1e-6)
    assert rates[1, :3, 0] == pytest.approx((0, 0, 0), abs=1e-6)
    assert animation.duration == 1.0


@pytest.mark.parametrize(('place', 'fault', 'times', 'turns'), [
    ('animations[0].samplers[0].interpolation', {'interpolation': 'CUBIC'}, (0, 1), None),
    ('animations[0].samplers[0].input', {}, (1, 0), None),
    ('animations[0].samplers[0].input', {}, (-1, 0), None),
    ('animations[0].samplers[0].output', {}, (0, 1, 2), None),
    ('animations[0].samplers[0].output', {'interpolation': 'CUBICSPLINE'}, (0, 1), None),
    ('animations[0].samplers[0].output', {}, (0, 1), ((0, 0, 0, 0), (0, 0, 0, 1))),
    ('animations[0].samplers[0].output', {'output': 99}, (0, 1), None),
    ('animations[0].samplers[0].input', {'input': None}, (0, 1), None)])
def test_a_broken_track_is_named(tmp_path, place, fault, times, turns):
    def change(data):
        data['animations'][0]['samplers'][0].update(fault)

    file = written(tmp_path, change, times, turns or ((0, 0, 0, 1),) * 2)
    with pytest.raises(ModelError) as caught:
        read_animations(file)[0].tracks  # noqa: B018
    assert caught.value.path == place


@pytest.mark.parametrize(('place', 'channel'), [
    ('animations[0].channels[0].sampler', {'sampler': 1}),
    ('animations[0].channels[0].sampler', {'sampler': 'x'}),
    ('animations[0].channels[0].target.node', {'target': {'node': 7, 'path': 'rotation'}})])
def test_a_broken_channel_is_named(tmp_path, place, channel):
    file = written(tmp_path, lambda data: data['animations'][0]['channels'][0].update(channel))
    with pytest.raises(ModelError) as caught:
        read_animations(file)[0].tracks  # noqa: B018
    assert caught.value.path == place


@pytest.mark.parametrize('path', ['pointer', ['rotation'], None])
def test_a_channel_that_moves_no_node_is_left_out(tmp_path, path):
    """Of morph targets, of extensions, and of nothing."""
    file = written(tmp_path, lambda data: data['animations'][0]['channels'][0].update(
        target={'node': 0, 'path': path}))
    assert read_animations(file) == []


def test_a_file_without_animations_has_none(tmp_path):
    assert read_animations(written(tmp_path, lambda data: data.pop('animations'))) == []


def test_too_many_keys_are_refused(tmp_path, monkeypatch):
    """The limit counts all tracks of an animation: they may share one accessor."""
    monkeypatch.setattr(tracks, 'MAX_KEYS', 5)
    times, turns = (0, 1, 2), ((0, 0, 0, 1),) * 3
    assert read_animations(written(tmp_path, times=times, turns=turns))[0].duration == 2

    def change(data):
        data['animations'][0]['channels'].append(
            {'sampler': 0, 'target': {'node': 1, 'path': 'rotation'}})

    with pytest.raises(ModelError, match='6 keys'):
        read_animations(written(tmp_path, change, times, turns))[0].tracks  # noqa: B018


@pytest.mark.parametrize('time', [0.0, 0.02, 0.31, 0.5, 0.96, 1.0])
def test_linear_keys_at_equal_steps_are_samples_of_a_smooth_motion(tmp_path, time):
    """Of a turn to and fro: amid them to order 3, at their ends to order 2 of steps of 1/30 s."""
    times = np.arange(31) / 30

    def turn(at):
        angle = 0.8 * math.sin(5 * at)
        return np.array((math.sin(angle / 2), 0, 0, math.cos(angle / 2)))

    keys = np.array([turn(at) for at in times]) * (-1.0) ** (np.arange(31) // 7)[:, None]
    animation, = read_animations(written(tmp_path, times=times, turns=keys))
    value, found = animation.tracks[0, 'rotation'].at(time)
    speed = 0.8 * 5 * math.cos(5 * time)
    spin = 2 * rotation.multiply(found, rotation.inverse(value))[:3]
    tolerance = 1e-3 if 0.1 < time < 0.9 else 0.05
    assert spin == pytest.approx((speed, 0, 0), abs=tolerance)
    assert rotation.angle_between(value, turn(time)) < tolerance / 30


@pytest.mark.parametrize('times', [(0, 0.05, 0.1, 0.15, 0.3), (0, 0.2, 0.4, 0.6, 0.8),
                                   (0, 0.05, 0.1, 0.15)])
def test_other_linear_keys_have_the_speed_of_the_chord(tmp_path, times):
    """Of unequal steps, of long ones, and of too few for a difference of order 4."""
    turns = [rotation.from_axis_angle((1, 0, 0), angle) for angle in np.square(times)]
    animation, = read_animations(written(tmp_path, times=times, turns=turns))
    value, found = animation.tracks[0, 'rotation'].at(0.07)
    first = np.searchsorted(times, 0.07) - 1
    speed = times[first] + times[first + 1]
    assert 2 * rotation.multiply(found, rotation.inverse(value))[0] == pytest.approx(
        speed, abs=1e-5)
