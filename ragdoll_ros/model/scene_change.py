"""SceneChange: the scenes before and after dolls come or go, and which doll, bone and angle of one
is which of the other.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .scene import Scene


@dataclass(frozen=True)
class SceneChange:
    """Two scenes that differ in their dolls alone. A doll of both has the same name in both; those
    that stay keep their order.
    """

    before: Scene
    after: Scene

    @cached_property
    def old_dolls(self) -> np.ndarray:
        """(d,) index in ``before`` of each doll of ``after``; -1: it is new."""
        return _indices(self.after, self.before)

    @cached_property
    def new_dolls(self) -> np.ndarray:
        """(d,) index in ``after`` of each doll of ``before``; -1: it is gone."""
        return _indices(self.before, self.after)

    @cached_property
    def new_bones(self) -> np.ndarray:
        """(n,) index in ``after`` of each bone of ``before``; -1: it is gone."""
        bones = np.full(len(self.before.bones), -1)
        for own, doll in zip(self.before.bone_slices, self.new_dolls, strict=True):
            if doll >= 0:
                there = self.after.bone_slices[doll]
                bones[own] = np.arange(there.start, there.stop)
        return bones

    @cached_property
    def bone_names(self) -> dict[str, str]:
        """Name in ``after`` of each bone that stays, by that in ``before``: a scene of one doll has
        names without the doll's.
        """
        return {name: self.after.bone_names[bone] for name, bone in zip(
            self.before.bone_names, self.new_bones, strict=True) if bone >= 0}

    @cached_property
    def angle_names(self) -> dict[str, str]:
        """Name in ``after`` of each joint angle that stays, by that in ``before``."""
        return {self.before.qualified(placement, angle): self.after.qualified(placement, angle)
                for placement, doll in zip(self.before.dolls, self.new_dolls, strict=True)
                if doll >= 0 for joint in placement.doll.joints for angle in joint.angle_names}


def _indices(scene: Scene, other: Scene) -> np.ndarray:
    """Index in ``other`` of each doll of ``scene``, -1 where it has none of that name."""
    places = {placement.name: index for index, placement in enumerate(other.dolls)}
    return np.array([places.get(placement.name, -1) for placement in scene.dolls])
