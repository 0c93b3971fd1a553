"""DrivenBodies: the motions of bodies with `follow`, from the last pose and twist of each.

A motion goes on at constant twist for TIMEOUT, then the body stands. A body that follows exactly
reaches its motion at the end of the tick in which the motion begins, and then moves with it. A body
that gives way is pulled to its motion by a stiff drive, whose target velocity has a part in
proportion to the distance, at most CATCH_UP_SPEED.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from ...model.robot import Robot
from ...model.scene import SECOND, Scene
from ...model.scene_change import SceneChange
from ...model.state import State
from ...model.vectors import clamp_norm
from ..engine.protocol import AppliedDrive
from .body_motion import (
    AT_REST,
    JUMP_SPEED,
    NEGLIGIBLE,
    TIMEOUT,
    MotionCommand,
    Twist,
    TwistMotion,
    checked_pose,
    checked_twist,
)

if TYPE_CHECKING:
    from .driven_robot import DrivenRobot

DRIVE_TIME = 1e-3
"""s in which a drive without limits would take up a difference of velocity."""

CATCH_UP_TIME, CATCH_UP_SPEED = 0.1, 1.0
"""s in which a body that gives way returns to its motion, and m/s or rad/s at most."""

LEASH = 0.02
"""m by which a twist without a pose lets a motion get ahead of a body that gives way."""


@dataclass
class _BoneMotion(TwistMotion):
    """Motion of a body's frame, and how the body's bone approaches this motion."""

    approach: Twist = AT_REST
    """Of the bone, until ``approach_end``, ns."""
    approach_end: int = -1


class _Body:
    """A body with `follow`, and its motion."""

    def __init__(self, scene: Scene, doll: int, state: State) -> None:
        self.placement, self.doll = scene.dolls[doll], doll
        self.bone = scene.bone_slices[doll].start
        self.shape_pose = self.placement.doll.root.pose
        """Pose of the bone's center of mass and principal axes in the body's frame."""
        self.reach = float(np.linalg.norm(self.placement.doll.root.shape.half_extents))
        self.jumps = 0
        self.engine_twist: Twist | None = None
        """The twist of the bone that the engine has."""
        self.hold(state, 0)

    def hold(self, state: State, time: int) -> None:
        """Stand where it is, from ``time``, ns, on."""
        self.motion = _BoneMotion(self.frame(state), AT_REST, time - TIMEOUT)
        self.engine_twist = None

    def drive(self, pose: Pose | None, twist: Twist, time: int, tick: int,
              state: State) -> Pose | None:
        """Begin a motion at ``time``. If the body jumps, returns the new pose of its bone, else
        None.
        """
        before, here = self.motion, self.frame(state)
        due = here if self.placement.is_kinematic else before.at(time)
        self.motion = _BoneMotion(
            pose or (here if self._distance(due, here) > LEASH else due), twist, time, True)
        if pose is None:
            return None
        off = self._distance(due, pose)
        if off > JUMP_SPEED * tick / SECOND:
            self.jumps += before.told
            return pose.compose(self.shape_pose)
        if self.placement.is_kinematic and off > NEGLIGIBLE:
            end, seconds = self.motion.at(time + tick).compose(self.shape_pose), tick / SECOND
            turn = rotation.multiply(end.orientation, rotation.inverse(
                state.orientations[self.bone]))
            self.motion.approach = ((end.position - state.positions[self.bone]) / seconds,
                                    rotation.rotation_vector(turn) / seconds)
            self.motion.approach_end = time + tick
        return None

    def twist(self, time: int, end: int) -> Twist:
        """Mean twist of the bone of a body that follows exactly, from ``time`` to ``end``, ns."""
        motion = self.motion
        if time < motion.approach_end:
            return motion.approach
        velocity, spin = motion.twist_at(time)
        arm = self.shape_pose.position
        if spin.any() and arm.any():
            before, after = (rotation.rotate(motion.at(t).orientation, arm) for t in (time, end))
            velocity = velocity + (after - before) * (SECOND / (end - time))
        return velocity, spin

    def moves(self, time: int) -> bool:
        """Whether the body moves; one that gives way counts as moving until its motion ends."""
        motion = self.motion
        if not self.placement.is_kinematic:
            return motion.told and time < motion.end
        return time < motion.approach_end or any(each.any() for each in motion.twist_at(time))

    def applied_drive(self, time: int, state: State) -> AppliedDrive:
        """The drive that pulls a body that gives way towards its motion."""
        due, bone = self.motion.at(time), self.placement.doll.root
        velocity, spin = self.motion.twist_at(time)
        center = due.compose(self.shape_pose)
        turn = rotation.multiply(center.orientation,
                                 rotation.inverse(state.orientations[self.bone]))
        targets = (
            velocity + np.cross(spin, center.position - due.position)
            + _catch_up(center.position - state.positions[self.bone]),
            spin + _catch_up(rotation.rotation_vector(turn)))
        follow = self.placement.follow
        return AppliedDrive(self.bone, np.array(targets),
                            (bone.mass / DRIVE_TIME, max(bone.inertia) / DRIVE_TIME),
                            (follow.max_force, follow.max_torque))

    def frame(self, state: State) -> Pose:
        """Pose of the body's frame in a state."""
        return Pose(state.positions[self.bone], state.orientations[self.bone]).compose(
            self.shape_pose.relative(Pose()))

    def _distance(self, a: Pose, b: Pose) -> float:
        """Distance, m, of the frame's origins at two poses, plus the angle times ``reach``."""
        turn = float(rotation.angle_between(a.orientation, b.orientation))
        return float(np.linalg.norm(a.position - b.position)) + turn * self.reach


