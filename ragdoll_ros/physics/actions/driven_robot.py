"""DrivenRobot: a robot of several links, moved by forward kinematics from what it was told last.

Its frame moves on at its twist and each joint at its rate for TIMEOUT after it was told, then
stands. A value that is told is reached at the end of the tick in which it is: a joint turns there
at a constant rate, so that links move along their arcs.
"""
from __future__ import annotations

import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.drive import MAX_SPEED
from ...model.pose import Pose
from ...model.robot import Robot, Row
from ...model.scene import SECOND, Scene
from ...model.state import State
from ...model.vectors import finite_floats
from .body_motion import (
    AT_REST,
    JUMP_SPEED,
    NEGLIGIBLE,
    TIMEOUT,
    MotionCommand,
    TwistMotion,
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

    def __post_init__(self) -> None:
        self.goes_on = any(each.any() for each in self.twist)

    def at(self, time: int) -> Pose:
        if self.begin is None or time >= self.approach_end:
            return super().at(time) if self.goes_on else self.pose
        goal, part = super().at(self.approach_end), (time - self.since) / (
            self.approach_end - self.since)
        turn = rotation.rotation_vector(rotation.multiply(
            goal.orientation, rotation.inverse(self.begin.orientation)))
        return Pose(self.begin.position + part * (goal.position - self.begin.position),
                    rotation.multiply(rotation.from_rotation_vector(part * turn),
                                      self.begin.orientation))

    @property
    def arrival(self) -> int:
        """Time from which on it stands."""
        return max(self.approach_end, self.end if self.goes_on else -TIMEOUT)


@dataclass
class _JointMotion:
    """Motion of a joint at a constant rate, first from ``begin`` to it. Times in ns."""

    begin: float
    """rad or m when it was told."""
    value: float
    """rad or m that it was told."""
    rate: float = 0.0
    """rad/s or m/s"""
    since: int = -TIMEOUT
    approach_end: int = -TIMEOUT
    told: bool = False

    def at(self, time: int) -> float:
        """Value at ``time``."""
        if time < self.approach_end:
            span = self.approach_end - self.since
            goal = self.value + span / SECOND * self.rate
            return self.begin + (time - self.since) / span * (goal - self.begin)
        return self.value + (min(time, self.end) - self.since) / SECOND * self.rate

    @property
    def end(self) -> int:
        """Time from which on its rate is zero."""
        return self.since + TIMEOUT

    @property
    def arrival(self) -> int:
        """Time from which on it stands."""
        return max(self.approach_end, self.end if self.rate else -TIMEOUT)


class DrivenRobot:
    """A robot of a scene, and its motion. Times in ns."""

    def __init__(self, scene: Scene, robot: Robot) -> None:
        self.robot = robot
        self.find_links(scene)
        self._reach = np.array([np.linalg.norm(scene.dolls[doll].doll.root.shape.half_extents)
                                for doll in self.dolls])
        """(n,) m, from a link's frame to its farthest point at most."""
        self.jumps = 0
        self.engine_twist: list[tuple[float, ...]] | None = None
        """(n, 6) twists of the links that the engine has."""
        self._frame = _FrameMotion(robot.pose, AT_REST, -TIMEOUT)
        self._joints = [_JointMotion(value, value) for value in robot.start.tolist()]
        self.changes: set[int] = set()
        """Times at which motions change."""
        self._arrival = -TIMEOUT
        """Time from which on all stand."""

    def find_links(self, scene: Scene) -> None:
        """Find the dolls (n,) and bones (n,) of the links in a scene."""
        names = {placement.name: doll for doll, placement in enumerate(scene.dolls)}
        self.dolls = [names[name] for name in self.robot.links.values()]
        self.bones = [scene.bone_slices[doll].start for doll in self.dolls]

    def frame(self, time: int) -> Pose:
        """Pose of the robot's frame at ``time``, world frame."""
        return self._frame.at(time)

    def is_stale(self, time: int) -> bool:
        """Whether nothing has moved it yet, or one of what was told to move stands again."""
        ends = [motion.end for motion in (self._frame, *self._joints) if motion.told]
        return not ends or time >= min(ends)

    def moves(self, time: int) -> bool:
        """Whether it is on its way."""
        return time < self._arrival

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
            self._joints[index].told for index in (*angles, *rates))
        begin = self._frame.at(time)
        if moves_frame:
            self._frame = _FrameMotion(begin if pose is None else pose, twist, time, True)
        for index in {**angles, **rates}:
            self._tell_joint(index, angles.get(index), rates.get(index, 0.0), time)
        due = self.robot.link_poses(self._frame.pose if moves_frame else begin,
                                    np.array([joint.at(time) for joint in self._joints]))
        off = np.linalg.norm(due.position - state.positions[self.bones], axis=1)
        off += self._reach * rotation.angle_between(due.orientation, state.orientations[self.bones])
        if off.max() > JUMP_SPEED * tick / SECOND:
            self.jumps += bool(was_told)
            self.engine_twist = None
            self._note_times()
            return list(zip(self.dolls, map(Pose, *due), strict=True))
        if pose is not None and _differ(begin, pose):
            self._frame.begin, self._frame.approach_end = begin, time + tick
        for index in angles:
            joint = self._joints[index]
            if abs(joint.value - joint.begin) > NEGLIGIBLE:
                joint.approach_end = time + tick
        self._note_times()
        return []

    def changed_twists(self, time: int, end: int,
                       state: State) -> tuple[list[int], list[tuple[float, ...]]]:
        """Dolls (m,) of links whose twists change, and these (m, 6) until ``end``: m/s, rad/s."""
        twists, bound = [(0.0,) * 6] * len(self.dolls), 0.0
        if self.moves(time):
            seconds = (end - time) / SECOND
            frame = self._frame.at(end)
            goal = self.robot.link_rows((*frame.position.tolist(), *frame.orientation.tolist()),
                                        [joint.at(end) for joint in self._joints])
            bound = ROUNDING / seconds
            twists = [_twist(*rows, seconds, bound) for rows in zip(
                state.rows[self.bones].tolist(), goal, strict=True)]
        before = self.engine_twist or [(math.inf,) * 6] * len(self.dolls)
        changed = [index for index, pair in enumerate(zip(twists, before, strict=True))
                   if max(map(abs, map(operator.sub, *pair))) > bound]
        self.engine_twist = before
        for index in changed:
            before[index] = twists[index]
        return [self.dolls[index] for index in changed], [twists[index] for index in changed]

    def _note_times(self) -> None:
        """Note when motions change, and when all stand."""
        motions = [self._frame, *self._joints]
        self.changes = {at for motion in motions for at in (motion.approach_end, motion.end)}
        self._arrival = max(motion.arrival for motion in motions)

    def _tell_joint(self, index: int, angle: float | None, rate: float, time: int) -> None:
        """Let a joint move at a rate from an angle on; None: from where it is."""
        begin = self._joints[index].at(time)
        value = begin if angle is None else angle
        if self.robot.driven[index].kind == 'continuous':
            # It takes the shorter way.
            begin += round((value - begin) / math.tau) * math.tau
        self._joints[index] = _JointMotion(begin, value, rate, time, told=True)

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


