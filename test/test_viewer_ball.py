"""A ball that a page throws: where it flies, what it hits, and what it does to the scene."""
from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip('viser')
from page_client import served, wait

from ragdoll_ros import Simulation
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Ground, height
from ragdoll_ros.viewer.pushing.ball import (
    MASS,
    NAME,
    RADIUS,
    RANGE,
    SPEED,
    Target,
    aim,
    has_ball,
    launch,
    with_ball,
)
from ragdoll_ros.viewer.pushing.motion import Motion
from ragdoll_ros.viewer.sources.simulation import SimulationSource
from ragdoll_ros.viewer.sources.source import Frame

DROP, FLIGHT = load_scene('drop'), load_scene('flight')


@pytest.mark.parametrize('name', ['drop', 'flight', 'crowd', 'man', 'ponytail', 'pile'])
def test_the_ball_rests_on_the_ground_and_touches_nothing(name):
    """In every kind of scene; it stays there while the others fall."""
    scene = load_scene(name)
    made = with_ball(scene)
    assert made.dolls[:-1] == scene.dolls and not has_ball(scene) and has_ball(made)
    ball = made.dolls[-1]
    if scene.ground is not None:
        pose = ball.bone_pose(ball.doll.root)
        assert height(ball.doll.root, pose.position, pose.orientation,
                      scene.ground) == pytest.approx(0, abs=1e-12)
    clear = [np.linalg.norm(placement.bone_pose(bone).position - ball.position)
             - np.linalg.norm(bone.shape.half_extents) - RADIUS
             for placement in scene.dolls for bone in placement.doll.bones]
    assert min(clear) > 0


def test_the_ball_rests_on_a_slope():
    slope = dataclasses.replace(DROP, ground=Ground((0.3, -0.2, 1), 0.4))
    ball = with_ball(slope).dolls[-1]
    assert height(ball.doll.root, np.array(ball.position), np.array((0, 0, 0, 1.0)),
                  slope.ground) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize('target', [(0, 0, 5), (1, -2, 9), (8, 0, 4.5)])
@pytest.mark.parametrize('velocity', [(0, 0, 0), (1, 2, 0.5)])
def test_it_meets_what_it_was_thrown_at(target, velocity):
    """Simulated, from a camera 1 m, 3 m and 9 m away, at a target that moves evenly."""
    scene = with_ball(load_scene('drop'))
    for distance in (1.0, 3.0, 9.0):
        eye = np.array(target) + distance * np.array((0.6, 0.0, 0.8))
        position, speed = launch(scene, eye, Target(np.array(target, float),
                                                    np.array(velocity, float)))
        assert np.linalg.norm(np.array(position) - target) == pytest.approx(min(distance, 3.0))
        with Simulation(scene, step=min(distance, 3.0) / SPEED / 10) as simulation:
            simulation.set_state(NAME, position, velocity=speed)
            for _ in range(10):
                state = simulation.advance()
        met = np.array(target) + np.array(velocity) * min(distance, 3.0) / SPEED
        assert np.abs(state.positions[-1] - met).max() < 1e-6  # ticks are whole ns


def line(frame, eye, to):
    motion = Motion()
    motion.add(frame)
    return aim(frame, motion, np.array(eye, float), np.array(to, float) - eye)


def test_what_a_line_of_sight_meets():
    """A bone; the ground; past everything; and a bone behind the ball itself."""
    scene = with_ball(DROP)
    with Simulation(scene) as simulation:
        head = simulation.state.positions[scene.bone_index('doll/head')]
        simulation.set_state(NAME, head + np.array((1, 0, 0)))
        frame = Frame(scene, 0.0, simulation.state)
        met, velocity, falls = line(frame, head + np.array((4, 0, 0)), head)
        assert np.abs(met - head).max() < 1e-9 and not velocity.any() and not falls
        assert line(frame, (5, 5, 2), (5, 7, 0)).position == pytest.approx((5, 7, 0))
        eye = np.array((5.0, 0, 1))
        met = line(frame, eye, eye + np.array((0, 0, 1))).position
        assert met == pytest.approx(eye + np.array((0, 0, 3)))


@pytest.mark.parametrize('ticks', [3, 30, 200])
@pytest.mark.parametrize('eye', [(4, 0, 1), (1, 5, 2), (0.8, 0, 0.5)])
def test_it_hits_a_doll_that_falls_and_one_that_lies(ticks, eye):
    """Thrown at its head just after the start, in free fall, and at rest: the doll is hit, by a
    tenth of the ball's momentum at least, when the ball is to arrive. Without a lead of one in
    free fall the ball passes above it.
    """
    high = dataclasses.replace(DROP.dolls[0], position=(0.0, 0.0, 3.0))
    scene, motion = with_ball(dataclasses.replace(DROP, dolls=(high,))), Motion()
    masses = np.array([bone.mass for bone in scene.bones[:-1]])
    with Simulation(scene) as simulation:
        for tick in range(ticks):
            frame = Frame(scene, tick / 100, simulation.advance())
            motion.add(frame)
        falls, head = motion.falls(1), frame.state.positions[scene.bone_index('doll/head')]
        assert falls == (ticks < 200)
        target = aim(frame, motion, head + eye, -np.array(eye))
        position, velocity = launch(scene, head + eye, target)
        simulation.set_state(NAME, position, velocity=velocity)
        momenta = [masses @ simulation.state.linear_velocities[:-1]]
        for _ in range(int(100 * RANGE / SPEED) + 5):
            momenta.append(masses @ simulation.advance().linear_velocities[:-1])
    gained = np.diff(momenta, axis=0) - falls * masses.sum() * np.array(scene.gravity) / 100
    assert np.linalg.norm(gained, axis=1).max() > 0.1 * MASS * SPEED


