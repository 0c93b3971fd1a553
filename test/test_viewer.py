"""The page on a simulation in this process: a real viser server, real websockets to it."""
from __future__ import annotations

import dataclasses
import itertools
import math
import threading
import time

import numpy as np
import pytest

pytest.importorskip('viser')
from page_client import PATIENCE, START, batch_of, has_all, served, wait

from ragdoll_ros.files.limits import load_limits
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll, SkeletonFrame
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Capsule, Sphere
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.recording import Recording
from ragdoll_ros.viewer.drawing.framing import bounding_spheres, box_center, home_position
from ragdoll_ros.viewer.drawing.overlays import WEIGHT_LENGTH
from ragdoll_ros.viewer.page import Page
from ragdoll_ros.viewer.sources.playback import PlaybackSource
from ragdoll_ros.viewer.sources.simulation import SimulationSource
from ragdoll_ros.viewer.sources.source import RequestedData

DROP = load_scene('drop')


@pytest.fixture
def page():
    with served(SimulationSource(DROP)) as page:
        yield page


def drawn(page):
    """Places (p, 3) m of all parts that are drawn, and which bone each is of."""
    batches = page.stage.bodies.batches
    return (np.concatenate([batch.handle.batched_positions for batch in batches]),
            np.concatenate([batch.bones for batch in batches]))


def paused(page):
    """Hold the time; give the frame that is drawn then."""
    page.source.pause(True)
    wait(lambda: page.source.status.paused and page.frame is page.source.frame)
    return page.frame


def test_what_is_drawn_is_the_simulation(page):
    """Boxes and balls of the default doll stand where a second simulation has them.

    A page gets numbers of 32 bits: 1e-6 m at 2 m.
    """
    page.open()
    wait(lambda: page.frame and page.frame.time > 0.3)
    frame = paused(page)
    with Simulation(DROP) as twin:
        while twin.time < round(frame.time * 1e9):
            twin.advance()
        places, bones = drawn(page)
        assert len(bones) == 10
        assert np.abs(places - twin.state.positions[bones]).max() < 1e-6


def test_a_capsule_is_a_cylinder_between_two_balls():
    """Their ends are where the shape's are, along the bone's own z."""
    turn = rotation.from_axis_angle((1, 2, 3), 0.7)
    bone = Bone('b', Capsule(0.1, 0.6), 1, (0, 0, 1), turn, color=(1, 0.5, 0, 1))
    scene = Scene('s', (Placement(Ragdoll('d', (bone,))),), gravity=(0, 0, 0))
    with served(SimulationSource(scene)) as page:
        page.open()
        wait(lambda: page.stage)
        batches = {batch.kind: batch.handle
                   for batch in page.stage.bodies.batches}
        assert set(batches) == {'cylinder', 'sphere'}
        along = rotation.rotate(turn, np.array([0, 0, 0.3]))
        ends = batches['sphere'].batched_positions
        assert np.abs(ends - np.stack([along, -along]) - (0, 0, 1)).max() < 1e-6
        assert np.allclose(batches['cylinder'].batched_scales, [(0.2, 0.2, 0.6)])
        # Viser takes them for light: half of sRGB is 0.214 of it.
        assert batches['sphere'].batched_colors.tolist() == [[255, 55, 0]] * 2


def stands(source):
    """Whether the time stands for 0.1 s; a tick would be due within 10 ms."""
    frame, since = source.frame, time.monotonic()
    wait(lambda: source.frame is not frame or time.monotonic() > since + 0.1)
    return source.frame is frame


def test_time_stands_while_no_page_is_open(page):
    """Nobody misses the fall; and nothing is computed for nobody."""
    before = page.source.frame
    first = page.open()
    assert before.time < 0.1
    wait(lambda: page.source.frame.time > 0.1)
    first.close()
    wait(lambda: stands(page.source))
    stood = page.source.frame
    page.open()
    wait(lambda: page.source.frame.time > stood.time)


