"""Whether everybody can use the page: contrast, names, focus, and targets for fingers."""
from __future__ import annotations

import dataclasses
import importlib.resources

import numpy as np
import pytest

pytest.importorskip('viser')
from browser import View, chromium, skip_or_fail
from page_client import served

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.motors import Motors
from ragdoll_ros.viewer.sources.simulation import SimulationSource

DROP = load_scene('drop')
SCENE = dataclasses.replace(DROP, dolls=(dataclasses.replace(DROP.dolls[0], motors=Motors()),))
"""With the controls of motors."""

DESKTOP, PHONE = {'width': 1280, 'height': 800}, {'width': 390, 'height': 844}

FINGER = 40
"""Pixels: least width and height of what a finger has to hit."""

TARGETS = """() => [...document.querySelectorAll(
  'button, a[href], input:not([type=hidden]), textarea, [role=tab], [role=slider], [role=button]')]
  .filter(each => each.checkVisibility({visibilityProperty: true})
                  && each.getBoundingClientRect().width)"""
"""What a user can press, of all that is shown."""

MISSED = """pressed => {
  const target = pressed.closest('.mantine-Slider-trackContainer') ?? pressed;
  target.scrollIntoView({block: 'center'});
  const box = target.getBoundingClientRect();
  const x = box.x + box.width / 2, y = box.y + box.height / 2, half = FINGER / 2 - 1;
  const own = [target, ...(target.labels ?? [])];
  return [[0, -half], [0, half], [-half, 0], [half, 0]].filter(([dx, dy]) => {
    const hit = document.elementFromPoint(Math.min(Math.max(x + dx, 1), innerWidth - 2), y + dy);
    return !own.some(each => each.contains(hit));
  }).length;
}""".replace('FINGER', str(FINGER))
"""How many of four points at half a finger's width from a target's middle are not its own."""

FOCUS = """() => {
  const focused = document.activeElement, style = getComputedStyle(focused);
  const outline = style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2;
  return [focused === document.body ? '' : focused.getAttribute('aria-label')
          || focused.labels?.[0]?.textContent || focused.textContent.trim() || focused.id, outline];
}"""
"""Name of what has the focus, empty for the page itself, and whether that can be seen."""


AXE = "() => axe.run({resultTypes: ['violations']})"
"""What axe-core finds; without the nodes of what is right, which take as long."""


@pytest.fixture(scope='module')
def axe():
    """Source of axe-core."""
    try:
        files = importlib.resources.files('axe_playwright_python')
    except ImportError:
        skip_or_fail("no axe-core: pip install axe-playwright-python, or '.[test]'")
    return (files / 'axe.min.js').read_text('utf-8')


@pytest.fixture(scope='module')
def opened():
    """A page and the view of it."""
    with served(SimulationSource(SCENE)) as page, chromium() as context:
        view = View(context, f'http://127.0.0.1:{page.server.get_port()}', DESKTOP)
        view.wait(lambda: np.isfinite(view.bodies(SCENE)).all() and page.editor is not None)
        view.wait(lambda: view.page.get_by_role('slider', name='Strength, N').count())
        page.source.pause(True)
        yield page, view
        assert not view.errors
        view.close()


@pytest.mark.parametrize('dark', [False, True], ids=['light', 'dark'])
@pytest.mark.parametrize('size', [DESKTOP, PHONE], ids=['desktop', 'phone'])
def test_axe_finds_nothing_serious(opened, axe, size, dark):
    """In any tab, also while a bone is edited; of a doll that moves, and of one that is paused."""
    page, view = opened
    page.source.pause(dark)
    view.wait(lambda: view.button('Play' if dark else 'Pause').count())
    view.page.set_viewport_size(size)
    page.display.dark.value = dark
    scheme = f'html[data-mantine-color-scheme={"dark" if dark else "light"}]'
    view.page.locator(scheme).wait_for()
    view.page.evaluate(axe)

    def findings():
        return [(each['id'], node['html'][:150], [check['message'] for check in node['any']])
                for each in view.page.evaluate(AXE)['violations']
                if each['impact'] in ('serious', 'critical') for node in each['nodes']]

    # A name or a colour may come half a second after its widget.
    for tab in ('Play', 'Edit', 'Plots'):
        view.tab(tab)
        try:
            view.wait(lambda: not findings(), 60)
        except AssertionError:
            raise AssertionError(f'{tab}: {findings()}') from None
    page.display.dark.value = False


