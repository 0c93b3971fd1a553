"""Keyboard teleoperation: the arrow keys push the doll.

You look at the doll's face, from +x along -x: Up pushes it away from you, Down toward you, Left and
Right as you see them. A push is 2000 N: a tap gives the doll about 1 m/s.
A held key brings the doll to a top speed, 3 m/s by default, which + and - change; with --force, and
in the scene `article`, it pushes with 2000 N until its release. Pushes of several keys add up.
Space pauses and resumes, r resets, q quits.
"""
from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable

import numpy as np
import rclpy
from geometry_msgs.msg import Vector3, Wrench
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from rclpy.validate_topic_name import validate_topic_name
from std_srvs.srv import SetBool, Trigger

from ...model.vectors import Vector
from ...realtime.arrow_keys import ARTICLE, DIRECTIONS, TAP, HeldKeys, total_force
from ...realtime.speed_limit import RESPONSE_TIME, TOP_SPEED, TOP_SPEEDS, SpeedLimit
from ..process.rclpy_context import rclpy_context
from .doll_motion import DollMotion
from .status_line import StatusLine
from .terminal_keys import Keyboard

PERIOD = 0.02
"""s between two messages of a held key, well below the node's push_timeout."""

CALLBACKS = 4
"""Callbacks per PERIOD: two states and, now and then, a report."""

LINE_PERIOD = 0.1
"""s between two status lines."""

GRAPH_PERIOD = 0.5
"""s between two checks of the ROS graph."""

TOPIC_TYPES = {'/poses': 'geometry_msgs/msg/PoseArray', '/force': 'geometry_msgs/msg/Wrench'}
"""Topics by which a ragdoll node is recognized, relative to its name."""

SPEED_STEP = 0.5
"""m/s by which + and - change the top speed."""

HELP = 'arrows push: tap or hold | + - top speed | space pauses | r resets | q quits'

EXAMPLE = """examples:
  ragdoll_teleop
  ragdoll_teleop /stage/doll
  ragdoll_teleop --top-speed 1.5
  ragdoll_teleop --ros-args -r __ns:=/stage
"""


class NodeFinder:
    """The fully qualified ``name`` of a ragdoll node.

    ``requested``: the name the user gave; '': ``ragdoll``, or the only other ragdoll node if that
    is not there. Raises rclpy's InvalidTopicNameException for an invalid name.
    """

    def __init__(self, node: Node, requested: str) -> None:
        self._node, self._fixed = node, bool(requested)
        validate_topic_name(requested or 'ragdoll')
        self.name = node.resolve_topic_name(requested or 'ragdoll')
        self.problem = ''
        """Why no node can be chosen."""
        self._found: list[str] = []

    def update(self) -> bool:
        """Check the ROS graph; to be called periodically. Returns whether ``name`` has changed."""
        self.problem = ''
        if self._fixed or self._exists(self.name):
            return False
        # Discovery takes time: a result counts when the next check confirms it.
        before, self._found = self._found, self._ragdoll_nodes()
        found = self._found
        if len(found) > 1:
            self.problem = (f'several nodes: {", ".join(found)}; choose one: '
                            f'ragdoll_teleop {found[0]}')
        if len(found) != 1 or found != before:
            return False
        self.name = found[0]
        return True

    def _ragdoll_nodes(self) -> list[str]:
        types = dict(self._node.get_topic_names_and_types())
        names = (topic[:-len('/poses')] for topic in sorted(types) if topic.endswith('/poses'))
        return [name for name in names if self._exists(name)
                and all(kind in types.get(name + end, ()) for end, kind in TOPIC_TYPES.items())]

    def _exists(self, name: str) -> bool:
        return self._node.count_publishers(f'{name}/poses') > 0


