"""Joint springs: springs on joint angles with a torque limit, as of muscles or motors.

``Simulation.hold`` puts one on an angle; a doll with motors begins with one on each. A target that
is told with a rate moves on at it for TIMEOUT, then stands. Times in ns.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...model import errors
from ...model.drive import MAX_SPEED
from ...model.motors import MAX_STIFFNESS
from ...model.scene import SECOND, Scene
from ...model.scene_change import SceneChange
from ..engine.protocol import AppliedJointSpring
from .body_motion import TIMEOUT


@dataclass(frozen=True)
class JointSpring:
    """A spring on a joint angle; its torque is at most strength times ``max_torque``.

    Args:
        angle: one of Scene.angle_names.
        target: rad, now.
        stiffness: N m/rad.
        damping: N m s/rad.
        max_torque: N m.
        strength: 0 to 1, by which stiffness, damping and max_torque are multiplied.
    """

    angle: str
    target: float
    stiffness: float
    damping: float
    max_torque: float = math.inf
    strength: float = 1.0


@dataclass(frozen=True)
class _Spring:
    """A spring at full strength, with the target that it had at ``since``, and its strength."""

    full: AppliedJointSpring
    strength: float = 1.0
    since: int = 0
    """ns"""

    @property
    def moves(self) -> bool:
        return self.full.rate != 0.0

    @property
    def end(self) -> int:
        """Time at which its target stands."""
        return self.since + round(self.full.left * SECOND) if self.moves else self.since

    def target(self, time: int) -> float:
        """Target at ``time``, rad."""
        seconds = (min(time, self.end) - self.since) / SECOND
        return self.full.target + self.full.rate * seconds

    def aimed(self, target: float, rate: float, left: float, time: int) -> _Spring:
        """The spring with another target, which moves at ``rate`` for ``left`` s."""
        full = self.full  # dataclasses.replace() would take three times as long, for each motor
        return _Spring(AppliedJointSpring(full.bone, full.axis, target, full.stiffness,
                                          full.damping, full.most, rate, left),
                       self.strength, time)

    def applied(self, time: int) -> AppliedJointSpring:
        """The spring as it acts from ``time`` on."""
        full, strength = self.full, self.strength
        moves = self.moves and time < self.end
        return AppliedJointSpring(
            full.bone, full.axis, self.target(time), strength * full.stiffness,
            strength * full.damping, strength * full.most,
            full.rate if moves else 0.0, (self.end - time) / SECOND if moves else math.inf)


class JointSprings:
    """The joint springs of a scene, at most one for each angle."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._names = scene, scene.angle_names
        self._all: dict[str, _Spring] = {}
        for placement in scene.dolls:
            if placement.motors is not None:
                for name, motor in placement.motors.of(placement.doll).items():
                    angle = scene.qualified(placement, name)
                    bone, axis = self._axes[self._index(angle)]
                    self._all[angle] = _Spring(AppliedJointSpring(
                        bone, axis, placement.start.angles.get(name, 0.0), *motor),
                        placement.motors.strength)
        self._forget()

    def __bool__(self) -> bool:
        return bool(self._active)

    def joint_springs(self, time: int) -> tuple[JointSpring, ...]:
        """All joint springs, each with its target at ``time``."""
        return tuple(JointSpring(name, each.target(time), each.full.stiffness, each.full.damping,
                                 each.full.most, each.strength)
                     for name, each in self._all.items())

    def springs(self, time: int) -> tuple[AppliedJointSpring, ...]:
        """Springs for Engine.advance() from ``time`` on; none without strength."""
        if self._standing is None:
            applied = tuple(each.applied(time) for each in self._active)
            if any(each.rate for each in applied):
                return applied
            self._standing = applied
        return self._standing

    def next_change(self, time: int, end: int) -> int:
        """Earliest time after ``time`` at which a target stops moving, at most ``end``."""
        return min((each.end for each in self._active if each.moves and time < each.end < end),
                   default=end)

    def hold(self, angle: str, stiffness: float, damping: float, target: float | None,
             max_torque: float, angles: np.ndarray) -> None:
        """Add or replace a spring, see Simulation.hold(); ``angles`` (k,) rad: the current ones."""
        index = self._index(angle)
        if self._axes[index] is None:
            raise errors.WrongAxes('angle', angle, 'no ball joint without limits: it has no angles')
        for key, value, most in (('stiffness', stiffness, MAX_STIFFNESS),
                                 ('damping', damping, MAX_STIFFNESS),
                                 ('max_torque', max_torque, math.inf)):
            errors.check_range(key, value, 0.0, most)
        aim = float(angles[index]) if target is None else float(target)
        errors.check_finite('target', (aim,))
        bone, axis = self._axes[index]
        self._all[angle] = _Spring(AppliedJointSpring(
            bone, axis, aim, float(stiffness), float(damping), float(max_torque)))
        self._forget()

    def set_targets(self, angles: Mapping[str, float], rates: Mapping[str, float],
                    time: int) -> None:
        """Set targets, see Simulation.set_pose_target()."""
        for key, given, most in (('joint_angles', angles, math.inf), ('rates', rates, MAX_SPEED)):
            for name, value in given.items():
                self._index(name)
                if name not in self._all:
                    raise errors.WrongForm(f'{key}.{name}', name,
                                           'an angle with a spring: of motors, or of hold()')
                errors.check_finite(f'{key}.{name}', (value,))
                errors.check_range(f'{key}.{name}', value, -most, most)
        for name in {**angles, **rates}:
            spring = self._all[name]
            self._all[name] = spring.aimed(
                float(angles.get(name, spring.target(time))), float(rates.get(name, 0.0)),
                TIMEOUT / SECOND, time)
        self._forget()

    def follow(self, doll: int, angles: np.ndarray, rates: np.ndarray, time: int) -> None:
        """Set the targets of a doll's springs to ``angles`` (k,) rad; they move on at ``rates``
        (k,), rad/s, for TIMEOUT.
        """
        names = self._scene.angle_names_of(self._scene.dolls[doll])
        for name, angle, rate in zip(names, angles.tolist(), rates.tolist(), strict=True):
            if name in self._all:
                self._all[name] = self._all[name].aimed(angle, rate, TIMEOUT / SECOND, time)
        self._forget()

    def set_strengths(self, strengths: Mapping[str, float]) -> None:
        """Set strengths of springs, by the names of angles or of bones below joints."""
        for strength in strengths.values():
            errors.check_range('strength', strength, 0.0, 1.0)
        found = {angle: float(strength) for name, strength in strengths.items()
                 for angle in self._angles(name)}
        for angle in found.keys() & self._all.keys():
            self._all[angle] = dataclasses.replace(self._all[angle], strength=found[angle])
        self._forget()

    def changed(self, change: SceneChange) -> JointSprings:
        """Joint springs after a scene change: of dolls that stay, and of the motors of
        new dolls.
        """
        after = JointSprings(change.after)
        for placement, old in zip(change.after.dolls, change.old_dolls, strict=True):
            for name in change.after.angle_names_of(placement) if old >= 0 else ():
                after._all.pop(name, None)
        names = change.angle_names if self._all else {}
        after._all |= {
            names[angle]: dataclasses.replace(each, full=dataclasses.replace(
                each.full, bone=int(change.new_bones[each.full.bone])))
            for angle, each in self._all.items() if angle in names}
        after._forget()
        return after

    def go_limp(self, angles: Sequence[str] | None) -> None:
        """Remove the springs of these angles; None: of all."""
        if angles is None:
            self._all.clear()
        for angle in angles or ():
            self._index(angle)
            self._all.pop(angle, None)
        self._forget()

    def _forget(self) -> None:
        """Update which springs act, and discard the kept result of springs()."""
        self._active = [each for each in self._all.values() if each.strength > 0]
        self._standing: tuple[AppliedJointSpring, ...] | None = None
        """What springs() returns while no target moves."""

    def _angles(self, name: str) -> list[str]:
        """The angle of a name, or those of the joint above the bone of this name."""
        if name in self._indices:
            return [name]
        bones = self._scene.bone_names
        if name not in bones:
            raise errors.UnknownJoint('names', name, errors.one_of((*self._names, *bones), name))
        bone = bones.index(name)
        return [angle for angle, at in zip(self._names, self._axes, strict=True)
                if at is not None and at[0] == bone]

    @cached_property
    def _axes(self) -> list[tuple[int, int] | None]:
        """Child bone and axis index of each angle; None for a ball joint without angles."""
        scene = self._scene
        return [None if joint.is_free_ball else (
            scene.bone_index(scene.qualified(placement, joint.child)), axis)
            for placement in scene.dolls for joint in placement.doll.joints
            for axis in range(joint.dof)]

    @cached_property
    def _indices(self) -> dict[str, int]:
        return {name: index for index, name in enumerate(self._names)}

    def _index(self, angle: str) -> int:
        if angle not in self._indices:
            raise errors.UnknownJoint('angle', angle, errors.one_of(self._names, angle))
        return self._indices[angle]
