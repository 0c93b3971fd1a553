"""The page in headless Chromium: what a user sees and does, on a viewer in a process of its own."""
from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from browser import PATIENCE, View, chromium
from conftest import ROOT

from ragdoll_ros.scene_file import load_scene
from ragdoll_ros.simulation import Simulation

SCENE = load_scene('drop')


@pytest.fixture(scope='module')
def browser():
    with chromium() as context:
        yield context


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


@pytest.fixture
def view(browser, viewer):
    """A fresh page, with all bones in it."""
    view = View(browser, viewer.url)
    view.wait(lambda: view.bodies(SCENE) is not None)
    yield view
    view.close()
    assert not view.errors


def press(view, button):
    view.page.get_by_role('button', name=button).click()


def bodies_at_rest():
    """Where the doll comes to rest, by a simulation of this process."""
    with Simulation(SCENE) as simulation:
        while not simulation.asleep:
            simulation.advance()
        return simulation.state.positions


def test_sees_ten_bodies_fall_and_come_to_rest(view):
    """All move; the page's last picture is where the doll comes to rest in a simulation here.

    A page gets numbers of 32 bits: 1e-6 m at 2 m.
    """
    press(view, 'Reset')
    before = view.bodies(SCENE)
    assert before.shape == (10, 3)
    view.wait(lambda: (abs(view.bodies(SCENE) - before).max(axis=1) > 0.1).all())
    rest = bodies_at_rest()
    view.wait(lambda: abs(view.bodies(SCENE) - rest).max() < 1e-6)


@pytest.mark.parametrize(('button', 'key', 'axis', 'sign'), [
    ('↑ away', 'ArrowUp', 0, -1), ('→ right', 'ArrowRight', 1, 1)])
def test_a_button_and_its_key_push_alike(view, button, key, axis, sign):
    """2000 N for 0.6 s: the torso is 1 m off in no time, where the fall alone moves it 0.5 m."""
    for act in (lambda: press(view, button), lambda: view.page.keyboard.press(key)):
        press(view, 'Reset')
        view.wait(lambda: abs(view.bodies(SCENE)[0][:2]).max() < 0.1)
        act()
        view.wait(lambda: view.bodies(SCENE)[0][axis] * sign > 1)
