"""The page's ROS side with a real node in a process of its own, DDS between."""
from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip('viser')
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Vector3, Wrench
from page_client import served, wait
from peer import STARTED, end, kill, start
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback

from ragdoll_ros.files.run_scene import run_scene_text
from ragdoll_ros.files.scene import load_scene, save_scene
from ragdoll_ros.files.urdf import scene_to_urdf
from ragdoll_ros.model.errors import RagdollError
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.ros.latched_topic import LATCHED_HISTORY
from ragdoll_ros.ros.messages.convert import to_pose_array
from ragdoll_ros.ros.messages.measures import TickMeasures, checksum, serialize_measures
from ragdoll_ros.ros.messages.serialized import deserialize_pose_array
from ragdoll_ros.viewer.sources.node import source as remote_source
from ragdoll_ros.viewer.sources.node.frames import LATCHED_QOS, MAX_MESSAGES, NodeFrames
from ragdoll_ros.viewer.sources.node.hands import NodeHands
from ragdoll_ros.viewer.sources.node.pushes import ObservedPushes
from ragdoll_ros.viewer.sources.node.scene import scene_of_node
from ragdoll_ros.viewer.sources.node.source import NodeSource
from ragdoll_ros.viewer.sources.source import RequestedData

OPEN = RequestedData(frames=True)


@pytest.fixture(scope='module')
def nodes(ros):
    """The nodes that served one test after the other so far; only the last one may still run."""
    nodes = []
    yield nodes
    for process in nodes:
        kill(process)


@pytest.fixture(autouse=True)
def nothing_runs_on(nodes):
    before = len(STARTED)
    yield
    for process in STARTED[before:]:
        if process not in nodes:
            kill(process)


@pytest.fixture
def remote(ros):
    remote = NodeSource([])
    yield remote
    remote.close()


@pytest.fixture
def node(nodes, peer):
    """The node in the default scene as it begins: another one only where the last was killed."""
    if not nodes or nodes[-1].poll() is not None:
        nodes.append(start('node', compiled=True))
    yield nodes[-1]
    if nodes[-1].poll() is None:
        assert set_parameters(peer, scene='drop', real_time_factor=1.0)
        assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=False)).success
        assert peer.call(Trigger, 'ragdoll/reset', Trigger.Request()).success


@pytest.fixture
def no_node(nodes):
    """No node runs as the test begins."""
    if nodes and nodes[-1].poll() is None:
        end(nodes[-1], signal.SIGINT)


def set_parameters(peer, **values):
    """Whether the node takes these parameters."""
    parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
    return peer.call(SetParametersAtomically, 'ragdoll/set_parameters_atomically',
                     SetParametersAtomically.Request(parameters=parameters)).result.successful


def seen(remote, name='drop'):
    """Wait until the node's scene is shown."""
    wait(lambda: remote.frame is not None and remote.frame.scene.name == name)
    # They are found apart from what is shown; what is asked before is lost.
    services = remote._services
    wait(lambda: all(client.service_is_ready() for client in (
        services._set, services._pause, *services._triggers.values())))
    wait(remote._hands._publisher.get_subscription_count)
    wait(remote._force._publisher.get_subscription_count)
    return remote.frame


@pytest.mark.parametrize('frame', ['', 'w', 'world', 'a/longer/frame'])
@pytest.mark.parametrize('count', [0, 1, 10, 333])
def test_poses_read_from_bytes_are_what_was_serialized(frame, count):
    poses = np.random.default_rng(1).normal(size=(count, 7))
    data = serialize_message(to_pose_array(frame, 7_000_000_009, poses))
    stamp, found = deserialize_pose_array(data)
    assert stamp == 7_000_000_009 and np.array_equal(found, poses)


