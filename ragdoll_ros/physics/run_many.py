"""Run many scenes for a time, side by side."""
from __future__ import annotations

import itertools
import os
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from ..model.scene import Scene
from .accuracy import Accuracy
from .simulation import Simulation


def run_many(scenes: Iterable[Scene], ticks: int, *, accuracy: str | Accuracy = 'normal',
             engine: str = 'auto', threads: int | None = None) -> Iterator[np.ndarray]:
    """Simulate scenes from their starts, each for so many ticks, on several threads.

    Engine rigid computes without Python's lock, so that threads share the processors. Scenes are
    taken as they are needed: ``scenes`` may be endless.

    Args:
        scenes: what to simulate.
        ticks: of each scene.
        accuracy: as of Simulation.
        engine: as of Simulation.
        threads: scenes that are simulated at once; None: as many as there are processors.

    Returns:
        Rows (ticks, n, 13) of each scene's states, in the order of the scenes: the same to the bit
        as by Simulation.run(), for any number of threads.

    Raises:
        RagdollError: as Simulation and its run() do, when the scene's turn comes.

    Example:
        >>> scenes = [load_scene('drop'), load_scene('flight')]
        >>> [rows.shape for rows in run_many(scenes, 50)]
        [(50, 10, 13), (50, 10, 13)]
    """
    count = threads or os.cpu_count() or 1

    def run(scene: Scene) -> np.ndarray:
        with Simulation(scene, accuracy=accuracy, engine=engine) as simulation:
            return simulation.run(ticks)

    left = iter(scenes)
    with ThreadPoolExecutor(count) as pool:
        running: deque[Future[np.ndarray]] = deque(
            pool.submit(run, scene) for scene in itertools.islice(left, 2 * count))
        while running:
            done = running.popleft().result()
            running.extend(pool.submit(run, scene) for scene in itertools.islice(left, 1))
            yield done
