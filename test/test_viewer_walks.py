"""Users who do this and that on the page, at random, find home by one key: the doll is in sight."""
from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from browser import BODIES, chromium, opened, serving

from ragdoll_ros.files.scene import load_scene

DROP = load_scene('drop')

SIZES = {'desk': {'width': 1280, 'height': 800}, 'phone': {'width': 390, 'height': 844}}

ACTS = 12
"""Acts of one walk."""

COVERED = """points => points.filter(([x, y]) => document.elementFromPoint(x, y)
  !== window.__viserMutable.canvas).length"""
"""How many points of the page, pixels, show something else than the picture."""


@pytest.fixture(scope='module')
def browser():
    with chromium() as context:
        yield context


@pytest.fixture(scope='module', params=SIZES)
def view(browser, request, tmp_path_factory):
    folder = str(tmp_path_factory.mktemp('walks'))
    with (serving('--port', '0', '--scene', 'drop', '--folder', folder) as url,
          opened(browser, url, DROP, SIZES[request.param], first=True) as view):
        yield view


def points(view):
    """Where all bodies are drawn, (n, 3) m."""
    return np.array([matrix[12:15] for batch in view.page.evaluate(BODIES).values()
                     for matrix in batch])


def in_sight(view):
    """Whether every body's middle is in the picture, with nothing above it."""
    places = points(view)
    if not len(places):  # one scene has gone, the next is to come
        return False
    drawn = view.pixels(places)
    frame = view.page.locator('canvas').first.bounding_box()
    share = (drawn - (frame['x'], frame['y'])) / (frame['width'], frame['height'])
    inside = ((share > 0) & (share < 1)).all()
    return bool(inside) and view.page.evaluate(COVERED, drawn.tolist()) == 0


def drag(view, start, end, button='left'):
    mouse = view.page.mouse
    mouse.move(*start)
    mouse.down(button=button)
    mouse.move(*end, steps=4)
    mouse.up(button=button)


def act(view, random):
    """Do something, as one who tries the page."""
    frame = view.page.locator('canvas').first.bounding_box()

    def anywhere():
        return (frame['x'] + frame['width'] * random.uniform(0.05, 0.95),
                frame['y'] + frame['height'] * random.uniform(0.05, 0.95))

    def hold():
        key = random.choice(['ArrowUp', 'ArrowDown', 'ArrowLeft', 'ArrowRight'])
        view.page.keyboard.down(key)
        view.page.wait_for_timeout(random.uniform(50, 800))
        view.page.keyboard.up(key)

    def zoom():
        view.page.mouse.move(*anywhere())
        view.page.mouse.wheel(0, random.choice([-1, 1]) * random.uniform(300, 3000))

    def choose():
        view.tab('Play')
        view.row('Scene').locator('input').first.click()
        options = view.page.get_by_role('option')
        options.first.wait_for()
        names = options.all_inner_texts()
        name = random.choice([name for name in ('drop', 'flight', 'crowd', 'ponytail')
                              if name in names])
        view.page.get_by_role('option', name=name, exact=True).click()

    def follow():
        view.tab('Play')
        view.page.get_by_role('checkbox', name='Follow').click()

    body = view.pixels(view.wait(lambda: points(view).tolist())[:1])
    # What nobody sees nobody drags: the panel may be there, whose tabs come off.
    seen = view.page.evaluate(COVERED, body.tolist()) == 0
    random.choice([
        hold, hold, zoom, choose, follow, lambda: drag(view, anywhere(), anywhere()),
        lambda: drag(view, body[0] if seen else anywhere(), anywhere()),
        lambda: drag(view, anywhere(), anywhere(), 'right'),
        *(lambda key=key: view.key(key) for key in (' ', 'n', 'r', 'e', 'Control+z'))])()


@pytest.mark.parametrize('seed', [pytest.param(seed, marks=[pytest.mark.slow] if seed else [])
                                  for seed in range(20)])
def test_home_is_found_from_everywhere(view, seed):
    random = np.random.default_rng(seed)
    for _ in range(ACTS):
        act(view, random)
    view.page.evaluate('document.activeElement.blur()')
    view.wait(lambda: view.button('Pause').count() or view.button('Play').count())
    view.key('h')
    view.wait(lambda: at_home(view))


def at_home(view):
    """Whether all is in sight; what goes on yet is stopped first, or it may fall out of sight
    as soon as it was in it. A busy machine may have had Space before under way until now.
    """
    if view.button('Pause').count():
        view.key(' ')
        with suppress(AssertionError):
            view.wait(view.button('Play').count, 5)
        view.key('h')
    return in_sight(view)
