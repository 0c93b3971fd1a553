"""`python -m ragdoll_ros.ros.tools.crowd_bench`: what nodes of many dolls cost, heard and unheard.

Each node, each listener and the empty timer that a node is held against is a process of its own,
with DDS between; a processor's time is read from Linux. Take ratios; the rest is this machine's.
"""
from __future__ import annotations

import argparse
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..rclpy_context import ros_session
from ..run import started
from .listen import TOPIC

PERIOD = 0.01
"""s: the tick of all scenes here."""

ROUNDS, ROUND = 10, 2.0
"""How often, and for how many s, shares of a processor are taken; their median counts."""

LYING = 'position: [0, 0, 0.12], orientation: [0, 1, 0, 1]'
"""On its face, and soon asleep."""

HIGH, LOW = 'position: [0, 0, 50]', 'position: [0, 0, 0]'
"""For 3 s in the air; 0.4 m above the ground."""


def dolls(folder: Path, count: int, place: str) -> list[str]:
    """Arguments of a node with so many default dolls, 2.5 m apart, and a thread for each core."""
    file = folder / f'scene_{count}_{len(place)}.yaml'
    repeat = f', repeat: {{count: {count}, grid: [2.5, 2.5, 0]}}' if count > 1 else ''
    file.write_text(f'ground: {{normal: [0, 0, 1], offset: 0}}\n'
                    f'dolls:\n  - {{doll: doll, {place}{repeat}}}\n')
    return ['--ros-args', '-p', f'scene:={file}', '-p', 'workers:=0']


def cpu(process: subprocess.Popen) -> float:
    """Time, s, that a process has had of processors; Linux's clock of another process."""
    return time.clock_gettime((~process.pid) << 3 | 2)


def shares(processes: list[subprocess.Popen]) -> list[list[float]]:
    """Percents of a core that each process takes, in ROUNDS rounds at the same time."""
    rounds = []
    for _ in range(ROUNDS):
        before, begin = [cpu(process) for process in processes], time.monotonic()
        time.sleep(ROUND)
        elapsed = time.monotonic() - begin
        rounds.append([100 * (cpu(process) - used) / elapsed
                       for process, used in zip(processes, before, strict=True)])
    return [list(each) for each in zip(*rounds, strict=True)]


def wait_asleep(node: Node, names: list[str]) -> None:
    """Wait until /diagnostics has said of all these nodes that they sleep."""
    awake = set(names)

    def take(message: DiagnosticArray) -> None:
        awake.difference_update(
            status.name.partition(':')[0] for status in message.status
            if {pair.key: pair.value for pair in status.values}['asleep'] == 'true')

    subscription = node.create_subscription(DiagnosticArray, '/diagnostics', take, 10)
    while awake:
        rclpy.spin_once(node)
    node.destroy_subscription(subscription)


def set_up(folder: Path, count: int) -> float:
    """Time, s, from a node's start as a process until it has said which engine it has."""
    begin = time.monotonic()
    with started('ros.node', dolls(folder, count, LYING), stderr=subprocess.PIPE) as process:
        for line in process.stderr:
            if b'engine' in line:
                return time.monotonic() - begin
    raise RuntimeError('the node has ended')


def unheard(node: Node, folder: Path, *counts: int) -> None:
    """Print what sleepers cost that nobody listens to, beside an empty timer at their rate."""
    with ExitStack() as stack:
        empty = stack.enter_context(started('ros.tools.crowd_bench', ['empty']))
        nodes = [stack.enter_context(started(
            'ros.node', [*dolls(folder, count, LYING), '-r', f'__ns:=/of_{count}'],
            stderr=subprocess.DEVNULL)) for count in counts]
        wait_asleep(node, [f'of_{count}/ragdoll' for count in counts])
        timer, *found = shares([empty, *nodes])
        print(f'an empty timer at {1 / PERIOD:.0f} Hz: {statistics.median(timer):.1f} % of a core')
        for count, share in zip(counts, found, strict=True):
            more = statistics.median(a - b for a, b in zip(share, timer, strict=True))
            print(f'{count} asleep, unheard: {statistics.median(share):.1f} % of a core, '
                  f'{more:.1f} above the timer', flush=True)


def heard(folder: Path, count: int, place: str, seconds: float,
          ready: Callable[[], None] = lambda: None) -> None:
    """Print what a listener to ~/poses hears from the first message on, and the node's share.

    The listener begins once the node is ``ready``, else with it.
    """
    listen = ['--seconds', str(seconds), TOPIC]
    with started('ros.node', dolls(folder, count, place), stderr=subprocess.DEVNULL) as process:
        ready()
        with started('ros.tools.listen', listen, stdout=subprocess.PIPE) as listener:
            begin, used = time.monotonic(), cpu(process)
            print(listener.stdout.read().decode(), end='')
            share = 100 * (cpu(process) - used) / (time.monotonic() - begin)
    print(f'the node takes {share:.0f} % of a core', flush=True)


def empty() -> None:
    """Run a node of nothing but an empty timer."""
    node = Node('empty')
    node.create_timer(PERIOD, lambda: None, clock=Clock(clock_type=ClockType.STEADY_TIME))
    rclpy.spin(node)


def main() -> None:
    """Print all figures, in two minutes."""
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.tools.crowd_bench', description=__doc__,
        epilog='example: python -m ragdoll_ros.ros.tools.crowd_bench')
    parser.add_argument('part', nargs='?', choices=['empty'], help='the empty timer alone')
    options = parser.parse_args()
    with ros_session([]), tempfile.TemporaryDirectory() as name:
        if options.part:
            return empty()
        folder, node = Path(name), Node('crowd_bench')
        one, thousand = (statistics.median(set_up(folder, count) for _ in range(3))
                         for count in (1, 1000))
        print(f'up after {one:.1f} s with one doll, {thousand:.1f} s with 1000', flush=True)
        unheard(node, folder, 1, 100)
        print('1000 asleep, one listener', flush=True)
        heard(folder, 1000, LYING, 10.0, lambda: wait_asleep(node, ['ragdoll']))
        print('100 falling at 100 Hz, in the air', flush=True)
        heard(folder, 100, HIGH, 5.0)
        print('100 falling at 100 Hz, from 0.4 m, and tumbling', flush=True)
        heard(folder, 100, LOW, 3.0)
    return None


if __name__ == '__main__':
    main()
