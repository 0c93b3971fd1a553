"""The node's executor: every tick on time, messages before the next, services in between."""
from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray, Vector3, Wrench
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from ragdoll_ros.ros.process.node_executor import NodeExecutor


@pytest.fixture
def node(make_node, monkeypatch):
    """A node that a thread spins, which counts what rclpy's executor does."""
    node = make_node(scene='flight')
    node.polls, rclpys = 0, SingleThreadedExecutor.wait_for_ready_callbacks
    executor, ended, errors = NodeExecutor(node.ticker), threading.Event(), []

    def wait_for_ready_callbacks(self, *arguments):
        node.polls += self is executor
        return rclpys(self, *arguments)

    def spin():
        try:
            while not ended.is_set():
                executor.spin_once(0.1)
        except Exception as error:
            errors.append(error)

    monkeypatch.setattr(SingleThreadedExecutor, 'wait_for_ready_callbacks',
                        wait_for_ready_callbacks)
    executor.add_node(node)
    thread = threading.Thread(target=spin)
    thread.start()
    yield node
    ended.set()
    thread.join()
    executor.shutdown()
    assert not errors


def test_ticks_are_on_time_and_few_go_through_rclpys_executor(node, peer):
    got = peer.collect(PoseArray, 'ragdoll/poses')
    peer.wait(lambda: got)

    def on_time_with_few_polls():
        """Whether 200 ticks are; if others take the machine's time away, the next 200 may be."""
        begin, polls, count = node.simulation.time, node.polls, len(got)
        peer.wait(lambda: len(got) > count + 200)
        ticks = (node.simulation.time - begin) / node.simulation.tick
        stamps = [message.header.stamp.sec * 10 ** 9 + message.header.stamp.nanosec
                  for _, message in got[count:]]
        # After one in ten the services are polled, once unless one is called.
        return (np.median(np.diff(stamps)) == node.simulation.tick
                and node.polls - polls < 0.2 * ticks)

    peer.wait(on_time_with_few_polls)


def test_messages_act_at_the_next_tick(node, peer):
    """All of several that come within one."""
    sender = peer.sender(Wrench, 'ragdoll/force')
    pushes = []
    take = node.inputs.on_force

    def on_force(message):
        pushes.append((node.simulation.time, message.force.x))
        take(message)

    for subscription in node.subscriptions:
        if subscription.topic_name == '/ragdoll/force':
            subscription.callback = on_force
    for number in range(1, 6):
        sender.publish(Wrench(force=Vector3(x=float(number))))
    peer.wait(lambda: len(pushes) == 5)
    assert [force for _, force in pushes] == [1.0, 2.0, 3.0, 4.0, 5.0]
    peer.wait(lambda: node.simulation.state.linear_velocities[0, 0] > 0)


def test_services_answer_while_it_ticks_and_while_it_is_paused(node, peer):
    assert peer.call(Trigger, 'ragdoll/reset', Trigger.Request()).success
    peer.wait(lambda: node.simulation.time > 0)
    # By its service: where this thread paused it, a tick could still be under way.
    assert peer.call(SetBool, 'ragdoll/pause', SetBool.Request(data=True)).success
    before = node.simulation.time
    assert peer.call(Trigger, 'ragdoll/step', Trigger.Request()).success
    assert node.simulation.time == before + node.simulation.tick


def test_services_answer_between_ticks_that_are_seconds_apart(node, peer):
    """A tick is due every 10 s: an answer comes sooner than the next."""
    set_factor = SetParametersAtomically.Request(
        parameters=[Parameter('real_time_factor', value=0.001).to_parameter_msg()])
    assert peer.call(SetParametersAtomically, 'ragdoll/set_parameters_atomically',
                     set_factor).result.successful
    assert peer.call(Trigger, 'ragdoll/reset', Trigger.Request()).success  # now it is found
    begin = time.monotonic()
    for _ in range(3):
        assert peer.call(Trigger, 'ragdoll/reset', Trigger.Request()).success
    assert time.monotonic() - begin < 9
    assert node.simulation.time == 0