def test_nothing_is_sent_while_nothing_moves():
    """A scene at rest in free space: the page gets its time and figures, two a second each."""
    still = load_scene('flight')
    with served(SimulationSource(still)) as page:
        client = page.open()
        wait(lambda: page.frame and page.frame.time > 0.3)
        before, since, began = client.windows, page.frame.time, time.monotonic()
        wait(lambda: page.frame.time > since + 0.5)
        # By the clock, as these are. Frames that are sent are some 60 windows a second.
        assert client.windows - before < 8 + 8 * (time.monotonic() - began)


def look_from_the_front(page, client):
    """Look along -x, where the arrows push along the world's axes."""
    wait(lambda: page.frame)
    camera, = (each.camera for each in page.server.get_clients().values())
    # The home view comes after the connection, in a thread of its own.
    wait(lambda: tuple(camera.position) != START)
    wait(lambda: client.look((6.0, 0.0, 1.0), (0.0, 0.0, 1.0)) or tuple(
        camera.look_at - camera.position) == (-6, 0, 0))


def test_each_frame_is_sent_before_the_next_is_drawn(monkeypatch):
    """Drawing takes 30 ms of CPU time. Without the wait four in five are not sent by then."""
    update, sent = Page._update_pages, []

    def slow(page, now):
        sent.append(has_all(page.server))
        end = time.thread_time() + 0.03
        while time.thread_time() < end:
            pass
        update(page, now)
        page.server.scene.add_frame('/changed')

    monkeypatch.setattr(Page, '_update_pages', slow)
    with served(SimulationSource(DROP)) as page:
        page.open()
        wait(lambda: len(sent) > 70)
        assert np.mean(sent[10:]) > 0.8


@pytest.mark.parametrize(('label', 'axis', 'sign'), [
    ('Push up', 0, -1), ('Push down', 0, 1), ('Push left', 1, -1), ('Push right', 1, 1)])
def test_arrow_keys_push(page, label, axis, sign):
    """A tap of 2000 N: 50 N s of 55 kg. The arrow is there while the push is, and gone after."""
    client = page.open()
    wait(lambda: page.frame)
    client.press(page, 'Play or pause')
    wait(lambda: page.source.status.paused)
    before = page.frame.run
    client.press(page, 'Reset')
    # By the run: a time of 0 may be that of the first one, which the reset has yet to end.
    wait(lambda: page.frame.run > before)
    # Last, as the page shows the home view when it has opened.
    look_from_the_front(page, client)
    client.press(page, label)
    wait(lambda: page.frame.pushes and page.frame.time == 0)
    assert page.frame.pushes[0].force[axis] == 2000 * sign
    arrow = wait_for(page, '/scene/pushes')
    assert arrow.visible and np.sign(np.diff(arrow.points[0], axis=0)[0, axis]) == sign
    client.press(page, 'Play or pause')
    wait(lambda: not page.frame.pushes)
    frame = page.frame
    masses = np.array([bone.mass for bone in frame.scene.bones])
    momentum = masses @ frame.state.linear_velocities
    # Its feet strike the ground after 0.28 s.
    assert frame.time > 0.25 or 0.5 < momentum[axis] * sign / masses.sum() < 1.2
    wait(lambda: not arrow.visible)


class LoggingSource(SimulationSource):
    """Logs actions of users in place of performing them."""

    def __init__(self):
        self.done = []
        super().__init__(DROP)

    def step(self):
        self.done.append('step')

    def reset(self):
        self.done.append('reset')

    def go_limp(self):
        self.done.append('go limp')

    def set_strength(self, strength):
        self.done.append(strength)

    def grab(self, hand, bone, point, target):
        self.done.append('grab')

    def let_go(self, hand):
        self.done.append('let go')

    def push(self, force, duration):
        self.done.append('right' if force[1] > 0 else 'left')


