"""Listeners that come at random instants, with each durability: what they hear first."""
from __future__ import annotations

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from rclpy.qos import DurabilityPolicy, QoSProfile

TOPICS = {'ragdoll/poses': PoseArray, 'ragdoll/measures': DiagnosticArray,
          'ragdoll/swings': PoseArray}
"""Those that late listeners get something of."""

HISTORY = 50
"""Messages of such a topic that late listeners get while others listen, too."""

SECOND = 1_000_000_000


def stamps(got):
    """Of messages, ns."""
    return [message.header.stamp.sec * SECOND + message.header.stamp.nanosec for _, message in got]


class Listeners:
    """Of one topic of a node in this process."""

    def __init__(self, node, peer, topic, durability):
        self.publisher_of = lambda: next(
            each for each in node.publishers if each.topic_name == f'/{topic}')
        self._peer, self._topic = peer, topic
        self._qos = QoSProfile(depth=100, durability=durability)
        self.subscriptions = []

    def come(self):
        """Another one; the list that its messages go to."""
        got = self._peer.collect(TOPICS[self._topic], self._topic, self._qos)
        self.subscriptions.append(list(self._peer.subscriptions)[-1])
        self._await_count()
        return got

    def go(self):
        """Of one, if there is any."""
        if self.subscriptions:
            self._peer.destroy_subscription(self.subscriptions.pop())
            self._await_count()

    def _await_count(self):
        self._peer.wait(lambda: self.publisher_of().get_subscription_count()
                        == len(self.subscriptions))


@pytest.mark.parametrize('durability', [DurabilityPolicy.TRANSIENT_LOCAL,
                                        DurabilityPolicy.VOLATILE], ids=['latched', 'volatile'])
@pytest.mark.parametrize('topic', TOPICS)
def test_who_comes_at_any_instant_gets_the_present(make_node, peer, topic, durability):
    """At 20 random instants, running or paused, after others that came, went or still listen.

    The first message is at most one tick old, and a latched one comes without a further tick. Where
    others heard the last tick, latched listeners first get the last fifty messages, which end
    at the present.
    """
    rng, node = np.random.default_rng(37), make_node(scene='ponytail')
    others = Listeners(node, peer, topic, durability)
    latched, seen, accompanied = durability is DurabilityPolicy.TRANSIENT_LOCAL, set(), False
    made = [node.stamp]

    def tick():
        node.tick()
        made.append(node.stamp)

    for _ in range(20):
        for act in rng.choice(['tick'] * 4 + ['pause', 'come', 'go'], size=rng.integers(8)):
            if act == 'tick' and not node.paused:
                accompanied = bool(others.subscriptions)
                tick()
            elif act == 'pause':
                node.pause(not node.paused)
            elif act == 'come' and len(others.subscriptions) < 3:
                others.come()
            elif act == 'go':
                others.go()
        seen.add((node.paused, accompanied))
        got = others.come()
        if not (latched and (node.paused or accompanied)):
            if node.paused:
                node.pause(False)
            accompanied = False
            tick()
        peer.wait(lambda got=got: made[-1] in stamps(got))
        age = made[::-1].index(stamps(got)[0])
        assert age <= (HISTORY - 1 if latched and accompanied else 1), 'ticks'
        assert stamps(got)[-1] == made[-1]
        others.go()
    assert len(seen) == 4, 'all kinds of instants'
