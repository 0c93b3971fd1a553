"""A run of the node as a log: what ~/events and ~/scene tell is enough to repeat it to the bit."""
from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from bags import write_bag
from geometry_msgs.msg import Point, Pose, PoseArray, Twist, Vector3, Wrench, WrenchStamped
from peer import LOCKS, STARTED, kill, start
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from recorder import PAST
from std_msgs.msg import Header, String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback

from ragdoll_ros.files.run_scene import read_run_scene, scene_digest
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.logged_simulation import state_digest
from ragdoll_ros.replay.command import main
from ragdoll_ros.ros.event_log import HASH_INTERVAL

EVENTS, SCENE = '/ragdoll/events', '/ragdoll/scene'


def vector(x=0.0, y=0.0, z=0.0):
    return Vector3(x=float(x), y=float(y), z=float(z))


def feedback(bone, kind, position=(0.0, 0.0, 0.0)):
    """What a client says that drags a bone by its centre of mass."""
    x, y, z = map(float, position)
    return InteractiveMarkerFeedback(
        header=Header(frame_id='world'), client_id='rviz', marker_name=bone, event_type=kind,
        pose=Pose(position=Point(x=x, y=y, z=z)))


def push(node, number):
    """Push by each input in turn, with numbers that no short decimal gives."""
    force = vector(300 * math.sin(number), 300 * math.cos(number), 1 / (number + 1))
    (lambda: node.inputs.on_force(Wrench(force=force)),
     lambda: node.inputs.on_cmd_vel(Twist(linear=vector(0.1 * math.sin(number)))),
     lambda: node.inputs.on_push(WrenchStamped(
         header=Header(frame_id='left_shin'), wrench=Wrench(force=force))))[number % 3]()


class Log:
    """What a peer hears of the two topics, and the bag that it makes."""

    def __init__(self, peer):
        self._peer = peer
        self.scenes, self.lines = (peer.collect(String, topic, PAST) for topic in (SCENE, EVENTS))

    @property
    def events(self):
        return [json.loads(message.data) for _, message in self.lines]

    def of(self, kind):
        return [event for event in self.events if event['kind'] == kind]

    def write(self, folder):
        """Write all that came; events have no gap."""
        assert [event['number'] for event in self.events] == list(range(len(self.lines)))
        return write_bag(folder, [
            *((SCENE, message.data) for _, message in self.scenes),
            *((EVENTS, message.data) for _, message in self.lines)])


@pytest.fixture
def log(peer):
    return Log(peer)


def replayed(capsys, *arguments):
    """Exit code of the command, what it prints, and what it warns of."""
    capsys.readouterr()
    code = main([str(argument) for argument in arguments])
    return code, *capsys.readouterr()