class DrivenBodies:
    """All bodies of a scene with `follow`, alone or as links of a robot. Times in ns."""

    def __init__(self, scene: Scene, state: State) -> None:
        linked = scene.robot_of_body
        self._robots = {robot.name: _driven_robot(scene, robot) for robot in scene.robots}
        self._set_bodies({placement.name: _Body(scene, doll, state)
                          for doll, placement in enumerate(scene.dolls)
                          if placement.follow and placement.name not in linked})

    def _set_bodies(self, bodies: dict[str, _Body]) -> None:
        self._bodies = bodies
        self._exact = [body for body in bodies.values() if body.placement.is_kinematic]
        self._limited = [body for body in bodies.values() if not body.placement.is_kinematic]

    def change_scene(self, change: SceneChange, state: State) -> None:
        """Let the bodies that stay continue their motions; new ones stand."""
        bodies = DrivenBodies(change.after, state)._bodies
        for name, body in self._bodies.items():
            if name in bodies:
                body.doll, body.bone = bodies[name].doll, bodies[name].bone
                bodies[name] = body
        self._set_bodies(bodies)
        for robot in self._robots.values():
            robot.change_scene(change.after)

    @property
    def jumps(self) -> int:
        """Jumps of all bodies since the start."""
        return sum(body.jumps for body in (*self._bodies.values(), *self._robots.values()))

    def stale(self, time: int) -> tuple[str, ...]:
        """Names of the bodies that have no motion any more, or none yet."""
        return (*(name for name, body in self._bodies.items() if time >= body.motion.end),
                *(name for name, robot in self._robots.items() if robot.is_stale(time)))

    def drive(self, name: str, command: MotionCommand, time: int, tick: int,
              state: State) -> list[tuple[int, Pose]]:
        """Begin a motion; see Simulation.drive_body(). Returns the dolls that jump, and the pose of
        the bone of each.
        """
        if name in self._robots:
            return self._robots[name].drive(command, time, tick, state)
        body = self._body(name)
        for key in ('joint_angles', 'rates'):
            if getattr(command, key) is not None:
                raise errors.WrongForm(key, getattr(command, key), f'none: {name} is no robot')
        pose = None if command.pose is None else checked_pose(command.pose)
        jump = body.drive(pose, checked_twist(command.twist), time, tick, state)
        return [] if jump is None else [(body.doll, jump)]

    def pose(self, name: str, time: int, state: State) -> Pose:
        """Pose of the frame of a body, world frame. Raises UnknownDoll."""
        robot = self._robots.get(name)
        return robot.frame(time) if robot else self._body(name).frame(state)

    def _body(self, name: str) -> _Body:
        """The body of a name. Raises UnknownDoll."""
        if name not in self._bodies:
            names = [*self._bodies, *self._robots]
            raise errors.UnknownDoll('name', name, errors.one_of(names, name) if names else (
                'a body with follow; the scene has none'))
        return self._bodies[name]

    def hold(self, doll: int, state: State, time: int) -> None:
        """Let a doll, if it is one of these bodies, stand where it is."""
        for body in self._bodies.values():
            if body.doll == doll:
                body.hold(state, time)

    def forget_twists(self) -> None:
        """Forget which twists were set, so that all are set again: another state was restored."""
        for body in self._exact:
            body.engine_twist = None
        for robot in self._robots.values():
            robot.forget_twists()

    def twists(self, time: int, end: int, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Dolls (n,) that follow exactly and whose twists change, and their new twists (n, 6),
        constant until ``end``: m/s and rad/s. Takes them for set.
        """
        dolls: list[int] = []
        twists: list[np.ndarray] = []
        for body in self._exact:
            twist = body.twist(time, end)
            if body.engine_twist is None or not all(map(np.array_equal, twist, body.engine_twist)):
                body.engine_twist = twist
                dolls.append(body.doll)
                twists.append(np.concatenate(twist))
        changed = [robot.changed_twists(time, end, state) for robot in self._robots.values()]
        if len(changed) == 1 and not dolls:
            return changed[0]
        changed.append((np.array(dolls, np.int64), np.array(twists).reshape(-1, 6)))
        found, theirs = zip(*changed, strict=True)
        return np.concatenate(found), np.concatenate(theirs)

    def drives(self, time: int, state: State, sleeping: np.ndarray) -> list[AppliedDrive]:
        """Drives of the bodies that give way; none of those that sleep where they stand."""
        return [body.applied_drive(time, state) for body in self._limited
                if body.moves(time) or not sleeping[body.doll]]

    def moving_bones(self, time: int) -> list[int]:
        """Indices of the bones of bodies that are on their way."""
        return [*(body.bone for body in self._bodies.values() if body.moves(time)),
                *(bone for robot in self._robots.values() if robot.moves(time)
                  for bone in robot.bones)]

    def next_change(self, time: int, end: int) -> int:
        """Earliest time after ``time`` at which a motion changes, at most ``end``."""
        for body in self._bodies.values():
            for at in (body.motion.approach_end, body.motion.end):
                if time < at < end:
                    end = at
        for robot in self._robots.values():
            end = robot.next_change(time, end)
        return end


def _driven_robot(scene: Scene, robot: Robot) -> DrivenRobot:
    # Imported here: its kernels are compiled, or loaded, where there is a robot.
    from .driven_robot import DrivenRobot
    return DrivenRobot(scene, robot)


def _catch_up(missing: np.ndarray) -> np.ndarray:
    """Velocity (3,), m/s or rad/s, that makes up for what is ``missing``, m or rad: at most
    CATCH_UP_SPEED.
    """
    return np.array(clamp_norm((missing / CATCH_UP_TIME).tolist(), CATCH_UP_SPEED)[0])
