"""A doll's skin, and the poses of its skeleton, which is attached to the bones.

Linear blend skinning: a vertex v of the bind pose (doll's frame) moves to the sum of w_j P_j R_j^-1
v, with P_j the pose of rider j and R_j its initial pose. With a glTF file's inverse bind matrices
M_j, in metres, it is the sum of w_j P_j M_j v.
"""
from dataclasses import dataclass, field

import numpy as np

from .pose import Pose
from .ragdoll import SkeletonFrame
from .scene import Scene
from .state import State

SKIN_COLOR = (0.8, 0.75, 0.69, 1.0)
"""Colour of a skin without materials."""


@dataclass(frozen=True)
class Texture:
    """An encoded image of MIME type ``kind`` and its glTF sampler."""

    image: bytes
    kind: str
    sampler: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Appearance:
    """Normals, texture coordinates and materials of a skin of v vertices and t triangles.

    ``normals`` (v, 3) are unit vectors in the bind pose, zero where the file has none; ``uvs``
    (v, 2) are glTF's. ``materials`` are glTF's (2.0, 5.19), with indices into ``textures``;
    ``material_indices`` (t,) are the triangles', -1: none.
    """

    normals: np.ndarray
    uvs: np.ndarray
    material_indices: np.ndarray
    materials: tuple[dict, ...] = ()
    textures: tuple[Texture, ...] = ()


@dataclass(frozen=True)
class Skin:
    """A doll's skin in its bind pose, doll's frame.

    ``bones`` (b,) are the doll's bones that have riders, ``weights`` (v, b) their skin weights.
    ``positions`` (b, 3) m and ``orientations`` (b, 4) are the bones' poses that the skin is bound
    in: the doll's bind pose, unless a limb was moved with its skin. Without ``appearance`` all of
    it has the ``color`` red, green, blue, opacity.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray
    appearance: Appearance | None = None
    color: tuple[float, float, float, float] = SKIN_COLOR


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
