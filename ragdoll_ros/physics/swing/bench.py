"""Benchmark of swings without dolls: wall time of a tick."""
import statistics
import time

import numpy as np

from ...model.rotation import from_rotation_vector
from ...model.state import State
from ...model.swing import Swing, strand
from ...model.swing_mount import SwingMount
from .swings import Swings
from .track import Track


def tick_cost(count: int = 1000, links: int = 1, bones: int = 10, tick: float = 0.01,
              ticks: int = 200) -> float:
    """Median time, s, of a tick of ``tick`` s with ``count`` swings of ``links`` damped springs.

    The bones translate and rotate at 3 Hz. A tick adds the bones' state, integrates the swings and
    computes the positions of all masses.
    """
    random = np.random.default_rng(0)
    mounted = []
    for index in range(count):
        swing = Swing(f'swing_{index}', '', (0.1, 0, 0), random.normal(size=3),
                      strand(links, 0.3, 0.1, (random.uniform(0.2, 2), 0.1), 0.3))
        mounted.append(SwingMount(swing, index % bones, swing.name, np.array(swing.root),
                             np.array(swing.directions())))
    track = Track()
    swings = Swings(mounted, (0, 0, -9.8), track)
    states = [_shaken(bones, number * tick) for number in range(ticks + 1)]
    track.add(0.0, states[0])
    swings.evaluate(0.0)
    costs = []
    for number in range(1, ticks + 1):
        begin = time.perf_counter()
        track.add(number * tick, states[number])
        _ = swings.evaluate(number * tick).positions
        costs.append(time.perf_counter() - begin)
    return statistics.median(costs)


def main() -> None:
    """Print the table."""
    print(f'us a tick of 10 ms, median\n{"":22}{"swings":>14}')
    for count, links in ((1, 8), (100, 8), (1000, 1)):
        label = f'{count} of {links} link{"s" * (links > 1)}'
        print(f'{label:22}{tick_cost(count, links) * 1e6:14.1f}', flush=True)


def _shaken(bones: int, t: float) -> State:
    rate = 6 * np.pi
    axis = np.tile([0.2, 0.1, 0.3], (bones, 1))
    move = np.tile([0.0, 0.05, 0.02], (bones, 1))
    sin, cos = np.sin(rate * t), np.cos(rate * t)
    return State(move * sin, from_rotation_vector(axis * sin), move * rate * cos, axis * rate * cos)


if __name__ == '__main__':
    main()
