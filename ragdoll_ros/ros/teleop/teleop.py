"""Arrow keys push the doll: Up away from you, Down toward you, Left and Right as you see it.

You look at the doll's face, from +x along -x. A push is 2000 N: a tap gives the doll about 1 m/s, a
held key pushes on, and keys add up, as far as the terminal can tell. Space pauses and goes on, r
resets, q quits.
"""
from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable

import rclpy
from geometry_msgs.msg import Vector3, Wrench
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from std_srvs.srv import SetBool, Trigger

from ...realtime.arrow_keys import DIRECTIONS, TAP, Held, total
from ..rclpy_context import ros_session
from .find_node import Followed
from .status_line import Status
from .terminal_keys import Keyboard

PERIOD = 0.02
"""s between two messages of a held push, well within the node's push_timeout."""

MESSAGES = 4
"""Messages that are taken in each PERIOD: two states and, now and then, a report."""

LINE_PERIOD = 0.1
"""s between two status lines."""

LOOK_PERIOD = 0.5
"""s between two looks at which nodes there are."""

HELP = 'arrows push: tap or hold | space pauses | r resets | q quits'

EXAMPLE = """examples:
  ragdoll_teleop
  ragdoll_teleop /stage/doll
  ragdoll_teleop --ros-args -r __ns:=/stage
"""


class Teleop(Node):
    """Sends pushes to the node that it follows, and calls its services; ``asked``: see Followed."""

    def __init__(self, asked: str = '') -> None:
        super().__init__('ragdoll_teleop')
        self._followed = Followed(self, asked)
        self.held = Held()
        self._pushing = False
        self._take_up(self._followed.name)

    def look_around(self) -> None:
        """Follow another node, if the one that was steered is not there."""
        if self._followed.look():
            for subscription in self.status.subscriptions:
                self.destroy_subscription(subscription)
            self.destroy_publisher(self._force)
            for client in (self._reset, self._pause):
                self.destroy_client(client)
            self._take_up(self._followed.name)

    def take(self, key: str, down: bool, now: float) -> bool:
        """Do what a key says; False to quit."""
        if key in DIRECTIONS:
            self.held.tap = TAP / self.status.pace
            self.held.take(key, down, now)
        elif key == ' ':
            self._pause.call_async(SetBool.Request(data=not self.status.paused))
        elif key in 'rR':
            self._reset.call_async(Trigger.Request())
        return key not in 'qQ'

    def go_on(self) -> bool:
        """Let the time go on; False if there is no node to tell."""
        if not self._pause.service_is_ready():
            return False
        self._pause.call_async(SetBool.Request(data=False))
        return True

    def send(self, now: float) -> str:
        """Send the push of the keys that are held, once zero when none is; say which it is."""
        keys = self.held.at(now)
        force = total(keys)
        if keys or self._pushing:
            x, y, z = force
            self._force.publish(Wrench(force=Vector3(x=x, y=y, z=z)))
        self._pushing = bool(keys)
        return f'({force[0]:g} {force[1]:g} {force[2]:g}) N' if keys else ''

    def patience(self, now: float) -> float:
        """How long there is nothing to send, s."""
        return min(PERIOD, self.held.left(now)) if self._pushing else PERIOD

    def line(self, push: str) -> str:
        """How the doll does, and the push that acts; or why none can be steered."""
        return self._followed.problem or self.status.line(push)

    def _take_up(self, name: str) -> None:
        """Steer the node of a full name."""
        self.status = Status(self, name)
        self._force = self.create_publisher(Wrench, f'{name}/force', 10)
        self._reset = self.create_client(Trigger, f'{name}/reset')
        self._pause = self.create_client(SetBool, f'{name}/pause')


def steer(teleop: Teleop, attend: Callable[[], bool] = lambda: True) -> None:
    """Go on until a key quits, ROS shuts down or ``attend``, called each time, says False."""
    next_line = next_look = 0.0
    pushed = ''
    with SingleThreadedExecutor() as executor, Keyboard() as keyboard:
        executor.add_node(teleop)
        while rclpy.ok() and attend():
            keys = keyboard.keys(teleop.patience(time.monotonic()))
            now = time.monotonic()
            if not all(teleop.take(key, down, now) for key, down in keys):
                break
            # A tap is over before the next line: that shows it all the same.
            pushed = teleop.send(now) or pushed
            if now >= next_look:
                next_look = now + LOOK_PERIOD
                teleop.look_around()
            if now >= next_line:
                next_line = now + LINE_PERIOD
                show(teleop.line(pushed))
                pushed = ''
            for _ in range(MESSAGES):
                executor.spin_once(timeout_sec=0)
    print()


def show(line: str) -> None:
    """Write a line over the last one, no longer than the terminal is wide."""
    width = shutil.get_terminal_size().columns
    sys.stdout.write(f'\r{line[:width - 1]}\x1b[K')
    sys.stdout.flush()


def main(arguments: list[str] | None = None) -> int:
    """Steer a running node until q; 2 without a terminal, or if no node can have that name."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'ragdoll_teleop', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('node', nargs='?', default='',
                        help='name of the node; else ragdoll, or the only one that there is')
    asked = parser.parse_args(remove_ros_args(arguments)[1:]).node
    if not sys.stdin.isatty():
        print('ragdoll_teleop: standard input is no terminal; keys need one', file=sys.stderr)
        return 2
    with ros_session(arguments):
        try:
            teleop = Teleop(asked)
        except InvalidTopicNameException as error:
            print(f'ragdoll_teleop: {error}', file=sys.stderr)
            return 2
        print(HELP)
        steer(teleop)
    return 0


if __name__ == '__main__':
    sys.exit(main())
