"""The timeline: what was shown is kept for minutes, looked at again, saved, and costs no tick."""
from __future__ import annotations

import io
import threading
import time
import tracemalloc
import zipfile
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('viser')
from page_client import served, wait

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.scene import SECOND
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.save import FORMATS
from ragdoll_ros.viewer.command import free_port, server_at
from ragdoll_ros.viewer.sources.playback import PlaybackSource
from ragdoll_ros.viewer.sources.simulation import SimulationSource
from ragdoll_ros.viewer.sources.source import Frame
from ragdoll_ros.viewer.timeline import frame_buffer
from ragdoll_ros.viewer.timeline.export import ALL, PART, ExportPanel, export_zip
from ragdoll_ros.viewer.timeline.frame_buffer import MAX_FRAMES, MAX_NUMBERS, FrameBuffer
from ragdoll_ros.viewer.timeline.playhead import Playhead
from ragdoll_ros.viewer.timeline.strip import WIDTH, strip
from ragdoll_ros.viewer.timeline.timeline import Timeline
from ragdoll_ros.viewer.timeline.transport import PERIOD

DROP = load_scene('drop')


def frame(time, height=5.0, scene=DROP, **changes):
    count = len(scene.bones)
    places = np.zeros((count, 3))
    places[:, 0], places[:, 2] = time, height
    still = np.zeros((count, 3))
    return Frame(scene, time, State(places, np.tile((0, 0, 0, 1.0), (count, 1)), still, still),
                 **changes)


@pytest.fixture
def buffer():
    """1.0 s, a push in 0.2 to 0.3 s, the ground from 0.5 s on."""
    buffer = FrameBuffer()
    push = Push('torso', (10, 0, 0))
    for tick in range(101):
        buffer.add(frame(tick / 100, height=0.0 if tick >= 50 else 5.0,
                           pushes=(push,) if 20 <= tick < 30 else ()))
    return buffer


def test_five_minutes_of_a_doll_are_kept_and_no_more():
    """Of 310 s in ticks of 10 ms those of the last 300 s, each in its place, the newest last."""
    buffer, seen = FrameBuffer(), frame(0.0)
    for tick in range(31_000):
        assert buffer.clip().is_cut == (tick > MAX_FRAMES) if tick % 5000 == 1 else True
        buffer.add(replace(seen, time=tick / 100, grabs=(None,) if tick % 7 == 0 else ()))
    clip = buffer.clip()
    assert len(buffer) == MAX_FRAMES and clip.duration == pytest.approx(299.99) and clip.is_cut
    assert clip.frame(0).time == 10.0 and clip.frame(MAX_FRAMES - 1).time == 309.99
    np.testing.assert_allclose(clip.times, [clip.frame(k).time for k in range(MAX_FRAMES)])
    assert (clip.pushed == [bool(clip.frame(k).grabs) for k in range(MAX_FRAMES)]).all()


@pytest.mark.parametrize('minutes', [12, pytest.param(90, marks=pytest.mark.slow)])
def test_memory_is_bounded_whatever_comes(minutes):
    """So many minutes at 60 frames a second, without waiting: no more than when it was full.

    A frame of ten bones is 1040 bytes of numbers and half as much of objects.
    """
    tracemalloc.start()
    buffer, sizes = FrameBuffer(), []
    for tick in range(minutes * 3600):
        buffer.add(frame(tick / 60))
        if tick in (MAX_FRAMES + 100, minutes * 3600 - 1):
            sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    # It goes up and down by 2 %; one number kept of each frame would be 20 % in 90 minutes.
    assert sizes[1] < 1.05 * sizes[0] and sizes[1] < 60e6