def test_bytes_that_are_no_poses_are_a_value_error():
    data = serialize_message(PoseArray(header=Header(frame_id='w'), poses=[
        Pose(position=Point(x=1.0), orientation=Quaternion())]))
    for wrong in (b'', b'\x00\x01\x00\x00', data[:-8], b'\x00\x00' + data[2:],
                  data[:12] + b'\xff\xff\xff\xff' + data[16:]):
        with pytest.raises(ValueError):
            deserialize_pose_array(wrong)


def end_viewer():
    """Start a viewer without any node and end it well as it waits for one; seconds of the end."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'ragdoll_ros.viewer.command', '--port', '0'],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ))
    assert 'The page is at' in process.stdout.readline()
    code, seconds = end(process, signal.SIGTERM)
    assert code == 0 and 'Traceback' not in process.stderr_text
    return seconds


def test_the_viewer_leaves_at_a_signal(no_node):
    end_viewer()


@pytest.mark.slow
def test_the_viewer_leaves_within_two_seconds(no_node):
    assert end_viewer() < 2


def test_no_node_is_said_and_heals_by_itself(no_node, nodes, remote):
    remote.request(OPEN)
    wait(lambda: 'no node' in remote.status.problem and 'ragdoll_node' in remote.status.problem)
    with pytest.raises(ValueError, match='no node'):
        remote.load('drop')
    nodes.append(start('node', compiled=True))
    seen(remote)
    assert not remote.status.problem


def test_two_nodes_of_one_name_are_told_with_what_to_do(node, remote):
    remote.request(OPEN)
    twin = start('node')
    wait(lambda: 'namespace of its own' in remote.status.note)
    end(twin, signal.SIGINT)
    wait(lambda: not remote.status.note)


def test_shows_what_the_node_publishes(node, remote, peer):
    """The poses are those of ~/poses, with their scene and their time since the start."""
    remote.request(OPEN)
    frame = seen(remote)
    assert frame.scene == load_scene('drop') and not remote.status.note
    got = peer.collect(PoseArray, 'ragdoll/poses')
    peer.wait(lambda: len(got) > 5)
    wait(lambda: remote.frame.time > frame.time)
    shown = remote.frame
    peer.wait(lambda: any(np.array_equal(
        [[p.position.x, p.position.y, p.position.z] for p in message.poses],
        shown.state.positions) for _, message in got))
    wait(lambda: remote.status.measures)
    before = remote.frame.time
    assert 0 < before < 60


def test_listens_to_what_is_shown_alone(node, remote, peer):
    remote.request(RequestedData())
    topics = ('ragdoll/poses', 'ragdoll/contacts', 'joint_states', 'ragdoll/swings',
              'ragdoll/scene', 'robot_description')

    def listened():
        return [topic for topic in topics if peer.count_subscribers(topic)]

    peer.wait(lambda: peer.count_publishers('ragdoll/poses'))
    peer.wait(lambda: listened() == [])
    remote.request(OPEN)
    seen(remote)
    peer.wait(lambda: listened() == ['ragdoll/poses', 'ragdoll/scene', 'robot_description'])
    assert remote.frame.contacts is None and remote.frame.angles is None
    remote.request(RequestedData(frames=True, contacts=True, angles=True))
    wait(lambda: remote.frame.contacts is not None and remote.frame.angles is not None)
    assert len(remote.frame.angles) == 14
    remote.load('ponytail')
    seen(remote, 'ponytail')
    wait(lambda: remote.frame.rods is not None)
    assert remote.frame.rods.shape == (8, 2, 3)
    peer.wait(lambda: listened() == list(topics))
    remote.request(RequestedData())
    peer.wait(lambda: listened() == [])


def test_contacts_with_bodies_are_on_the_timeline(no_node, nodes, page, peer):
    """On stairs, above the ground; in a scene without bodies nobody listens to contacts."""
    pytest.importorskip('numba')
    # Slow motion: a busy machine asks for contacts when the doll would have fallen down the stairs.
    nodes.append(start('node', '--ros-args', '-p', 'real_time_factor:=0.25', compiled=True))
    wait(lambda: page.frame)
    assert not peer.count_subscribers('ragdoll/contacts')
    wait(page.source._services._set.service_is_ready)
    page.source.load('stairs')

    def touched_above_ground():
        clip = page.timeline.clip
        return any(clip.frame(int(k)).state.positions[:, 2].min() > 0.3
                   for k in np.flatnonzero(clip.touching))

    wait(lambda: page.frame.scene.name == 'stairs' and touched_above_ground())
    end(nodes[-1], signal.SIGINT)


def test_impacts_are_seen_for_a_second(no_node, nodes, remote, peer):
    pytest.importorskip('numba')
    # Slow motion: a busy machine delays frames by little simulated time.
    nodes.append(start('node', '--ros-args', '-p', 'real_time_factor:=0.25', compiled=True))
    frames = []
    remote.request(RequestedData(frames=True, impacts=True))
    seen(remote)
    peer.wait(lambda: peer.count_subscribers('ragdoll/impacts/markers'))
    assert peer.call(Trigger, 'ragdoll/reset', Trigger.Request()).success
    wait(lambda: frames.append(remote.frame) or frames[-1].impacts)
    arrow = frames[-1].impacts[0]
    assert 'of the limit' in arrow.text and 0.09 < arrow.length < 1.01
    assert frames[-1].time < 1.5, 'the doll falls in .3 s'
    end(nodes[-1], signal.SIGINT)


def test_a_node_that_is_paused_is_seen_as_it_stands(node, remote, peer):
    """It publishes nothing: the last poses are kept for who comes late."""
    remote.request(OPEN)
    seen(remote)
    remote.pause(True)
    wait(lambda: remote.status.paused)
    late = NodeSource([])
    late.request(OPEN)
    frame = seen(late)
    wait(lambda: late.status.paused)
    wait(lambda: np.array_equal(late.frame.state.positions, remote.frame.state.positions))
    before = frame.time
    late.step()
    wait(lambda: late.frame.time > before)
    late.close()


def test_swings_of_a_paused_node_are_seen_by_who_comes_late(node, remote, peer):
    assert set_parameters(peer, scene='ponytail')
    remote.request(OPEN)
    seen(remote, 'ponytail')
    wait(lambda: remote.frame.rods is not None and remote.frame.time > 0.2)
    remote.pause(True)
    wait(lambda: remote.status.paused)
    late = NodeSource([])
    late.request(OPEN)
    seen(late, 'ponytail')
    wait(lambda: late.frame.rods is not None and late.frame.time == remote.frame.time)
    wait(lambda: np.array_equal(late.frame.rods, remote.frame.rods))
    late.close()


def test_steers_the_node(node, remote):
    remote.request(OPEN)
    seen(remote)
    remote.set_real_time_factor(0.5)
    wait(lambda: remote.status.real_time_factor == 0.5)
    seen(remote)
    due, found = time.monotonic(), ()

    def pushed():
        """Sent once a second: a push may come before the node listens, or end between two looks."""
        nonlocal due, found
        if time.monotonic() >= due:
            remote.push((0.0, 2000.0, 1.0), 0.1)
            due += 1
        found = remote.frame.pushes
        return found

    wait(pushed)
    assert found[0].force == pytest.approx((0, 2000, 1))
    # Of a node that falls behind, 0.1 s of a page's time may be a tick or two.
    wait(lambda: [pushed(), remote.status.measures['work_of_pushes_J'] > 100][1])
    wait(lambda: not remote.frame.pushes)
    run = remote.frame.run
    remote.reset()
    wait(lambda: remote.frame.run != run)


def test_another_accuracy_and_what_its_ticks_cost(node, remote):
    """Once a second the node tells its pace and the cost of a tick; a page shows both."""
    remote.request(OPEN)
    wait(lambda: remote.status.accuracy == 'normal' and remote.status.tick_cost > 0)
    wait(lambda: remote.status.measured_real_time_factor == pytest.approx(1, abs=0.5))
    try:
        remote.set_accuracy('draft')
        wait(lambda: remote.status.accuracy == 'draft')
        with pytest.raises(RagdollError, match='accuracy'):
            remote.set_accuracy('perfect')
    finally:
        remote.set_accuracy('normal')


def test_a_push_ends_at_a_reset_for_good():
    """Also where the new run comes to the time of the old one."""
    pushes = ObservedPushes(load_scene('drop'))
    pushes.set_time(5.0)
    pushes.push(Push('torso', (1.0, 0.0, 0.0), duration=1.0), 'keys')
    assert len(pushes.pushes) == 1
    for instant in (0.0, 5.5):
        pushes.set_time(instant)
        assert not pushes.pushes


def test_pushes_of_others_are_shown(node, remote, peer):
    """2000 N on ~/force for 0.1 s of simulated time, at two fifths of real time."""
    remote.request(OPEN)
    seen(remote)
    remote.set_real_time_factor(0.4)
    wait(lambda: remote.status.real_time_factor == 0.4)
    sender = peer.sender(Wrench, 'ragdoll/force')
    peer.wait(lambda: sender.get_subscription_count() == 2)
    found = ()

    def pushed():
        """Told again and again: a listener may hear the first before the page's has found it."""
        nonlocal found
        sender.publish(Wrench(force=Vector3(x=2000.0)))
        found = remote.frame.pushes
        return found
    wait(pushed)
    assert found[0].bone == 'torso'
    wait(lambda: not remote.frame.pushes)


