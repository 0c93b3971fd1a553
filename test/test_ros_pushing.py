"""Pushes by keys, on a real node, in headless Chromium: where one looks, to a speed, in view."""
from __future__ import annotations

import json
import math
import time

import numpy as np
import pytest

pytest.importorskip('viser')
from browser import chromium, opened, start_of
from geometry_msgs.msg import PoseArray, Wrench
from page_client import served
from peer import PATIENCE, kill, listening, start
from std_msgs.msg import String

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.sources.node.source import NodeSource

SCENE = load_scene('flight')
"""Free space, where nothing but pushes moves the doll."""

START = start_of(SCENE)
MASSES = np.array([bone.mass for bone in SCENE.bones])
CENTER = MASSES @ START / MASSES.sum()

TIMEOUT_TICKS = 10
"""That a push lasts at most: the node's push_timeout of 0.1 s."""


AGAIN = 20.0
"""s after which a reset that was not heard is asked for again."""


@pytest.fixture(scope='module')
def peer(ros):
    with listening() as peer:
        yield peer


@pytest.fixture(scope='module')
def heard(peer):
    """Poses, forces and the node's events, each with its arrival, s."""
    return (peer.collect(PoseArray, 'ragdoll/poses'), peer.collect(Wrench, 'ragdoll/force'),
            peer.collect(String, 'ragdoll/events'))


@pytest.fixture(scope='module')
def page(heard):
    """The viewer's page of a node in a process of its own."""
    node = start('node', '--ros-args', '-p', 'scene:=flight', compiled=True)
    try:
        with served(NodeSource([])) as page:
            # Where a busy machine makes a tap last until the node ends it, it gives 1.8 m/s.
            page.controls.pushes.strength.value = 1000
            yield page
    finally:
        kill(node)


@pytest.fixture(scope='module')
def view(page):
    with chromium() as browser, opened(
            browser, f'http://127.0.0.1:{page.server.get_port()}', SCENE) as view:
        yield view


def place(view, page, heard, azimuth, distance=5.0):
    """Reset, and look at the doll from ``azimuth`` rad to its left; wait until the server knows."""
    poses, _, events = heard
    events.clear()
    pressed = -math.inf

    def is_reset():
        nonlocal pressed
        if time.monotonic() > pressed + AGAIN:
            view.press('Reset')  # not R: a page that is just there may not hear keys yet
            pressed = time.monotonic()
        return events_of(events, 'reset')

    view.wait(is_reset)
    eye = CENTER + distance * np.array((math.cos(azimuth), math.sin(azimuth), 0.2))

    def is_there():
        camera, = (client.camera for client in page.server.get_clients().values())
        return np.abs(camera.position - eye).max() < 1e-3

    count = len(poses)
    view.wait(lambda: len(poses) > count + 11 and np.abs(velocity(poses)).max() < 1e-6
              and abs(view.bodies(SCENE) - START).max() < 1e-5
              and not page.display.follow.value)
    # Again and again: the page may still return from where it followed the doll.
    view.wait(lambda: view.look(eye, CENTER) or is_there())
    return eye


def center(message):
    return MASSES @ [(p.position.x, p.position.y, p.position.z)
                     for p in message.poses] / MASSES.sum()


def events_of(events, *kinds):
    """The node's events of these kinds."""
    return [event for _, message in list(events)
            if (event := json.loads(message.data))['kind'] in kinds]


def velocity(poses):
    """Velocity (3,) m/s of the doll's centre of mass over the last ten poses."""
    first, *_, last = (center(message) for _, message in poses[-11:])
    return (last - first) / 0.1


@pytest.mark.slow  # they time pushes on the wall, which tests beside them stretch
@pytest.mark.parametrize(('side', 'key'), [
    (0, 'ArrowRight'), (1, 'ArrowUp'), (2, 'ArrowUp'), (3, 'ArrowLeft'),
    (4, 'ArrowRight'), (5, 'ArrowDown'), (6, 'ArrowDown'), (7, 'ArrowLeft')])
