"""What the first page sees first: a run begins, or begins again, when that has drawn its start."""
from __future__ import annotations

import time

import numpy as np
import pytest

pytest.importorskip('viser')
from browser import start_of
from page_client import served, wait

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.controls import FIRST_SCENES
from ragdoll_ros.viewer.sources.simulation import SimulationSource
from ragdoll_ros.viewer.sources.source import RequestedData
from ragdoll_ros.viewer.start_when_visible import StartWhenVisible

SCENE = load_scene('drop')
START = start_of(SCENE)


class Client:
    """A page that draws at once."""

    def __init__(self):
        self.images = 0

    def get_render(self, height, width, timeout):
        self.images += 1


@pytest.fixture
def source():
    source = SimulationSource(SCENE)
    source.pause(True)
    source.request(RequestedData(frames=True))
    wait(lambda: source.status.paused)
    yield source
    source.close()


@pytest.fixture(scope='module')
def page():
    with served(SimulationSource(load_scene('flight'))) as page:
        yield page


def is_at_start(frame):
    return np.abs(frame.state.positions - START).max() < 0.1


def test_a_run_waits_for_the_first_page(source):
    start, client = StartWhenVisible(source, 60.0), Client()
    start.update([], source.frame, 0.0)
    assert source.status.paused and not start.hides(source.frame)
    wait(lambda: start.update([client], source.frame, 1.0) or start.is_done)
    assert client.images == 1
    wait(lambda: source.frame.time > 0)


def test_a_run_that_nobody_saw_begins_again_and_is_not_shown_before(source):
    """It had fallen; a second page, or one that comes back, changes nothing."""
    start, client = StartWhenVisible(source, 5.0), Client()
    start.update([], source.frame, 0.0)
    start.update([], source.frame, 6.0)
    wait(lambda: not is_at_start(source.frame))
    shown = []

    def step():
        frame = source.frame
        shown.extend([] if start.hides(frame) else [frame])
        start.update([client], frame, time.monotonic())
        return start.is_done
    assert start.hides(source.frame)
    wait(step)
    assert all(map(is_at_start, shown)) and shown
    wait(lambda: not is_at_start(source.frame))
    since = source.frame.time
    start.update([], source.frame, 100.0)
    start.update([client, Client()], source.frame, 101.0)
    assert not start.hides(source.frame)
    wait(lambda: source.frame.time > since + 0.2)


@pytest.mark.parametrize(('label', 'name'), FIRST_SCENES.items())
def test_scenes_to_begin_with_are_one_click_away(page, label, name):
    client = page.clients[0] if page.clients else page.open()
    wait(lambda: page.frame)
    client.update(page.controls.first_scenes, label)
    wait(lambda: page.frame.scene.name == name and page.controls.scene.value == name)