def test_a_grab_lifts_the_bone_and_rests_longer_than_the_nodes_patience(node, remote):
    """A pointer that rests sends nothing: the hand is kept for it beyond 3 s."""
    remote.request(OPEN)
    frame = seen(remote)
    bone = frame.scene.bone_index('head')
    target = np.array([0.3, 0.2, 2.2])
    remote.grab('page 1', 'head', (0.0, 0.0, 0.1), tuple(target))
    wait(lambda: np.linalg.norm(remote.frame.state.positions[bone] - target) < 0.2)
    assert remote.frame.grabs[0].bone == 'head'
    since = remote.frame.time
    wait(lambda: remote.frame.time > since + 3.5)
    assert np.linalg.norm(remote.frame.state.positions[bone] - target) < 0.2
    remote.let_go('page 1')
    wait(lambda: not remote.frame.grabs)
    wait(lambda: remote.frame.state.positions[bone][2] < 1.0)


def test_a_hand_rests_also_where_ros_time_stands(node, peer):
    """A page that is to go by a /clock which nobody tells still says that it holds the bone."""
    remote = NodeSource(['--ros-args', '-p', 'use_sim_time:=true'])
    try:
        remote.request(OPEN)
        seen(remote)
        feedback = peer.collect(InteractiveMarkerFeedback, 'ragdoll/interactive/feedback')
        remote.grab('page 1', 'head', (0.0, 0.0, 0.1), (0.3, 0.2, 2.2))
        peer.wait(lambda: sum(message.event_type == InteractiveMarkerFeedback.KEEP_ALIVE
                              for _, message in feedback) > 1)
        remote.let_go('page 1')
    finally:
        remote.close()


