"""The first minute with `make run`, in headless Chromium: the fall is seen, a press has a feel."""
from __future__ import annotations

import contextlib
import json
import time

import numpy as np
import pytest
from browser import chromium, opened, serving, start_of
from geometry_msgs.msg import PoseArray, Wrench
from peer import listening
from std_msgs.msg import String

from ragdoll_ros.files.scene import load_scene

SCENE = load_scene('drop')
START = start_of(SCENE)

FLIGHT = load_scene('flight')
MASSES = np.array([bone.mass for bone in FLIGHT.bones])

TOWARDS = np.array((3.2, -0.9, 0.0)) / np.hypot(3.2, 0.9)
"""Horizontal direction to the camera of the home view."""

SIZES = {'desk': {'width': 1280, 'height': 800}, 'phone': {'width': 390, 'height': 844}}


# They time the page on the wall, which tests beside them stretch.
pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def browser(ros):
    with chromium() as context:
        yield context


@pytest.mark.parametrize(('size', 'delay'), [
    ('desk', 0.0), ('desk', 4.0), ('phone', 4.0), ('desk', 20.0), ('desk', 60.0)])
def test_the_first_fall_begins_when_the_first_page_shows_it(browser, size, delay):
    """In the first picture all hangs at the start, then it falls; a second page changes nothing.

    The node of `make run` waits for a page for 5 s, and runs then.
    """
    with serving('--ros-args', '-r', f'__ns:=/{size}_{delay:.0f}',
                 module='ragdoll_ros.ros.run') as url:
        time.sleep(delay)  # what is waited for is that nothing happens, or what nobody sees
        with opened(browser, url, SCENE, SIZES[size]) as view:
            assert abs(view.bodies(SCENE) - START).max() < 0.3
            view.wait(lambda: abs(view.bodies(SCENE)[:, 2] - START[:, 2]).min() > 0.1)
            view.page.get_by_title('At rest').wait_for()
            lies = view.bodies(SCENE)
            assert lies[:, 2].max() < 0.6
            with opened(browser, url, SCENE, SIZES[size]) as other:
                other.page.get_by_title('At rest').wait_for()
                assert abs(other.bodies(SCENE) - lies).max() < 0.01


@pytest.fixture(scope='module')
def peer(ros):
    """A peer that listens in a thread of its own, so that what came last is new."""
    with listening() as peer:
        yield peer


@pytest.fixture(scope='module')
def heard(peer):
    """Poses, forces and events of a node that simulates a doll in free space, as they came."""
    return (peer.collect(PoseArray, '/free/ragdoll/poses'),
            peer.collect(Wrench, '/free/ragdoll/force'),
            peer.collect(String, '/free/ragdoll/events'))


@pytest.fixture(scope='module', params=['desk', pytest.param('phone', marks=pytest.mark.slow)])
def view(browser, heard, request):
    """A page of that node, in free space, where nothing but pushes moves the doll."""
    with (serving('flight', '--ros-args', '-r', '__ns:=/free', module='ragdoll_ros.ros.run') as url,
          opened(browser, url, FLIGHT, SIZES[request.param]) as view):
        view.button('Pause').wait_for()
        yield view


def velocity(poses):
    """Velocity (3,) m/s of the doll's centre of mass over the last ten poses."""
    centres = [np.average([(p.position.x, p.position.y, p.position.z) for p in message.poses],
                          axis=0, weights=MASSES) for _, message in poses[-11:]]
    return (centres[-1] - centres[0]) / (0.01 * (len(centres) - 1))


@contextlib.contextmanager
def pushed(view, heard):
    """From the start on: a list that gets, once it is over, all forces and the velocity, towards
    the camera.

    A push is over when a force of zero was heard, and ten poses after it.
    """
    poses, forces, events = heard
    events.clear()
    view.press('Reset')
    view.wait(lambda: any(json.loads(message.data)['kind'] == 'reset' for _, message in events))
    count = len(poses)
    view.wait(lambda: len(poses) > count + 11 and np.abs(velocity(poses)).max() < 1e-9)
    forces.clear()
    result = []
    yield result
    view.wait(lambda: forces and forces[-1][1] == Wrench())
    count = len(poses)
    view.wait(lambda: len(poses) > count + 12)
    sent = np.array([(m.force.x, m.force.y, m.force.z) for _, m in forces])
    gained = velocity(poses)
    for vectors in (sent, gained):
        assert np.abs(vectors - np.multiply.outer(vectors @ TOWARDS, TOWARDS)).max() < 1e-3
    result += [np.round(sent @ TOWARDS, 6).tolist(), gained @ TOWARDS]


@pytest.mark.parametrize('act', [lambda view: view.press('↓'),
                                 lambda view: view.key('ArrowDown')], ids=['button', 'key'])
def test_a_press_is_a_shove(view, heard, act):
    """25 ms of 2000 N give 55 kg 0.9 m/s: two ticks' push or three, of five presses the middle one.

    The page times it on the wall: where the machine is busy, now and then a tick more or less.
    """
    gains = []
    for _ in range(5):
        with pushed(view, heard) as result:
            act(view)
        forces, gained = result
        assert set(forces) == {2000.0, 0.0}
        gains.append(gained)
    assert 0.5 < np.median(gains) < 1.2, gains


@pytest.mark.parametrize('seconds', [1.0, 3.0])
def test_a_key_that_is_held_accelerates_to_the_top_speed(view, heard, seconds):
    """3 m/s, however long it is held; the first press is a tap with the whole strength."""
    with pushed(view, heard) as result:
        view.page.keyboard.down('ArrowUp')
        view.page.wait_for_timeout(1000 * seconds)
        view.page.keyboard.up('ArrowUp')
    forces, gained = result
    assert min(forces) == -2000.0 and max(forces) == 0.0
    assert 2.5 < -gained < 3.5


def test_the_strength_is_what_goes_out(view, heard):
    field = view.field('Strength, N')
    field.fill('350')
    field.press('Enter')
    view.see('A tap gives 55 kg 0.16 m/s in the air.')
    field.blur()  # else the keys would be the field's
    with pushed(view, heard) as result:
        view.key('ArrowDown')
    assert set(result[0]) == {350.0, 0.0}
