"""The shipped scenes as cards: each is there, tells what it costs, and is loaded by a click."""
from __future__ import annotations

import io
import re
import threading

import pytest

pytest.importorskip('viser')
from conftest import ROOT
from page_client import served, wait
from PIL import Image

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.gallery import cost, gallery
from ragdoll_ros.viewer.sources.simulation import SimulationSource

SCENES = sorted(path.stem for path in (ROOT / 'config').glob('*.yaml')
                if re.search('^dolls:', path.read_text(), re.M))


@pytest.fixture(scope='module')
def page():
    with served(SimulationSource(load_scene('flight'))) as page:
        page.open()
        wait(lambda: page.frame)
        yield page


@pytest.mark.parametrize('name', SCENES)
def test_each_shipped_scene_has_a_picture_a_sentence_and_a_cost(name):
    content = (gallery.FOLDER / f'{name}.webp').read_bytes()
    assert len(content) < 15_000 and Image.open(io.BytesIO(content)).size == (240, 150)
    entry = gallery.entry(name)
    assert entry.description == load_scene(name).description
    assert re.fullmatch('[A-Z0-9].{10,120}[.]', entry.description)
    assert cost.COSTS[name][0] > 0


def click(page, name):
    page.clients[0].tell(page.gallery.events, name)


def test_a_click_loads_a_scene(page):
    for name in ('drop', 'character_falls', 'nonsense', '<b>', '', 'flight'):
        click(page, name)
        if name in SCENES:
            wait(lambda name=name: page.frame.scene.name == name)
            wait(lambda name=name: [card for card, handle in page.gallery.cards.items()
                                    if 'aria-current' in handle.content] == [name])


def test_the_character_has_a_skin(page):
    click(page, 'character_falls')
    wait(lambda: page.frame.scene.name == 'character_falls' and page.stage.skins.handles)
    assert not page.stage.skins.notes


def test_loading_is_shown_to_all_until_it_has_ended(page, monkeypatch):
    load, go = page.source.load, threading.Event()
    monkeypatch.setattr(page.source, 'load', lambda name: (go.wait(60), load(name)))
    click(page, 'crowd')
    wait(lambda: page.transport.shown and page.transport.shown.loading == 'crowd')
    wait(lambda: 'aria-busy' in page.gallery.cards['crowd'].content)
    assert 'Loading' in page.gallery.cards['crowd'].content
    go.set()
    wait(lambda: page.frame.scene.name == 'crowd' and not page.transport.shown.loading)
    wait(lambda: 'aria-busy' not in page.gallery.cards['crowd'].content)


def test_what_is_too_slow_here_says_so_before_it_is_loaded(page, monkeypatch):
    """On a machine that takes ten times as long as the one of the costs, with one processor."""
    monkeypatch.setattr(cost.os, 'sched_getaffinity', lambda _: {0})
    monkeypatch.setitem(cost.COSTS, 'pile', [20.0, 16])
    monkeypatch.setitem(cost.COSTS, 'drop', [0.2, 1])
    slow = 10 * cost.COSTS['reference'][0]
    assert cost.estimated_cost('pile', slow) == pytest.approx(200)
    monkeypatch.setattr(gallery, 'reference_cost', lambda: slow)
    click(page, 'seen')
    wait(lambda: 'At most 0.05 of real time here' in page.gallery.cards['pile'].content)
    wait(lambda: 'Real time here: a tick of 10 ms takes 2 ms' in page.gallery.cards['drop'].content)


def test_the_estimate_is_that_of_the_run_of_reference():
    """For this scene it is what was measured here; its busiest second costs more than the mean."""
    measured = cost.reference_cost()
    assert 0.8 * measured < cost.estimated_cost('drop', measured) < 5 * measured


def test_a_pace_below_real_time_is_enough_where_a_scene_asks_for_it():
    assert cost.cost_text(12.0, 0.01, 0.6) == (
        'Its pace, 0.6 of real time, here: a tick of 10 ms takes 12 ms', False)
    assert cost.cost_text(25.0, 0.01, 1.0) == ('At most 0.4 of real time here: a tick of 10 ms '
                                               'takes 25 ms', True)
