"""`python -m ragdoll_ros.ros.tools.crowd_bench`: CPU load of nodes with many dolls.

Measured with and without a subscriber. Nodes, subscribers and an empty timer as the baseline are
processes of their own. Compare the ratios; absolute values depend on the machine.
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

from ..process.rclpy_context import rclpy_context
from ..run import child_process
from .listen import TOPIC

PERIOD = 0.01
"""s: tick of all scenes."""

ROUNDS, ROUND = 10, 2.0
"""Number and length, s, of the measurements; the median is reported."""

LYING = 'position: [0, 0, 0.12], orientation: [0, 1, 0, 1]'
"""On its face; sleeps soon."""

HIGH, LOW = 'position: [0, 0, 50]', 'position: [0, 0, 0]'
"""In the air for 3 s; 0.4 m above the ground."""


def node_arguments(folder: Path, count: int, pose: str) -> list[str]:
    """Write a scene of ``count`` default dolls 2.5 m apart, and return the arguments of a node for
    it with one thread per core.
    """
    file = folder / f'scene_{count}_{len(pose)}.yaml'
    repeat = f', repeat: {{count: {count}, grid: [2.5, 2.5, 0]}}' if count > 1 else ''
    file.write_text(f'ground: {{normal: [0, 0, 1], offset: 0}}\n'
                    f'dolls:\n  - {{doll: doll, {pose}{repeat}}}\n')
    return ['--ros-args', '-p', f'scene:={file}', '-p', 'workers:=0']


def cpu_time(process: subprocess.Popen) -> float:
    """CPU time of another process, s; its Linux clock id is (~pid << 3) | 2."""
    return time.clock_gettime((~process.pid) << 3 | 2)


def cpu_loads(processes: list[subprocess.Popen]) -> list[list[float]]:
    """CPU load of each process, % of a core, in each of ROUNDS rounds."""
    rounds = []
    for _ in range(ROUNDS):
        before, begin = [cpu_time(process) for process in processes], time.monotonic()
        time.sleep(ROUND)
        elapsed = time.monotonic() - begin
        rounds.append([100 * (cpu_time(process) - used) / elapsed
                       for process, used in zip(processes, before, strict=True)])
    return [list(each) for each in zip(*rounds, strict=True)]


def wait_asleep(node: Node, names: list[str]) -> None:
    """Wait until /diagnostics reports all these nodes as asleep."""
    awake = set(names)

    def take(message: DiagnosticArray) -> None:
        awake.difference_update(
            status.name.partition(':')[0] for status in message.status
            if {pair.key: pair.value for pair in status.values}['asleep'] == 'true')

    subscription = node.create_subscription(DiagnosticArray, '/diagnostics', take, 10)
    while awake:
        rclpy.spin_once(node)
    node.destroy_subscription(subscription)


def startup_time(folder: Path, count: int) -> float:
    """Time from the start of a node's process to its log line with the engine, s."""
    begin = time.monotonic()
    with child_process('ros.node', node_arguments(folder, count, LYING),
                       stderr=subprocess.PIPE) as process:
        for line in process.stderr:
            if b'engine' in line:
                return time.monotonic() - begin
    raise RuntimeError('the node has exited')


def without_subscriber(node: Node, folder: Path, *counts: int) -> None:
    """Print the load of nodes with sleeping dolls, and of an empty timer at their rate."""
    with ExitStack() as stack:
        empty = stack.enter_context(child_process('ros.tools.crowd_bench', ['empty']))
        nodes = [stack.enter_context(child_process(
            'ros.node', [*node_arguments(folder, count, LYING), '-r', f'__ns:=/of_{count}'],
            stderr=subprocess.DEVNULL)) for count in counts]
        wait_asleep(node, [f'of_{count}/ragdoll' for count in counts])
        timer, *found = cpu_loads([empty, *nodes])
        print(f'an empty timer at {1 / PERIOD:.0f} Hz: {statistics.median(timer):.1f} % of a core')
        for count, load in zip(counts, found, strict=True):
            more = statistics.median(a - b for a, b in zip(load, timer, strict=True))
            print(f'{count} asleep, no subscriber: {statistics.median(load):.1f} % of a core, '
                  f'{more:.1f} above the timer', flush=True)


def with_subscriber(folder: Path, count: int, pose: str, seconds: float,
                    wait_ready: Callable[[], None] = lambda: None) -> None:
    """Print the statistics of a subscriber to ~/poses, started after ``wait_ready``, and the node's
    CPU load.
    """
    listen = ['--seconds', str(seconds), TOPIC]
    with child_process('ros.node', node_arguments(folder, count, pose),
                       stderr=subprocess.DEVNULL) as process:
        wait_ready()
        with child_process('ros.tools.listen', listen, stdout=subprocess.PIPE) as listener:
            begin, used = time.monotonic(), cpu_time(process)
            print(listener.stdout.read().decode(), end='')
            load = 100 * (cpu_time(process) - used) / (time.monotonic() - begin)
    print(f'the node takes {load:.0f} % of a core', flush=True)


def empty() -> None:
    """Run a node with an empty timer."""
    node = Node('empty')
    node.create_timer(PERIOD, lambda: None, clock=Clock(clock_type=ClockType.STEADY_TIME))
    rclpy.spin(node)


def main() -> None:
    """Print all figures; takes two minutes."""
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.tools.crowd_bench', description=__doc__,
        epilog='example: python -m ragdoll_ros.ros.tools.crowd_bench')
    parser.add_argument('part', nargs='?', choices=['empty'],
                        help='only the empty timer, the baseline')
    options = parser.parse_args()
    with rclpy_context([]), tempfile.TemporaryDirectory() as name:
        if options.part:
            return empty()
        folder, node = Path(name), Node('crowd_bench')
        one, thousand = (statistics.median(startup_time(folder, count) for _ in range(3))
                         for count in (1, 1000))
        print(f'startup: {one:.1f} s with one doll, {thousand:.1f} s with 1000', flush=True)
        without_subscriber(node, folder, 1, 100)
        print('1000 asleep, one subscriber', flush=True)
        with_subscriber(folder, 1000, LYING, 10.0, lambda: wait_asleep(node, ['ragdoll']))
        print('100 falling at 100 Hz, in the air', flush=True)
        with_subscriber(folder, 100, HIGH, 5.0)
        print('100 falling at 100 Hz, from 0.4 m, and tumbling', flush=True)
        with_subscriber(folder, 100, LOW, 3.0)
    return None


if __name__ == '__main__':
    main()
