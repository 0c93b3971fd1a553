"""What the page costs, measured from outside: CPU time of the processes, not time on the wall.

`make bench` prints it. A node, a viewer and a page's other half run as for a user; a twin of the
node that no viewer ever looks at is measured at the same instants, so that the ratio to it
stays when others load the machine.
"""
from __future__ import annotations

import dataclasses
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rclpy
from conftest import ROOT
from diagnostic_msgs.msg import DiagnosticArray
from page_client import PageClient, wait
from peer import Peer, end, free_domain, kill, start

from ragdoll_ros.files.scene import load_scene, save_scene

SECONDS = 10
"""Reports of the node, one a second, that a measurement lasts."""

FRESH = 0.02
"""s that a report may take to come here; one that took longer is not measured at."""

NAMES = ('ragdoll: simulation', 'twin/ragdoll: simulation')


@dataclasses.dataclass(frozen=True)
class Cost:
    """Shares of one core, and what was got for them."""

    viewer: float
    node: float
    twin: float
    rate: float
    """Ticks of the node per s on the wall."""
    pages: float
    """Pictures per s that reach the page."""
    gaps: tuple[float, float]
    """s between two pictures: median, and what 99 of 100 stay below."""


class Bench:
    """A node with a scene, its twin if wanted, and a viewer that comes and goes."""

    def __init__(self, scene: Path, twin: bool) -> None:
        arguments = ('--ros-args', '-p', f'scene:={scene}')
        self.peer = Peer()
        self._reports = self.peer.collect(DiagnosticArray, '/diagnostics')
        self._node = start('node', *arguments, compiled=True)
        self._twin = start('node', *arguments, '-r', '__ns:=/twin', compiled=True) if twin else None
        self._viewer = self._client = None

    def open_viewer(self) -> None:
        """Start a viewer; nobody looks at it yet."""
        self._viewer = subprocess.Popen(
            [sys.executable, '-m', 'ragdoll_ros.viewer.command', '--port', '0'],
            stdout=subprocess.PIPE, text=True, cwd=ROOT)
        self._port = int(re.search(r':(\d+)\n', self._viewer.stdout.readline())[1])

    def open_page(self) -> None:
        """Look at it."""
        self._client = PageClient(self._port)
        wait(lambda: self._client.windows > 60, timeout=60)

    def close_page(self) -> None:
        """Look away, and wait until the viewer has noticed."""
        if self._client is not None:
            self._client.close()
            self._client = None
            self.peer.wait(lambda: not self.peer.count_subscribers('ragdoll/poses'))

    def close_viewer(self) -> None:
        """End the viewer."""
        if self._viewer is not None:
            end(self._viewer, signal.SIGTERM)
            self._viewer = None

    def close(self) -> None:
        """End all."""
        if self._client is not None:
            self._client.close()
        if self._viewer is not None:
            self._viewer.kill()
            self._viewer.communicate()
        for process in filter(None, (self._node, self._twin)):
            kill(process)
        self.peer.destroy_node()

    def listeners(self) -> dict[str, int]:
        """Subscribers of each topic that the node publishes."""
        topics = self.peer.get_publisher_names_and_types_by_node('ragdoll', '/')
        return {topic: self.peer.count_subscribers(topic) for topic, _ in topics}

    def measure(self) -> Cost:
        """Measure from one report of the node to the one SECONDS later."""
        before = self._now()
        for _ in range(SECONDS):
            after = self._now()
        at, simulated, *had = (b - a for a, b in zip(before, after, strict=True))
        arrivals = [moment for moment in getattr(self._client, 'arrivals', ())
                    if before[0] <= moment <= after[0]]
        gaps = np.diff(arrivals) if len(arrivals) > 1 else np.array([np.nan])
        return Cost(*(share / at for share in had), simulated / 0.01 / at, len(arrivals) / at,
                    (float(np.median(gaps)), float(np.quantile(gaps, 0.99))))

    def _now(self) -> tuple[float, ...]:
        """Arrival of the next report, s simulated at it, and CPU s that the processes had."""
        names = NAMES if self._twin else NAMES[:1]
        self.peer.wait(lambda: set(names) <= {
            status.name for _, message in self._reports for status in message.status})
        self._reports.clear()
        self.peer.wait(lambda: self._values(), timeout=30)
        at, values = self._values()[-1]
        return (at, float(values['simulated_time']),
                *map(cpu, (self._viewer, self._node, self._twin)))

    def _values(self) -> list[tuple[float, dict[str, str]]]:
        """Reports that came at once; others waited here, and are of an earlier instant."""
        return [(at, {pair.key: pair.value for pair in status.values})
                for at, message in self._reports for status in message.status
                if status.name == NAMES[0]
                and time.time() - stamp(message) < time.monotonic() - at + FRESH]


