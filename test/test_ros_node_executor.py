"""The node's executor: every tick on time, messages before the next, services in between."""
from __future__ import annotations

import threading

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray, Vector3, Wrench
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from ragdoll_ros.ros.process.node_executor import NodeExecutor


@pytest.fixture
def node(make_node, monkeypatch):
    """A node that a thread spins, which counts what rclpy's executor does."""
    node = make_node(scene='flight')
    node.rclpy_spins, rclpys = 0, SingleThreadedExecutor.spin_once
    executor, ended, errors = NodeExecutor(node.ticker), threading.Event(), []

    def spin_once(self, timeout_sec=None):
        node.rclpy_spins += self is executor
        rclpys(self, timeout_sec)

    def spin():
        try:
            while not ended.is_set():
                executor.spin_once(0.1)
        except Exception as error:
            errors.append(error)

    monkeypatch.setattr(SingleThreadedExecutor, 'spin_once', spin_once)
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
    begin, spins = node.simulation.time, node.rclpy_spins
    peer.wait(lambda: len(got) > 200)
    ticks = (node.simulation.time - begin) / node.simulation.tick
    stamps = [message.header.stamp.sec * 10 ** 9 + message.header.stamp.nanosec
              for _, message in got]
    assert np.median(np.diff(stamps)) == node.simulation.tick
    # One in ten is when services are polled; rclpy's executor spins some three times at each.
    assert node.rclpy_spins - spins < 0.7 * ticks


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
    node.pause(True)
    time = node.simulation.time
    assert peer.call(Trigger, 'ragdoll/step', Trigger.Request()).success
    assert node.simulation.time == time + node.simulation.tick
