"""Starts the node and the page as child processes, with teleop and a status line in the terminal.

Without a terminal, the status line is logged every second.
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

from .process.rclpy_context import rclpy_context
from .process.signals import run_until_signal
from .teleop.teleop import HELP, Teleop, show_line, spin_with_keyboard

LOG_PERIOD = 1.0
"""s between two log lines without a terminal."""

EXIT_TIMEOUT = 5.0
"""s that a child process has to exit before it is killed."""

START_PAUSED = ['--ros-args', '-p', 'start_paused:=true', '--']
"""Arguments of the node: the page resumes it once it is open."""

START_AFTER = 5.0
"""s after which the page resumes the node even if no browser has opened it."""

NO_VISER = "No page in the browser without viser: pip install 'ragdoll_ros[viewer]'"

EXAMPLE = """examples:
  python -m ragdoll_ros.ros.run
  python -m ragdoll_ros.ros.run crowd
  python -m ragdoll_ros.ros.run --ros-args -p real_time_factor:=0.5
"""


def main(arguments: list[str] | None = None) -> int:
    """Run until q, SIGINT or SIGTERM. Returns the node's exit code if it exits by itself."""
    arguments = sys.argv if arguments is None else arguments
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.run', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scene', nargs='?', help='a name in config/ or a path')
    scene = parser.parse_args(remove_ros_args(arguments)[1:]).scene
    node_arguments = list(arguments[1:])
    if scene:
        node_arguments.remove(scene)
        node_arguments += ['--ros-args', '-p', f'scene:={scene}']
    return run_until_signal(lambda: _run(arguments, node_arguments))


def _run(arguments: list[str], node_arguments: list[str]) -> int:
    terminal, code = sys.stdin.isatty() and sys.stdout.isatty(), 0
    with rclpy_context(arguments):
        paused = START_PAUSED if importlib.util.find_spec('viser') is not None else []
        with (child_process('ros.node', paused + node_arguments,
                            stderr=subprocess.PIPE if terminal else None) as node,
              page_process(node_arguments, terminal) as page):
            (_spin_in_terminal if terminal else _spin_and_log)(Teleop(), node, page)
        code = node.returncode
    return code


@contextmanager
def child_process(module: str, arguments: list[str],
                  **streams: int | None) -> Iterator[subprocess.Popen]:
    """Run a module of the package; ``streams`` as for Popen. The context ends it with SIGINT."""
    command = [sys.executable, '-m', f'ragdoll_ros.{module}', *arguments]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, **streams)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(EXIT_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        _show_output(process)


@contextmanager
def page_process(arguments: list[str], quiet: bool) -> Iterator[subprocess.Popen | None]:
    """Serve the page, which prints its URL; without viser, print how to install it."""
    if importlib.util.find_spec('viser') is None:
        print(NO_VISER, flush=True)
        yield None
        return
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT} if quiet else {}
    with child_process('viewer.command', ['--start-after', f'{START_AFTER:g}', *arguments],
                       **streams) as process:
        yield process


def _spin_in_terminal(teleop: Teleop, node: subprocess.Popen,
                      page: subprocess.Popen | None) -> None:
    children = [process for process in (node, page) if process is not None]
    for process in children:
        os.set_blocking(_output(process).fileno(), False)

    fallback = _ResumeWithoutPage(teleop, page)

    def keep_running() -> bool:
        for process in children:
            _show_output(process)
        fallback.update()
        return node.poll() is None

    print(HELP)
    spin_with_keyboard(teleop, keep_running)


def _spin_and_log(teleop: Teleop, node: subprocess.Popen, page: subprocess.Popen | None) -> None:
    fallback = _ResumeWithoutPage(teleop, page)
    next_line = time.monotonic() + LOG_PERIOD
    with SingleThreadedExecutor() as executor:
        executor.add_node(teleop)
        while rclpy.ok() and node.poll() is None:
            executor.spin_once(timeout_sec=LOG_PERIOD)
            fallback.update()
            if time.monotonic() >= next_line:
                next_line += LOG_PERIOD
                print(f'{teleop.status_text("")}\n', end='', flush=True)


class _ResumeWithoutPage:
    """Resumes the node if the page's process exits before it could."""

    def __init__(self, teleop: Teleop, page: subprocess.Popen | None) -> None:
        self._teleop, self._page = teleop, page

    def update(self) -> None:
        """Resume once the page's process has exited and the node's service is available."""
        if self._page is not None and self._page.poll() is not None and self._teleop.resume():
            self._page = None


def _show_output(process: subprocess.Popen) -> None:
    """Print the new output of a piped process above the status line."""
    output = _output(process)
    for line in ((output and output.read()) or b'').decode('utf-8', 'replace').splitlines():
        show_line(line)


def _output(process: subprocess.Popen) -> IO[bytes] | None:
    return process.stderr or process.stdout


if __name__ == '__main__':
    sys.exit(main())
