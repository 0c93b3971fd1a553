"""DrivenRobot: a robot of several links, moved by forward kinematics as commanded last.

Its frame moves at its twist and each joint at its rate for TIMEOUT after the command, then stands.
At the end of the tick in which a command begins, a joint is where its value and rate take it. Until
then it moves at a constant rate, so that links move along their arcs.
"""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.drive import MAX_SPEED
from ...model.pose import Pose
from ...model.robot import Robot
from ...model.scene import SECOND, Scene
from ...model.state import State
from ...model.vectors import finite_floats
from ..kernels.compiling.bundle import bind
from ..kernels.loaded import links as kernels
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
from .robot_links import bones_of, robot_links

NO_TWISTS = np.zeros(0, np.int64), np.zeros((0, 6))
"""Dolls, and their twists."""


@dataclass
class _FrameMotion(TwistMotion):
    """Motion of a robot's frame; until ``approach_end`` the frame gets from ``begin`` to it."""

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


class DrivenRobot:
    """A robot of a scene, and its motion. Times in ns."""

    def __init__(self, scene: Scene, robot: Robot) -> None:
        self.robot = robot
        self.dolls = _dolls_of(scene, robot)
        """(n,) dolls of the scene that its links are."""
        self._links = robot_links(scene, robot, self.dolls)
        self._rows = bind(self._links)
        self._address = self._rows[0].ctypes.data
        self.jumps = 0
        self._frame = _FrameMotion(robot.pose, AT_REST, -TIMEOUT)
        self._arrival = -TIMEOUT
        """Time from which on all stand."""
        self._stands = False
        """Whether the engine has no twists of the links other than zero."""

    def change_scene(self, scene: Scene) -> None:
        """Find the links in a scene with other dolls."""
        self.dolls = _dolls_of(scene, self.robot)
        self._links.bones[:] = bones_of(scene, self.dolls)

    @property
    def bones(self) -> list[int]:
        """(n,) bones of the links in the scene."""
        return self._links.bones.tolist()

    def frame(self, time: int) -> Pose:
        """Pose of the robot's frame at ``time``, world frame."""
        return self._frame.at(time)

    def is_stale(self, time: int) -> bool:
        """Whether no command has moved the robot yet, or the motion of its frame or of a joint that
        a command has moved is over.
        """
        motions = self._links.motions
        ends = motions['end'][motions['told'] > 0].tolist()
        if self._frame.told:
            ends.append(self._frame.end)
        return not ends or time >= min(ends)

    def moves(self, time: int) -> bool:
        """Whether the frame or a joint still moves."""
        return time < self._arrival

    def drive(self, command: MotionCommand, time: int, tick: int,
              state: State) -> list[tuple[int, Pose]]:
        """Begin a motion; see Simulation.drive_body(). Returns the dolls that jump, and the pose of
        the bone of each.
        """
        pose = None if command.pose is None else checked_pose(command.pose)
        twist = checked_twist(command.twist)
        told = np.array((self._checked('joint_angles', command.joint_angles, MAX_COORDINATE),
                         self._checked('rates', command.rates, MAX_SPEED)))
        begin, frame_told = self._frame.at(time), False
        if not (pose is None and command.twist is None and command.moves_joints):
            frame_told = self._frame.told
            self._frame = _FrameMotion(begin if pose is None else pose, twist, time, True)
        jumps, joints_told, self._arrival = kernels.set_joint_targets(
            self._address, np.concatenate(begin if pose is None else pose), told, time,
            time + tick, time + TIMEOUT, state.rows, JUMP_SPEED * tick / SECOND)
        if not jumps and pose is not None and _differ(begin, pose):
            self._frame.begin, self._frame.approach_end = begin, time + tick
        self._arrival = max(self._arrival, self._frame.arrival)
        if not jumps:
            return []
        self.jumps += frame_told or joints_told
        self.forget_twists()
        poses = self._links.poses.copy()
        return list(zip(self.dolls.tolist(), map(Pose, poses[:, :3], poses[:, 3:]), strict=True))

    def forget_twists(self) -> None:
        """Forget which twists were set, so that all are set again: the engine has others."""
        self._links.twists[:], self._stands = math.inf, False

    def changed_twists(self, time: int, end: int, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Dolls (m,) of links whose twists change, and their new twists (m, 6), constant until
        ``end``: m/s, rad/s. Takes them for set.
        """
        links = self._links
        if self.moves(time):
            self._stands = False
            count = kernels.change_twists(self._address, np.concatenate(self._frame.at(end)), time,
                                          end, state.rows)
            if count == len(self.dolls):
                return self.dolls, links.twists
        elif self._stands:
            return NO_TWISTS
        else:
            self._stands = True
            links.changed[:], links.twists[:] = links.twists.any(axis=1), 0
        return self.dolls[links.changed], links.twists[links.changed]

    def next_change(self, time: int, end: int) -> int:
        """Earliest time after ``time`` at which a motion changes, at most ``end``."""
        end = min((at for at in (self._frame.approach_end, self._frame.end) if at > time),
                  default=end)
        return kernels.next_joint_change(self._address, time, end)

    def _checked(self, key: str, given: Mapping[str, float] | None, most: float) -> list[float]:
        """Values (k,) of the driven joints; NaN: not given. Those of joints that mimic others are
        checked and left out.
        """
        values = [math.nan] * len(self.robot.driven)
        if given is None:
            return values
        if not isinstance(given, Mapping):
            raise errors.WrongForm(key, given, 'a mapping of names of joints to numbers')
        indices = self.robot.indices
        for name, value in given.items():
            if name in indices:
                values[indices[name]] = (
                    value if type(value) is float and -most <= value <= most
                    else _checked_number(f'{key}.{name}', value, most))
            elif name in self.robot.mimics:
                _checked_number(f'{key}.{name}', value, most)
            else:
                raise errors.UnknownJoint(f'{key}.{name}', name, errors.one_of(
                    list(indices), name) if indices else 'none: it has no joints that move')
        return values


def _dolls_of(scene: Scene, robot: Robot) -> np.ndarray:
    """Dolls (n,) of a scene that are the links of a robot."""
    names = {placement.name: doll for doll, placement in enumerate(scene.dolls)}
    return np.array([names[name] for name in robot.links.values()])


def _checked_number(path: str, value: object, most: float) -> float:
    """A number from -``most`` to ``most``. Raises WrongForm, NotFinite, OutOfRange."""
    number, = finite_floats(path, (value,), 1)
    errors.check_range(path, number, -most, most)
    return number


def _differ(a: Pose, b: Pose) -> bool:
    """Whether two poses are farther apart than NEGLIGIBLE, m or rad."""
    return bool(np.linalg.norm(a.position - b.position) > NEGLIGIBLE
                or rotation.angle_between(a.orientation, b.orientation) > NEGLIGIBLE)
