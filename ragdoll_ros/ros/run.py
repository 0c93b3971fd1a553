"""Starts the node as a process of its own, with the teleop and one live line in front.

Without a terminal, it logs that line every second.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

from .session import ros_session
from .teleop import HELP, Teleop, show, steer

LOG_PERIOD = 1.0
"""s between two lines without a terminal."""

PATIENCE = 5.0
"""s that the node has to end."""

EXAMPLE = """examples:
  python -m ragdoll_ros.ros.run
  python -m ragdoll_ros.ros.run crowd
  python -m ragdoll_ros.ros.run --ros-args -p real_time_factor:=0.5
"""


def main(arguments: list[str] | None = None) -> int:
    """Run until q, SIGINT or SIGTERM; the node's exit code if it ends by itself."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.run', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scene', nargs='?', help='a name in config/ or a path')
    scene = parser.parse_args(remove_ros_args(arguments)[1:]).scene
    own = list(arguments[1:])
    if scene:
        own.remove(scene)
        own += ['--ros-args', '-p', f'scene:={scene}']
    terminal = sys.stdin.isatty() and sys.stdout.isatty()
    with node_process(own, quiet=terminal) as process, ros_session(arguments):
        (_steer if terminal else _log)(Teleop(), process)
    return process.returncode


@contextmanager
def node_process(arguments: list[str], quiet: bool) -> Iterator[subprocess.Popen]:
    """Run the node; ``quiet``: its log goes to a pipe. It is ended with the context."""
    command = [sys.executable, '-m', 'ragdoll_ros.ros.node', *arguments]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE if quiet else None)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if quiet:
            _show_log(process)


def _steer(teleop: Teleop, process: subprocess.Popen) -> None:
    os.set_blocking(process.stderr.fileno(), False)

    def attend() -> bool:
        _show_log(process)
        return process.poll() is None

    print(HELP)
    steer(teleop, attend)


def _log(teleop: Teleop, process: subprocess.Popen) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(teleop)
    next_line = time.monotonic() + LOG_PERIOD
    while rclpy.ok() and process.poll() is None:
        executor.spin_once(timeout_sec=LOG_PERIOD)
        if time.monotonic() >= next_line:
            next_line += LOG_PERIOD
            print(teleop.status.line(), flush=True)


def _show_log(process: subprocess.Popen) -> None:
    """Write what the node has logged above the line."""
    text = process.stderr.read()
    for line in (text or b'').decode('utf-8', 'replace').splitlines():
        show(line)
        print()


if __name__ == '__main__':
    sys.exit(main())
