"""Phases of a fall and impacts of its body parts, computed from its frames alone.

As in Choi et al. 2015, the descent lasts from the onset of the fall to the impact of the pelvis;
speeds at impact are vertical, before the first contact with the ground.
"""
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.scene import Scene
from .real_falls import bones_of

ONSET_SPEED, ONSET_DURATION, REST_SPEED = 0.1, 0.1, 0.05
"""m/s, s, m/s: default thresholds. A knee that yields for a shorter time is no onset."""


@dataclass(frozen=True)
class Phases:
    """Frame indices at which a fall begins, first hits the ground and ends; None if never."""

    onset: int | None = None
    """First frame from which the whole body's centre of mass descends faster than the onset speed
    for ONSET_DURATION, or until ``impact``; equal to ``impact`` if there is none before it."""
    impact: int | None = None
    """First contact: first frame in which a bone other than the feet touches the ground."""
    rest: int | None = None
    """First frame, not before ``impact``, from which no bone is faster than the rest speed."""


def find_phases(scene: Scene, states: np.ndarray, touching: np.ndarray, feet: Sequence[str],
                onset_frames: int, onset_speed: float = ONSET_SPEED,
                rest_speed: float = REST_SPEED) -> Phases:
    """Phases from ``states`` (t, n, 13), as State.rows, and ground contacts ``touching`` (t, n).

    ``feet`` are names of bones, ``onset_frames`` is ONSET_DURATION in frames, speeds are in m/s.
    """
    contact = touching[:, [name not in feet for name in scene.bone_names]].any(axis=1)
    if not contact.any():
        return Phases()
    impact = int(contact.argmax())
    masses = np.array([bone.mass for bone in scene.bones])
    sinking = -(states[:, :, 9] * masses).sum(axis=1) / masses.sum()
    sinks = sinking[:impact] > onset_speed
    onset = next((frame for frame in np.flatnonzero(sinks).tolist()
                  if sinks[frame:frame + onset_frames].all()), impact)
    moves = np.flatnonzero((np.linalg.norm(states[:, :, 7:10], axis=2) > rest_speed).any(axis=1))
    rest = int(moves[-1]) + 1 if len(moves) else 0
    return Phases(onset, impact, max(rest, impact) if rest < len(states) else None)


def bone_impacts(states: np.ndarray, touching: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First contact of each of n bones with the ground, from arrays as for find_phases.

    Returns the frame (n,) in which the bone first touches, and the velocity (n, 3) m/s of its
    centre of mass in the frame before; NaN for bones that never touch or touch from the start.
    """
    n = touching.shape[1]
    first = touching.argmax(axis=0) if len(touching) else np.zeros(n, int)
    frames = np.where(first > 0, first, np.nan)
    if not (first > 0).any():
        return frames, np.full((n, 3), np.nan)
    return frames, np.where((first > 0)[:, None], states[first - 1, np.arange(n), 7:10], np.nan)


def part_impact(part: str, names: Sequence[str], frames: np.ndarray,
                speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frame and speed (...) at which a body part, such as 'pelvis', first hits; NaN if never.

    ``frames`` and ``speeds`` (..., n) are those of the bones ``names``; (...) is the shape of the
    falls.
    """
    bones = bones_of(part, list(names))
    if not bones:
        return np.full((2, *frames.shape[:-1]), np.nan)
    own = frames[..., bones]
    first = np.where(np.isnan(own), np.inf, own).argmin(axis=-1)[..., None]
    return (np.take_along_axis(own, first, axis=-1)[..., 0],
            np.take_along_axis(speeds[..., bones], first, axis=-1)[..., 0])
