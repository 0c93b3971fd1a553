"""PushQueue: a bounded queue of pushes and drives, and the loads of those that are active."""
import dataclasses
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.drive import Drive
from ...model.push import Push
from ...model.scene import SECOND, Scene
from ...model.scene_change import SceneChange
from ...model.state import State
from ..engine.protocol import AppliedDrive, AppliedWrench

MAX_PUSHES = 1000
"""Length of the queue."""


@dataclass
class _QueuedPush:
    """A push or drive with its times, ns, and its wrench once it has begun."""

    push: Push | Drive
    bone: int
    start: int
    end: int
    channel: str | None
    wrench: AppliedWrench | None = None


class PushQueue:
    """Pushes and drives of a scene, in the order of their arrival. Times in ns."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._queue: list[_QueuedPush] = []

    def __len__(self) -> int:
        return len(self._queue)

    def bones(self, now: int) -> list[int]:
        """Indices of the bones under active pushes and drives."""
        return [queued.bone for queued in self._active(now)]

    def add(self, push: Push | Drive, channel: str | None, now: int) -> None:
        """Queue a push; see Simulation.push()."""
        bone = self._scene.bone_index(push.bone)
        start = now if push.start is None else round(push.start * SECOND)
        if start < now:
            raise errors.OutOfRange('start', push.start, f'{now / SECOND:g} s or later')
        if channel is not None:
            self.release(channel)
        if len(self._queue) >= MAX_PUSHES:
            raise errors.OutOfRange('pushes', len(self._queue) + 1, f'at most {MAX_PUSHES}')
        end = start + max(1, round(push.duration * SECOND))
        self._queue.append(_QueuedPush(push, bone, start, end, channel))

    def release(self, channel: str) -> bool:
        """End the push on a channel; returns whether there was one."""
        left = [queued for queued in self._queue if queued.channel != channel]
        ended, self._queue = len(left) < len(self._queue), left
        return ended

    def drop_ended(self, now: int) -> None:
        """Remove pushes that have ended."""
        self._queue = [queued for queued in self._queue if queued.end > now]

    def change_scene(self, change: SceneChange) -> None:
        """Keep the pushes on dolls that stay."""
        self._scene, queue, self._queue = change.after, self._queue, []
        for queued in queue:
            bone = int(change.new_bones[queued.bone])
            if bone >= 0:
                self._queue.append(dataclasses.replace(
                    queued, bone=bone,
                    push=dataclasses.replace(queued.push, bone=change.after.bone_names[bone]),
                    wrench=queued.wrench and dataclasses.replace(queued.wrench, bone=bone)))

    def active(self, now: int) -> tuple[Push, ...]:
        """Active pushes; a drive as the push that it exerts on a bone at rest."""
        return tuple(queued.push.at_rest if isinstance(queued.push, Drive) else queued.push
                     for queued in self._active(now))

    def wrenches(self, now: int, state: State) -> list[AppliedWrench]:
        """Loads of active pushes; a push's point is fixed in its bone's frame when it begins."""
        return [self._wrench(queued, state) for queued in self._active(now)
                if isinstance(queued.push, Push)]

    def drives(self, now: int) -> list[AppliedDrive]:
        """Loads of active drives."""
        return [_applied(queued.push, queued.bone) for queued in self._active(now)
                if isinstance(queued.push, Drive)]

    def next_change(self, now: int) -> int | None:
        """Time of the next start or end of a push; None without one."""
        times = [time for queued in self._queue for time in (queued.start, queued.end)]
        return min((time for time in times if time > now), default=None)

    def _active(self, now: int) -> list[_QueuedPush]:
        return [queued for queued in self._queue if queued.start <= now < queued.end]

    @staticmethod
    def _wrench(queued: _QueuedPush, state: State) -> AppliedWrench:
        if queued.wrench is None:
            push = queued.push
            point = np.array(push.point)
            if not push.local:
                point = rotation.rotate(rotation.inverse(state.orientations[queued.bone]), point)
            queued.wrench = AppliedWrench(queued.bone, np.array(push.force), np.array(push.torque),
                                          point, push.local)
        return queued.wrench


def _applied(drive: Drive, bone: int) -> AppliedDrive:
    targets = drive.velocity, drive.angular_velocity
    gains = drive.force_per_speed, drive.torque_per_speed
    return AppliedDrive(
        bone, np.array([target or (0.0, 0.0, 0.0) for target in targets]),
        tuple(0.0 if target is None else gain
              for target, gain in zip(targets, gains, strict=True)),
        (drive.most_force, drive.most_torque))