def test_actions_of_users_run_in_their_order():
    """Bar, hotkeys, buttons, a slider, the pointer and arrow keys, after a step that waits, as one
    does that ends editing: a reset must not cancel a push that follows it.
    """
    go_on = threading.Event()
    with served(LoggingSource()) as page:
        client, controls = page.open(), page.controls
        wait(lambda: page.editor is not None)
        look_from_the_front(page, client)
        node, number, place = batch_of(page, 'torso')
        page.transport.before_step = lambda: go_on.wait(PATIENCE)
        client.steer(page, 'step')
        client.press(page, 'Push right')
        client.steer(page, 'reset')
        client.press(page, 'Push left')
        client.press(page, 'Reset')
        client.update(controls.go_limp, True)
        client.update(controls.motor_strength, 0.5)
        client.drag(node, 'start', place, place, number)
        client.steer(page, 'reset')
        client.drag(node, 'end', place, place, number)
        client.update(controls.pushes.key_events, '0 right')
        client.update(controls.pushes.strength, 350.0)
        wait(lambda: controls.pushes.strength.value == 350)  # so all has arrived
        assert not page.source.done
        go_on.set()
        due = ['step', 'right', 'reset', 'left', 'reset', 'go limp', 0.5, 'grab', 'reset', 'let go',
               'right']
        wait(lambda: len(page.source.done) >= len(due))
        assert page.source.done[:len(due)] == due, 'a key that is down pushes on'


def test_a_key_that_comes_again_and_again_is_held(page):
    """As a browser tells it, until the speed that is set; nothing once it is let go."""
    client = page.open()
    look_from_the_front(page, client)
    client.update(page.controls.pushes.top_speed, 15.0)
    counts = itertools.count()

    def fast():
        client.update(page.controls.pushes.key_events, f'{next(counts)} up')
        return page.frame.state.linear_velocities[0, 0] < -5
    wait(fast)
    client.update(page.controls.pushes.key_events, f'{next(counts)}')
    wait(lambda: not any(any(push.force) for push in page.frame.pushes))


def test_the_strength_is_that_of_the_slider(page):
    client = page.open()
    look_from_the_front(page, client)
    client.press(page, 'Play or pause')
    wait(lambda: page.source.status.paused)
    client.update(page.controls.pushes.strength, 350.0)
    client.update(page.controls.pushes.key_events, '0 right')
    wait(lambda: page.frame.pushes and page.frame.pushes[0].force[:2] == (0, 350))


def test_arrows_pressed_together_add_up(page):
    client = page.open()
    look_from_the_front(page, client)
    client.press(page, 'Play or pause')
    wait(lambda: page.source.status.paused)
    client.update(page.controls.pushes.key_events, '0 up left')
    wait(lambda: page.frame.pushes and np.allclose(page.frame.pushes[0].force, (-2000, -2000, 0)))


def test_in_the_articles_scene_arrows_have_its_directions():
    """Wherever the camera is: here behind the doll."""
    with served(SimulationSource(load_scene('article'))) as page:
        client = page.open()
        wait(lambda: page.frame)
        client.look((-4.0, 1.0, 1.0))
        client.press(page, 'Play or pause')
        wait(lambda: page.source.status.paused)
        client.update(page.controls.pushes.key_events, '0 up')
        wait(lambda: page.frame.pushes and np.allclose(page.frame.pushes[0].force, (-2000, 0, 1)))


def buttons_and_keys(page):
    """Labels of all that can be used on a page, and all commands by which it can be.

    Of copies, made at once: viser's threads change what they copy.
    """
    gui = page.server.gui
    handles = list(gui._gui_input_handle_from_uuid.values())
    commands = list(gui._command_handle_from_uuid.values())
    return ({handle.label for handle in handles if handle.visible},
            {command.label for command in commands})


