"""The node in this process: time, services, exactness, what it leaves behind."""
from __future__ import annotations

import gc
import hashlib
import os
import threading
from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, Twist, Vector3, Wrench, WrenchStamped
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.drive import Drive
from ragdoll_ros.model.push import Push
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.ros.node import RagdollNode

SECOND = 1_000_000_000
POSES, MARKERS = '/ragdoll/poses', '/ragdoll/markers'

LATE = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Of a subscriber that wants what was published before it came."""


def digest(states):
    """SHA-256 of all numbers of all states."""
    sha = hashlib.sha256()
    for state in states:
        for part in vars(state).values():
            sha.update(np.ascontiguousarray(part).tobytes())
    return sha.hexdigest()


def wrench(x=0.0, y=0.0, z=0.0):
    return Wrench(force=Vector3(x=x, y=y, z=z))


def script(tick):
    """What is pushed before which tick, every 15 ticks: a message on each input in turn."""
    number, rest = divmod(tick, 15)
    if rest or not 1 <= number <= 20:
        return None
    strength = 100.0 * number
    return (('on_force', wrench(strength)),
            ('on_cmd_vel', Twist(linear=Vector3(y=number / 10))),
            ('on_push', WrenchStamped(header=Header(frame_id='left_shin'),
                                        wrench=wrench(z=strength))))[number % 3]


def played(node, ticks):
    """States of a node that is pushed by the script."""
    for tick in range(ticks):
        message = script(tick)
        if message:
            getattr(node.inputs, message[0])(message[1])
        node.tick()
        yield node.simulation.state


def plain(ticks):
    """States of a simulation without any node, pushed alike."""
    with Simulation(load_scene('drop')) as simulation:
        for tick in range(ticks):
            message = script(tick)
            if message and message[0] == 'on_force':
                simulation.push(Push('torso', (message[1].force.x, 0, 0)), 'a')
            elif message and message[0] == 'on_cmd_vel':
                velocity = (0, message[1].linear.y, 0)
                simulation.push(Drive('torso', velocity, duration=0.6), 'b')
            elif message:
                force = (0, 0, message[1].wrench.force.z)
                simulation.push(Push('left_shin', force, local=True), 'c')
            yield simulation.advance()


def test_a_node_with_listeners_leaves_the_simulation_its_bits(make_node, peer):
    node = make_node()
    heard = [peer.collect(kind, topic) for kind, topic in (
        (PoseArray, 'ragdoll/poses'), (MultiDOFJointState, 'ragdoll/state'),
        (JointState, 'joint_states'), (MarkerArray, 'ragdoll/markers'),
        (MultiDOFJointState, 'ragdoll/contact_wrenches'),
        (DiagnosticArray, 'ragdoll/impacts'))]
    peer.wait_heard(node, POSES, '/ragdoll/state', '/joint_states', MARKERS,
                    '/ragdoll/contact_wrenches', '/ragdoll/impacts')
    alone = digest(plain(320))
    assert digest(played(node, 320)) == alone
    node.reset()
    assert digest(played(node, 320)) == alone
    peer.wait(lambda: all(heard))


def test_pace_leaves_the_simulation_its_bits(make_node, peer):
    node = make_node(real_time_factor=20.0)
    peer.executor_.add_node(node)
    peer.wait(lambda: node.simulation.time >= SECOND)
    with Simulation(load_scene('drop')) as simulation:
        while simulation.time < node.simulation.time:
            simulation.advance()
        assert digest([simulation.state]) == digest([node.simulation.state])


@pytest.fixture
def paused(make_node):
    """A node whose time stands."""
    node = make_node(scene='flight')
    node.pause(True)
    return node


def test_a_step_is_one_tick_and_takes_a_pause(make_node, peer):
    node = make_node()
    peer.executor_.add_node(node)
    assert not peer.call(Trigger, 'ragdoll/step', Trigger.Request()).success
    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True)).success
    before = node.simulation.time
    answer = peer.call(Trigger, 'ragdoll/step', Trigger.Request())
    assert answer.success and str(node.simulation.time / SECOND) in answer.message
    assert node.simulation.time == before + node.simulation.tick
    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=False)).success
    peer.wait(lambda: node.simulation.time > before + 3 * node.simulation.tick)


def test_a_reset_goes_back_to_the_start_and_stays_paused(paused):
    start = digest([paused.simulation.state])
    paused.inputs.on_force(wrench(2000.0))
    for _ in range(5):
        paused.tick()
    paused.reset()
    assert paused.simulation.time == 0 and paused.paused
    assert paused.simulation.pushes == ()
    assert digest([paused.simulation.state]) == start


def momentum(simulation):
    masses = np.array([bone.mass for bone in simulation.scene.bones])
    return masses @ simulation.state.linear_velocities


def test_a_push_lasts_its_simulated_time_also_across_a_pause(paused):
    """2000 N for 0.1 s is 200 N s, whatever happens on the wall; given while paused."""
    paused.inputs.on_force(wrench(2000.0))
    for _ in range(4):
        paused.tick()
    paused.pause(False)
    paused.pause(True)
    np.testing.assert_allclose(momentum(paused.simulation), [80, 0, 0], rtol=1e-6, atol=1e-6)
    for _ in range(20):
        paused.tick()
    np.testing.assert_allclose(momentum(paused.simulation), [200, 0, 0], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(('take', 'message', 'expected'), [
    ('on_force', wrench(1000.0), 13.7),
    ('on_cmd_vel', Twist(linear=Vector3(y=900.0)), 50.2)])
def test_a_timeout_between_two_ticks_is_kept_exactly(make_node, take, message, expected):
    """A drive far from its velocity pushes with its most, 2000 N; it turns by some 1e-5 as the
    bone's own velocity does.
    """
    node = make_node(scene='flight', push_timeout=0.0137, cmd_vel_timeout=0.0251)
    getattr(node.inputs, take)(message)
    for _ in range(6):
        node.tick()
    assert np.linalg.norm(momentum(node.simulation)) == pytest.approx(expected, rel=1e-6)


def test_messages_in_a_row_push_without_a_gap(paused):
    """Sent every 5 ticks, held for 10: as one push of 25 and 10 more ticks."""
    for _ in range(6):
        paused.inputs.on_force(wrench(100.0))
        for _ in range(5):
            paused.tick()
    for _ in range(10):
        paused.tick()
    np.testing.assert_allclose(momentum(paused.simulation)[0], 100 * 0.35, rtol=1e-6)


def stamp_of(message):
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def stamps_of(got):
    return [stamp_of(message) for _, message in got]


def test_reports_bear_the_time_that_the_node_itself_tells(make_node, peer):
    node = make_node(publish_clock=True)
    peer.executor_.add_node(node)
    reports = peer.collect(DiagnosticArray, '/diagnostics')
    peer.wait(lambda: reports)
    values = {pair.key: pair.value for pair in reports[0][1].status[0].values}
    # The value is written with six digits.
    assert stamps_of(reports)[0] / SECOND == pytest.approx(float(values['simulated_time']),
                                                           rel=1e-5)


def late_comer(peer, kind, display):
    """What a display of config/ragdoll.rviz hears of its topic if it is made now."""
    topic = display['Topic']
    words = {key: topic[f'{key} Policy'].upper().replace(' ', '_')
             for key in ('Durability', 'History', 'Reliability')}
    return peer.collect(kind, topic['Value'], QoSProfile(
        depth=topic['Depth'], history=HistoryPolicy[words['History']],
        durability=DurabilityPolicy[words['Durability']],
        reliability=ReliabilityPolicy[words['Reliability']]))


def heads(node, poses, markers):
    """Where the head is in the last PoseArray, in the last MarkerArray, and indeed."""
    index = node.simulation.scene.bone_index('head')
    marker, = (marker for marker in markers[-1][1].markers if marker.ns == 'head')
    return (np.array([[pose.position.x, pose.position.y, pose.position.z]
                      for pose in (poses[-1][1].poses[index], marker.pose)]),
            node.simulation.state.positions[index])


def test_rviz_shows_what_is_also_if_it_comes_while_the_time_stands(make_node, peer):
    """After the last tick of a run, a step, a reset and another frame: early comer and late."""
    config = yaml.safe_load((Path(__file__).parent.parent / 'config/ragdoll.rviz').read_text())
    displays = {display['Name']: display
                for display in config['Visualization Manager']['Displays']}
    node = make_node()
    early = peer.collect(MarkerArray, 'ragdoll/markers')
    peer.wait_heard(node, MARKERS)
    for act in (lambda: None, node.tick, node.reset,
                lambda: node.set_parameters([Parameter('frame_id', value='map')])):
        node.pause(False)
        # Two ticks at once: the second one's markers come too soon for a screen.
        node.tick()
        node.tick()
        node.pause(True)
        act()
        poses = late_comer(peer, PoseArray, displays['Bones'])
        late = late_comer(peer, MarkerArray, displays['Shapes'])
        newest = (node.stamp, node.settings.frame_id)
        for markers in (early, late):
            peer.wait(lambda markers=markers, poses=poses, newest=newest: poses and markers and {
                (stamp_of(message), message.header.frame_id)
                for message in (poses[-1][1], markers[-1][1].markers[-1])} == {newest})
            places, truth = heads(node, poses, markers)
            np.testing.assert_allclose(places, [truth, truth], atol=1e-12)
    assert newest[1] == 'map'


def test_a_clock_that_stands_is_told_to_who_comes_late(make_node, peer):
    """Who goes by /clock, as rclpy's own time source, asks for no past messages."""
    node = make_node(publish_clock=True)
    for _ in range(7):
        node.tick()
    node.pause(True)
    peer.executor_.add_node(node)
    got = peer.collect(Clock, '/clock', QoSProfile(
        depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    peer.wait(lambda: got)
    assert got[-1][1].clock.nanosec == 70_000_000


def test_with_publish_clock_stamps_are_the_clock_and_the_simulated_time(make_node, peer):
    node = make_node(publish_clock=True)
    got, clock = peer.collect(PoseArray, 'ragdoll/poses'), peer.collect(Clock, '/clock')
    peer.wait_heard(node, POSES, '/clock')
    for _ in range(3):
        node.tick()
    peer.wait(lambda: len(got) == len(clock) == 3)
    times = [message.clock.sec * SECOND + message.clock.nanosec for _, message in clock]
    assert times == stamps_of(got) == [10_000_000, 20_000_000, 30_000_000]


def test_a_node_that_uses_simulated_time_does_not_wait_for_itself(make_node, peer):
    node = make_node(publish_clock=True, use_sim_time=True)
    peer.executor_.add_node(node)
    peer.wait(lambda: node.simulation.time > 10 * node.simulation.tick)


def left_behind():
    """Threads, file descriptors and memory, MB, of this process."""
    gc.collect()
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return (threading.active_count(), len(os.listdir('/proc/self/fd')),
            pages * os.sysconf('SC_PAGE_SIZE') / 1e6)


def make_and_destroy(count):
    for _ in range(count):
        node = RagdollNode()
        node.tick()
        node.destroy_node()


@pytest.mark.parametrize('count', [5, pytest.param(100, marks=pytest.mark.slow)])
def test_nodes_leave_nothing_behind(ros, count):
    """After a few to warm up: no thread, no descriptor, and far less memory than a node takes."""
    make_and_destroy(5)
    threads, files, memory = left_behind()
    make_and_destroy(count)
    after = left_behind()
    assert after[:2] == (threads, files)
    assert after[2] - memory < 0.5 * count + 5, 'MB; a node with its engines takes some 50'


def test_what_nobody_hears_is_not_made_and_who_comes_later_hears_it(make_node, peer):
    """No layout of a message before its first listener; while paused, the last poses are kept."""
    node = make_node(scene='crowd')
    for _ in range(3):
        node.tick()
    assert not set(vars(node._outputs._templates)) & {'poses', 'state', 'joints', 'markers'}
    node.pause(True)
    late = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    poses = peer.collect(PoseArray, 'ragdoll/poses', late)
    peer.wait(lambda: stamps_of(poses) == [node.stamp])
    state = peer.collect(MultiDOFJointState, 'ragdoll/state')
    peer.wait_heard(node, '/ragdoll/state')
    node.tick()
    peer.wait(lambda: stamps_of(state) == stamps_of(poses)[1:] == [node.stamp])


def test_calls_are_answered_while_ticks_follow_each_other_closely(make_node, peer):
    """Services are looked at before some ticks only, and before each where these are rare."""
    node = make_node(rate=5000.0)
    peer.executor_.add_node(node)
    for wanted in (True, False, True):
        assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=wanted)).success
    assert peer.call(Trigger, 'ragdoll/step', Trigger.Request()).success


