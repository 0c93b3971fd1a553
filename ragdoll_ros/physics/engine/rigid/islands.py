"""Islands: the parts of a large cluster that cannot meet within a window of time.

In a cluster of many bodies few times of impact, or none, are located, as each costs a step of all
bodies. Where the cluster falls into islands that are small enough for a while, these are advanced
one by one, each with its own steps and impacts, from window to window (conservative
synchronization). The windows follow from positions and velocities of the cluster alone, so that
results do not depend on how work is split.
"""
import numpy as np

from ...kernels.loaded import advance as kernels

LARGE_CLUSTER, MOST_BODIES = 62, 20
"""Bodies from beyond which a cluster locates no impacts, see MIN_IMPACTS in kernels/advance.py, and
up to which an island locates as many as one body."""

MOST_HALVINGS = 6
"""How often the rest of a tick is halved at most to find a window."""


def next_window(job: np.ndarray, body_counts: np.ndarray, left: float,
                touching: float) -> tuple[float, np.ndarray]:
    """The longest window, ``left`` s divided by a power of two, in which a cluster falls into
    islands of at most MOST_BODIES, and the island (d,) of each doll. If there is none: 0 and one
    island.

    ``job``: of the cluster, see Cluster.job(). ``body_counts`` (d,): bodies of each doll.
    ``touching``: see Accuracy.
    """
    windows = left / 2.0 ** np.arange(MOST_HALVINGS + 1)
    labels = np.zeros((len(windows), len(body_counts)), np.int64)
    kernels.find_islands(job, windows, labels, touching)
    for window, label in zip(windows.tolist(), labels, strict=True):
        if np.bincount(label, body_counts).max() <= MOST_BODIES:
            return window, label
    return 0.0, np.zeros_like(labels[0])
