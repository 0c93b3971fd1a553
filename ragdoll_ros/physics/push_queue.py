"""Pushes that wait or act: a bounded queue, and the wrench that each gives while it acts."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model import errors, rotation
from ..model.push import Push
from ..model.scene import SECOND, Scene
from ..model.state import State
from .engine.protocol import AppliedWrench

MOST_PUSHES = 1000
"""Pushes that may wait at once; one more is refused."""


@dataclass
class _Active:
    """A push with its times in ns; its wrench once it has begun."""

    push: Push
    bone: int
    start: int
    end: int
    channel: str | None
    wrench: AppliedWrench | None = None


class PushQueue:
    """Pushes of a scene in the order in which they came. Times in ns."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._queue: list[_Active] = []

    def bones(self, now: int) -> list[int]:
        """The bones that are being pushed."""
        return [active.bone for active in self._acting(now)]

    def add(self, push: Push, channel: str | None, now: int) -> None:
        """Queue a push; on a ``channel`` it takes the place of the last. See Simulation.push."""
        bone = self._scene.bone_index(push.bone)
        start = now if push.start is None else round(push.start * SECOND)
        if start < now:
            raise errors.OutOfRange('start', push.start, f'{now / SECOND:g} s or later')
        if channel is not None:
            self.release(channel)
        if len(self._queue) >= MOST_PUSHES:
            raise errors.OutOfRange('pushes', len(self._queue) + 1, f'at most {MOST_PUSHES}')
        end = start + max(1, round(push.duration * SECOND))
        self._queue.append(_Active(push, bone, start, end, channel))

    def release(self, channel: str) -> bool:
        """End the push on a channel now; whether there was one."""
        left = [active for active in self._queue if active.channel != channel]
        ended, self._queue = len(left) < len(self._queue), left
        return ended

    def drop_ended(self, now: int) -> None:
        """Forget pushes that are over."""
        self._queue = [active for active in self._queue if active.end > now]

    def acting(self, now: int) -> tuple[Push, ...]:
        """Pushes that act."""
        return tuple(active.push for active in self._acting(now))

    def wrenches(self, now: int, state: State) -> list[AppliedWrench]:
        """What acts on the bones; a push's point is tied to its bone when it begins."""
        return [self._wrench(active, state) for active in self._acting(now)]

    def next_change(self, now: int) -> int | None:
        """Instant at which the next push begins or ends; None if none does."""
        times = [time for active in self._queue for time in (active.start, active.end)]
        return min((time for time in times if time > now), default=None)

    def _acting(self, now: int) -> list[_Active]:
        return [active for active in self._queue if active.start <= now < active.end]

    @staticmethod
    def _wrench(active: _Active, state: State) -> AppliedWrench:
        if active.wrench is None:
            push = active.push
            point = np.array(push.point)
            if not push.local:
                point = rotation.rotate(rotation.inverse(state.orientations[active.bone]), point)
            active.wrench = AppliedWrench(active.bone, np.array(push.force), np.array(push.torque),
                                          point, push.local)
        return active.wrench
