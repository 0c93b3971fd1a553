"""Arrow keys push the doll: Up away from you, Down toward you, Left and Right as you see it.

You look at the doll's face, from +x along -x. Held keys hold the push and add up, as far as the
terminal can tell. Space pauses and goes on, r resets, q quits.
"""
from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable

import rclpy
from geometry_msgs.msg import Vector3, Wrench
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from std_srvs.srv import SetBool, Trigger

from ..physics.arrow_keys import FORCES, Held, total
from .keys import Keyboard
from .session import ros_session
from .status import Status

PERIOD = 0.02
"""s between two messages of a held push, well within the node's push_timeout."""

MESSAGES = 4
"""Messages that are taken in each PERIOD: two states and, now and then, a report."""

LINE_PERIOD = 0.1
"""s between two status lines."""

HELP = 'arrows push, held keys add up | space pauses | r resets | q quits'

EXAMPLE = """examples:
  ragdoll_teleop
  ragdoll_teleop --ros-args -r __ns:=/stage
"""


class Teleop(Node):
    """Sends pushes and calls the services of the node ``ragdoll`` in its own namespace."""

    def __init__(self) -> None:
        super().__init__('ragdoll_teleop')
        self.status = Status(self)
        self.held = Held()
        self._force = self.create_publisher(Wrench, 'ragdoll/force', 10)
        self._reset = self.create_client(Trigger, 'ragdoll/reset')
        self._pause = self.create_client(SetBool, 'ragdoll/pause')
        self._pushing = False

    def take(self, key: str, down: bool, now: float) -> bool:
        """Do what a key says; False to quit."""
        if key in FORCES:
            self.held.take(key, down, now)
        elif key == ' ':
            self._pause.call_async(SetBool.Request(data=not self.status.paused))
        elif key in 'rR':
            self._reset.call_async(Trigger.Request())
        return key not in 'qQ'

    def send(self, now: float) -> str:
        """Send the push of the keys that are held, once zero when none is; say which it is."""
        keys = self.held.at(now)
        force = total(keys)
        if keys or self._pushing:
            x, y, z = force
            self._force.publish(Wrench(force=Vector3(x=x, y=y, z=z)))
        self._pushing = bool(keys)
        return f'({force[0]:g} {force[1]:g} {force[2]:g}) N' if keys else ''


def steer(teleop: Teleop, attend: Callable[[], bool] = lambda: True) -> None:
    """Go on until a key quits, ROS shuts down or ``attend``, called each time, says False."""
    next_line = 0.0
    with SingleThreadedExecutor() as executor, Keyboard() as keyboard:
        executor.add_node(teleop)
        while rclpy.ok() and attend():
            now = time.monotonic()
            if not all(teleop.take(key, down, now) for key, down in keyboard.keys(PERIOD)):
                break
            push = teleop.send(now)
            if now >= next_line:
                next_line = now + LINE_PERIOD
                show(teleop.status.line(push))
            for _ in range(MESSAGES):
                executor.spin_once(timeout_sec=0)
    print()


def show(line: str) -> None:
    """Write a line over the last one, no longer than the terminal is wide."""
    width = shutil.get_terminal_size().columns
    sys.stdout.write(f'\r{line[:width - 1]}\x1b[K')
    sys.stdout.flush()


def main(arguments: list[str] | None = None) -> int:
    """Steer a running node until q; 2 without a terminal."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'ragdoll_teleop', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args(remove_ros_args(arguments)[1:])
    if not sys.stdin.isatty():
        print('ragdoll_teleop: standard input is no terminal; keys need one', file=sys.stderr)
        return 2
    with ros_session(arguments):
        print(HELP)
        steer(Teleop())
    return 0


if __name__ == '__main__':
    sys.exit(main())