def test_a_recording_offers_nothing_that_it_cannot_do():
    """Nothing pushes it, and it has one scene, simulated once. The hint says so little, too."""
    run = Recording(DROP, np.array((0, 1.0)), np.zeros((2, 10, 3)),
                    np.tile((0, 0, 0, 1.0), (2, 10, 1)))
    changes = {'Push', 'Strength, N', 'Scene', 'Engine'}
    pushes = {'Push up', 'Push down', 'Push left', 'Push right'}
    with served(SimulationSource(DROP)) as page:
        page.open()
        wait(lambda: page.editor)
        shown, keys = buttons_and_keys(page)
        assert changes < shown and pushes < keys and 'Reset' in keys
    with served(PlaybackSource(run)) as page:
        page.open()
        wait(lambda: page.editor)  # the last part of a page that is made
        shown, keys = buttons_and_keys(page)
        assert not changes & shown and not pushes & keys
        assert {'Play or pause', 'Reset', 'Step back'} < keys


def test_pause_step_reset_and_real_time_factor(page):
    client = page.open()
    wait(lambda: page.frame and page.frame.time > 0.2)
    client.press(page, 'Play or pause')
    wait(lambda: page.source.status.paused)
    held = paused(page).time
    client.press(page, 'Step')
    wait(lambda: page.frame.time > held)
    assert page.frame.time == pytest.approx(held + 0.01)
    client.press(page, 'Reset')
    wait(lambda: page.frame.time == 0)
    client.steer(page, 'speed 0.5')
    wait(lambda: page.source.status.real_time_factor == 0.5)
    client.press(page, 'Play or pause')
    wait(lambda: page.frame.time > 0)


def test_another_scene_by_the_dropdown(page):
    """Ten dolls, 100 bones, in as many batches as one; then the old stage is gone."""
    client = page.open()
    wait(lambda: page.stage)
    client.update(page.controls.scene, 'crowd')
    wait(lambda: len(page.stage.scene.bones) == 100)
    _, bones = drawn(page)
    assert sorted(bones) == list(range(100)) and len(page.stage.bodies.batches) == 2
    client.update(page.controls.scene, 'ponytail')
    wait(lambda: page.stage.scene.name == 'ponytail')
    rods = wait_for(page, '/scene/rods').points
    assert rods.shape == (8, 2, 3) and np.allclose(rods[1:, 0], rods[:-1, 1])


def test_another_engine_by_the_dropdown(page):
    """The scene starts anew in it; and another scene begins in the same."""
    client = page.open()
    wait(lambda: page.stage and page.frame and page.frame.time > 0.2)
    scene, run = page.frame.scene, page.frame.run
    client.update(page.controls.engine, 'bullet')
    wait(lambda: page.source.status.engine == 'bullet' and page.frame.run != run)
    assert page.frame.scene is scene
    client.update(page.controls.scene, 'flight')
    wait(lambda: page.stage.scene.name == 'flight')
    assert page.source.status.engine == page.controls.engine.value == 'bullet'


def test_a_scene_that_is_refused_is_not_chosen():
    """The list goes on naming the scene that is shown, and the page that chose is told why."""
    unturned = np.tile((0, 0, 0, 1.0), (1, 10, 1))
    run = Recording(DROP, np.zeros(1), np.zeros((1, 10, 3)), unturned)
    with served(PlaybackSource(run)) as page:
        client, handle, seen = page.open(), page.controls.scene, []
        wait(lambda: handle.value == 'drop')

        async def note(event):  # at once, before the page takes the choice back
            seen.append(event.target.value)

        handle.on_update(note)
        client.update(handle, 'crowd')
        wait(lambda: 'crowd' in seen and handle.value == 'drop')
        engine = page.controls.engine
        engine.on_update(note)
        client.update(engine, 'bullet')
        wait(lambda: 'bullet' in seen and engine.value == 'auto')


