"""`python -m ragdoll_ros.ros.tools.soak`: hours of the node in minutes, and what they leave behind.

A node as fast as it goes, pushed, set back and given other scenes by messages and calls that come
over DDS as anybody's, while somebody listens. What grows with time shows: memory, threads, files.
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
from ..rclpy_context import ros_session

TICKS = 864_000
"""2.4 hours at 100 Hz."""

RESETS, CHANGES, SAMPLES = 1000, 100, 200
"""How often in a run the scene is set back, another one comes, and memory is looked at."""

SCENES = ('drop', 'flight', 'article', 'crowd')
"""Taken in turn."""

PUSHES = 0.05
"""Of each tick: probability that a message pushes."""

STRONGEST = 2000.0
"""N."""

WARM = 0.5
"""Share of the run after which nothing should grow any more: by then each scene has come 12 times,
and `~/events` has the 1000 messages that it keeps."""

ROUNDS = int((1 - WARM) * CHANGES / len(SCENES))
"""Parts of what follows, in each of which every scene comes once: a crowd takes 5 MB that other
scenes give back, so that memory is compared from round to round."""

GROWTH = 1.0
"""MB an hour on the wall that memory may grow by."""

LIBC = ctypes.CDLL(None)
"""Of this process."""

LONG_ENOUGH = 300.0
"""s of the warm part from which on its growth is judged: in less, a page more is too much."""


@dataclass(frozen=True)
class Sample:
    """What the process has at a time, s."""

    time: float
    memory: float
    """MB."""
    threads: int
    files: int

    @classmethod
    def now(cls) -> Sample:
        """Of this process, without what it only keeps for later: garbage, and memory that malloc
        has free, which goes up and down by 3 MB from one scene to the next.
        """
        gc.collect()
        LIBC.malloc_trim(0)
        pages = int(Path('/proc/self/statm').read_text().split()[1])
        return cls(time.monotonic(), pages * os.sysconf('SC_PAGE_SIZE') / 1e6,
                   len(os.listdir('/proc/self/task')), len(os.listdir('/proc/self/fd')))


class CountingNode(RagdollNode):
    """The node, which counts its ticks."""

    ticks = 0

    def tick(self, due: float | None = None) -> None:
        """Go on by one tick; see RagdollNode."""
        super().tick(due)
        self.ticks += 1


class Soak:
    """A node, who pushes it and who listens, in one executor; all goes by the count of ticks."""

    def __init__(self, ticks: int, seed: int) -> None:
        self._ticks, self._random = ticks, random.Random(seed)
        self._node = CountingNode(parameter_overrides=[Parameter('real_time_factor', value=100.0)])
        self._other = Node('soak')
        self._force = self._other.create_publisher(Wrench, '/ragdoll/force', 10)
        self._other.create_subscription(PoseArray, '/ragdoll/poses', self._hear, 10)
        self.heard = self.bad = 0
        self._executor = SingleThreadedExecutor()
        for node in (self._node, self._other):
            self._executor.add_node(node)

    def run(self) -> list[Sample]:
        """Make all ticks; what the process had meanwhile."""
        samples, begin = [Sample.now()], time.monotonic()
        done = {'reset': 0, 'change': 0, 'sample': 0, 'push': 0}
        while self._node.ticks < self._ticks:
            self._executor.spin_once(timeout_sec=1.0)
            share = self._node.ticks / self._ticks
            for name, count, act in (('reset', RESETS, self._node.reset),
                                     ('change', CHANGES, self._change),
                                     ('push', self._ticks * PUSHES, self._push)):
                if done[name] < int(share * count):
                    done[name] += 1
                    act()
            if done['sample'] < int(share * SAMPLES):
                done['sample'] += 1
                samples.append(Sample.now())
                _say(share, samples[-1], time.monotonic() - begin)
        return samples

    def close(self) -> None:
        """Give all back."""
        self._executor.shutdown()
        self._node.end()
        self._other.destroy_node()

    @property
    def taken_back(self) -> int:
        """Bad states that the node did not publish."""
        return self._node.rescue.count

    def _push(self) -> None:
        force = Vector3(**{axis: self._random.uniform(-STRONGEST, STRONGEST) for axis in 'xyz'})
        self._force.publish(Wrench(force=force))

    def _change(self) -> None:
        """Take the next scene."""
        name = SCENES[(SCENES.index(self._node.settings.scene) + 1) % len(SCENES)]
        result, = self._node.set_parameters([Parameter('scene', value=name)])
        if not result.successful:
            raise RuntimeError(result.reason)

    def _hear(self, message: PoseArray) -> None:
        self.heard += 1
        self.bad += not all(math.isfinite(pose.position.x + pose.orientation.w)
                            for pose in message.poses)


def growth(samples: Sequence[Sample]) -> tuple[float, float]:
    """MB an hour by which memory grew once warm, and how far that may be off (two sigma): a line
    through the medians of the rounds of scenes.
    """
    warm = samples[int(WARM * len(samples)):]
    hours = [sample.time / 3600 for sample in warm]
    memory = [sample.memory for sample in warm]
    middles, medians = ([np.median(part) for part in np.array_split(values, ROUNDS)]
                        for values in (hours, memory))
    (slope, _), spread = np.polyfit(np.array(middles) - hours[0], medians, 1, cov=True)
    return float(slope), 2 * math.sqrt(max(0.0, float(spread[0, 0])))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run it; 1 if something grew, or a bad state was seen."""
    parser = argparse.ArgumentParser(
        'python -m ragdoll_ros.ros.tools.soak', description=__doc__.partition('\n')[0],
        epilog='example: python -m ragdoll_ros.ros.tools.soak --ticks 20000')
    parser.add_argument('--ticks', type=int, default=TICKS, metavar='N',
                        help=f'ticks to make, at least 1000 ({TICKS})')
    parser.add_argument('--seed', type=int, default=1, help='of the random pushes (1)')
    options = parser.parse_args(arguments)
    if options.ticks < 1000:
        parser.error(f'--ticks {options.ticks}: expected 1000 or more')
    with ros_session([]):
        soak = Soak(options.ticks, options.seed)
        try:
            samples = soak.run()
        finally:
            soak.close()
        return _judge(samples, soak)
    return 0


