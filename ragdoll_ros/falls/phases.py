"""When a fall begins, hits and ends, from its frames alone."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.scene import Scene
from .fall import Phases

LASTS = 0.1
"""Time, s, for which a body sinks that falls; less is a knee that gives a little."""


def find_phases(scene: Scene, states: np.ndarray, touching: np.ndarray, feet: Sequence[str],
                lasts: int, onset_speed: float, rest_speed: float) -> Phases:
    """Phases of t frames: ``states`` (t, n, 13), and which bones touch the ground (t, n). LASTS are
    ``lasts`` frames.
    """
    impact = first(touching[:, [name not in feet for name in scene.bone_names]].any(axis=1))
    if impact is None:
        return Phases()
    masses = np.array([bone.mass for bone in scene.bones])
    sinking = -(states[:, :, 9] * masses).sum(axis=1) / masses.sum()
    sinks = sinking[:impact] > onset_speed
    onset = next((frame for frame in np.flatnonzero(sinks).tolist()
                  if sinks[frame:frame + lasts].all()), impact)
    moves = np.flatnonzero(
        (np.linalg.norm(states[:, :, 7:10], axis=2) > rest_speed).any(axis=1))
    rest = int(moves[-1]) + 1 if len(moves) else 0
    return Phases(onset, impact,
                  max(rest, impact) if rest < len(states) else None)


def first(flags: np.ndarray) -> int | None:
    """Index of the first true one of ``flags`` (t,); None if there is none."""
    return int(flags.argmax()) if flags.any() else None
