"""Joint springs: springs on joint angles, as of muscles that hold a pose until they go limp."""
from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...model import errors
from ...model.scene import Scene
from ...model.scene_change import SceneChange
from ..engine.protocol import AppliedJointSpring

MAX_STIFFNESS = 1e6
"""N m/rad and N m s/rad: a hundred times a person's, and far from loss of precision."""


@dataclass(frozen=True)
class JointSpring:
    """A spring on a joint angle: target in rad, stiffness in N m/rad, damping in N m s/rad."""

    angle: str
    target: float
    stiffness: float
    damping: float


class JointSprings:
    """The active joint springs of a scene, at most one for each angle."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._names = scene, scene.angle_names
        self._applied: dict[str, AppliedJointSpring] = {}

    @property
    def joint_springs(self) -> tuple[JointSpring, ...]:
        """Active springs by name, oldest first."""
        return tuple(JointSpring(name, spring.target, spring.stiffness, spring.damping)
                     for name, spring in self._applied.items())

    @property
    def springs(self) -> tuple[AppliedJointSpring, ...]:
        """Active springs for Engine.advance()."""
        return tuple(self._applied.values())

    def hold(self, angle: str, stiffness: float, damping: float, target: float | None,
             angles: np.ndarray) -> None:
        """Add or replace a spring, see Simulation.hold(); ``angles`` (k,) rad: the current ones."""
        index = self._index(angle)
        if self._axes[index] is None:
            raise errors.WrongAxes('angle', angle, 'no ball joint without limits: it has no angles')
        for key, value in (('stiffness', stiffness), ('damping', damping)):
            errors.check_range(key, value, 0.0, MAX_STIFFNESS)
        aim = float(angles[index]) if target is None else float(target)
        errors.check_finite('target', (aim,))
        bone, axis = self._axes[index]
        self._applied[angle] = AppliedJointSpring(bone, axis, aim, float(stiffness), float(damping))

    def changed(self, change: SceneChange) -> JointSprings:
        """Those on dolls that stay, in the scene after."""
        after, names = JointSprings(change.after), change.angle_names if self._applied else {}
        after._applied = {
            names[angle]: dataclasses.replace(spring, bone=int(change.new_bones[spring.bone]))
            for angle, spring in self._applied.items() if angle in names}
        return after

    def go_limp(self, angles: Sequence[str] | None) -> None:
        """Remove the springs of these angles; None: of all."""
        for angle in self._names if angles is None else angles:
            self._index(angle)
            self._applied.pop(angle, None)

    @cached_property
    def _axes(self) -> list[tuple[int, int] | None]:
        """Child bone and axis index of each angle; None for a ball joint without angles."""
        scene = self._scene
        return [None if joint.is_free_ball else (
            scene.bone_index(scene.qualified(placement, joint.child)), axis)
            for placement in scene.dolls for joint in placement.doll.joints
            for axis in range(joint.dof)]

    def _index(self, angle: str) -> int:
        if angle not in self._names:
            raise errors.UnknownJoint('angle', angle, errors.one_of(self._names, angle))
        return self._names.index(angle)