def test_what_was_sent_is_text_on_the_page(page):
    """A doll's name, which anyone may send, is told with the skin that it has not: as no HTML."""
    placement = DROP.dolls[0]
    doll = dataclasses.replace(placement.doll, riders=(SkeletonFrame('r', 'torso', (0, 0, 0)),),
                               model='nothing.glb')
    page.open()
    page.source.set_scene(dataclasses.replace(DROP, dolls=(
        dataclasses.replace(placement, doll=doll, name='<iframe srcdoc=x>'),)))
    wait(lambda: 'no skin for &lt;iframe srcdoc=x&gt;' in page.problem.content)
    assert '<iframe' not in page.problem.content


def wait_for(page, name):
    wait(lambda: page.server.scene.get_handle_by_name(name))
    return page.server.scene.get_handle_by_name(name)


def test_what_cannot_be_used_is_refused_and_the_old_goes_on(page, broken_scene):
    page.open()
    wait(lambda: page.frame)
    path, words = broken_scene
    with pytest.raises(ValueError) as error:
        page.source.load(str(path))
    assert all(word in str(error.value) for word in words)
    before = page.frame.time
    wait(lambda: page.frame.time > before)


def test_a_dragged_bone_follows_at_the_distance_it_had(page):
    """The target is as far from the eye as the grabbed point was, in the pointer's direction."""
    eye = np.array([3.0, 1.0, 1.5])
    client = page.open()
    wait(lambda: page.frame)
    frame = paused(page)
    client.look(tuple(eye))
    camera, = (each.camera for each in page.server.get_clients().values())
    wait(lambda: np.array_equal(camera.position, eye))
    node, number, place = batch_of(page, 'left_forearm')
    client.drag(node, 'start', place, place, number)
    wait(lambda: page.source.frame.grabs)
    pointer = np.add(place, (0.0, 0.4, 0.5))
    client.drag(node, 'update', place, pointer, number)
    distance = np.linalg.norm(place - eye)
    target = eye + (pointer - eye) / np.linalg.norm(pointer - eye) * distance
    page.source.pause(False)
    wait(lambda: page.frame.grabs and np.allclose(page.frame.grabs[0].target, target))
    assert page.frame.grabs[0].bone == 'left_forearm'
    bone = frame.scene.bone_index('left_forearm')
    wait(lambda: np.linalg.norm(page.frame.state.positions[bone] - target) < 0.05)
    # Drawn as a line while it is held.
    assert wait_for(page, '/scene/hands').visible
    client.drag(node, 'end', place, pointer, number)
    wait(lambda: not page.frame.grabs)


def test_a_point_that_has_moved_on_is_taken_at_the_edge(page):
    """The page shows the past: what was aimed at lies within the bone's box."""
    client = page.open()
    wait(lambda: page.frame)
    frame = paused(page)
    node, number, place = batch_of(page, 'head')
    client.drag(node, 'start', np.add(place, (0.5, 0, 0)), place, number)
    wait(lambda: page.source.frame.grabs)
    turn = rotation.matrix(frame.state.orientations[DROP.bone_index('head')])
    edge = np.clip(turn.T @ (0.5, 0, 0), -0.1, 0.1)  # half of its edges are 0.1 m
    # A page gets numbers of 32 bits.
    assert turn.T @ (page.source.frame.grabs[0].point - place) == pytest.approx(edge, abs=1e-5)


def test_a_page_that_vanishes_lets_go(page):
    """A closed laptop: no end of the drag, no goodbye. The other page goes on."""
    stays, goes = page.open(), page.open()
    wait(lambda: page.frame and len(page.server.get_clients()) == 2)
    node, number, place = batch_of(page, 'head')
    goes.drag(node, 'start', place, place, number)
    wait(lambda: page.frame.grabs)
    goes.drop()
    page.clients.remove(goes)
    wait(lambda: not page.frame.grabs and len(page.server.get_clients()) == 1)
    before = stays.windows
    wait(lambda: stays.windows > before)


