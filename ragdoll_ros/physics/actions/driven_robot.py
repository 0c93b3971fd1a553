"""DrivenRobot: a robot of several links, moved by forward kinematics from what it was told last.

Its frame moves on at its twist and each joint at its rate for TIMEOUT after it was told, then
stands. A value that is told is reached at the end of the tick in which it is: a joint turns there
at a constant rate, so that links move along their arcs.
"""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.drive import MAX_SPEED
from ...model.pose import Pose
from ...model.robot import Robot
from ...model.scene import SECOND, Scene
from ...model.state import State
from ...model.vectors import finite_floats
from .body_motion import (
    AT_REST,
    JUMP_SPEED,
    NEGLIGIBLE,
    TIMEOUT,
    TwistMotion,
    MotionCommand,
    checked_pose,
    checked_twist,
)
from .grab import MAX_COORDINATE

ROUNDING = 1e-12
"""m or rad: a twist that takes a link no farther from where it should be is not changed."""


@dataclass
class _FrameMotion(TwistMotion):
    """Motion of a robot's frame, which first gets from ``begin`` to it."""

    begin: Pose | None = None
    approach_end: int = -1
    """ns"""

    def at(self, time: int) -> Pose:
        if self.begin is None or time >= self.approach_end:
            return super().at(time)
        goal, part = super().at(self.approach_end), (time - self.since) / (
            self.approach_end - self.since)
        turn = rotation.rotation_vector(rotation.multiply(
            goal.orientation, rotation.inverse(self.begin.orientation)))
        return Pose(self.begin.position + part * (goal.position - self.begin.position),
                    rotation.multiply(rotation.from_rotation_vector(part * turn),
                                      self.begin.orientation))

    def moves(self, time: int) -> bool:
        """Whether it is on its way."""
        return (self.begin is not None and time < self.approach_end) or any(
            each.any() for each in self.twist_at(time))


class _JointMotions:
    """Motions of k joints at constant rates, each first from ``begin`` to it. Times in ns."""

    def __init__(self, values: np.ndarray) -> None:
        count = len(values)
        self.begin, self.values, self.rates = values, values.copy(), np.zeros(count)
        """(k,) rad or m when each was told, those that it was told; rad/s or m/s."""
        self.since = np.full(count, -TIMEOUT)
        self.approach_end = np.full(count, -TIMEOUT)
        self.told = np.zeros(count, bool)

    def at(self, time: int) -> np.ndarray:
        """(k,) values at ``time``."""
        gone = (np.minimum(time, self.since + TIMEOUT) - self.since) / SECOND
        near = time < self.approach_end
        if not near.any():
            return self.values + gone * self.rates
        span = np.maximum(self.approach_end - self.since, 1)
        goal = self.values + span / SECOND * self.rates
        part = (time - self.since) / span
        return np.where(near, self.begin + part * (goal - self.begin),
                        self.values + gone * self.rates)

    def moves(self, time: int) -> bool:
        """Whether one is on its way."""
        return bool(((time < self.approach_end)
                     | (time < self.since + TIMEOUT) & (self.rates != 0)).any())


