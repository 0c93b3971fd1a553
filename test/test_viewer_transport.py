"""The bar below the picture: one set of controls for a simulation, its past and a recording."""
from __future__ import annotations

import time

import numpy as np
import pytest

pytest.importorskip('viser')
from browser import View, chromium
from page_client import served, wait

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.sources.playback import PlaybackSource
from ragdoll_ros.viewer.sources.simulation import SimulationSource

DROP = load_scene('drop')

SIZES = {'small': (1280, 800), 'large': (1440, 900), 'phone': (390, 844)}


@pytest.fixture(scope='module')
def browser():
    with chromium() as context:
        yield context


@pytest.fixture(scope='module')
def page():
    with served(SimulationSource(DROP)) as page:
        yield page


@pytest.fixture(scope='module')
def opened(browser, page):
    view = open_view(browser, page)
    yield view
    view.close()
    assert not view.errors


@pytest.fixture
def view(opened, page):
    """A page that is live and runs from the start."""
    run = page.source.frame.run
    page.timeline.go_live()
    page.source.pause(False)
    page.source.set_real_time_factor(1.0)
    page.source.reset()
    opened.wait(lambda: page.source.frame.run != run and page.frame.run == page.source.frame.run)
    opened.wait(lambda: page.transport.shown.playing and not looking_back(opened))
    opened.button('Pause').wait_for()
    return opened


def open_view(browser, page):
    width, height = SIZES['small']
    view = View(browser, f'http://127.0.0.1:{page.server.get_port()}',
                {'width': width, 'height': height})
    view.button('Pause').or_(view.button('Play')).wait_for()
    return view


def looking_back(view):
    return view.page.get_by_text('Looking back').is_visible()


def shown_time(view):
    return float(view.page.get_by_label('Time', exact=True).input_value())


def test_one_button_pauses_and_a_step_is_one_tick(page, view):
    view.press('Pause')
    view.button('Play').wait_for()
    assert page.source.status.paused and not looking_back(view)
    held = page.source.frame.time
    for key, count in (('.', 1), ('n', 2)):
        view.key(key)
        view.wait(lambda count=count: page.source.frame.time == pytest.approx(held + count / 100))
    view.wait(lambda: shown_time(view) == pytest.approx(held + 0.02, abs=0.006))
    view.key(' ')
    view.wait(lambda: not page.source.status.paused)
    view.wait(lambda: view.button('Step').is_disabled())


def test_a_button_with_the_focus_is_pressed_once_by_space(page, view):
    """By the button, and not by the hotkey besides, which would undo it."""
    view.button('Pause').focus()
    view.key(' ')
    view.button('Play').wait_for()
    before = page.source.frame.time
    view.page.wait_for_timeout(500)
    assert page.source.status.paused and page.source.frame.time == before


def test_the_past_takes_no_keys_and_no_drags_and_says_so(page, view, monkeypatch):
    done = []
    for name in ('push', 'grab'):
        monkeypatch.setattr(page.source, name, lambda *_, name=name: done.append(name))
    view.wait(lambda: page.source.frame.time > 0.5)
    view.key(',')
    view.wait(lambda: looking_back(view))
    held = page.frame
    for act in (lambda: view.key('ArrowLeft'), lambda: drag_doll(view, page)):
        act()
        view.page.get_by_role('status').get_by_text('This is the past').wait_for()
        view.page.evaluate("document.querySelector('.ragdoll-bar .notice').hidden = true")
    assert not done and page.frame is held
    view.press('Live')
    view.wait(lambda: not looking_back(view) and page.frame is not held)
    view.key('ArrowLeft')
    view.wait(lambda: 'push' in done)
    drag_doll(view, page)
    view.wait(lambda: 'grab' in done)


def drag_doll(view, page):
    x, y = view.pixels(page.frame.state.positions[:1])[0]
    view.page.mouse.move(x, y)
    view.page.mouse.down()
    view.page.mouse.move(x + 30, y, steps=4)
    view.page.mouse.up()


def test_a_second_page_shows_the_same(browser, page, view):
    """Also what was done before it was opened."""
    view.wait(lambda: page.source.frame.time > 0.5)
    view.key(' ')
    view.wait(lambda: page.source.status.paused)
    view.key(',')
    view.page.get_by_label('Speed', exact=True).select_option('0.1')
    view.wait(lambda: page.timeline.speed == 0.1)
    view.wait(lambda: looking_back(view))
    other = open_view(browser, page)
    other.wait(lambda: looking_back(other) and shown_time(other) == shown_time(view))
    assert other.page.get_by_label('Speed', exact=True).input_value() == '0.1'
    other.press('Live')
    view.wait(lambda: not looking_back(view))
    other.close()


def test_a_typed_time_is_that_of_the_shown_run(page, view):
    """Simulated time, though the timeline began before a reset."""
    view.wait(lambda: page.source.frame.time > 0.5)
    run = page.source.frame.run
    view.key('r')
    # The key may still be on its way, and the page may still draw the run before.
    view.wait(lambda: page.source.frame.run != run and page.timeline.clip.resets.any()
              and page.frame.time > 0.5 and page.frame.run == page.source.frame.run)
    field = view.page.get_by_label('Time', exact=True)
    field.click()
    view.key('Control+a')
    view.page.keyboard.type('0.25')
    view.wait(lambda: page.frame.time == pytest.approx(0.25, abs=1e-9))
    view.key('Enter')
    view.wait(lambda: looking_back(view) and shown_time(view) == 0.25)
    assert page.timeline.shown_instant(time.monotonic()) > 0.5


