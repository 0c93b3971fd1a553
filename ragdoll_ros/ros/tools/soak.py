"""`python -m ragdoll_ros.ros.tools.soak`: soak test for leaks of memory, threads and files.

A node at maximum speed is pushed, reset and given other scenes, while a peer subscribes to its
poses over DDS. Hours of simulated time pass in minutes.
"""
from __future__ import annotations

import argparse
import ctypes
import gc
import math
import os
import random
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from geometry_msgs.msg import PoseArray, Vector3, Wrench
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..node import RagdollNode
from ..process.rclpy_context import rclpy_context

TICKS = 864_000
"""2.4 hours at 100 Hz."""

RESETS, CHANGES, SAMPLES = 1000, 100, 200
"""Resets, changes of the scene, and resource samples in a run."""

SCENES = ('drop', 'flight', 'article', 'crowd')
"""Loaded in turn."""

PUSH_RATE = 0.05
"""Pushes per tick."""

MAX_FORCE = 2000.0
"""N."""

WARM_UP = 0.5
"""Share of the run after which nothing should grow: by then each scene has been loaded 12 times and
the queue of `~/events` is full."""

ROUNDS = int((1 - WARM_UP) * CHANGES / len(SCENES))
"""Rounds after the warm-up, each with every scene once. Memory is compared between rounds, as a
crowd takes 5 MB that other scenes free."""

MAX_GROWTH = 1.0
"""MB per hour of wall time."""

LIBC = ctypes.CDLL(None)

MIN_DURATION = 300.0
"""s after the warm-up that are needed to judge the growth."""


@dataclass(frozen=True)
class SoakSample:
    """Resources of the process at a time, s."""

    time: float
    memory: float
    """MB."""
    threads: int
    files: int

    @classmethod
    def now(cls) -> SoakSample:
        """Sample this process after a garbage collection and malloc_trim: memory that malloc keeps
        varies by 3 MB between scenes.
        """
        gc.collect()
        LIBC.malloc_trim(0)
        pages = int(Path('/proc/self/statm').read_text().split()[1])
        return cls(time.monotonic(), pages * os.sysconf('SC_PAGE_SIZE') / 1e6,
                   len(os.listdir('/proc/self/task')), len(os.listdir('/proc/self/fd')))


class CountingNode(RagdollNode):
    """The node, counting its ticks."""

    ticks = 0

    def tick(self, due: float | None = None) -> None:
        """Make one tick; see RagdollNode."""
        super().tick(due)
        self.ticks += 1


class Soak:
    """The node and a peer that pushes and subscribes, in one executor; scheduled by tick count."""

    def __init__(self, ticks: int, seed: int) -> None:
        self._ticks, self._random = ticks, random.Random(seed)
        self._node = CountingNode(parameter_overrides=[Parameter('real_time_factor', value=100.0)])
        self._peer = Node('soak')
        self._force = self._peer.create_publisher(Wrench, '/ragdoll/force', 10)
        self._peer.create_subscription(PoseArray, '/ragdoll/poses', self._on_poses, 10)
        self.received = self.bad = 0
        self._executor = SingleThreadedExecutor()
        for node in (self._node, self._peer):
            self._executor.add_node(node)

    def run(self) -> list[SoakSample]:
        """Make all ticks. Returns the samples."""
        samples, begin = [SoakSample.now()], time.monotonic()
        done = {'reset': 0, 'change': 0, 'sample': 0, 'push': 0}
        # Ticks are also made while a scene is loaded: the last sample comes after the last one.
        while done['sample'] < SAMPLES:
            self._executor.spin_once(timeout_sec=1.0)
            # One wake-up may make several ticks, and the last one too many.
            share = min(self._node.ticks / self._ticks, 1.0)
            for name, count, act in (('reset', RESETS, self._node.reset),
                                     ('change', CHANGES, self._change),
                                     ('push', self._ticks * PUSH_RATE, self._push)):
                if done[name] < int(share * count):
                    done[name] += 1
                    act()
            while done['sample'] < int(share * SAMPLES):
                done['sample'] += 1
                samples.append(SoakSample.now())
                _print_progress(share, samples[-1], time.monotonic() - begin)
        return samples

    def close(self) -> None:
        """Destroy the nodes."""
        self._executor.shutdown()
        self._node.end()
        self._peer.destroy_node()

    @property
    def undone(self) -> int:
        """Number of bad states that the node has undone."""
        return self._node.recovery.count

    def _push(self) -> None:
        force = Vector3(**{axis: self._random.uniform(-MAX_FORCE, MAX_FORCE) for axis in 'xyz'})
        self._force.publish(Wrench(force=force))

    def _change(self) -> None:
        """Load the next scene."""
        name = SCENES[(SCENES.index(self._node.settings.scene) + 1) % len(SCENES)]
        result, = self._node.set_parameters([Parameter('scene', value=name)])
        if not result.successful:
            raise RuntimeError(result.reason)

    def _on_poses(self, message: PoseArray) -> None:
        self.received += 1
        self.bad += not all(math.isfinite(pose.position.x + pose.orientation.w)
                            for pose in message.poses)