class DrivenRobot:
    """A robot of a scene, and its motion. Times in ns."""

    def __init__(self, scene: Scene, robot: Robot) -> None:
        self.robot = robot
        self.find_links(scene)
        self._reach = np.array([np.linalg.norm(scene.dolls[doll].doll.root.shape.half_extents)
                                for doll in self.dolls])
        """(n,) m, from a link's frame to its farthest point at most."""
        self.jumps = 0
        self.engine_twist: np.ndarray | None = None
        """(n, 6) twists of the links that the engine has."""
        self._frame = _FrameMotion(robot.pose, AT_REST, -TIMEOUT)
        self._joints = _JointMotions(robot.start)

    def find_links(self, scene: Scene) -> None:
        """Find the dolls (n,) and bones (n,) of the links in a scene."""
        names = {placement.name: doll for doll, placement in enumerate(scene.dolls)}
        self.dolls = np.array([names[name] for name in self.robot.links.values()])
        self.bones = [scene.bone_slices[doll].start for doll in self.dolls]

    def frame(self, time: int) -> Pose:
        """Pose of the robot's frame at ``time``, world frame."""
        return self._frame.at(time)

    def is_stale(self, time: int) -> bool:
        """Whether nothing has moved it yet, or one of what was told to move stands again."""
        times = [*self._joints.since[self._joints.told], *[self._frame.since] * self._frame.told]
        return not times or time >= min(times) + TIMEOUT

    def moves(self, time: int) -> bool:
        """Whether it is on its way."""
        return self._frame.moves(time) or self._joints.moves(time)

    def changes(self) -> Iterator[int]:
        """Times at which motions change."""
        yield from (self._frame.approach_end, self._frame.end)
        yield from self._joints.approach_end.tolist()
        yield from (self._joints.since + TIMEOUT).tolist()

    def drive(self, command: MotionCommand, time: int, tick: int,
              state: State) -> list[tuple[int, Pose]]:
        """Begin a motion; see Simulation.drive_body(). Returns the dolls that jump, and the pose of
        the bone of each.
        """
        pose = None if command.pose is None else checked_pose(command.pose)
        twist = checked_twist(command.twist)
        angles = self._checked('joint_angles', command.joint_angles, MAX_COORDINATE)
        rates = self._checked('rates', command.rates, MAX_SPEED)
        moves_frame = not (pose is None and command.twist is None and command.moves_joints)
        was_told = (moves_frame and self._frame.told) or any(
            self._joints.told[index] for index in (*angles, *rates))
        begin = self._frame.at(time)
        if moves_frame:
            self._frame = _FrameMotion(begin if pose is None else pose, twist, time, True)
        told = self._tell_joints(angles, rates, time)
        due = self.robot.link_poses(self._frame.pose if moves_frame else begin,
                                    self._joints.at(time))
        off = np.linalg.norm(due.position - state.positions[self.bones], axis=1)
        off += self._reach * rotation.angle_between(due.orientation, state.orientations[self.bones])
        if off.max() > JUMP_SPEED * tick / SECOND:
            self.jumps += bool(was_told)
            self._joints.begin[told] = self._joints.values[told]
            self.engine_twist = None
            return list(zip(self.dolls.tolist(), map(Pose, *due), strict=True))
        if pose is not None and _differ(begin, pose):
            self._frame.begin, self._frame.approach_end = begin, time + tick
        joints = self._joints
        told &= np.abs(joints.values - joints.begin) > NEGLIGIBLE
        joints.approach_end[told] = time + tick
        return []

    def changed_twists(self, time: int, end: int,
                       state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Dolls (m,) of links whose twists change, and these until ``end``: velocities (m, 3) m/s
        and angular velocities (m, 3) rad/s.
        """
        twists = np.zeros((len(self.dolls), 6))
        bound = 0.0
        if self.moves(time):
            seconds = (end - time) / SECOND
            goal = self.robot.link_poses(self._frame.at(end), self._joints.at(end))
            twists[:, :3] = (goal.position - state.positions[self.bones]) / seconds
            twists[:, 3:] = rotation.rotation_vector(rotation.multiply(
                goal.orientation, rotation.inverse(state.orientations[self.bones]))) / seconds
            bound = ROUNDING / seconds
            twists[np.abs(twists).max(axis=1) <= bound] = 0
        if self.engine_twist is None:
            self.engine_twist = np.full_like(twists, np.inf)
        changed = np.abs(twists - self.engine_twist).max(axis=1) > bound
        self.engine_twist[changed] = twists[changed]
        return self.dolls[changed], twists[changed, :3], twists[changed, 3:]

    def _tell_joints(self, angles: dict[int, float], rates: dict[int, float],
                     time: int) -> np.ndarray:
        """Let joints move at ``rates`` from ``angles`` on, by index; returns which (k,)."""
        joints, here = self._joints, self._joints.at(time)
        indices = [*angles, *(index for index in rates if index not in angles)]
        joints.begin[indices] = joints.values[indices] = here[indices]
        joints.values[list(angles)] = list(angles.values())
        # A continuous joint takes the shorter way.
        turned = joints.values - joints.begin
        joints.begin += np.where(self.robot.is_continuous,
                                 np.round(turned / (2 * np.pi)) * 2 * np.pi, 0)
        joints.rates[indices] = 0
        joints.rates[list(rates)] = list(rates.values())
        joints.since[indices], joints.approach_end[indices] = time, -TIMEOUT
        joints.told[indices] = True
        told = np.zeros(len(here), bool)
        told[indices] = True
        return told

    def _checked(self, key: str, given: Mapping[str, float] | None,
                 most: float) -> dict[int, float]:
        """Values by the indices of joints; those that mimic others are checked and left out."""
        if given is not None and not isinstance(given, Mapping):
            raise errors.WrongForm(key, given, 'a mapping of names of joints to numbers')
        robot, values = self.robot, {}
        for name, value in (given or {}).items():
            where = f'{key}.{name}'
            if name not in robot.indices and name not in robot.mimics:
                raise errors.UnknownJoint(where, name, errors.one_of(list(robot.indices), name)
                                          if robot.indices else 'none: it has no joints that move')
            number, = finite_floats(where, (value,), 1)
            errors.check_range(where, number, -most, most)
            if name in robot.indices:
                values[robot.indices[name]] = number
        return values


def _differ(a: Pose, b: Pose) -> bool:
    """Whether two poses are farther apart than NEGLIGIBLE, m or rad."""
    return bool(np.linalg.norm(a.position - b.position) > NEGLIGIBLE
                or rotation.angle_between(a.orientation, b.orientation) > NEGLIGIBLE)