def zero_of(reports):
    """Stamp of time zero, ns, as the node has reported it last."""
    values = {pair.key: pair.value for pair in reports[-1][1].status[0].values}
    return int(values['stamp_of_zero'])


def test_a_pause_opens_no_hand(node, remote, peer):
    """The node's stamps are set to ROS time as it goes on; the page's time goes on as the doll's.

    Its pace is so slow that a second on the wall would be seen.
    """
    remote.request(OPEN)
    seen(remote)
    remote.set_real_time_factor(0.01)
    wait(lambda: remote.status.measures and remote.status.real_time_factor == 0.01)
    remote.grab('page 1', 'head', (0.0, 0.0, 0.1), (0.3, 0.2, 2.2))
    wait(lambda: remote.frame.grabs)
    remote.pause(True)
    wait(lambda: remote.status.paused)
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.wait(lambda: reports)
    before, stamp = remote.frame.time, zero_of(reports)
    frames = []
    remote.pause(False)
    peer.wait(lambda: frames.append(remote.frame) or zero_of(reports) > stamp)
    # The picture at hand may be one that came before the stamps were set.
    wait(lambda: frames.append(remote.frame) or any(
        before < frame.time < before + 0.1 for frame in frames))
    assert remote.frame.grabs
    remote.let_go('page 1')