def test_fingers_hit_what_they_aim_at(opened):
    """On a phone, all controls of each tab."""
    _, view = opened
    view.page.set_viewport_size(PHONE)
    for tab in ('Play', 'Edit', 'Plots'):
        view.tab(tab)
        view.wait(lambda tab=tab: view.page.get_by_role('tab', name=tab).get_attribute(
            'aria-selected') == 'true')
        targets = view.page.evaluate_handle(TARGETS)
        missed = {target.as_element().evaluate(
            'each => each.getAttribute("aria-label") || each.labels?.[0]?.textContent '
            '|| each.textContent.trim() || each.outerHTML'): count
            for target in targets.get_properties().values()
            if (count := target.as_element().evaluate(MISSED))}
        assert not missed, tab
        assert len(targets.get_properties()) > 3
    view.tab('Play')


def test_a_phone_is_told_of_fingers_and_a_desktop_of_keys(opened):
    _, view = opened
    for size, word, other in ((PHONE, 'one finger', 'Arrow keys'),
                              (DESKTOP, 'Arrow keys', 'one finger')):
        view.page.set_viewport_size(size)
        hint = view.page.locator('.ragdoll-hint').filter(visible=True)
        view.wait(lambda hint=hint, word=word: word in hint.inner_text())
        assert other not in hint.inner_text()


def test_the_keyboard_reaches_all_and_shows_where_it_is(opened):
    """By Tab alone, through pushes, time, check boxes and folders."""
    _, view = opened
    view.page.set_viewport_size(DESKTOP)
    view.tab('Play')
    view.page.evaluate('() => document.activeElement.blur()')
    names = []
    for _ in range(80):
        view.key('Tab')
        name, is_seen = view.page.evaluate(FOCUS)
        if name:
            assert is_seen, name
            names.append(name)
    for name in ('Commands', 'Play', 'Strength, N', 'Go limp', 'Motor strength', 'Scene',
                 'Contacts', 'Settings'):
        assert name in names


def test_an_arrow_on_a_slider_moves_it_and_pushes_nothing(opened, monkeypatch):
    page, view = opened
    view.page.set_viewport_size(DESKTOP)
    pushed = []
    monkeypatch.setattr(page.source, 'push', lambda force, duration: pushed.append(force))
    slider = view.page.get_by_role('slider', name='Strength, N')
    slider.focus()
    before = page.controls.pushes.strength.value
    view.key('ArrowRight')
    view.wait(lambda: page.controls.pushes.strength.value > before)
    view.page.evaluate('() => document.activeElement.blur()')
    assert not pushed
    view.key('ArrowRight')
    view.wait(lambda: pushed)


def test_space_on_a_button_presses_it_and_does_not_pause(opened):
    page, view = opened
    view.page.set_viewport_size(DESKTOP)
    was_paused = page.source.status.paused
    heading = view.page.get_by_role('button', name='Show')
    heading.focus()
    for expanded in ('false', 'true'):
        view.key(' ')
        view.wait(lambda expanded=expanded: heading.get_attribute('aria-expanded') == expanded)
    assert page.source.status.paused == was_paused
    view.page.evaluate('() => document.activeElement.blur()')
    view.key(' ')
    view.wait(lambda: page.source.status.paused != was_paused)


def test_the_browsers_tab_has_our_name_and_icon(opened):
    _, view = opened
    view.wait(lambda: view.page.title() == 'Ragdoll')
    icon = view.page.locator('link[rel=icon]').get_attribute('href')
    assert icon.startswith('data:image/svg+xml') and 'circle' in icon