def middle(costs: list[Cost]) -> Cost:
    """The one whose node and twin have the middle ratio.

    Those of two equal processes differ by up to a fifth over 10 s, each way.
    """
    return sorted(costs, key=lambda cost: cost.node / cost.twin)[len(costs) // 2]


def stamp(message: DiagnosticArray) -> float:
    """Instant of a report, s of the clock on the wall."""
    return message.header.stamp.sec + message.header.stamp.nanosec / 1e9


def cpu(process: subprocess.Popen | None) -> float:
    """Seconds of CPU that a process has had, to the ns.

    By the clock that clock_getcpuclockid(3) gives for it, which Python does not have: Linux makes
    its number from the process's. /proc tells hundredths of a second.
    """
    return 0.0 if process is None else time.clock_gettime((~process.pid << 3) | 2)


def spinning(dolls: int, path: Path) -> Path:
    """Write a scene of dolls that never come to rest: no ground, no gravity, no damping."""
    scene = load_scene('flight')
    (placement,) = scene.dolls
    joints = tuple(dataclasses.replace(joint, damping=0.0) for joint in placement.doll.joints)
    doll = dataclasses.replace(placement.doll, joints=joints)
    placements = tuple(dataclasses.replace(
        placement, doll=doll, name=f'd{k}', spin=(1.0, 2.0, 3.0),
        position=(-3.0 * (k // 10), 3.0 * (k % 10), 0.0)) for k in range(dolls))
    save_scene(dataclasses.replace(scene, name='spinning', dolls=placements), path)
    return path


@contextmanager
def bench(dolls: int, twin: bool = False):
    """A node of so many dolls that spin."""
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(spinning(dolls, Path(folder) / 'spinning.yaml'), twin)
        try:
            yield bench
        finally:
            bench.close()


def one_doll():
    """Give the label, the listeners' counts and the cost of each stage of a viewer's life."""
    with bench(1, twin=True) as b:
        for label, change in (
                ('no viewer', lambda: None), ('viewer, no page', b.open_viewer),
                ('page open', b.open_page), ('page closed', b.close_page),
                ('viewer ended', b.close_viewer)):
            change()
            cost = middle([b.measure() for _ in range(3)])
            yield label, b.listeners(), cost


def many_dolls():
    """Give the cost of a page with 50 dolls, 500 bones.

    Of three measurements that in which the page kept up best: others may use the machine meanwhile.
    """
    with bench(50) as b:
        b.open_viewer()
        b.open_page()
        return max((b.measure() for _ in range(3)),
                   key=lambda cost: cost.pages / min(60, cost.rate))


def row(label: str, cost: Cost) -> str:
    """One line of the table."""
    ratio = f'{cost.node / cost.twin:10.2f}' if cost.twin else f'{"-":>10}'
    return (f'{label:16}{100 * cost.viewer:10.1f}{100 * cost.node:10.1f}{ratio}{cost.rate:10.2f}'
            f'{cost.pages:10.1f}{1e3 * cost.gaps[0]:12.1f}{1e3 * cost.gaps[1]:10.1f}')


def main() -> None:
    """Print the table."""
    domain, lock = free_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    rclpy.init(args=[])
    print("% of a core for the viewer and the node, the node's share to that of a twin that no\n"
          'viewer ever saw; ticks and pictures a second; ms between pictures, median and 99 %')
    print(f'{"":16}' + ''.join(f'{name:>10}' for name in ('viewer', 'node', 'to twin', 'ticks',
                                                          'pictures')) + f'{"median":>12}'
          f'{"99 %":>10}')
    for label, _, cost in one_doll():
        print(row(label, cost), flush=True)
    print(row('50 dolls, open', many_dolls()))
    rclpy.try_shutdown()
    lock.close()


if __name__ == '__main__':
    main()
