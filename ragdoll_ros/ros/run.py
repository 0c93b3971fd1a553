"""Starts the node and the page as processes of their own, with teleop and a live line in front.

Without a terminal, it logs that line every second.
"""
from __future__ import annotations

import argparse
import importlib.util
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

from .rclpy_context import ros_session
from .signals import ended_by_signals
from .teleop.teleop import HELP, Teleop, show, steer

LOG_PERIOD = 1.0
"""s between two lines without a terminal."""

PATIENCE = 5.0
"""s that a process has to end."""

WAITING = ['--ros-args', '-p', 'start_paused:=true', '--']
"""Arguments by which the node lets the doll hang until the page lets it go."""

LONGEST = 5.0
"""s for which it does without a page that is open."""

NO_PAGE = "No page in the browser without viser: pip install 'ragdoll_ros[viewer]' gets it"

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
    return ended_by_signals(lambda: _run(arguments, own))


def _run(arguments: list[str], own: list[str]) -> int:
    terminal, code = sys.stdin.isatty() and sys.stdout.isatty(), 0
    with ros_session(arguments):
        waiting = WAITING if importlib.util.find_spec('viser') is not None else []
        with (started('ros.node', waiting + own,
                      stderr=subprocess.PIPE if terminal else None) as node,
              page_process(own, terminal) as page):
            (_steer if terminal else _log)(Teleop(), node, page)
        code = node.returncode
    return code


@contextmanager
def started(module: str, arguments: list[str], **streams: int | None) -> Iterator[subprocess.Popen]:
    """Run a module, its ``streams`` as for Popen. It is ended with the context."""
    command = [sys.executable, '-m', f'ragdoll_ros.{module}', *arguments]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, **streams)
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
        _show_log(process)


@contextmanager
def page_process(arguments: list[str], quiet: bool) -> Iterator[subprocess.Popen | None]:
    """Serve the page, which says where it is; without viser, say how to get it."""
    if importlib.util.find_spec('viser') is None:
        print(NO_PAGE, flush=True)
        yield None
        return
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT} if quiet else {}
    with started('viewer.command', ['--start-after', f'{LONGEST:g}', *arguments],
                 **streams) as process:
        yield process


def _steer(teleop: Teleop, node: subprocess.Popen, page: subprocess.Popen | None) -> None:
    told = [process for process in (node, page) if process is not None]
    for process in told:
        os.set_blocking(_log_of(process).fileno(), False)

    let_go = _LetGo(teleop, page)

    def attend() -> bool:
        for process in told:
            _show_log(process)
        let_go.look()
        return node.poll() is None

    print(HELP)
    steer(teleop, attend)


def _log(teleop: Teleop, node: subprocess.Popen, page: subprocess.Popen | None) -> None:
    let_go = _LetGo(teleop, page)
    next_line = time.monotonic() + LOG_PERIOD
    with SingleThreadedExecutor() as executor:
        executor.add_node(teleop)
        while rclpy.ok() and node.poll() is None:
            executor.spin_once(timeout_sec=LOG_PERIOD)
            let_go.look()
            if time.monotonic() >= next_line:
                next_line += LOG_PERIOD
                print(teleop.line(''), flush=True)


class _LetGo:
    """Lets the doll go in the page's place, where that ends before it could."""

    def __init__(self, teleop: Teleop, page: subprocess.Popen | None) -> None:
        self._teleop, self._page = teleop, page

    def look(self) -> None:
        """Let go once the page's process is no more and the node can be told."""
        if self._page is not None and self._page.poll() is not None and self._teleop.go_on():
            self._page = None


def _show_log(process: subprocess.Popen) -> None:
    """Write what a process has said to a pipe above the line."""
    log = _log_of(process)
    for line in ((log and log.read()) or b'').decode('utf-8', 'replace').splitlines():
        show(line)
        print()


def _log_of(process: subprocess.Popen) -> IO[bytes] | None:
    return process.stderr or process.stdout


if __name__ == '__main__':
    sys.exit(main())