def _judge(samples: Sequence[Sample], soak: Soak) -> int:
    """Print what was found; 0 if all is as it should be."""
    slope, error = growth(samples)
    warm = samples[int(WARM * len(samples)):]
    middle, last = warm[:len(warm) // 2], warm[len(warm) // 2:]
    told = warm[-1].time - warm[0].time >= LONG_ENOUGH
    flat = all(max(getattr(sample, name) for sample in last)
               <= max(getattr(sample, name) for sample in middle) for name in ('threads', 'files'))
    print(f'{samples[-1].time - samples[0].time:.0f} s; memory grew by {slope:.2f} +- {error:.2f} '
          f'MB an hour{"" if told else " (too short a run to tell)"}, {warm[0].memory:.1f} to '
          f'{warm[-1].memory:.1f} MB; threads and descriptors '
          f'{"flat" if flat else "GREW"}; {soak.heard} PoseArrays heard, {soak.bad} of them bad; '
          f'{soak.taken_back} bad states taken back')
    # What can not be told from growth is not called flat.
    grew = told and slope + error > GROWTH
    return int(grew or not flat or soak.bad > 0 or soak.taken_back > 0 or soak.heard == 0)


def _say(share: float, sample: Sample, gone: float) -> None:
    print(f'{share:4.0%} {gone:6.0f} s, about {gone * (1 / share - 1):.0f} s left: '
          f'{sample.memory:.1f} MB, {sample.threads} threads, {sample.files} descriptors',
          flush=True)


if __name__ == '__main__':
    sys.exit(main())
