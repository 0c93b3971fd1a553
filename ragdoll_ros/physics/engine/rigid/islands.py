"""Islands: the parts of a large cluster that cannot meet within a window of time.

In a cluster of many bodies few impacts are located, as each costs the whole. Where it falls into
islands that are small enough for a while, these are advanced one by one, each with its own steps
and impacts, from window to window (conservative synchronization). The windows follow from positions
and velocities of the cluster alone, so that results do not depend on how work is split.
"""
import numpy as np

from ...kernels.loaded import advance as kernels

LARGE_CLUSTER, MOST_BODIES = 62, 20
"""Bodies from beyond which a cluster locates no impacts, see MIN_IMPACTS in kernels/advance.py, and
up to which an island locates as many as one body."""

MOST_HALVINGS = 6
"""The shortest window is this many times a half of a tick."""


def next_window(job: np.ndarray, body_counts: np.ndarray, left: float) -> tuple[float, np.ndarray]:
    """The longest window, ``left`` s halved some times, in which a cluster falls into islands of at
    most MOST_BODIES, and the island (d,) of each doll; 0 where there is none.

    ``job``: of the cluster, see Cluster.job(). ``body_counts`` (d,): bodies of each doll.
    """
    label = np.zeros(len(body_counts), np.int64)

    def falls_apart(window: float) -> bool:
        kernels.find_islands(job, window, label)
        return bool(np.bincount(label, body_counts).max() <= MOST_BODIES)

    windows = [left / 2 ** halvings for halvings in range(MOST_HALVINGS + 1)]
    if not falls_apart(windows[-1]):
        return 0.0, label
    return next(window for window in windows if falls_apart(window)), label
