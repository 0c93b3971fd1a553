"""A recording as a source: its time follows the clock on the wall, as told."""
import time

import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors
from ragdoll_ros.recordings.recording import Recording
from ragdoll_ros.viewer.sources.playback import PlaybackSource
from ragdoll_ros.viewer.sources.source import RequestedData

TURNS = np.tile((0, 0, 0, 1.0), (10, 1))


def climb(duration, poses=11):
    """A recording in which each bone rises at 1 m/s: a height tells the instant."""
    times = np.linspace(0, duration, poses)
    places = np.zeros((poses, 10, 3))
    places[:, :, 2] = times[:, None]
    return Recording(load_scene('drop'), times, places, np.stack([TURNS] * poses))


@pytest.fixture
def playing():
    """An hour's recording that is shown, and an instant before which it did not go."""
    playback = PlaybackSource(climb(3600.0))
    begin = time.monotonic()
    playback.request(RequestedData(frames=True))
    return playback, begin


def height(frame):
    return frame.state.positions[0, 2]


def test_follows_the_clock_on_the_wall(playing):
    playback, begin = playing
    until = time.monotonic()
    for _ in range(3):
        before = time.monotonic()
        frame = playback.frame
        assert before - until <= frame.time <= time.monotonic() - begin
        assert height(frame) == pytest.approx(frame.time, abs=1e-9)
    assert np.isnan(frame.state.linear_velocities).all()  # nobody has recorded velocities


def test_another_instant_is_another_frame(playing):
    playback, _ = playing
    first = playback.frame
    playback.pause(True)
    assert playback.frame is not first
    assert playback.frame is playback.frame


def test_stands_while_no_page_is_open(playing):
    playback, _ = playing
    playback.request(RequestedData())
    assert playback.frame is playback.frame
    assert not playback.status.paused


def test_pause_step_and_restart(playing):
    playback, _ = playing
    playback.step()
    assert playback.frame.time < 360
    playback.pause(True)
    assert playback.status.paused
    for following in (360, 720):
        playback.step()
        assert playback.frame.time == height(playback.frame) == following
    playback.reset()
    assert playback.frame.time == 0
    playback.pause(False)
    assert playback.frame is not playback.frame


def test_real_time_factor_changes_from_here_on(playing):
    playback, _ = playing
    playback.pause(True)
    playback.step()
    playback.set_real_time_factor(50.0)
    assert (playback.frame.time, playback.status.real_time_factor) == (360, 50)
    before = time.monotonic()
    playback.pause(False)
    after = time.monotonic()
    while time.monotonic() < after + 0.01:
        pass
    assert 360 + 50 * 0.01 <= playback.frame.time + 1e-9 <= 360 + 50 * (time.monotonic() - before)
    with pytest.raises(errors.OutOfRange, match='real_time_factor'):
        playback.set_real_time_factor(0.0)


def test_stands_at_its_end_and_goes_on_from_the_start():
    playback = PlaybackSource(climb(0.01))
    playback.request(RequestedData(frames=True))
    while not playback.status.paused:
        pass
    assert playback.frame.time == height(playback.frame) == 0.01
    assert playback.status.note == 'recording: 0.0 of 0.0 s'
    playback.set_real_time_factor(0.001)
    playback.pause(False)
    assert playback.frame.time < 0.01


def test_says_where_it_is(playing):
    playback, _ = playing
    playback.pause(True)
    playback.step()
    assert playback.status.note == 'recording: 360.0 of 3600.0 s'


def test_what_cannot_be_is_refused_with_what_can(playing):
    playback, _ = playing
    with pytest.raises(errors.RagdollError, match='ragdoll_viewer --scene crowd'):
        playback.load('crowd')
    with pytest.raises(errors.RagdollError, match='ragdoll_viewer --scene'):
        playback.set_scene(load_scene('crowd'))
