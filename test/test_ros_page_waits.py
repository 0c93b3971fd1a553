"""What the page asks of a node that is not discovered yet waits for it."""
from __future__ import annotations

import pytest

pytest.importorskip('viser')
import rclpy
from peer import Peer
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from ragdoll_ros.viewer.sources.node import services
from ragdoll_ros.viewer.sources.node.motors import StrengthPublisher
from ragdoll_ros.viewer.sources.node.services import NodeServices


@pytest.fixture
def page(ros):
    node = rclpy.create_node('page')
    yield node
    node.destroy_node()


@pytest.fixture
def listener(ros):
    node = Peer('listener')
    yield node
    node.destroy_node()


def test_a_strength_waits_for_the_subscription(page, listener):
    publisher = StrengthPublisher(page, 'ragdoll')
    for strength in (0.7, 0.2):
        publisher.send(strength)
    heard = listener.collect(Float64, 'ragdoll/motor_strength')
    listener.wait(lambda: publisher.retry() or heard)
    publisher.retry()
    publisher.send(0.4)
    listener.wait(lambda: len(heard) > 1)
    assert [message.data for _, message in heard] == [0.2, 0.4]


def serve(listener, name, called):
    listener.create_service(Trigger, f'ragdoll/{name}',
                            lambda _, response: called.append(name) or response)


def test_a_trigger_waits_for_its_service(page, listener):
    asked, called = NodeServices(page, 'ragdoll'), []
    asked.trigger('reset')
    asked.trigger('reset')
    serve(listener, 'reset', called)
    listener.wait(lambda: asked.retry() or called)
    asked.retry()
    asked.trigger('reset')
    listener.wait(lambda: len(called) > 1)
    assert called == ['reset', 'reset'], 'two that wait are one'


def test_a_trigger_does_not_wait_for_ever(page, listener, monkeypatch):
    asked, called = NodeServices(page, 'ragdoll'), []
    monkeypatch.setattr(services, 'PATIENCE', -1.0)
    asked.trigger('reset')
    asked.retry()
    serve(listener, 'reset', called)
    serve(listener, 'step', called)
    asked.trigger('step')
    monkeypatch.setattr(services, 'PATIENCE', 60.0)
    listener.wait(lambda: asked.retry() or called)
    assert called == ['step']
