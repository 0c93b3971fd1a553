"""Velocities of bones, and whether dolls fall freely, from places in successive frames, which every
source has.
"""
from __future__ import annotations

from collections import deque

import numpy as np

from ...model.scene import Scene
from ..sources.source import Frame

SPAN = 0.015
"""s of simulated time over which a velocity is measured at least: one or two frames."""

FALLING = 0.1
"""Largest difference between a doll's acceleration and gravity, relative to gravity, with which it
falls freely: then it is a rounding error, else contacts and hands make it as large as gravity."""


class Motion:
    """Velocities in the newest frame; zero until there is a second frame. Not thread-safe."""

    def __init__(self) -> None:
        self._frames: deque[Frame] = deque()

    @property
    def frame(self) -> Frame | None:
        """The newest frame; None before the first."""
        return self._frames[-1] if self._frames else None

    def add(self, frame: Frame) -> None:
        """Take note of a new frame; an earlier one, or another scene, starts anew."""
        last = self.frame
        if last is not None and (frame.scene is not last.scene or frame.time < last.time):
            self._frames.clear()
        elif last is not None and frame.time == last.time:
            self._frames.pop()
        self._frames.append(frame)
        while len(self._frames) > 3 and frame.time - self._frames[1].time >= SPAN:
            self._frames.popleft()

    @property
    def knows_falling(self) -> bool:
        """Whether there are frames enough to tell who falls."""
        return len(self._frames) > 2

    def velocities(self) -> np.ndarray:
        """Velocities of the bones' centres of mass, (n, 3) m/s."""
        last = self._frames[-1]
        first = next((frame for frame in reversed(self._frames) if last.time - frame.time >= SPAN),
                     self._frames[0])
        moved = last.state.positions - first.state.positions
        return moved / (last.time - first.time) if last.time > first.time else np.zeros_like(moved)

    def doll_velocity(self, bone: int) -> np.ndarray:
        """Velocity (3,) m/s of the centre of mass of the doll that has a bone."""
        return doll_mean(self._frames[-1].scene, bone, self.velocities())

    def falls(self, bone: int) -> bool:
        """Whether gravity alone accelerates the doll that has a bone."""
        if not self.knows_falling:
            return False
        frames = [self._frames[k] for k in (0, len(self._frames) // 2, -1)]
        places = [doll_mean(frame.scene, bone, frame.state.positions) for frame in frames]
        first, second = np.diff([frame.time for frame in frames])
        before, after = np.diff(places, axis=0) / [[first], [second]]
        gravity = np.array(frames[0].scene.gravity)
        difference = 2 * (after - before) / (first + second) - gravity
        return bool(np.linalg.norm(difference) <= FALLING * np.linalg.norm(gravity))


def doll_mean(scene: Scene, bone: int, vectors: np.ndarray) -> np.ndarray:
    """Mean of vectors (n, 3) of all bones over the doll that has a bone, weighted by mass."""
    part = scene.bone_slices[scene.doll_of_bone[bone]]
    masses = np.array([each.mass for each in scene.bones[part]])
    return masses @ vectors[part] / masses.sum()
