"""Time on the page is the node's simulated time, tick by tick, whatever is done to the node."""
from __future__ import annotations

import io
import json
import signal
import struct
import time
import zipfile

import numpy as np
import pytest

pytest.importorskip('viser')
from page_client import served, wait
from peer import end, kill, start

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.mcap_file import load_recording
from ragdoll_ros.viewer.drawing.plots import thinned
from ragdoll_ros.viewer.sources.node.source import NodeSource
from ragdoll_ros.viewer.timeline.export import export_zip

SCENES = ('drop', 'flight', 'ponytail')

TICK = 0.01

ACTS = 8
"""Of one walk."""


class Reference:
    """The states of a scene by their ticks, as a simulation here makes them."""

    def __init__(self, name):
        self._simulation = Simulation(load_scene(name))
        self._states = [self._simulation.state]

    def positions(self, tick):
        while len(self._states) <= tick:
            self._states.append(self._simulation.advance())
        return self._states[tick].positions


@pytest.fixture(scope='module')
def references():
    return {name: Reference(name) for name in SCENES}


class Bench:
    """A node in a process of its own and the page that shows it."""

    def __init__(self, page):
        self.page, self.node = page, None
        self.restart()

    def restart(self):
        """End the node, if there is one, and start another."""
        if self.node is not None:
            end(self.node, signal.SIGINT)
        self.node = start('node', compiled=True)
        run = self.page.frame and self.page.frame.run
        wait(lambda: self.page.frame and self.page.frame.run != run)
        wait(lambda: not self.page.source.status.problem and not self.page.source.status.paused)

    def go_on(self, seconds):
        """Until so many s of the simulation are past; while paused, of the wall."""
        if self.page.source.status.paused:
            until = time.monotonic() + seconds
            wait(lambda: time.monotonic() > until)
            return
        frame = self.page.frame
        wait(lambda: self.page.frame.run != frame.run
             or self.page.frame.time > frame.time + seconds)

    def pause(self, paused):
        wait(lambda: self.page.source.pause(paused))
        wait(lambda: self.page.source.status.paused == paused)

    def reset(self):
        run = self.page.frame.run
        self.page.source.reset()
        wait(lambda: self.page.frame.run != run)

    def step(self):
        self.pause(True)
        before = self.page.frame.time
        self.page.source.step()
        wait(lambda: self.page.frame.time > before)

    def load(self, name):
        run = self.page.frame.run
        self.page.source.load(name)
        wait(lambda: self.page.frame.run != run and self.page.frame.scene.name == name)

    def set_pace(self, pace):
        self.page.source.set_real_time_factor(pace)
        wait(lambda: self.page.source.status.real_time_factor == pytest.approx(pace))


@pytest.fixture(scope='module')
def bench(ros):
    with served(NodeSource([])) as page:
        page.open()
        bench = Bench(page)
        yield bench
        kill(bench.node)


def act(bench, random):
    """Something that a user does, or a machine."""
    random.choice([
        lambda: bench.pause(True), lambda: bench.pause(False), bench.step, bench.reset,
        lambda: bench.set_pace(round(random.uniform(0.1, 2.0), 2)),
        lambda: bench.load(random.choice(SCENES)),
        *([bench.restart] if random.random() < 0.2 else [])])()
    bench.go_on(random.uniform(0.02, 0.5))


def runs(clip):
    """The frames of a clip, run by run."""
    found = []
    for index, resets in enumerate(clip.resets):
        if resets or not index:
            found.append([])
        found[-1].append(clip.frame(index))
    return found


def check_frames(clip, reference):
    """Every tick of each run is there, as the simulation has it; a frame is TICK after another."""
    for frames in runs(clip):
        ticks = np.array([frame.time for frame in frames]) / TICK
        np.testing.assert_allclose(ticks, round(ticks[0]) + np.arange(len(ticks)), atol=1e-6)
        assert len({frame.run for frame in frames}) == 1
        for tick, frame in zip(np.rint(ticks).astype(int), frames, strict=True):
            assert np.array_equal(frame.state.positions, reference.positions(tick))
    np.testing.assert_allclose(np.diff(clip.times), TICK, atol=1e-9)


