"""Which way a page's arrows push, to what speed, on which bone; Follow when the doll leaves."""
from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip('viser')
from page_client import served, wait

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.realtime.arrow_keys import DIRECTIONS
from ragdoll_ros.realtime.speed_limit import LONGEST, RESPONSE_TIME, SpeedLimit
from ragdoll_ros.viewer.pushing.directions import seen_from
from ragdoll_ros.viewer.pushing.hover import bone_at, ray
from ragdoll_ros.viewer.sources.simulation import SimulationSource

FLIGHT = load_scene('flight')
UP = np.array((0.0, 0.0, 1.0))


@pytest.fixture(scope='module')
def page():
    with served(SimulationSource(FLIGHT)) as page:
        yield page


@pytest.mark.parametrize('turn', np.arange(8) * math.pi / 4)
def test_arrows_are_horizontal_and_relative_to_the_camera(turn):
    """From the front, +x, they are those of the article; with the camera they turn about z."""
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array(((c, -s, 0), (s, c, 0), (0, 0, 1)))
    found = seen_from(turned @ (3.0, 0.0, 2.0), np.zeros(3), UP)
    for arrow, direction in DIRECTIONS.items():
        np.testing.assert_allclose(found[arrow], turned @ (*direction[:2], 0.0), atol=1e-12)


@pytest.mark.parametrize('height', [5.0, -5.0])
def test_seen_from_above_or_below_up_is_the_top_of_the_picture(height):
    found = seen_from(np.array((0, 0, height)), np.zeros(3), np.array((0.0, 1.0, 0.0)))
    up = {5.0: (0, 1, 0), -5.0: (0, -1, 0)}[height]
    assert np.allclose(np.abs(found['up']), np.abs(up)) and np.linalg.norm(found['up']) == 1
    assert np.allclose(np.cross(found['right'], found['up']), UP)


@pytest.mark.parametrize('delay', [0.01, 0.06, 0.11])
@pytest.mark.parametrize('duration', [0.03, 0.05, 0.1])
def test_pushes_reach_the_top_speed_and_do_not_pass_it(delay, duration):
    """A mass in free space whose pushes show ``delay`` s later and last longer or shorter."""
    limit, velocities, time = SpeedLimit(), [0.0], 0.0
    forces = np.zeros(400)
    for tick in range(200):
        time = 0.01 * tick
        if tick % 5 == 0:
            seen = velocities[max(0, tick - round(100 * delay / 2))]
            force = limit.impulse(UP, 3.0 - seen, 55.0, time) / RESPONSE_TIME
            limit.sent(force * UP, time, 1.0)
            first = tick + round(100 * delay / 2)
            forces[first:] = 0.0
            forces[first:first + round(100 * duration)] = force
        velocities.append(velocities[-1] + forces[tick] / 55.0 * 0.01)
    assert duration <= LONGEST and velocities[-1] > 2.7 and max(velocities) < 3.01


def test_a_ray_meets_the_first_bone(page):
    """From the front at the height of the head, of the torso, and beside the doll."""
    client = page.open()
    wait(lambda: page.frame)
    names = FLIGHT.bone_names
    for place, bone in (((0, 0, 1.45), 'head'), ((0, 0, 1.1), 'torso'), ((0, 0.5, 1.3),
                        'left_forearm'), ((0, 2.0, 1.0), None)):
        found = bone_at(page.frame, np.array((4.0, 0, 1.0)), place - np.array((4.0, 0, 1.0)))
        assert (None if found is None else names[found]) == bone
    camera, = (each.camera for each in page.server.get_clients().values())
    wait(lambda: client.look((4.0, 0.0, 1.0), (0.0, 0.0, 1.0)) or tuple(
        camera.look_at - camera.position) == (-4, 0, 0))
    origin, direction = ray(camera, 0.0, 0.5)
    # Half of the way to the upper edge of 0.4 rad.
    assert direction @ (0, 0, 1) / -direction[0] == pytest.approx(0.5 * math.tan(0.4))
    assert tuple(origin) == (4.0, 0.0, 1.0)


def test_follow_comes_on_when_the_doll_leaves_and_goes_with_a_reset():
    """Not when the user looks away from it."""
    with served(SimulationSource(FLIGHT)) as page:
        client = page.open()
        wait(lambda: page.frame and page.frame.time > 0.2)
        client.look((3.0, 0.0, 1.0), look_at=(3.0, 50.0, 1.0))
        begin = page.frame.time
        wait(lambda: page.frame.time > begin + 0.3)
        assert not page.display.follow.value
        client.look((3.0, 0.0, 1.0), look_at=(0.0, 0.0, 1.0))
        begin = page.frame.time
        wait(lambda: page.frame.time > begin + 0.3)
        # A tenth of real time, for the frame that is read to be that which switched it on.
        page.source.set_real_time_factor(0.1)
        client.press(page, 'Push right')
        wait(lambda: page.display.follow.value)
        assert page.frame.state.positions[0][1] < 2.0  # where the picture ends
        page.source.reset()
        wait(lambda: not page.display.follow.value)


def test_a_fall_alone_does_not_switch_follow_on():
    """In the home view, which has the place where it will lie."""
    with served(SimulationSource(load_scene('drop'))) as page:
        page.open()
        wait(lambda: page.frame and page.frame.time > 1.5)
        assert not page.display.follow.value


def test_what_is_pushed_is_chosen_by_a_click(page):
    from viser import _messages
    client = page.open()
    wait(lambda: page.frame)
    batch = page.stage.bodies.batches[-1]
    head = FLIGHT.bone_index('head')
    assert batch.bones.tolist() == [head]
    client.send(_messages.SceneNodeClickMessage(
        name=batch.handle.name, instance_index=0, ray_origin=(4.0, 0.0, 1.0),
        ray_direction=(-1.0, 0.0, 0.0), screen_pos=(0.5, 0.5), modifier=None))
    wait(lambda: page.source.pushed_bone == 'head')
    # While time stands the push stays: a tap may be over before the page draws again.
    page.source.pause(True)
    wait(lambda: page.source.status.paused)
    client.press(page, 'Push up')
    wait(lambda: any(push.bone == 'head' for push in page.frame.pushes))