def test_two_pages_have_a_hand_each(page):
    clients = [page.open(), page.open()]
    wait(lambda: page.frame and len(page.server.get_clients()) == 2)
    for client, bone in zip(clients, ('left_forearm', 'right_forearm'), strict=True):
        node, number, place = batch_of(page, bone)
        client.drag(node, 'start', place, place, number)
    wait(lambda: len(page.frame.grabs) == 2)


@pytest.mark.filterwarnings('ignore')
@pytest.mark.parametrize('data', [b'', b'\xff\x00garbage', b'\x81\xa4type\xa7Nothing'])
def test_garbage_on_the_socket_hurts_nobody_else(page, data, caplog):
    stays, bad = page.open(), page.open()
    wait(lambda: page.frame and len(page.server.get_clients()) == 2)
    bad.send_bytes(data)
    before = stays.windows
    wait(lambda: stays.windows > before + 3)


@pytest.mark.parametrize('phase', ['start', 'update'])
@pytest.mark.parametrize('number', [np.nan, np.inf, 1e300])
def test_a_pointer_that_points_nowhere_moves_nothing(page, phase, number):
    client = page.open()
    wait(lambda: page.frame)
    node, bone, place = batch_of(page, 'head')
    if phase == 'update':
        client.drag(node, 'start', place, place, bone)
        wait(lambda: page.frame.grabs)
    client.drag(node, phase, place if phase == 'update' else (number,) * 3, (number,) * 3, bone)
    client.drag(node, 'end', place, place, bone)
    since = page.frame.time
    wait(lambda: not page.frame.grabs and page.frame.time > since + 0.1)
    assert np.isfinite(page.frame.state.positions).all()
    assert np.abs(page.frame.state.positions).max() < 10
    assert not page.source.status.problem


def test_a_click_chooses_the_bone_for_the_editor(page):
    from viser import _messages
    client = page.open()
    wait(lambda: page.frame)
    node, number, _ = batch_of(page, 'right_shin')
    client.send(_messages.SceneNodeClickMessage(
        name=node, instance_index=number, ray_origin=(4.0, 0.0, 1.0),
        ray_direction=(-1.0, 0.0, 0.0), screen_pos=(0.5, 0.5), modifier=None))
    wait(lambda: page.editor.bone == 'right_shin')


def test_a_dark_page_has_a_dark_ground(page):
    client = page.open()
    wait(lambda: page.frame)
    ground = page.server.scene.get_handle_by_name('/scene/ground')
    assert min(ground.plane_color) > 200
    client.update(page.display.dark, True)
    wait(lambda: max(page.server.scene.get_handle_by_name('/scene/ground').plane_color) < 60)
    client.update(page.display.dark, False)
    wait(lambda: min(page.server.scene.get_handle_by_name('/scene/ground').plane_color) > 200)


def test_contacts_on_demand(page):
    """At rest the doll touches the ground: the points are at its height, within its margin."""
    client = page.open()
    wait(lambda: page.frame)
    assert page.server.scene.get_handle_by_name('/scene/contacts') is None
    client.update(page.display.contacts, True)
    wait(lambda: page.source.frame is page.frame and page.frame.contacts is not None and
         np.linalg.norm(page.frame.state.linear_velocities, axis=1).max() == 0)
    points = wait_for(page, '/scene/contacts').points
    assert len(points) > 3
    # Bones of the doll touch each other as well, above the ground.
    assert points[:, 2].min() == pytest.approx(0, abs=0.01)
    # At rest the ground bears the weight: 1 m of lines in all.
    lines = page.server.scene.get_handle_by_name('/scene/forces').points
    below = lines[:, 0, 2] < 0.01
    rises = (lines[below, 1, 2] - lines[below, 0, 2]).sum()
    assert rises == pytest.approx(WEIGHT_LENGTH, rel=0.01)
    client.update(page.display.contacts, False)
    wait(lambda: not page.server.scene.get_handle_by_name('/scene/contacts').visible)


