"""The page in headless Chromium: what a user sees and does, on a viewer in a process of its own."""
from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import imageio.v3 as iio
import numpy as np
import pytest
from browser import PATIENCE, SIZE, View, chromium
from conftest import ROOT

from ragdoll_ros.scene_file import load_scene
from ragdoll_ros.simulation import Simulation
from ragdoll_ros.viewer.recording_file import load_recording

SCENE = load_scene('drop')
START = np.array([SCENE.dolls[0].bone_pose(bone)[0] for bone in SCENE.bones])


@pytest.fixture(scope='module')
def browser():
    with chromium() as context:
        yield context


@pytest.fixture(scope='module')
def states():
    """The scene's states, tick by tick from 0 until it is at rest, by a simulation here."""
    with Simulation(SCENE) as simulation:
        states = [simulation.state]
        while not simulation.asleep:
            states.append(simulation.advance())
    return states


class Viewer:
    """`ragdoll_viewer` as a process; ``url`` is what it printed."""

    def __init__(self, *arguments):
        command = [sys.executable, '-m', 'ragdoll_ros.viewer.command', '--port', '0', *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT,
                                        start_new_session=True)
        said, end = b'', time.monotonic() + PATIENCE
        while not (found := re.search(rb'http://\S+\n', said)):
            assert time.monotonic() < end and self.process.poll() is None, said
            if select.select([self.process.stdout], [], [], 1.0)[0]:
                said += os.read(self.process.stdout.fileno(), 1000)
        self.url = found[0].decode().strip()

    def end(self):
        """Give the exit code after SIGTERM."""
        self.process.send_signal(signal.SIGTERM)
        self.process.communicate(timeout=10)
        return self.process.returncode


@pytest.fixture(scope='module')
def viewer():
    viewer = Viewer('--scene', 'drop')
    yield viewer
    assert viewer.end() == 0


@contextmanager
def opened(browser, viewer):
    """A page of a viewer, with all bones in it; no script of it has failed at the end."""
    view = View(browser, viewer.url)
    view.wait(lambda: view.bodies(SCENE) is not None)
    yield view
    view.close()
    assert not view.errors


@pytest.fixture(scope='module')
def view(browser, viewer):
    with opened(browser, viewer) as view:
        yield view


def press(view, button):
    view.page.get_by_role('button', name=button, exact=True).click()


def key(view, name):
    view.page.keyboard.press(name)


def hold_at_start(view):
    """Paused at the start, as the page draws it."""
    if view.page.get_by_role('button', name='Pause', exact=True).count():
        key(view, ' ')
        view.page.get_by_role('button', name='Go on', exact=True).wait_for()
    key(view, 'r')
    view.wait(lambda: abs(view.bodies(SCENE) - START).max() < 1e-6)


def index_of(bodies, states):
    """Which tick is drawn; 0 if none."""
    off = abs(np.array([state.positions for state in states]) - bodies).max(axis=(1, 2))
    return int(off.argmin()) if off.min() < 1e-6 else 0


def far(view, bodies, distance):
    """Whether each body is further than ``distance`` m from where it was."""
    return (np.linalg.norm(view.bodies(SCENE) - bodies, axis=1) > distance).all()


def test_sees_ten_bodies_fall(view, states):
    """All move, and what is drawn is a tick of the fall as a simulation here has it.

    A page gets numbers of 32 bits: 1e-6 m at 2 m.
    """
    assert len(START) == 10
    view.wait(lambda: far(view, START, 0.1))
    drawn = view.wait(lambda: index_of(view.bodies(SCENE), states))
    view.wait(lambda: index_of(view.bodies(SCENE), states) > drawn)


@pytest.mark.parametrize(('button', 'arrow', 'axis', 'sign'), [
    ('↑ away', 'ArrowUp', 0, -1), ('↓ toward', 'ArrowDown', 0, 1),
    ('← left', 'ArrowLeft', 1, -1), ('→ right', 'ArrowRight', 1, 1)])
def test_a_button_and_its_key_push_alike(view, button, arrow, axis, sign):
    """2000 N for 0.6 s: the torso is 1 m off at once; the fall alone takes it 0.5 m."""
    for act in (lambda: press(view, button), lambda: key(view, arrow)):
        hold_at_start(view)
        act()
        key(view, ' ')
        view.wait(lambda: view.bodies(SCENE)[0][axis] * sign > 1)


def test_pause_holds_and_step_makes_one_tick(view, states):
    hold_at_start(view)
    for tick in (1, 2):
        press(view, 'Step')
        view.wait(lambda tick=tick: abs(
            view.bodies(SCENE) - states[tick].positions).max() < 1e-6)
    press(view, 'Go on')
    view.wait(lambda: far(view, states[2].positions, 0.1))


def test_two_pages_show_and_steer_the_same(browser, viewer, view):
    with opened(browser, viewer) as other:
        hold_at_start(view)
        other.wait(lambda: abs(other.bodies(SCENE) - START).max() < 1e-6)
        press(other, 'Go on')
        for each in (view, other):
            each.wait(lambda each=each: far(each, START, 0.1))


def test_a_run_is_recorded_and_played_back(browser, view, states, tmp_path):
    """From the start on, each recorded pose is the simulation's at that tick, to the bit."""
    view.page.get_by_text('Recording', exact=True).click()
    hold_at_start(view)
    press(view, 'Record')
    press(view, 'Go on')
    view.wait(lambda: far(view, START, 0.1))
    with view.page.expect_download() as download:
        press(view, 'Stop and download')
    download.value.save_as(tmp_path / 'run.json')
    recording = load_recording(tmp_path / 'run.json')
    assert recording.scene == SCENE and len(recording) > 20
    for time_, positions in zip(recording.times, recording.positions, strict=True):
        np.testing.assert_array_equal(positions, states[round(time_ / SCENE.step)].positions)
    player = Viewer('--play', str(tmp_path / 'run.json'))
    with opened(browser, player) as page:
        page.wait(lambda: abs(page.bodies(SCENE) - recording.positions[-1]).max() < 1e-6)
        page.page.get_by_text(re.compile(r'run\.json: [0-9.]+ of [0-9.]+ s')).wait_for()
    assert player.end() == 0


def test_the_view_is_saved_as_png(view, tmp_path):
    """As large as the page, white beside the doll, and not where the torso is seen."""
    hold_at_start(view)
    with view.page.expect_download() as download:
        press(view, 'Picture')
    download.value.save_as(tmp_path / 'view.png')
    picture = iio.imread(tmp_path / 'view.png')
    x, y = view.pixels(START[:1])[0].round().astype(int)
    assert picture.shape == (SIZE['height'], SIZE['width'], 3)
    assert (picture[2, 2] == 255).all() and picture[y, x].min() < 200
    press(view, 'Go on')