def test_arrow_keys_move_the_focused_track_by_frames(page, view):
    view.wait(lambda: page.source.frame.time > 0.5)
    view.page.get_by_label('Timeline').focus()
    view.key('ArrowLeft')
    view.wait(lambda: looking_back(view))
    held = page.frame.time
    view.key('ArrowLeft')
    view.wait(lambda: page.frame.time == pytest.approx(held - 0.01))
    view.key('ArrowRight')
    view.wait(lambda: page.frame.time == pytest.approx(held))
    assert not page.source.frame.pushes


def test_the_track_is_dragged_and_gives_the_keys_back(page, view):
    view.wait(lambda: page.timeline.duration > 1.0)
    box = view.page.get_by_label('Timeline').bounding_box()
    view.page.mouse.move(box['x'] + box['width'] * 0.9, box['y'] + box['height'] / 2)
    view.page.mouse.down()
    view.page.mouse.move(box['x'] + box['width'] / 2, box['y'] + box['height'] / 2, steps=5)
    view.wait(lambda: not page.timeline.is_live)
    view.page.mouse.up()
    position = lambda: page.timeline.position(page.frame, time.monotonic())  # noqa: E731
    view.wait(lambda: position() == float(view.page.get_by_label('Timeline').input_value()))
    assert 0.4 < position() / page.timeline.duration < 0.6
    held = position()
    view.key(' ')
    view.wait(lambda: not page.timeline.is_live and position() > held)


@pytest.mark.parametrize('size', SIZES)
def test_the_bar_is_below_the_picture_and_whole(view, size):
    """In both modes: no control is cut off or covers another one, the panel ends above."""
    width, height = SIZES[size]
    view.page.set_viewport_size({'width': width, 'height': height})
    try:
        for key in ('l', ','):
            view.key(key)
            view.wait(lambda key=key: looking_back(view) == (key == ','))
            view.wait(lambda: bottom(view.page.locator('canvas').first) <= bar(view)['y'] + 1)
            found = bar(view)
            assert (found['x'], found['width']) == (0, width)
            assert found['y'] + found['height'] == pytest.approx(height, abs=1)
            assert bottom(view.page.locator('canvas').first) > 0.3 * height
            assert bottom(view.page.get_by_role('tab', name='Play')) < found['y']
            boxes = [each.bounding_box() for each in view.page.locator(
                '.ragdoll-bar :is(button, select, .time, .track, .badge):visible').all()]
            assert all(box['x'] >= 0 and box['x'] + box['width'] <= width
                       and box['y'] >= found['y'] for box in boxes)
            assert not any(overlap(one, other) for k, one in enumerate(boxes)
                           for other in boxes[:k])
    finally:
        width, height = SIZES['small']
        view.page.set_viewport_size({'width': width, 'height': height})


def bar(view):
    return view.page.get_by_role('group', name='Transport').bounding_box()


def bottom(part):
    box = part.bounding_box()
    return box['y'] + box['height']


def overlap(one, other):
    return (one['x'] < other['x'] + other['width'] - 0.5
            and other['x'] < one['x'] + one['width'] - 0.5
            and one['y'] < other['y'] + other['height'] - 0.5
            and other['y'] < one['y'] + one['height'] - 0.5)


def test_it_works_while_the_panel_is_closed(page, view):
    page.server.gui.main_panel.minimize()
    try:
        view.page.get_by_role('tab', name='Play').wait_for(state='detached')
        view.press('Pause')
        view.button('Play').wait_for()
        view.key(',')
        view.wait(lambda: looking_back(view))
        assert bar(view)['height'] < 100
    finally:
        page.server.gui.main_panel.expand()


def test_each_control_has_a_name(view):
    """As a screen reader has it."""
    names = [each.evaluate('each => each.ariaLabel || each.textContent') for each in
             view.page.locator('.ragdoll-bar :is(button, select, input)').all()]
    assert names == ['Reset', 'Step back', 'Pause', 'Step', 'Time', 'Speed', 'Timeline', 'Live']


def test_a_recording_is_moved_itself(recording):
    """It has no other time: what is typed, stepped or dragged is where it goes on."""
    with served(PlaybackSource(recording)) as page:
        client = page.open()
        wait(lambda: page.transport.shown)
        for text, instant in (('position 0.5', 0.5), ('back', 0.49), ('step', 0.5),
                              ('time 0.8', 0.8), ('position 99', 1.19), ('step', 1.19)):
            client.steer(page, text)
            wait(lambda instant=instant: page.frame.time == pytest.approx(instant, abs=1e-9))
            assert page.timeline.is_live and page.source.status.paused
        np.testing.assert_array_equal(page.frame.state.positions, recording.positions[-1])
        client.steer(page, 'position 0.5')
        wait(lambda: page.frame.time == 0.5)
        client.steer(page, 'speed 0.25')
        client.steer(page, 'toggle')
        wait(lambda: page.frame.time > 0.55)
        assert page.source.status.real_time_factor == 0.25
        assert page.transport.shown.recorded and page.transport.shown.duration == 1.19


@pytest.mark.parametrize('text', ['', 'nonsense', 'speed', 'speed nan', 'speed -1', 'time x',
                                  'position inf', 'speed 1e9', 'step 1e400'])
def test_what_makes_no_sense_changes_nothing(page, text, capfd):
    client = page.clients[0] if page.clients else page.open()
    wait(lambda: page.transport.shown)
    before = page.source.status.real_time_factor
    client.steer(page, text)
    client.steer(page, 'focus')
    client.steer(page, 'blur')
    wait(lambda: page.transport.shown.live)
    assert page.source.status.real_time_factor == before
    assert 'Traceback' not in capfd.readouterr().err