def test_impacts_on_demand(page):
    client = page.open()
    wait(lambda: page.frame)
    client.update(page.display.impacts, True)
    wait(lambda: page.source.status.measures)
    page.source.reset()
    wait(lambda: page.frame.impacts)
    frame = paused(page)  # while time stands they stay
    assert frame.impacts and all('of the limit' in arrow.text for arrow in frame.impacts)
    labels = wait_for(page, '/scene/impacts_labels/0')
    wait(lambda: labels.text in {arrow.text for arrow in frame.impacts})
    page.source.pause(False)
    # The worst one of three seconds, as they are simulated apart from the page.
    wait(lambda: page.frame.time > 3)
    with Simulation(page.frame.scene) as simulation:
        simulation.record_impacts(load_limits())
        hits = [hit for _ in range(300) if simulation.advance() for hit in simulation.impacts]
    worst = max(hits, key=lambda hit: hit.ratio)
    expected = (f'{worst.bone}: {worst.peak_force:.0f} N, {worst.ratio:.2f} of the limit, '
                f'at {math.ceil(worst.time / 1e7) / 100:.2f} s')
    assert expected in page.display.worst_impact.line.content
    client.update(page.display.impacts, False)
    wait(lambda: page.server.scene.get_handle_by_name('/scene/impacts_labels/0') is None)
    wait(lambda: not page.source.frame.impacts)


def test_who_looks_back_sees_contacts_of_the_time_before_they_were_shown(page):
    client = page.open()
    wait(lambda: page.frame and page.frame.time > 2)
    client.steer(page, 'time 1.8')
    wait(lambda: page.frame.time < 2)
    assert page.server.scene.get_handle_by_name('/scene/contacts') is None
    client.update(page.display.contacts, True)
    assert len(wait_for(page, '/scene/contacts').points) > 3


def test_a_scene_that_is_loaded_while_editing_runs(page):
    client = page.open()
    wait(lambda: page.editor)
    page.editor.toggle()
    wait(lambda: page.source.status.paused)
    client.tell(page.gallery.events, 'flight')
    wait(lambda: page.frame.scene.name == 'flight' and page.frame.time > 0.1)
    assert not page.editor.editing


def test_the_camera_is_told_on_demand_what_to_follow(page):
    """The centre of mass, which a hand that holds something stops; test_viewer_browser looks."""
    client = page.open()
    wait(lambda: page.frame)
    masses = np.array([bone.mass for bone in DROP.bones])

    def followed():
        return page.server.scene.get_handle_by_name('/followed')

    def is_at(place):
        return np.allclose(followed().position, place, rtol=0, atol=1e-6)

    def centre():
        return masses @ page.frame.state.positions / masses.sum()

    paused(page)
    begin = centre()
    assert followed() is None
    client.update(page.display.follow, True)
    wait(lambda: followed() and is_at(begin))
    node, number, place = batch_of(page, 'head')
    client.drag(node, 'start', place, place, number)
    client.drag(node, 'update', place, np.add(place, (0, 0, 1)), number)
    wait(lambda: page.frame.grabs)
    page.source.pause(False)
    wait(lambda: centre()[2] - begin[2] > 0.5)
    assert is_at(begin)
    client.drag(node, 'end', place, place, number)
    wait(lambda: not page.frame.grabs and is_at(centre()))
    client.update(page.display.follow, False)
    wait(lambda: followed() is None)


