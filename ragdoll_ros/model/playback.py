"""Playback: how an animation moves a doll from the start of a simulation until it goes limp."""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from . import errors, rotation
from .dof_layout import GeneralizedState
from .motion_spline import MotionSpline
from .pose import Pose

MAX_SPEED = 100.0
"""Times as fast as in the file."""

SHORTEST_LOOP = 0.02
"""s of simulated time."""


@dataclass(frozen=True)
class Playback:
    """An animation that moves a doll, whatever acts on it, until the doll goes limp; then the doll
    falls, from the pose and with the velocities of that instant. With motors it only sets their
    targets. Times are simulated time since the start.

    Args:
        name: of the animation.
        motion: of the doll in the animation's frame.
        start: s within the animation.
        speed: times as fast as in the file, above 0 to 100.
        loop: whether it is repeated, from where it ended and facing as there; else the doll then
            stands until it goes limp.
        limp_at: s, when the doll goes limp; infinity: only when it is told to.
        limp_above: N: the doll goes limp when a push, a drive or a hand on it is stronger;
            infinity: never for that reason.
        file: absolute path of the animation's .bvh; None: it is of the doll's character.
        bones: names of joints of that file by those of bodies, where they were chosen.

    Raises:
        OutOfRange, NotPositive, NotFinite: for a number out of range, or a loop below 0.02 s.
    """

    name: str
    motion: MotionSpline
    start: float = 0.0
    speed: float = 1.0
    loop: bool = False
    limp_at: float = math.inf
    limp_above: float = math.inf
    file: str | None = None
    bones: Mapping[str, str] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        errors.check_range('start', self.start, 0.0, self.motion.duration)
        errors.check_positive('speed', self.speed)
        errors.check_range('speed', self.speed, 0.0, MAX_SPEED)
        for key in ('limp_at', 'limp_above'):
            errors.check_range(key, getattr(self, key), 0.0, math.inf)
        if self.loop and self.motion.duration < SHORTEST_LOOP * self.speed:
            raise errors.OutOfRange('loop', self.motion.duration,
                                    f'an animation that lasts {SHORTEST_LOOP:g} s at this speed')

    def phase(self, elapsed: float) -> float:
        """Time within the animation, s, ``elapsed`` s after the start."""
        return self._repetition(elapsed)[1]

    def _repetition(self, elapsed: float) -> tuple[int, float]:
        """Number of ends that have passed, and the time within the animation."""
        phase, duration = self.start + self.speed * elapsed, self.motion.duration
        if not self.loop:
            return 0, min(phase, duration)
        passed, rest = divmod(phase, duration)
        return int(passed), rest

    def left(self, elapsed: float) -> float:
        """Time, s, from ``elapsed`` s after the start until the animation ends or begins anew;
        infinity after its end.
        """
        left = (self.motion.duration - self.phase(elapsed)) / self.speed
        return left if left > 0 else math.inf

    def at(self, frame: Pose, velocity: np.ndarray, elapsed: float,
           further: float = 0.0) -> GeneralizedState:
        """Coordinates and velocities of the doll in the world, ``elapsed`` s after the start.

        Args:
            frame: pose of the animation's frame at the start.
            velocity: (3,) m/s, of that frame, until the animation ends.
            elapsed: s after the start.
            further: s by which to go on from there without beginning anew.
        """
        motion, layout = self.motion, self.motion.layout
        passed, phase = self._repetition(elapsed)
        if passed:
            frame = frame.compose(motion.repeated(passed))
        there = motion.at(min(phase + self.speed * further, motion.duration))
        end = math.inf if self.loop else (motion.duration - self.start) / self.speed
        moves = elapsed < end
        q, v = there.q, self.speed * there.v if moves else np.zeros_like(there.v)
        own = layout.root_positions[0], layout.root_orientations[0]
        here = frame.compose(Pose(q[own[0]], q[own[1]]))
        q[own[0]] = here.position + min(elapsed + further, end) * velocity
        q[own[1]] = here.orientation
        for at in (layout.root_velocities[0], layout.root_angular_velocities[0]):
            v[at] = rotation.rotate(frame.orientation, v[at])
        if moves:
            v[layout.root_velocities[0]] += velocity
        return GeneralizedState(q, v)