def test_a_reset_lets_go_here_too(node, remote):
    """The node opens its hands; none is shown that pulls nothing."""
    remote.request(OPEN)
    seen(remote)
    wait(lambda: remote.status.measures and remote.frame.time > 0.5)
    remote.grab('page 1', 'head', (0.0, 0.0, 0.1), (0.3, 0.2, 2.2))
    wait(lambda: remote.frame.grabs and remote.status.measures['work_of_grabs_J'] > 1)
    remote.reset()
    wait(lambda: not remote.frame.grabs)


def test_uses_an_edited_scene_or_says_why_not(node, remote, tmp_path):
    remote.request(OPEN)
    seen(remote)
    heavier = load_scene('drop')
    doll = heavier.dolls[0].doll.replace_bone('head', mass=7.5)
    heavier = dataclasses.replace(heavier, name='heavier', dolls=(
        dataclasses.replace(heavier.dolls[0], doll=doll),))
    remote.set_scene(heavier)
    assert seen(remote, 'heavier').scene.bones[1].mass == 7.5
    assert not remote.status.note
    with pytest.raises(ValueError, match='nowhere'):
        remote.load('nowhere')
    assert remote.frame.scene.name == 'heavier'


def test_a_node_takes_a_fixed_root_unless_its_engine_cannot(no_node, nodes, remote):
    """Its URDF stays the same, so the page has to learn of it from the file."""
    pytest.importorskip('numba')
    nodes.append(start('node', compiled=True))
    remote.request(OPEN)
    drop = seen(remote).scene
    free = dataclasses.replace(drop, dolls=(dataclasses.replace(drop.dolls[0], spin=(0, 0, 0)),))
    fixed = dataclasses.replace(free, dolls=(
        dataclasses.replace(free.dolls[0], fixed_root=True),))
    remote.set_scene(free)
    wait(lambda: remote.frame.scene == free)
    remote.set_engine('bullet')
    with pytest.raises(RagdollError, match='rigid, which holds roots that are fixed'):
        remote.set_scene(fixed)
    remote.set_engine('rigid')
    remote.set_scene(fixed)
    wait(lambda: remote.frame.scene == fixed and remote.frame.time > 0.5)
    root = drop.bone_names.index(drop.dolls[0].doll.root.name)
    assert remote.frame.state.positions[root] == pytest.approx(
        drop.dolls[0].bone_pose(drop.bones[root]).position, abs=1e-6)
    end(nodes[-1], signal.SIGINT)


def test_a_file_that_is_another_one_by_now_changes_nothing(node, remote, peer, tmp_path):
    """What the node took is what is shown, to the last field."""
    path, scene = tmp_path / 'mine.yaml', load_scene('crowd')
    save_scene(scene, path)
    assert set_parameters(peer, scene=str(path))
    save_scene(load_scene('drop'), path)
    remote.request(OPEN)
    wait(lambda: remote.frame is not None)
    assert not remote.status.note and remote.frame.scene == scene