def gltf_times(data):
    """Instants of a binary glTF's animation, s."""
    length, = struct.unpack_from('<I', data, 12)
    document = json.loads(data[20:20 + length])
    accessor = document['accessors'][document['animations'][0]['samplers'][0]['input']]
    view = document['bufferViews'][accessor['bufferView']]
    begin = 28 + length + view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
    return np.frombuffer(data, '<f4', accessor['count'], begin)


def check_files(clip, folder):
    """What a user exports has these frames and these instants, in every format."""
    count, ticks = len(clip.times), TICK * np.arange(len(clip.times))
    with zipfile.ZipFile(io.BytesIO(export_zip(clip.recording()))) as archive:
        archive.extractall(folder)
    table = np.genfromtxt(folder / 'run.csv', delimiter=',', skip_header=1)
    np.testing.assert_allclose(table[:, 0], ticks, atol=1e-9)
    recording = load_recording(folder / 'run.mcap')
    np.testing.assert_allclose(recording.times, ticks, atol=2e-9)
    np.testing.assert_allclose(gltf_times((folder / 'run.glb').read_bytes()), ticks, atol=1e-5)
    head, _, rows = (folder / 'run.bvh').read_text().partition('Frame Time: ')
    step, *rows = rows.splitlines()
    assert f'Frames: {count}' in head and float(step) == pytest.approx(TICK) and len(rows) == count
    for frames in (table[:, 1:4], recording.positions[:, 0]):
        assert np.array_equal(frames, [clip.frame(k).state.positions[0] for k in range(count)])


def check_plots(page, clip):
    """They have a point for each tick, whose energy no step of a plot has lost."""
    points = {round(row[0], 6): row[2:] for row in page.plots.energy._rows}
    for time_, frame in zip(clip.times, map(clip.frame, range(len(clip.times))), strict=True):
        assert points[round(float(time_), 6)] == (frame.time, frame.energy, frame.work)
        assert frame.energy < 1e-6 and frame.work == 0


def walk(bench, seed, references, folder):
    random = np.random.default_rng(seed)
    for _ in range(ACTS):
        act(bench, random)
    bench.pause(True)
    wait(lambda: bench.page.frame is bench.page.source.frame)
    clip = bench.page.timeline.clip
    check_frames(clip, references[clip.frame(0).scene.name])
    if len(clip.times) > 1:
        check_files(clip, folder)
        check_plots(bench.page, clip)
    bench.pause(False)


def test_a_pause_takes_no_time(bench, references, tmp_path):
    """Two seconds of the wall are none of the run, on the timeline and in what is saved."""
    bench.load('drop')
    bench.go_on(0.3)
    bench.pause(True)
    bench.go_on(2.0)
    bench.pause(False)
    bench.go_on(0.3)
    bench.pause(True)
    wait(lambda: bench.page.frame is bench.page.source.frame)
    clip = bench.page.timeline.clip
    last = runs(clip)[-1]
    assert last[0].time == 0 and len(last) == 1 + round(bench.page.frame.time / TICK)
    check_frames(clip, references['drop'])
    check_files(clip, tmp_path)
    check_plots(bench.page, clip)
    bench.pause(False)


@pytest.mark.parametrize('seed', [pytest.param(seed, marks=[pytest.mark.slow] if seed else [])
                                  for seed in range(40)])
def test_no_tick_is_lost_and_none_is_invented(bench, seed, references, tmp_path):
    """Pauses, steps, resets, paces, scenes and new nodes at random."""
    walk(bench, seed, references, tmp_path)


def test_a_picture_of_many_points_has_their_extremes():
    random = np.random.default_rng(1)
    rows = np.column_stack([np.arange(5000) / 100, random.normal(size=(5000, 2))])
    rows[1234, 1] = 100.0
    drawn = thinned(rows, 150)
    assert len(drawn) <= 4 * 150 + 2 and rows[1234].tolist() in drawn.tolist()
    assert (drawn[[0, -1]] == rows[[0, -1]]).all() and (np.diff(drawn[:, 0]) > 0).all()
    for row in rows[::7]:
        near = drawn[abs(drawn[:, 0] - row[0]) < 50 / 150]
        assert (near[:, 1:].max(axis=0) >= row[1:]).all()
        assert (near[:, 1:].min(axis=0) <= row[1:]).all()
