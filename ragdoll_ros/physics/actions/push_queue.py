"""Pushes and drives that wait or act: a bounded queue, and what each does while it acts."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.drive import Drive
from ...model.push import Push
from ...model.scene import SECOND, Scene
from ...model.state import State
from ..engine.protocol import AppliedDrive, AppliedWrench

MOST_PUSHES = 1000
"""Pushes that may wait at once; one more is refused."""


@dataclass
class _Active:
    """A push with its times in ns; its wrench once it has begun."""

    push: Push | Drive
    bone: int
    start: int
    end: int
    channel: str | None
    wrench: AppliedWrench | None = None


class PushQueue:
    """Pushes and drives of a scene in the order in which they came. Times in ns."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._queue: list[_Active] = []

    def __len__(self) -> int:
        return len(self._queue)

    def bones(self, now: int) -> list[int]:
        """The bones that are being pushed."""
        return [active.bone for active in self._acting(now)]

    def add(self, push: Push | Drive, channel: str | None, now: int) -> None:
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
        """Pushes that act; a drive as the push that it is on a bone at rest."""
        return tuple(active.push.at_rest if isinstance(active.push, Drive) else active.push
                     for active in self._acting(now))

    def wrenches(self, now: int, state: State) -> list[AppliedWrench]:
        """What pushes do to the bones; a push's point is tied to its bone when it begins."""
        return [self._wrench(active, state) for active in self._acting(now)
                if isinstance(active.push, Push)]

    def drives(self, now: int) -> list[AppliedDrive]:
        """What drives do to the bones."""
        return [_applied(active.push, active.bone) for active in self._acting(now)
                if isinstance(active.push, Drive)]

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


def _applied(drive: Drive, bone: int) -> AppliedDrive:
    targets = drive.velocity, drive.angular_velocity
    gains = drive.force_per_speed, drive.torque_per_speed
    return AppliedDrive(
        bone, np.array([target or (0.0, 0.0, 0.0) for target in targets]),
        tuple(0.0 if target is None else gain
              for target, gain in zip(targets, gains, strict=True)),
        (drive.most_force, drive.most_torque))