def test_calls_are_answered_by_a_node_that_falls_behind(make_node, peer):
    """Its timer is ready whenever the executor looks, and comes first."""
    node = make_node(rate=5000.0, real_time_factor=100.0)
    peer.executor_.add_node(node)
    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True)).success


@pytest.mark.parametrize('kind, topic', [(PoseArray, 'ragdoll/poses'),
                                         (MarkerArray, 'ragdoll/markers'),
                                         (DiagnosticArray, 'ragdoll/measures')])
def test_who_comes_late_gets_the_present(make_node, peer, kind, topic):
    """Not what was when somebody listened last, or what was while it was paused."""
    node = make_node()
    name = f'/{topic}'

    def publisher():
        found, = (each for each in node.publishers if each.topic_name == name)
        return found

    def heard_from_now():
        got = peer.collect(kind, topic, LATE)
        peer.wait(lambda: publisher().get_subscription_count())
        return got

    def leave():
        peer.destroy_subscription(list(peer.subscriptions)[-1])
        peer.wait(lambda: not publisher().get_subscription_count())

    def first_stamp(got):
        peer.wait(lambda: got)
        message = got[0][1]
        return stamp_of(message.markers[-1] if kind is MarkerArray else message)

    first = heard_from_now()
    for _ in range(20):
        node.tick()
    assert first_stamp(first) <= node.stamp
    leave()
    for before in (lambda: None, lambda: (node.pause(True), node.pause(False))):
        before()
        for _ in range(5):
            node.tick()
        since = node.stamp
        late = heard_from_now()
        node._outputs._next_markers = 0  # markers are drawn 30 times a second
        node.tick()
        assert first_stamp(late) > since
        leave()
    node.pause(True)
    assert first_stamp(heard_from_now()) == node.stamp