def test_a_held_key_pushes_to_that_side_of_the_picture_and_stays_in_view(
        view, page, heard, side, key):
    """Held for 1 s: below 3.5 m/s, with the impulse of the forces that were sent.

    In the node's events each push has its ticks.
    """
    poses, forces, events = heard
    eye = place(view, page, heard, side * math.pi / 4)
    forces.clear()
    events.clear()
    count = len(poses)
    view.page.keyboard.down(key)
    seen = []
    while len(poses) < count + 100:
        drawn = MASSES @ view.bodies(SCENE) / MASSES.sum()
        seen.append(view.pixels([drawn])[0])
    view.page.keyboard.up(key)
    # Over is what has had no further push for 0.3 s.
    view.wait(lambda: forces[-1][1] == Wrench() and poses[-1][0] > forces[-1][0] + 0.3)
    acts = events_of(events, 'push', 'release')
    gained, end = velocity(poses), center(poses[-1][1])
    canvas = view.page.locator('canvas').first.bounding_box()
    seen = np.array(seen)
    assert (seen >= (canvas['x'], canvas['y'])).all()
    assert (seen <= (canvas['x'] + canvas['width'], canvas['y'] + canvas['height'])).all()
    assert 2.0 < np.linalg.norm(gained) < 3.5
    if key in ('ArrowUp', 'ArrowDown'):
        away = np.linalg.norm(end - eye) - np.linalg.norm(CENTER - eye)
        assert away * {'ArrowUp': 1, 'ArrowDown': -1}[key] > 1.0
    place(view, page, heard, side * math.pi / 4)
    (before, _), (after, _) = view.pixels([CENTER, end])
    if key in ('ArrowLeft', 'ArrowRight'):
        assert (after - before) * {'ArrowRight': 1, 'ArrowLeft': -1}[key] > 100
    ticks = np.minimum(np.diff([act['tick'] for act in acts]), TIMEOUT_TICKS)
    sent = np.array([act.get('force', (0, 0, 0)) for act in acts])
    assert all(force == (m.force.x, m.force.y, m.force.z) for force, (_, m) in zip(
        ([tuple(act['force']) for act in acts if act['kind'] == 'push']),
        [each for each in forces if each[1] != Wrench()], strict=True))
    impulse = (sent[:-1] * ticks[:, None] * SCENE.step).sum(axis=0)
    print(f'{key}: {np.linalg.norm(gained):.2f} m/s, {np.linalg.norm(impulse):.0f} N s')
    # To a tick of the largest force.
    np.testing.assert_allclose(gained * MASSES.sum(), impulse, rtol=0, atol=10)


@pytest.mark.slow
def test_the_top_speed_is_what_is_set(view, page, heard):
    """6 m/s, where 3 is the default; held until it is reached."""
    poses = heard[0]
    place(view, page, heard, 0.0)
    field = view.field('Top speed, m/s')
    field.fill('6')
    field.press('Enter')
    field.blur()
    view.wait(lambda: page.controls.pushes.top_speed.value == 6)
    view.page.keyboard.down('ArrowUp')
    view.wait(lambda: np.linalg.norm(velocity(poses)) > 5.5)
    count = len(poses)
    view.wait(lambda: len(poses) > count + 60)
    view.page.keyboard.up('ArrowUp')
    assert np.linalg.norm(velocity(poses)) < 6.5
    page.controls.pushes.top_speed.value = 3


def hovered(page):
    """Text of the label at the bone below the pointer, which three.js draws."""
    client, = page.server.get_clients().values()
    label = client.scene.get_handle_by_name('/hover')
    return label and label.text


def test_a_click_chooses_what_is_pushed_and_the_pointer_tells_its_name(view, page, heard):
    """The node's parameter is set; a tap gives the head a speed that the label below it tells."""
    place(view, page, heard, 0.3, distance=2.5)
    head = START[SCENE.bone_index('head')]
    view.page.mouse.click(*view.pixels([head])[0])
    view.wait(lambda: page.source.pushed_bone == 'head')
    view.see('Pushes head')
    view.page.mouse.move(*(view.pixels([head])[0] + 1))
    view.wait(lambda: hovered(page) == 'head 0.0 m/s')
    tapped, end = -math.inf, time.monotonic() + PATIENCE
    # It slows down at once, as the head takes the body along: to be seen while it is fast.
    while np.abs(page.controls.pushes.motion.velocities()[1]).max() < 0.5:
        assert time.monotonic() < end, 'not in time'
        if time.monotonic() > tapped + 1:
            view.key('ArrowUp')  # of one tap a busy node may see only the end
            tapped = time.monotonic()
        view.page.wait_for_timeout(20)
    view.page.mouse.move(5, 5)
    view.wait(lambda: hovered(page) is None)
    page.source.push_bone('torso')
    view.wait(lambda: page.source.pushed_bone == 'torso')