def test_a_crowd_is_kept_for_less_time():
    """By the numbers that its frames hold."""
    buffer, crowd = FrameBuffer(), load_scene('crowd')
    numbers = 13 * len(crowd.bones)
    for tick in range(2 * MAX_NUMBERS // numbers):
        buffer.add(frame(tick / 100, scene=crowd))
        if tick > 5000:
            break
    assert len(buffer) * numbers <= MAX_NUMBERS and len(buffer) > 100


def test_the_timeline_goes_on_over_a_reset(buffer):
    """Time that goes back is a reset: a tick later; the same frame again is not kept."""
    assert buffer.add(frame(1.0)) is None
    assert buffer.add(frame(0.0)) is True and buffer.end == pytest.approx(1.01)
    assert buffer.add(frame(0.01)) is False
    clip = buffer.clip()
    assert np.flatnonzero(clip.resets).tolist() == [101]
    np.testing.assert_allclose(np.diff(clip.times), 0.01, atol=1e-12)


def test_another_scene_begins_anew(buffer):
    buffer.add(frame(3.0, scene=load_scene('drop')))
    assert len(buffer) == 1 and buffer.end == 0


def test_pushes_and_contacts_are_marked(buffer):
    """When a push acted, and from when the doll lay; to the 0.05 s between two looks."""
    clip = buffer.clip()
    assert np.flatnonzero(clip.pushed).tolist() == list(range(20, 30))
    touched = np.flatnonzero(clip.touching)
    assert 50 <= touched[0] <= 55 and touched[-1] == 100 and len(touched) == 101 - touched[0]
    picture = strip(clip)
    assert f'x="{WIDTH * 20 // 100}"' in picture and '#e63219' in picture and '#f5be00' in picture
    quiet = FrameBuffer()
    quiet.add(frame(0.0))
    assert '#e63219' not in strip(quiet.clip())


def test_contacts_with_bodies_and_other_dolls_are_marked():
    """Where a source tells of them: also on stairs. Those of two bones of one doll are none."""
    stairs, buffer = load_scene('stairs'), FrameBuffer()
    with Simulation(stairs) as simulation:
        for tick in range(150):
            contacts = simulation.contacts
            pairs = np.stack([contacts.a, contacts.b, contacts.bodies], axis=1)
            buffer.add(Frame(stairs, tick / 100, simulation.state, contacts=contacts.positions,
                             pairs=pairs))
            if tick == 0:
                assert not buffer.clip().touching[0]
            last = simulation.advance()
    assert buffer.clip().touching[-1] and len(contacts) and last.positions[:, 2].min() > 0.2
    assert (pairs[:, 2] >= 0).any()
    own = FrameBuffer()
    own.add(frame(0.0, contacts=np.zeros((1, 3)), pairs=np.array([[0, 1, -1]])))
    own.add(frame(0.01, contacts=np.zeros((1, 3)), pairs=np.array([[0, -1, 2]])))
    assert own.clip().touching.tolist() == [False, True]


@pytest.fixture
def runs():
    """Three runs of 0.5, 0.3 and 0.4 s."""
    buffer = FrameBuffer()
    for run, ticks in ((0, 51), (1, 31), (2, 41)):
        for tick in range(ticks):
            buffer.add(frame(tick / 100, run=run))
    return buffer.clip()


def test_a_run_and_a_part_are_cut_out(runs):
    assert [runs.run(k) for k in (0, 50, 51, 81, 82, 122)] == [
        range(51), range(51), range(51, 82), range(51, 82), range(82, 123), range(82, 123)]
    part = runs.part(runs.run(60)[5:9])
    assert [part.frame(k).time for k in range(4)] == [0.05, 0.06, 0.07, 0.08]
    assert {part.frame(k).run for k in range(4)} == {1} and len(part.recording()) == 4


def test_what_is_exported_is_the_last_run_unless_one_chooses(runs):
    """Its times, as the bar shows them, from and to; a part that is not kept is an error."""
    with server_at('127.0.0.1', free_port('127.0.0.1', 0)) as server:
        panel = ExportPanel(server.gui, lambda: runs)
        times = lambda: [panel.chosen().frame(k).time  # noqa: E731
                         for k in range(len(panel.chosen().times))]
        assert times() == [tick / 100 for tick in range(41)] and not panel.first.visible
        panel.choice.value = PART
        wait(lambda: panel.last.visible and panel.last.value == 0.4)
        panel.first.value, panel.last.value = 0.1, 0.25
        assert times() == [tick / 100 for tick in range(10, 26)]
        panel.first.value = 0.3
        with pytest.raises(ValueError, match=r'from 0.3 to 0.25 s: .* from 0 to 0.4 s'):
            panel.chosen()
        panel.choice.value = ALL
        assert len(panel.chosen().times) == len(runs.times)


def test_a_playhead_pauses_plays_and_steps(buffer):
    playhead = Playhead(buffer.clip(), 0.5)
    assert playhead.frame(100.0).time == playhead.frame(200.0).time == 0.5
    playhead.toggle(200.0)
    assert playhead.frame(200.25).time == 0.75
    playhead.set_speed(0.1, 200.25)
    assert playhead.frame(201.25).time == 0.85
    playhead.step(-1, 201.25)
    assert playhead.frame(300.0).time == 0.84 and not playhead.is_playing
    playhead.step(2, 300.0)
    assert playhead.frame(300.0).time == 0.86
    playhead.go_to(7.0, 300.0)
    playhead.step(1, 300.0)
    assert playhead.frame(300.0).time == 1.0
    playhead.toggle(300.0)
    assert playhead.frame(300.0).time == 0.0, 'from the beginning'
    assert playhead.frame(999.0).time == 1.0 and not playhead.is_playing


def test_a_replay_that_has_ended_begins_with_the_last_run():
    """Not with the one before the reset."""
    buffer = FrameBuffer()
    for run, ticks in ((0, 50), (1, 30)):
        for tick in range(ticks):
            buffer.add(frame(0.01 * tick, run=run))
    clip = buffer.clip()
    playhead = Playhead(clip, clip.duration)
    playhead.toggle(100.0)
    first = playhead.frame(100.0)
    assert (first.run, first.time) == (1, 0.0)


def drawn(page):
    batches = page.stage.bodies.batches
    return (np.concatenate([batch.handle.batched_positions for batch in batches]),
            np.concatenate([batch.bones for batch in batches]))


def shows(page, state):
    """Whether the page draws a state; it gets numbers of 32 bits."""
    places, bones = drawn(page)
    return np.abs(places - state.positions[bones]).max() < 1e-6


@pytest.fixture(scope='module')
def states():
    with Simulation(DROP) as simulation:
        return [simulation.state, *(simulation.advance() for _ in range(400))]


def test_what_was_is_drawn_while_the_doll_goes_on(states):
    """The slider shows the instant that it names; J and L go by frames; Live is what goes on."""
    with served(SimulationSource(DROP)) as page:
        client = page.open()
        wait(lambda: page.frame and page.frame.time > 1.0)
        client.steer(page, 'position 0.5')
        wait(lambda: not page.timeline.is_live)
        clip = page.timeline.clip
        index = clip.index(0.5)
        seen, following = clip.frame(index), clip.frame(index + 1)
        assert seen.time - clip.frame(0).time <= 0.5 < following.time - clip.frame(0).time
        wait(lambda: page.frame is seen)
        wait(lambda: shows(page, states[round(seen.time * 100)]))
        before = page.source.frame.time
        wait(lambda: page.source.frame.time > before + 0.3)
        assert page.frame is seen and page.timeline.clip is clip
        assert clip.duration < page.source.frame.time
        client.press(page, 'Step')
        wait(lambda: page.frame is following)
        client.press(page, 'Step back')
        wait(lambda: page.frame is seen)
        client.press(page, 'Play or pause')
        wait(lambda: page.frame.time > seen.time + 0.2)
        assert not page.timeline.is_live
        client.press(page, 'Live')
        wait(lambda: page.timeline.is_live and page.frame is page.source.frame)


def test_what_a_slider_is_put_to_is_looked_at():
    """Though viser's threads are busy meanwhile, and the page moves the slider along."""
    with served(SimulationSource(DROP)) as page:
        client, shown = page.open(), lambda: page.transport.shown
        wait(lambda: shown() and shown().position > 0.8)
        free = threading.Event()
        for _ in range(100):
            page.server.gui._thread_executor.submit(free.wait, 60)
        try:
            client.steer(page, 'position 0.3')
            wait(lambda: shown().position == 0.3)
            before = page.source.frame.time
            wait(lambda: page.source.frame.time > before + 2 * PERIOD)
        finally:
            free.set()
        wait(lambda: not page.timeline.is_live)
        assert page.timeline.shown_instant(time.monotonic()) == shown().position == 0.3


def test_time_stands_while_one_types_it():
    """From the click into the field on; and goes on if nothing was typed."""
    with served(SimulationSource(DROP)) as page:
        client, position = page.open(), lambda: page.transport.shown.position
        wait(lambda: page.transport.shown and position() > 0.8)
        client.steer(page, 'focus')
        wait(lambda: not page.timeline.is_live and not page.transport.shown.live)
        shown, before = position(), page.source.frame.time
        wait(lambda: page.source.frame.time > before + 2 * PERIOD)
        assert position() == shown == round(page.timeline.shown_instant(time.monotonic()), 3)
        client.steer(page, 'blur')
        wait(lambda: page.timeline.is_live and position() > shown)
        client.steer(page, 'focus')
        wait(lambda: not page.timeline.is_live)
        client.steer(page, 'position 0.5')
        client.steer(page, 'blur')
        before = page.source.frame.time
        wait(lambda: page.source.frame.time > before + 2 * PERIOD)
        assert page.timeline.shown_instant(time.monotonic()) == 0.5


def test_time_goes_on_when_the_page_that_types_it_closes():
    """And not when another one leaves its field."""
    with served(SimulationSource(DROP)) as page:
        one, other = page.open(), page.open()
        wait(lambda: page.transport.shown and page.transport.shown.position > 0)
        one.steer(page, 'focus')
        wait(lambda: not page.timeline.is_live)
        other.steer(page, 'blur')
        # Comes after that by the same way.
        other.steer(page, 'speed 0.5')
        wait(lambda: page.timeline.speed == 0.5)
        assert not page.timeline.is_live
        one.close()
        wait(lambda: page.timeline.is_live)


def test_nothing_is_taken_hold_of_in_the_past_and_a_reset_leads_back():
    with served(SimulationSource(DROP)) as page:
        client = page.open()
        wait(lambda: page.frame and page.frame.time > 0.3)
        assert page._grabbable_frame() is not None
        client.steer(page, 'position 0.1')
        wait(lambda: not page.timeline.is_live)
        assert page._grabbable_frame() is None
        client.press(page, 'Reset')
        wait(lambda: page.timeline.is_live)


def test_a_typed_time_is_that_of_the_shown_run():
    """Digit by digit, after a reset: neither another run's frame nor one that has gone."""
    with served(SimulationSource(DROP)) as page:
        client = page.open()
        wait(lambda: page.frame and page.frame.time > 0.5)
        client.press(page, 'Reset')
        # The page may still draw the run before.
        wait(lambda: page.timeline.clip.resets.any() and page.frame.time > 0.5
             and page.frame.run == page.source.frame.run)
        run = page.frame.run
        for text, instant in (('0', 0.0), ('0.', 0.0), ('0.2', 0.2), ('0.25', 0.25), ('-1', 0.0)):
            client.steer(page, f'time {text}')
            wait(lambda instant=instant: page.frame.time == pytest.approx(instant, abs=1e-9))
            assert page.frame.run == run and not page.timeline.is_live
        assert page.timeline.go_to_time(0.25) == ''
        assert page.timeline.go_to_time(-1.0).startswith('This run is kept from 0.00 to ')
        client.steer(page, 'time 99')
        wait(lambda: page.frame is page.timeline.clip.frame(len(page.timeline.clip.times) - 1))


def test_a_typed_time_that_is_not_kept_says_why(monkeypatch):
    """What was before has made room, or the page was opened later, or it has not come yet."""
    monkeypatch.setattr(frame_buffer, 'MAX_FRAMES', 50)
    source = SimulationSource(DROP)
    timeline = Timeline(source)
    for tick in range(10, 50):
        timeline.add(frame(tick / 100))
    assert timeline.go_to_time(0.3) == ''
    assert timeline.go_to_time(0.0) == ('This run is kept from 0.10 to 0.49 s; the page was opened '
                                        'then')
    assert timeline.go_to_time(0.5) == 'This run is kept from 0.10 to 0.49 s'
    timeline.go_live()
    for tick in range(50, 80):
        timeline.add(frame(tick / 100))
    assert timeline.go_to_time(0.29).startswith(
        'This run is kept from 0.30 to 0.79 s; what is older made room')
    source.close()


def test_plots_follow_the_timeline():
    """They end where one looks, and begin anew with a reset."""
    with served(SimulationSource(DROP)) as page:
        client = page.open()
        client.tell(page.plots.events, 'seen')
        ends = lambda: page.plots.gap.handle.data[0][-1]  # noqa: E731
        wait(lambda: len(page.plots.gap.handle.data[0]) > 6)
        client.steer(page, 'position 0.8')
        wait(lambda: not page.timeline.is_live and ends() <= 0.85)
        client.press(page, 'Live')
        wait(lambda: ends() > 1.0)
        client.press(page, 'Play or pause')  # else it may be as late again before one looks
        client.press(page, 'Reset')
        wait(lambda: ends() < 1.0 and page.frame.time < 1.0)


def test_plots_begin_anew_with_another_scene():
    """A run that is younger than the one before is plotted from its first moment, and alone."""
    with served(SimulationSource(DROP)) as page:
        client = page.open()
        plots = page.plots
        client.tell(plots.events, 'seen')
        handles = [plot.handle for plot in (plots.energy, plots.gap, plots.real_time_factor)]
        wait(lambda: min(handle.data[0][-1:].sum() for handle in handles) > 2)
        client.update(page.controls.scene, 'flight')
        wait(lambda: page.frame.scene.name == 'flight' and page.frame.time > 1)
        # Slow motion: a busy machine plots late, yet before the run is as old as the one before.
        page.source.set_real_time_factor(0.1)
        wait(lambda: all(handle.visible and handle.data[0][-1] <= page.frame.time
                         for handle in handles))
        assert page.frame.time < 2
        client.steer(page, 'position 0.01')
        wait(lambda: not page.timeline.is_live)
        wait(lambda: all(handle.data[0][-1] < 0.5 or not handle.visible for handle in handles))


def test_plots_begin_anew_with_a_recording(recording):
    """Played a second time, it is plotted as the first."""
    with served(PlaybackSource(recording)) as page:
        client, gap = page.open(), page.plots.gap.handle
        client.tell(page.plots.events, 'seen')
        wait(lambda: gap.data[0][-1:].sum() > 0.9)
        client.press(page, 'Reset')
        wait(lambda: 0 < gap.data[0][-1] < 0.9)


def test_a_file_has_the_same_timeline(recording, states):
    """All of it from the start on, with the ground that it touches."""
    with served(PlaybackSource(recording)) as page:
        client = page.open()
        wait(lambda: page.frame)
        clip = page.timeline.clip
        assert clip.duration == pytest.approx(1.19) and 0 < clip.touching.sum() < 120
        touched = next(k for k, state in enumerate(states) if state.positions[:, 2].min() < 0.11)
        assert abs(np.flatnonzero(clip.touching)[0] - touched) < 10
        client.steer(page, 'position 1.0')
        wait(lambda: page.frame.time == 1.0 and shows(page, states[100]))


def test_save_this_has_the_run_in_every_format(states):
    """What a page is sent: each file, and in the table the poses that were shown."""
    with served(SimulationSource(DROP)) as page:
        client = page.open()
        wait(lambda: page.frame and page.frame.time > 0.5)
        client.steer(page, 'position 0.2')
        wait(lambda: not page.timeline.is_live)
        clip = page.timeline.clip
        content = export_zip(clip.recording())
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.namelist() == [f'run{suffix}' for suffix in FORMATS]
        table = np.genfromtxt(io.BytesIO(archive.read('run.csv')), delimiter=',', skip_header=1)
    ticks = [round(clip.frame(k).time * SECOND / 1e7) for k in range(len(clip.times))]
    np.testing.assert_array_equal(table[:, 1:4], [states[k].positions[0] for k in ticks])
