"""Topic statistics of PoseArrays: message rate, bandwidth and spacing."""
from __future__ import annotations

import argparse
import sys
import time

import numpy as np
import rclpy
from geometry_msgs.msg import PoseArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from ..process.rclpy_context import rclpy_context

TOPIC = '/ragdoll/poses'

SKIPPED = 10
"""First messages of each topic that are not counted: discovery bunches them."""

EXAMPLE = """examples:
  python -m ragdoll_ros.ros.tools.listen
  python -m ragdoll_ros.ros.tools.listen --seconds 10 /east/ragdoll/poses /west/ragdoll/poses
"""


class TopicStatistics:
    """Arrival times and sizes of the messages on a topic."""

    def __init__(self, node: Node, topic: str) -> None:
        self.topic = topic
        self.arrivals: list[int] = []
        """ns of the steady clock."""
        self.bytes = 0
        node.create_subscription(PoseArray, topic, self._on_message, 100, raw=True)

    def _on_message(self, data: bytes) -> None:
        self.arrivals.append(time.monotonic_ns())
        self.bytes += len(data)

    def line(self) -> str:
        """Rate, size, bandwidth and spacing as text."""
        counted = self.arrivals[SKIPPED:]
        if len(counted) < 2:
            return f'{self.topic}: {len(self.arrivals)} messages'
        gaps = np.diff(counted) / 1e6
        rate = 1e3 / gaps.mean()
        return (f'{self.topic}: {rate:.1f} messages/s of {self.bytes // len(self.arrivals)} bytes, '
                f'{rate * self.bytes / len(self.arrivals) / 1e6:.2f} MB/s; between them '
                f'p50 {np.median(gaps):.2f} ms, p99 {np.percentile(gaps, 99):.2f} ms, '
                f'at the most {gaps.max():.1f} ms')


def main(arguments: list[str] | None = None) -> int:
    """Wait for a message of every topic, then listen for ``--seconds``, and print a line
    for each.
    """
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.tools.listen', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('topics', nargs='*', default=[TOPIC], help=f'topics (default: {TOPIC})')
    parser.add_argument('--seconds', type=float, default=5.0,
                        help='duration, s (default: %(default)s)')
    options = parser.parse_args(remove_ros_args(arguments)[1:])
    with rclpy_context(arguments), SingleThreadedExecutor() as executor:
        node = Node('listen')
        executor.add_node(node)
        statistics = [TopicStatistics(node, topic) for topic in options.topics]
        while rclpy.ok() and not all(each.arrivals for each in statistics):
            executor.spin_once(timeout_sec=1.0)
        end = time.monotonic() + options.seconds
        while rclpy.ok() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.1)
        print('\n'.join(each.line() for each in statistics), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