class Teleop(Node):
    """Publishes pushes to a ragdoll node and calls its services; ``requested``: see NodeFinder.

    ``top_speed``: m/s that a held key brings the doll to; None: a held key pushes with full force.
    """

    def __init__(self, requested: str = '', top_speed: float | None = TOP_SPEED) -> None:
        super().__init__('ragdoll_teleop')
        self.top_speed, self._limit = top_speed, SpeedLimit(2 * PERIOD)
        self._news = ''
        """What the next status line tells besides."""
        self._finder = NodeFinder(self, requested)
        self.held_keys = HeldKeys()
        self._pushing = False
        self._connect(self._finder.name)

    def update_node(self) -> None:
        """Connect to another node if the current one is gone."""
        if self._finder.update():
            for subscription in (*self.status.subscriptions, self._motion.subscription):
                self.destroy_subscription(subscription)
            self.destroy_publisher(self._force)
            for client in (self._reset, self._pause):
                self.destroy_client(client)
            self._connect(self._finder.name)

    def on_key(self, key: str, down: bool, now: float) -> bool:
        """Handle a key that went down or up; False to quit."""
        if key in DIRECTIONS:
            self.held_keys.tap = TAP / self.status.real_time_factor
            self.held_keys.on_key(key, down, now)
        elif key == ' ':
            self._pause.call_async(SetBool.Request(data=not self.status.paused))
        elif key in '+-' and self.top_speed is not None:
            step = SPEED_STEP if key == '+' else -SPEED_STEP
            self.top_speed = min(max(self.top_speed + step, TOP_SPEEDS[0]), TOP_SPEEDS[1])
            self._news = f'top speed {self.top_speed:g} m/s'
        elif key in 'rR':
            self._limit.clear()
            self._reset.call_async(Trigger.Request())
        return key not in 'qQ'

    def resume(self) -> bool:
        """Resume the node; False if its service is not available."""
        if not self._pause.service_is_ready():
            return False
        self._pause.call_async(SetBool.Request(data=False))
        return True

    def publish_force(self, now: float) -> str:
        """Publish the force of the active keys, and zero once after them. Returns it as text."""
        keys = self.held_keys.active(now)
        force = total_force(keys)
        if self.held_keys.is_held:
            force = self._limited(force)
        if keys or self._pushing:
            x, y, z = force
            self._force.publish(Wrench(force=Vector3(x=x, y=y, z=z)))
        self._pushing = bool(keys)
        return '({} {} {}) N'.format(*map(round, force)) if keys else ''

    def _limited(self, force: Vector) -> Vector:
        """The part of a held key's force (3,) N that brings the doll to the top speed."""
        motion, length = self._motion, float(np.linalg.norm(force))
        if self.top_speed is None or not length or not motion.mass or motion.scene == ARTICLE:
            return force
        unit, time = np.array(force) / length, self.status.time
        left = self._limit.impulse(unit, self.top_speed - motion.speed(unit), motion.mass, time)
        limited = min(length, left / RESPONSE_TIME) * unit
        if not self.status.paused:
            self._limit.sent(limited, time, self.status.real_time_factor)
        return tuple(limited.tolist())

    def next_publish(self, now: float) -> float:
        """Time until the next force is due, s."""
        return min(PERIOD, self.held_keys.remaining(now)) if self._pushing else PERIOD

    def status_text(self, push: str) -> str:
        """The status line with the active push, or why no node can be chosen."""
        news, self._news = self._news, ''
        return self._finder.problem or self.status.text(news or push)

    def _connect(self, name: str) -> None:
        """Create publishers and clients for the node of a fully qualified name."""
        self.status = StatusLine(self, name)
        self._motion = DollMotion(self, name, lambda: self.status.state)
        self._force = self.create_publisher(Wrench, f'{name}/force', 10)
        self._reset = self.create_client(Trigger, f'{name}/reset')
        self._pause = self.create_client(SetBool, f'{name}/pause')


def spin_with_keyboard(teleop: Teleop, keep_running: Callable[[], bool] = lambda: True) -> None:
    """Spin until q, a shutdown of rclpy, or ``keep_running``, called each turn, returns False."""
    next_line = next_graph = 0.0
    pushed = ''
    with SingleThreadedExecutor() as executor, Keyboard() as keyboard:
        executor.add_node(teleop)
        while rclpy.ok() and keep_running():
            keys = keyboard.keys(teleop.next_publish(time.monotonic()))
            now = time.monotonic()
            if not all(teleop.on_key(key, down, now) for key, down in keys):
                break
            # A tap may end before the next line, which shows it nevertheless.
            pushed = teleop.publish_force(now) or pushed
            if now >= next_graph:
                next_graph = now + GRAPH_PERIOD
                teleop.update_node()
            if now >= next_line:
                next_line = now + LINE_PERIOD
                show(teleop.status_text(pushed))
                pushed = ''
            for _ in range(CALLBACKS):
                executor.spin_once(timeout_sec=0)
    print()


def show(line: str) -> None:
    """Overwrite the current line of the terminal, cut to its width."""
    width = shutil.get_terminal_size().columns
    sys.stdout.write(f'\r{line[:width - 1]}\x1b[K')
    sys.stdout.flush()


def show_line(line: str) -> None:
    """Print a whole line above the status line, on as many rows as it takes."""
    sys.stdout.write(f'\r\x1b[K{line}\n')
    sys.stdout.flush()


def main(arguments: list[str] | None = None) -> int:
    """Steer a running node until q. Returns 2 without a terminal or for an invalid name."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'ragdoll_teleop', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('node', nargs='?', default='',
                        help='name of the node (default: ragdoll, or the only ragdoll node)')
    parser.add_argument('--top-speed', type=float, default=TOP_SPEED, metavar='M_S',
                        help='speed, m/s, to which a held key accelerates the doll '
                        f'({TOP_SPEED:g})')
    parser.add_argument('--force', action='store_true',
                        help='a held key pushes with 2000 N until its release, to any speed')
    options = parser.parse_args(remove_ros_args(arguments)[1:])
    lowest, highest = TOP_SPEEDS
    if not lowest <= options.top_speed <= highest:
        parser.error(f'--top-speed {options.top_speed:g}: expected {lowest:g} to {highest:g}')
    if not sys.stdin.isatty():
        print('ragdoll_teleop: standard input is not a terminal', file=sys.stderr)
        return 2
    with rclpy_context(arguments):
        try:
            teleop = Teleop(options.node, None if options.force else options.top_speed)
        except InvalidTopicNameException as error:
            print(f'ragdoll_teleop: {error}', file=sys.stderr)
            return 2
        print(HELP)
        spin_with_keyboard(teleop)
    return 0


if __name__ == '__main__':
    sys.exit(main())