ARROW = """() => {
  const arrow = document.querySelector('.ragdoll-edge-arrow');
  if (!arrow || arrow.style.display === 'none') return null;
  const {left, right, top, bottom} = arrow.getBoundingClientRect();
  return [(left + right) / 2, (top + bottom) / 2];
}"""


def test_an_arrow_at_the_edge_points_to_what_is_outside(view, page, heard):
    """A user looks away to the doll's left: it is to the right then. Follow is not switched on."""
    eye = place(view, page, heard, 0.0)
    assert view.page.evaluate(ARROW) is None
    view.look(eye, CENTER - np.array((0.0, 30.0, 0.0)))
    frame = view.page.locator('canvas').first.bounding_box()
    x, _ = view.wait(lambda: view.page.evaluate(ARROW))
    side = np.sign(view.pixels([CENTER])[0][0] - frame['x'] - frame['width'] / 2)
    assert side * (x - frame['x'] - frame['width'] / 2) > 0.4 * frame['width']
    assert not page.display.follow.value
    view.key('h')
    view.wait(lambda: view.page.evaluate(ARROW) is None)


CLICK_BEFORE_IT_IS_DRAWN = """([x, y]) => {
  const {camera, canvas} = window.__viserMutable;
  camera.position.z += 0.2;
  for (const type of ['pointerdown', 'pointerup']) canvas.dispatchEvent(
    new PointerEvent(type, {clientX: x, clientY: y, isPrimary: true, bubbles: true}));
}"""
"""A click as the camera has been moved to the left, seen from +x, and not drawn from there yet."""


def test_a_ball_is_thrown_where_one_clicks(view, page, heard):
    """The last test of the node, as the ball stays. A drag of the view throws nothing."""
    poses, _, events = heard
    place(view, page, heard, 0.0)
    frame = view.page.locator('canvas').first.bounding_box()
    corner = frame['x'] + 60, frame['y'] + 60
    view.page.mouse.move(*view.pixels([START[0]])[0])
    view.wait(lambda: hovered(page) == 'torso 0.0 m/s')
    view.key('t')
    # From its start again, with the ball, which flies at the torso from +x.
    thrown = view.wait(lambda: events_of(events, 'set_state'))[0]
    assert thrown['doll'] == 'ball' and thrown['velocity'][0] < -9
    view.wait(lambda: page.frame.scene.dolls[-1].name == 'ball'
              and page.controls.pushes.motion.velocities()[0][0] < -0.2)
    view.wait(lambda: len(poses[-1][1].poses) == len(START) + 1)
    view.page.get_by_label('Throw a ball by a click').check()
    view.wait(lambda: page.controls.ball.takes_clicks)
    view.page.mouse.move(*corner)
    view.page.mouse.down()
    view.page.mouse.move(corner[0] + 80, corner[1] + 10, steps=4)
    view.page.mouse.up()
    view.look(CENTER + np.array((5.0, 0.0, 0.0)), CENTER)
    view.page.mouse.click(*corner)
    view.wait(lambda: len(events_of(events, 'set_state')) == 2)
    # Away, to the left and up, as seen from +x.
    assert (np.sign(events_of(events, 'set_state')[1]['velocity']) == (-1, -1, 1)).all()
    view.page.evaluate(CLICK_BEFORE_IT_IS_DRAWN, corner)
    view.wait(lambda: len(events_of(events, 'set_state')) == 3)
    assert (np.sign(events_of(events, 'set_state')[2]['velocity']) == (-1, -1, 1)).all()
    view.page.get_by_label('Throw a ball by a click').uncheck()