def test_a_scene_whose_files_are_not_here_is_shown_by_its_urdf(no_node, nodes, remote, peer,
                                                               tmp_path):
    """As on another machine, which has no mesh of the node's."""
    pytest.importorskip('numba')
    nodes.append(start('node', compiled=True))
    (tmp_path / 'wedge.obj').write_text('v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n'
                                        'f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n')
    path = tmp_path / 'mine.yaml'
    path.write_text('dolls: [{doll: doll, position: [3, 0, 1]}]\nground: {}\n'
                    'bodies: [{name: wedge, shape: {mesh: {file: wedge.obj}}}]\n')
    assert set_parameters(peer, scene=str(path))
    (tmp_path / 'wedge.obj').unlink()
    remote.request(OPEN)
    wait(lambda: remote.frame is not None)
    assert 'robot_description' in remote.status.note and 'expected a file' in remote.status.note
    scene = load_scene('drop')
    assert remote.frame.scene.bone_names == scene.bone_names
    assert np.allclose([bone.shape.half_extents for bone in remote.frame.scene.bones],
                       [bone.shape.half_extents for bone in scene.bones])
    end(nodes[-1], signal.SIGINT)


def test_no_frame_has_the_scene_before(peer):
    """Of two whose URDFs are equal: the poses of one are no frame of the other, but wait."""
    drop, ponytail = map(load_scene, ('drop', 'ponytail'))
    urdf = checksum(scene_to_urdf(drop, 'world'))
    assert urdf == checksum(scene_to_urdf(ponytail, 'world'))
    frames = NodeFrames(peer, 'told', NodeHands(peer, 'told'))
    frames.subscribe(OPEN)
    publishers = [peer.create_publisher(kind, topic, LATCHED_HISTORY) for kind, topic in (
        (DiagnosticArray, 'told/measures'), (PoseArray, 'told/poses'))]
    for publisher in publishers:
        peer.wait(publisher.get_subscription_count)

    def tick(scene, time):
        publishers[0].publish(serialize_measures('/ragdoll', time, TickMeasures(
            time, 1 + (scene is ponytail), urdf, checksum(run_scene_text(scene)), 0.0, 0.0, 0.0)))
        publishers[1].publish(serialize_message(to_pose_array('world', time, np.ones((10, 7)))))

    def use(scene):
        frames.set_scene(ObservedPushes(scene), checksum(run_scene_text(scene)))

    use(drop)
    got = []
    wait(lambda: tick(drop, 1) or got.extend(frames.take()) or got)
    assert {frame.scene.name for frame in got} == {'drop'}
    last = frames.last_poses
    tick(ponytail, 2)
    wait(lambda: got.extend(frames.take()) or frames.last_poses != last)
    assert {frame.scene.name for frame in got} == {'drop'}
    use(ponytail)
    wait(lambda: frames.newest.scene.name == 'ponytail')


def test_lost_messages_are_told(peer, capfd):
    """A page that draws nothing for longer than messages wait for it says how many it missed."""
    frames = NodeFrames(peer, 'busy', NodeHands(peer, 'busy'))
    frames.subscribe(OPEN)
    publisher = peer.create_publisher(PoseArray, 'busy/poses', LATCHED_QOS)
    peer.wait(publisher.get_subscription_count)

    def publish_and_read(count):
        before = frames.last_poses
        for stamp in range(count):
            publisher.publish(to_pose_array('world', stamp, np.ones((10, 7))))
        wait(lambda: frames.take() or frames.last_poses != before)

    for count in (1, MAX_MESSAGES):
        publish_and_read(count)
    assert 'lost' not in capfd.readouterr().err
    publish_and_read(MAX_MESSAGES + 7)
    assert '7 messages of /busy/poses were lost' in capfd.readouterr().err


@pytest.mark.parametrize('name', ['drop', 'crowd', 'article', 'flight', 'ponytail'])
def test_shapes_and_axes_from_a_urdf_are_the_scenes(name):
    """The bones' frames are those of the poses: half extents along the same axes."""
    scene = load_scene(name)
    found, note = scene_of_node('/not/here.yaml', 'no text of a scene', scene.bone_names,
                                scene_to_urdf(scene, 'map'))
    same, nothing = scene_of_node(name, run_scene_text(scene), (), '')
    assert same == scene and not nothing
    assert note and found.bone_names == scene.bone_names
    for ours, theirs in zip(found.bones, scene.bones, strict=True):
        assert type(ours.shape) is type(theirs.shape)
        assert ours.shape.half_extents == pytest.approx(theirs.shape.half_extents)
        assert ours.color is None or ours.color == pytest.approx(theirs.color)


