"""Records all Strings of a node into a bag, in a process of its own; says each event's number.

python test/recorder.py FOLDER
"""
from __future__ import annotations

import json
import sys
from pathlib import Path

import rclpy
from bags import BagWriter
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from ragdoll_ros.ros.process.rclpy_context import rclpy_context

PAST = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TOPICS = ('/ragdoll/scene', '/ragdoll/events')


def main() -> None:
    """Record until SIGINT or SIGTERM."""
    with BagWriter(Path(sys.argv[1])) as bag, rclpy_context([]):
        node = Node('recorder')
        for topic in TOPICS:
            node.create_subscription(String, topic, lambda message, topic=topic: take(
                bag, topic, message.data), PAST)
        rclpy.spin(node)


def take(bag: BagWriter, topic: str, text: str) -> None:
    """Write what comes, and say how far it is."""
    bag.write(topic, text)
    if topic.endswith('events'):
        print(json.loads(text)['number'], flush=True)


if __name__ == '__main__':
    main()
