"""Random messages, parameters and calls in random order, up to a thousand a second."""
from __future__ import annotations

import itertools
import math
import os
import random
import signal
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, PoseArray, Twist, Vector3, Wrench, WrenchStamped
from peer import end, start
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Header
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback

NUMBERS = (0.0, -0.0, 1.0, -3.0, 50.0, 2000.0, 1e9, -1e300, 5e-324, math.nan, math.inf, -math.inf)
NAMES = ('torso', 'head', 'left_shin', 'doll_3/head', 'tail', '', 'world', '/world', 'ä' * 300)
SCENES = ('drop', 'crowd', 'flight', 'article', '/nowhere', '')
ENGINES = ('rigid', 'bullet', 'auto', 'steam')
ACCURACIES = ('draft', 'normal', 'exact', '?')
PARAMETERS = {
    'scene': SCENES, 'rate': (100.0, 50, 240.0, 1000.0, -1.0, math.nan, 'fast', 2),
    'real_time_factor': (1.0, 0.5, 4, 0.0, math.inf), 'accuracy': ACCURACIES,
    'engine': ENGINES, 'workers': (0, 1, 2, -1, 10 ** 12, 1.5),
    'frame_id': ('world', 'map', '', 'torso', '/map'), 'publish_clock': (True, False, 1),
    'publish_tf': ('all', 'none', 'some'), 'pushed_bone': NAMES, 'max_force': NUMBERS,
    'push_timeout': NUMBERS, 'dump_directory': ('/nowhere', 7), 'bone_names': (['a'], 'a'),
    'no_such': (1, 'a')}
MOST_CALLS = 10
"""Calls that wait for an answer at once."""

FLAT = 8.0
"""MB by which the least memory of the second half may exceed that of the first, once all scenes
were there with all engines and accuracies: the allocator keeps some. The least, as a scene that is
being loaded takes memory beside the present one. A leak of 10 kB at each of ten thousand inputs
would be 50."""


class Sender:
    """All that sends something to the node, at random."""

    def __init__(self, peer, seed):
        self.peer, self.random, self.calls = peer, random.Random(seed), []
        self.topics = [peer.sender(kind, topic) for kind, topic in (
            (Wrench, '/ragdoll/force'), (Twist, '/cmd_vel'), (WrenchStamped, '/ragdoll/push'),
            (InteractiveMarkerFeedback, '/ragdoll/interactive/feedback'))]
        self.services = {name: peer.create_client(kind, f'ragdoll/{name}') for name, kind in (
            ('reset', Trigger), ('step', Trigger), ('go_limp', Trigger), ('pause', SetBool),
            ('set_parameters', SetParameters))}
        for client in self.services.values():
            peer.wait(client.service_is_ready)

    def send(self):
        """One message, or one call."""
        if self.random.random() < 0.8:
            number = self.random.randrange(len(self.topics))
            make = (self.wrench, self.twist, self.push, self.feedback)[number]
            self.topics[number].publish(make())
        else:
            name = self.random.choice([*self.services])
            self.calls.append(self.services[name].call_async(self.request(name)))
            self.calls = [call for call in self.calls if not call.done()]
            self.peer.wait(lambda: sum(not call.done() for call in self.calls) < MOST_CALLS)

    def vector(self, kind=Vector3):
        return kind(**{axis: self.random.choice(NUMBERS) if self.random.random() < 0.5 else
                       self.random.gauss(0, 300) for axis in 'xyz'})

    def wrench(self):
        return Wrench(force=self.vector(), torque=self.vector())

    def twist(self):
        return Twist(linear=self.vector(), angular=self.vector())

    def push(self):
        return WrenchStamped(header=Header(frame_id=self.random.choice(NAMES)),
                             wrench=self.wrench())

    def feedback(self):
        pose = Pose(position=self.vector(Point))
        pose.orientation.w = self.random.choice(NUMBERS)
        return InteractiveMarkerFeedback(
            header=Header(frame_id='world'), client_id=self.random.choice('abcdef'),
            marker_name=self.random.choice(NAMES), event_type=self.random.randrange(7),
            pose=pose, mouse_point=self.vector(Point),
            mouse_point_valid=self.random.random() < 0.5)

    def request(self, name):
        if name == 'pause':
            return SetBool.Request(data=self.random.random() < 0.3)
        if name != 'set_parameters':
            return Trigger.Request()
        wanted = self.random.sample([*PARAMETERS], self.random.randint(1, 2))
        return SetParameters.Request(parameters=[
            Parameter(each, value=self.random.choice(PARAMETERS[each])).to_parameter_msg()
            for each in wanted])


def megabytes(process):
    """Memory of a process."""
    pages = int(Path(f'/proc/{process.pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


def visit_all(peer):
    """Load all scenes with all engines and accuracies, twice: one beside the other."""
    for values in 2 * list(itertools.product(SCENES[:4], ENGINES[:2], ACCURACIES[:3])):
        parameters = [Parameter(name, value=value).to_parameter_msg()
                      for name, value in zip(('scene', 'engine', 'accuracy'), values, strict=True)]
        peer.call(SetParameters, 'ragdoll/set_parameters', SetParameters.Request(
            parameters=parameters))


@pytest.mark.parametrize('count', [500, pytest.param(10_000, marks=pytest.mark.slow)])
def test_nothing_that_is_sent_harms_the_node(peer, nothing_runs_on, monkeypatch, count):
    # Else each thread that loads a scene or simulates has memory of its own, and keeps it.
    monkeypatch.setenv('MALLOC_ARENA_MAX', '1')
    # Nobody reads what it logs until it ends: errors alone fit into the pipe.
    process = start('node', '--ros-args', '--log-level', 'ERROR', compiled=True)
    worst = [0.0]

    def finite(numbers):
        worst[0] = max(worst[0], float(np.abs(numbers).max(initial=0.0)))
        if not np.isfinite(numbers).all():
            worst[0] = math.inf

    peer.create_subscription(PoseArray, 'ragdoll/poses', lambda message: finite(
        [[p.position.x, p.position.y, p.position.z, p.orientation.x, p.orientation.y,
          p.orientation.z, p.orientation.w] for p in message.poses]), QoSProfile(depth=10))
    peer.create_subscription(MultiDOFJointState, 'ragdoll/state', lambda message: finite(
        [[t.linear.x, t.linear.y, t.linear.z, t.angular.x, t.angular.y, t.angular.z]
         for t in message.twist]), QoSProfile(depth=10))
    sender = Sender(peer, count)
    if count > 1000:
        visit_all(peer)
    grown = []
    for number in range(1, count + 1):
        sender.send()
        peer.executor_.spin_once(timeout_sec=0.001)
        if number % (count // 50) == 0:
            grown.append(round(megabytes(process), 1))
            assert process.poll() is None, process.stderr.read()
    peer.wait(lambda: all(call.done() for call in sender.calls))
    answer = peer.call(SetParameters, 'ragdoll/set_parameters', SetParameters.Request(
        parameters=[Parameter('scene', value='drop').to_parameter_msg()]))
    assert answer.results[0].successful
    assert 0 < worst[0] < 1e6, 'm, m/s, rad/s'
    code, _ = end(process, signal.SIGINT)
    assert code == 0 and 'Traceback' not in process.stderr_text
    print('MB after each fiftieth:', *grown)
    if count > 1000:
        assert min(grown[25:]) - min(grown[:25]) < FLAT, grown