@pytest.fixture
def page(ros):
    """The whole way: DDS, page, websocket, one page that is open."""
    with served(NodeSource([])) as page:
        page.open()
        yield page


def drawn(page, scene):
    """Whether every bone of the scene is drawn, where the node has it."""
    stage, frame = page.stage, page.frame
    if stage is None or stage.scene != scene or frame.scene is not stage.scene:
        return False
    return all(np.abs(batch.handle.batched_positions
                      - frame.state.positions[batch.bones]).max() < 1e-6
               for batch in stage.bodies.batches) and sorted(np.concatenate(
                   [batch.bones for batch in stage.bodies.batches])) == list(
                       range(len(scene.bones)))


def test_the_page_draws_the_node(node, page):
    wait(lambda: page.frame is not None)
    before = page.frame.time
    wait(lambda: page.frame.time > before + 0.1)
    wait(lambda: page.source.pause(True))
    wait(lambda: page.source.status.paused and page.frame is page.source.frame)
    wait(lambda: drawn(page, load_scene('drop')))


def test_an_open_page_follows_the_scene_that_others_set(node, page, peer, broken_scene, tmp_path):
    """Other bones, the same bones in another size, swings; what the node refuses changes nothing.

    All while the page's hand holds the head and its pointer goes on dragging.
    """
    def set_scene(name):
        taken = set_parameters(peer, scene=str(name))
        page.source.drag('page 0', (0.0, 0.0, 2.0))
        return taken

    wait(lambda: page.frame is not None)
    larger = load_scene('drop')
    doll = larger.dolls[0].doll.replace_bone('head', shape=Sphere(0.15))
    larger = dataclasses.replace(larger, dolls=(
        dataclasses.replace(larger.dolls[0], doll=doll),))
    save_scene(larger, tmp_path / 'larger.yaml')
    for name in ('crowd', 'drop', tmp_path / 'larger.yaml', 'ponytail'):
        page.source.grab('page 0', page.frame.scene.bone_names[1], (0.0,) * 3, (0.0, 0.0, 2.0))
        assert set_scene(name)
        wait(lambda name=name: page.stage.scene == load_scene(str(name)))
        before = page.frame.time
        wait(lambda before=before: page.frame.time != before)
    assert not set_scene(broken_scene[0])
    before = page.frame.time
    wait(lambda: page.frame.time > before + 0.1)
    wait(lambda: page.source.pause(True))
    wait(lambda: page.source.status.paused)
    wait(lambda: drawn(page, load_scene('ponytail')))


def test_an_open_page_follows_a_node_that_comes_back_with_another_scene(
        node, page, peer, monkeypatch):
    """Killed while a hand of the page holds a bone that is not there any more then.

    The new node hears nothing of that bone, of which it would have to warn. A node is silent after
    1.5 s in place of 3: it reports once a second.
    """
    monkeypatch.setattr(remote_source, 'SILENCE', 1.5)
    wait(lambda: page.frame is not None)
    page.source.grab('page 0', 'head', (0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
    wait(lambda: page.frame.grabs)
    kill(node)
    wait(lambda: 'silent' in page.problem.content and 'start it again' in page.problem.content)
    wait(lambda: 'No messages' in page.settings.health.dot.content)
    start('node', '--ros-args', '-p', 'scene:=crowd', compiled=True)
    wait(lambda: page.stage.scene == load_scene('crowd'))
    wait(lambda: not page.problem.content)
    wait(lambda: page.source.pause(True))
    wait(lambda: page.source.status.paused)
    wait(lambda: drawn(page, load_scene('crowd')))
    assert not page.frame.grabs
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.wait(lambda: len(reports) > 1)
    assert {pair.key: pair.value for pair in reports[-1][1].status[0].values}['refused'] == '0'
