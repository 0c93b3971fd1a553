"""Poses of all bones of a skin's skeleton, so that the skin can follow the doll.

A skin's vertex v in the bind pose (doll's frame) stands at sum of w_j P_j inv(R_j) v, with P_j
the pose of rider j given here and R_j the same at the start. A rider keeps the axes that its
file gave it: with a glTF file's inverse bind matrices M_j in metres, P_j M_j does it at once.
"""
from __future__ import annotations

import numpy as np

from .pose import Pose
from .scene import Scene
from .state import State


def rider_names(scene: Scene) -> tuple[str, ...]:
    """Name of every rider, doll by doll; with several dolls, doll/rider."""
    return tuple(scene.qualified(placement, rider.name)
                 for placement in scene.dolls for rider in placement.doll.riders)


class Riders:
    """The riders of a scene, ready for many states."""

    def __init__(self, scene: Scene) -> None:
        carriers, riders = [], []
        for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
            place = {bone.name: k for k, bone in enumerate(placement.doll.bones, own.start)}
            carriers += [place[rider.bone] for rider in placement.doll.riders]
            riders += placement.doll.riders
        self.names = rider_names(scene)
        self._carriers = np.array(carriers, dtype=int)
        self._seats = Pose(np.array([rider.position for rider in riders]).reshape(-1, 3),
                           np.array([rider.orientation for rider in riders]).reshape(-1, 4))

    def poses(self, state: State) -> Pose:
        """Positions (m, 3) m and orientations (m, 4) of all riders, world frame."""
        return state.poses(self._carriers).compose(self._seats)
