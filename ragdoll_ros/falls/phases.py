"""When a fall begins, hits and ends, from its frames alone."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.scene import Scene
from .fall import Phases


def find_phases(scene: Scene, states: np.ndarray, touching: np.ndarray, feet: Sequence[str],
                onset_speed: float, rest_speed: float) -> Phases:
    """Phases of t frames: ``states`` (t, n, 13), and which bones touch the ground (t, n)."""
    impact = first(touching[:, [name not in feet for name in scene.bone_names]].any(axis=1))
    if impact is None:
        return Phases()
    masses = np.array([bone.mass for bone in scene.bones])
    sinking = -(states[:, :, 9] * masses).sum(axis=1) / masses.sum()
    onset = first(sinking[:impact] > onset_speed)
    moves = np.flatnonzero(
        (np.linalg.norm(states[:, :, 7:10], axis=2) > rest_speed).any(axis=1))
    rest = int(moves[-1]) + 1 if len(moves) else 0
    return Phases(impact if onset is None else onset, impact,
                  max(rest, impact) if rest < len(states) else None)


def first(flags: np.ndarray) -> int | None:
    """Index of the first true one of ``flags`` (t,); None if there is none."""
    return int(flags.argmax()) if flags.any() else None
