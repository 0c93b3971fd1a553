"""Holds: springs that hold joint angles until they are let go, as the joints of one who stands."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import errors
from ...model.scene import Scene
from ..engine.protocol import AppliedHold

STIFFEST = 1e6
"""N m/rad, and N m s/rad: a hundred people's, far from what steps can no longer tell."""


@dataclass(frozen=True)
class Hold:
    """What holds a joint angle: its name, the target in rad, stiffness in N m/rad, damping in
    N m s/rad.
    """

    angle: str
    target: float
    stiffness: float
    damping: float


class Holds:
    """All angles of a scene that are held."""

    def __init__(self, scene: Scene) -> None:
        self._names = scene.angle_names
        self._places = [place for placement in scene.dolls for joint in placement.doll.joints
                        for place in self._places_of(scene, placement, joint)]
        self._held: dict[str, AppliedHold] = {}

    @property
    def holds(self) -> tuple[Hold, ...]:
        """What is held, the longest held first."""
        return tuple(Hold(name, held.target, held.stiffness, held.damping)
                     for name, held in self._held.items())

    @property
    def springs(self) -> tuple[AppliedHold, ...]:
        """The springs by which they are held now."""
        return tuple(self._held.values())

    def hold(self, angle: str, stiffness: float, damping: float, target: float | None,
             angles: np.ndarray) -> None:
        """Hold an angle of ``angles`` (k,), all of now, from now on as this says."""
        index = self._index(angle)
        if self._places[index] is None:
            raise errors.WrongAxes('angle', angle, 'an angle of no ball joint without limits')
        for key, value in (('stiffness', stiffness), ('damping', damping)):
            errors.check_range(key, value, 0.0, STIFFEST)
        aim = float(angles[index]) if target is None else float(target)
        errors.check_finite('target', (aim,))
        bone, axis = self._places[index]
        self._held[angle] = AppliedHold(bone, axis, aim, float(stiffness), float(damping))

    def go_limp(self, angles: Sequence[str] | None) -> None:
        """Let angles go, None: all; what is not held stays limp."""
        for angle in self._names if angles is None else angles:
            self._index(angle)
            self._held.pop(angle, None)

    def _index(self, angle: str) -> int:
        if angle not in self._names:
            raise errors.UnknownJoint('angle', angle, errors.one_of(self._names, angle))
        return self._names.index(angle)

    @staticmethod
    def _places_of(scene: Scene, placement: object, joint: object) -> list[tuple[int, int] | None]:
        """Bone and axis of each angle of a joint."""
        bone = scene.bone_index(scene.qualified(placement, joint.child))
        return [None if joint.is_free_ball else (bone, axis) for axis in range(joint.dof)]