@pytest.fixture
def page():
    with served(SimulationSource(DROP)) as page:
        yield page


def click(page, client, eye, at=(0.0, 0.0, 0.3)):
    """A click at a point, seen from another one."""
    way = np.subtract(at, eye)
    numbers = ' '.join(f'{x:.4f}' for x in (*eye, *(way / np.linalg.norm(way))))
    client.tell(page._hover.pointer_events, f'click {numbers}')


@pytest.fixture
def thrown(page, monkeypatch):
    """Each throw: position and velocity; as by eye, a fast ball could be missed."""
    seen, throw = [], page.source.set_state

    def noted(doll, position, velocity):
        assert doll == NAME
        seen.append((position, velocity))
        throw(doll, position, velocity)

    monkeypatch.setattr(page.source, 'set_state', noted)
    return seen


def test_a_click_throws(page, thrown):
    """The first throw puts the ball into the scene, which starts again; the next do not."""
    client = page.open()
    wait(lambda: page.frame and page.frame.time > 1.0)
    click(page, client, (4.0, 0.0, 1.0))
    first = page.frame.time
    wait(lambda: page.frame.time > first + 0.3)
    assert not has_ball(page.frame.scene)  # not yet: clicks choose what is pushed
    client.update(page.controls.ball._by_click, True)
    click(page, client, (4.0, 0.0, 1.0))
    wait(lambda: thrown)
    assert has_ball(page.frame.scene) and thrown[0][1][0] < -9
    # While it is paused the ball waits where it is thrown from.
    page.source.pause(True)
    wait(lambda: page.source.status.paused)
    run, time = page.frame.run, page.frame.time
    click(page, client, (0.0, 4.0, 1.0))
    wait(lambda: len(thrown) == 2)
    wait(lambda: page.frame.state.positions[-1][1] == pytest.approx(
        thrown[1][0][1], abs=1e-6))
    assert thrown[1][1][1] < -8
    assert page.frame.run == run and page.frame.time >= time
    assert page.controls.pushes.bone == 0


def test_the_key_throws_at_the_pointer(page, thrown):
    """Or at the middle of the picture, where there is no pointer."""
    client = page.open()
    client.look((3.0, 0.0, 1.5), (0.0, 0.0, 0.5))
    wait(lambda: page.frame)
    client.press(page, 'Throw a ball')
    wait(lambda: thrown)
    before = page.frame.run
    client.tell(page._hover.pointer_events, '0.9 0.0')
    wait(lambda: page._hover._pointers)
    count = len(thrown)
    client.press(page, 'Throw a ball')
    wait(lambda: len(thrown) > count)
    # To the right as seen from +x: towards +y.
    assert thrown[-1][1][1] > 0.3 and page.frame.run == before


def test_nothing_is_thrown_while_editing(page):
    client = page.open()
    wait(lambda: page.editor)
    page.editor.toggle()
    client.press(page, 'Throw a ball')
    page.controls.ball._by_click.value = True
    assert not page.controls.ball.takes_clicks
    page.editor.toggle()
    wait(lambda: page.controls.ball.takes_clicks)
    assert not has_ball(page.frame.scene)


def test_undo_takes_the_ball_out(page):
    client = page.open()
    wait(lambda: page.frame)
    client.press(page, 'Throw a ball')
    wait(lambda: has_ball(page.frame.scene))
    wait(lambda: has_ball(page.editor.scene))
    page.editor.undo()
    wait(lambda: not has_ball(page.frame.scene))


def test_a_scene_that_cannot_take_it_says_so(monkeypatch, page):
    """A refused scene leaves all as it was, and the next throw is tried again."""
    from ragdoll_ros.model import errors
    tried = []

    def refuse(scene):
        tried.append(scene)
        raise errors.OutOfRange('dolls', len(scene.dolls), 'fewer')

    monkeypatch.setattr(page.source, 'set_scene', refuse)
    client = page.open()
    wait(lambda: page.frame)
    for count in (1, 2):
        wait(lambda count=count: client.press(page, 'Throw a ball') or len(tried) >= count)
    assert not has_ball(page.frame.scene)


def test_the_momentum_is_that_of_a_tap():
    """2000 N for 25 ms, as the page's arrow keys give: neither moves a doll out of sight."""
    from ragdoll_ros.realtime.arrow_keys import FORCE, TAP
    assert pytest.approx(FORCE * TAP) == MASS * SPEED