def test_a_run_with_all_that_can_act_is_repeated_to_the_bit(make_node, peer, log, tmp_path, capsys):
    node = make_node(start_paused=True)  # only the loop makes ticks, also while a scene is loaded
    peer.wait_heard(node, EVENTS, SCENE)
    digests = {}
    for tick in range(1, 401):
        if tick % 20 == 0:
            push(node, tick // 20)
        if tick == 90:
            node.interactive.on_feedback(feedback('head', InteractiveMarkerFeedback.MOUSE_DOWN,
                                           (0.1, 0.2, 0.3)))
        elif tick in (95, 105):
            node.interactive.on_feedback(feedback('head', InteractiveMarkerFeedback.POSE_UPDATE,
                                           (0.1, 1 / tick, 1.5)))
        elif tick == 130:
            node.interactive.on_feedback(feedback('head', InteractiveMarkerFeedback.MOUSE_UP))
        elif tick == 150:
            node.set_parameters([Parameter('rate', value=120.0),
                                 Parameter('accuracy', value='draft')])
        elif tick == 210:
            node.reset()
        elif tick == 250:
            node.set_parameters([Parameter('scene', value='crowd')])
        elif tick == 310:
            node.set_parameters([Parameter('engine', value='bullet')])
        node.tick()
        digests[tick] = state_digest(node.simulation.state)
    peer.wait(lambda: len(log.of('state')) == 4)
    told = {event['tick']: event['sha256'] for event in log.of('state')}
    assert told == {tick: digests[tick] for tick in (100, 200, 300, 400)}
    assert {'push', 'grab', 'drag', 'let_go', 'reset', 'parameters'} <= {
        event['kind'] for event in log.events}
    code, said, warned = replayed(capsys, log.write(tmp_path / 'bag'))
    # Three starts tell of their first state as well.
    assert (code, warned) == (0, '') and '400 ticks' in said and '7 of 7 hashes equal' in said


def test_events_tell_what_took_effect_and_when(make_node, peer, log):
    node = make_node(scene='flight', max_force=100.0)
    node.tick()
    node.inputs.on_force(Wrench(force=vector(300)))
    node.inputs.on_force(Wrench(force=vector(math.nan)))
    node.pause(True)
    node.tick()
    node.set_parameters([Parameter('push_timeout', value=0.25)])
    node.reset()
    peer.wait(lambda: log.of('reset'))
    start, push, pause, change, reset = log.events
    assert [event['tick'] for event in log.events] == [0, 1, 1, 2, 2]
    assert start['kind'] == 'start' and start['engine'] == node.simulation.engine_name
    assert (push['kind'], push['force'], push['bone'], push['duration']) == (
        'push', [100.0, 0.0, 0.0], 'torso', 0.1), 'after the clamp'
    assert (pause['kind'], pause['paused']) == ('pause', True)
    assert (change['kind'], change['push_timeout']) == ('parameters', 0.25)
    assert reset['kind'] == 'reset' and reset['step'] == start['step'] == 0.01


def test_the_scene_is_that_of_the_node_and_who_comes_late_hears_it(make_node, peer, log):
    node = make_node(scene='ponytail')
    peer.wait(lambda: log.scenes and log.events)
    text = log.scenes[0][1].data
    scene, told = read_run_scene(text)
    assert scene == load_scene('ponytail') and 'ragdoll_ros' in told and 'numpy' in told
    assert log.events[0]['scene'] == scene_digest(text)
    assert log.events[0]['state'] == state_digest(node.simulation.state)


def test_nothing_is_hashed_while_nobody_listens(make_node, monkeypatch):
    """Counted where it is made: the digest of a state."""
    node, made = make_node(scene='flight'), []
    monkeypatch.setattr('ragdoll_ros.ros.event_log.state_digest', lambda state: made.append(state))
    for _ in range(2 * HASH_INTERVAL):
        node.tick()
    assert made == []


@pytest.mark.parametrize(('bad', 'starts'), [(1, [0]), (3, [0, 70])])
def test_bad_ticks_are_told_as_going_back_and_three_as_a_start(
        bad, starts, make_node, peer, log, tmp_path, capsys, monkeypatch):
    node = make_node()
    peer.wait_heard(node, EVENTS, SCENE)
    for tick in range(200):
        if tick == 70:
            with monkeypatch.context() as patch:
                patch.setattr(node.simulation, 'advance', lambda: 1 / 0)
                for _ in range(bad):
                    node.tick()
        node.tick()
    peer.wait(lambda: len(log.of('state')) == 2)
    assert [event['tick'] for event in log.of('start')] == starts
    assert [event['tick'] for event in log.of('go_back')] == bad * [70]
    code, said, _ = replayed(capsys, log.write(tmp_path / 'bag'))
    hashes = 2 + len(starts)
    assert code == 0 and '200 ticks' in said and f'{hashes} of {hashes}' in said


def test_a_run_is_published_again(make_node, peer, log, tmp_path, nothing_runs_on):
    node = make_node()
    peer.wait_heard(node, EVENTS, SCENE)
    for number in range(HASH_INTERVAL):
        if number % 30 == 0:
            push(node, number)
        node.tick()
    last = node.simulation.state.positions
    peer.wait(lambda: log.of('state'))
    bag = log.write(tmp_path / 'bag')
    node.destroy_node()
    poses = peer.collect(PoseArray, '/ragdoll/poses')
    for pace in ('0.2', '0.05', '0.02'):  # slower, if a busy machine found the topic too late
        process = started('-m', 'ragdoll_ros.replay.command', bag, '--publish', '--pace', pace)
        peer.wait(lambda process=process: process.poll() is not None)
        assert process.returncode == 0 and '2 of 2 hashes equal' in process.stdout.read()
        for _ in range(1000):  # what has come is still to be taken
            peer.executor_.spin_once(timeout_sec=0.001)
        if poses and at(poses[-1], last):
            break
    assert at(poses[-1], last)


def at(heard, positions):
    """Whether a message has just these positions."""
    return [(p.position.x, p.position.y, p.position.z) for p in heard[1].poses] == [
        tuple(row) for row in positions.tolist()]


def started(*words):
    """Start Python with these words as a process of this test's domain."""
    here = str(Path(__file__).parent)
    STARTED.append(subprocess.Popen(
        [sys.executable, *map(str, words)], stdout=subprocess.PIPE, stdin=subprocess.DEVNULL,
        text=True, start_new_session=True, pass_fds=[lock.fileno() for lock in LOCKS],
        env={**os.environ, 'PYTHONPATH': os.pathsep.join([here, os.environ['PYTHONPATH']])}))
    return STARTED[-1]


@pytest.mark.slow
def test_a_node_that_is_killed_leaves_a_run_that_is_repeated(peer, log, tmp_path, capsys,
                                                             nothing_runs_on):
    """5 000 ticks with 50 pushes, recorded by a second process; the node ends by SIGKILL."""
    folder = tmp_path / 'bag'
    recorder = started(Path(__file__).parent / 'recorder.py', folder)
    os.set_blocking(recorder.stdout.fileno(), False)
    node = start('node', '--ros-args', '-p', 'real_time_factor:=10.0', compiled=True)
    force = peer.sender(Wrench, 'ragdoll/force')
    twist, stamped = peer.sender(Twist, 'cmd_vel'), peer.sender(WrenchStamped, 'ragdoll/push')
    hand = peer.sender(InteractiveMarkerFeedback, 'ragdoll/interactive/feedback')
    for number in range(50):
        values = vector(400 * math.sin(number), 400 * math.cos(number), 100 / (number + 1))
        wrench = Wrench(force=values)
        (lambda wrench=wrench: force.publish(wrench),
         lambda number=number: twist.publish(Twist(linear=vector(0.2 * math.sin(number)))),
         lambda wrench=wrench: stamped.publish(WrenchStamped(
             header=Header(frame_id='left_shin'), wrench=wrench)))[number % 3]()
        if number == 10:
            answer = peer.call(SetParameters, 'ragdoll/set_parameters', SetParameters.Request(
                parameters=[Parameter('rate', value=150.0).to_parameter_msg()]))
            assert answer.results[0].successful
        elif number == 20:
            hand.publish(feedback('head', InteractiveMarkerFeedback.MOUSE_DOWN, (0.0, 0.0, 0.5)))
        elif number == 22:
            hand.publish(feedback('head', InteractiveMarkerFeedback.POSE_UPDATE, (0.5, 0.1, 1.5)))
        elif number == 24:
            hand.publish(feedback('head', InteractiveMarkerFeedback.MOUSE_UP))
        elif number == 30:
            peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True))
            peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=False))
        elif number == 40:
            peer.call(Trigger, 'ragdoll/reset', Trigger.Request())
        peer.wait(lambda number=number: len(log.of('push') + log.of('drive')) > number)
        due = 100 * (number + 1)
        peer.wait(lambda due=due: log.events[-1]['tick'] >= due)
    force.publish(Wrench(force=vector(200)))
    peer.wait(lambda: len(log.of('push') + log.of('drive')) > 50)
    kill(node)
    heard = log.events[-1]['number']
    numbers = []
    peer.wait(lambda: numbers.extend(map(int, (recorder.stdout.read() or '').split()))
              or (numbers and numbers[-1] >= heard))
    recorder.send_signal(signal.SIGTERM)
    assert recorder.wait(timeout=20) == 0
    file, = folder.glob('*.mcap')
    code, said, warned = replayed(capsys, folder)
    assert (code, warned) == (0, '')
    assert int(said.split(' ticks')[0].split()[-1]) >= 5000
    equal, of = said.split(' repeated, ')[1].split(' hashes')[0].split(' of ')
    assert equal == of and int(of) >= 50 and len(log.of('push') + log.of('drive')) == 51
    torn = tmp_path / 'torn.mcap'
    torn.write_bytes(file.read_bytes()[:file.stat().st_size // 2])
    code, said, warned = replayed(capsys, torn)
    equal, torn_of = said.split(' repeated, ')[1].split(' hashes')[0].split(' of ')
    assert code == 0 and 'is truncated' in warned and equal == torn_of
    assert 10 < int(torn_of) < int(of)
