"""Poses of a skin's skeleton, attached to the bones of a doll.

Linear blend skinning: a vertex v of the bind pose (doll's frame) moves to the sum of w_j P_j R_j^-1
v, with P_j the pose of rider j and R_j its initial pose. With a glTF file's inverse bind matrices
M_j, in metres, it is the sum of w_j P_j M_j v.
"""
from __future__ import annotations

import numpy as np

from .pose import Pose
from .ragdoll import SkeletonFrame
from .scene import Scene
from .state import State


def rider_names(scene: Scene) -> tuple[str, ...]:
    """Names of all riders, doll by doll; with several dolls, doll/rider."""
    return tuple(scene.qualified(placement, rider.name)
                 for placement in scene.dolls for rider in placement.doll.riders)


class Riders:
    """World poses of the riders of a scene: the bones of its characters' skeletons, for skins.

    Args:
        scene: its dolls have riders, as ragdoll_fit writes them.

    Example:
        >>> scene = load_scene('drop')
        >>> with Simulation(scene) as simulation:
        ...     positions, orientations = Riders(scene).poses(simulation.state)
    """

    def __init__(self, scene: Scene) -> None:
        bones: list[int] = []
        riders: list[SkeletonFrame] = []
        for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
            index = {bone.name: k for k, bone in enumerate(placement.doll.bones, own.start)}
            bones += [index[rider.bone] for rider in placement.doll.riders]
            riders += placement.doll.riders
        self.names = rider_names(scene)
        """Names of the m riders, in the order of poses()."""
        self._bones = np.array(bones, dtype=int)
        self._offsets = Pose(np.array([rider.position for rider in riders]).reshape(-1, 3),
                             np.array([rider.orientation for rider in riders]).reshape(-1, 4))

    def poses(self, state: State) -> Pose:
        """Positions (m, 3) m and orientations (m, 4) x, y, z, w of all riders, world frame."""
        return state.poses(self._bones).compose(self._offsets)