def growth(samples: Sequence[SoakSample]) -> tuple[float, float]:
    """Growth of memory after the warm-up and its uncertainty (two sigma), MB per hour, by a line
    fitted to the medians of the rounds.
    """
    warm = samples[int(WARM_UP * len(samples)):]
    hours = [sample.time / 3600 for sample in warm]
    memory = [sample.memory for sample in warm]
    middles, medians = ([np.median(part) for part in np.array_split(values, ROUNDS)]
                        for values in (hours, memory))
    (slope, _), spread = np.polyfit(np.array(middles) - hours[0], medians, 1, cov=True)
    return float(slope), 2 * math.sqrt(max(0.0, float(spread[0, 0])))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the soak test. Returns 1 if something grew, a bad state was found, or no poses came."""
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.tools.soak', description=__doc__.partition('\n')[0],
        epilog='example: python -m ragdoll_ros.ros.tools.soak --ticks 20000')
    parser.add_argument('--ticks', type=int, default=TICKS, metavar='N',
                        help=f'ticks to make, at least 1000 ({TICKS})')
    parser.add_argument('--seed', type=int, default=1, help='seed of the random pushes (1)')
    options = parser.parse_args(arguments)
    if options.ticks < 1000:
        parser.error(f'--ticks {options.ticks}: expected 1000 or more')
    with rclpy_context([]):
        soak = Soak(options.ticks, options.seed)
        try:
            samples = soak.run()
        finally:
            soak.close()
        return _judge(samples, soak)
    return 0


def _judge(samples: Sequence[SoakSample], soak: Soak) -> int:
    """Print the result. Returns the exit code."""
    slope, error = growth(samples)
    warm = samples[int(WARM_UP * len(samples)):]
    middle, last = warm[:len(warm) // 2], warm[len(warm) // 2:]
    is_long = warm[-1].time - warm[0].time >= MIN_DURATION
    flat = all(max(getattr(sample, name) for sample in last)
               <= max(getattr(sample, name) for sample in middle) for name in ('threads', 'files'))
    print(f'{samples[-1].time - samples[0].time:.0f} s; memory grew by {slope:.2f} +- {error:.2f} '
          f'MB per hour{"" if is_long else " (too short a run to tell)"}, {warm[0].memory:.1f} to '
          f'{warm[-1].memory:.1f} MB; threads and descriptors '
          f'{"flat" if flat else "GREW"}; {soak.received} PoseArrays received, {soak.bad} bad; '
          f'{soak.undone} bad states undone')
    # The uncertainty counts as growth.
    grew = is_long and slope + error > MAX_GROWTH
    return int(grew or not flat or soak.bad > 0 or soak.undone > 0 or soak.received == 0)


def _print_progress(share: float, sample: SoakSample, elapsed: float) -> None:
    print(f'{share:4.0%} {elapsed:6.0f} s, about {elapsed * (1 / share - 1):.0f} s left: '
          f'{sample.memory:.1f} MB, {sample.threads} threads, {sample.files} descriptors',
          flush=True)


if __name__ == '__main__':
    sys.exit(main())