def _twist(row: list[float], goal: Row, seconds: float, bound: float) -> tuple[float, ...]:
    """Twist (6,) that takes a link from a ``row`` (13,) of a state to its ``goal`` in some seconds;
    zero where that is rounding, ``bound``.
    """
    x, y, z, a, b, c, d, *_ = row
    X, Y, Z, e, f, g, h = goal
    # goal * inverse(row)
    i, j, k, r = (e * d - h * a - f * c + g * b, f * d - h * b + e * c - g * a,
                  g * d - h * c - e * b + f * a, h * d + e * a + f * b + g * c)
    sine = math.hypot(i, j, k)
    scale = (2 * math.atan2(sine, abs(r)) / sine if sine > 1e-12 else 2.0) / (
        seconds if r >= 0 else -seconds)
    twist = ((X - x) / seconds, (Y - y) / seconds, (Z - z) / seconds,
             scale * i, scale * j, scale * k)
    return twist if max(map(abs, twist)) > bound else (0.0,) * 6


def _differ(a: Pose, b: Pose) -> bool:
    """Whether two poses are farther apart than NEGLIGIBLE, m or rad."""
    return bool(np.linalg.norm(a.position - b.position) > NEGLIGIBLE
                or rotation.angle_between(a.orientation, b.orientation) > NEGLIGIBLE)