def test_another_scene_is_framed_while_the_camera_follows(page):
    """By where its own first doll is, not by where that of the scene before was, 3 m aside."""
    client = page.open()
    wait(lambda: page.frame)
    client.update(page.display.follow, True)
    # The page's wish and the scenes below come by different ways: it follows before they do.
    wait(lambda: page.server.scene.get_handle_by_name('/followed'))
    camera, = (each.camera for each in page.server.get_clients().values())
    for name in ('crowd', 'flight'):
        page.source.load(name)
        scene = load_scene(name)
        part = scene.bone_slices[0]
        centre = np.average([scene.dolls[0].bone_pose(bone)[0] for bone in scene.bones[part]],
                            axis=0, weights=[bone.mass for bone in scene.bones[part]])
        # It may fall meanwhile: straight down.
        wait(lambda centre=centre: np.abs((camera.look_at - centre)[:2]).max() < 0.1)
    # In free space nothing falls.
    home = home_position(*bounding_spheres(scene, page.frame.state), centre, camera.fov,
                 camera.image_width / camera.image_height)
    assert np.linalg.norm(camera.position - home) < 0.01 * np.linalg.norm(home - centre)
    # It stays there when it follows no more: the views before were of another scene.
    client.update(page.display.follow, False)
    wait(lambda: page.server.scene.get_handle_by_name('/followed') is None)
    assert np.linalg.norm(camera.position - home) < 0.01 * np.linalg.norm(home - centre)


def test_a_home_view_of_another_size_is_replaced(page):
    """Also where it came last: the page told of its new size while the old view was computed."""
    page.source.pause(True)  # before a page is open: all frames are alike
    client = page.open()
    wait(lambda: page.frame)
    frame = paused(page)
    camera, = (each.camera for each in page.server.get_clients().values())
    spheres = bounding_spheres(frame.scene, frame.state)
    look_at = tuple(map(float, box_center(*spheres)))
    wide, tall = (1100, 700), (390, 844)
    start = page.server.initial_camera.position
    home = {size: home_position(*spheres, look_at, camera.fov, size[0] / size[1])
            for size in (wide, tall)}
    for position, size in ((start, wide), (home[wide], tall), (home[wide], tall)):
        client.look(tuple(map(float, position)), look_at, size)
        wait(lambda size=size: np.abs(camera.position - home[size]).max() < 1e-3, timeout=20)


def test_plots_tell_energy_gap_and_real_time_factor(page):
    client = page.open()
    wait(lambda: page.frame)
    client.press(page, 'Push up')
    # Nothing is drawn for pages that show another tab.
    wait(lambda: page.frame.time > 0.6)
    assert not page.plots.energy.handle.visible
    client.tell(page.plots.events, 'seen')
    wait(lambda: min(len(plot.handle.data[0]) for plot in (
        page.plots.real_time_factor, page.plots.energy)) > 3)
    wait(lambda: page.plots.energy.handle.data[2].max() > 10)
    _, energy, put_in = page.plots.energy.handle.data
    # The doll never has more than was put in: a thousandth for rounding.
    assert (energy <= put_in * 1.001 + 1e-6).all()
    _, gap = page.plots.gap.handle.data
    assert 0 <= gap.max() < 50
    _, factor, requested = page.plots.real_time_factor.handle.data
    assert requested.tolist() == [1.0] * len(requested) and 0 < np.median(factor) < 2


# What they are when they have run away is told as well, and cannot be computed.
@pytest.mark.filterwarnings('ignore::RuntimeWarning')
def test_numbers_that_run_away_are_never_drawn():
    """A spin of 1e155 rad/s has no finite square: the scene is started anew, and that is told."""
    bones = (Bone('a', Sphere(0.1), 1, (0, 0, 0)), Bone('b', Sphere(0.1), 1, (0, 0, 0.3)))
    doll = Ragdoll('d', bones, (Joint('a', 'b', 'ball', (0, 0, 0.15), ((0, 0, 1),)),))
    wild = Scene('wild', (Placement(doll, spin=(1e155, 0, 0)),), gravity=(0, 0, 0))
    try:
        source = SimulationSource(wild)
    except (ValueError, ArithmeticError):
        pytest.skip('the simulation refuses it at once')
    source.request(RequestedData(frames=True))
    wait(lambda: source.status.problem)
    assert all(np.isfinite(part).all() for part in vars(source.frame.state).values()) or \
        source.frame.time == 0
    source.close()
