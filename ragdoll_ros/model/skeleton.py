"""A doll's skin, and the poses of its skeleton, which is attached to bones and to links of swings.

Linear blend skinning: a vertex v of the bind pose (doll's frame) moves to the sum of w_j P_j R_j^-1
v, with P_j the pose of rider j and R_j its initial pose. With a glTF file's inverse bind matrices
M_j, in metres, it is the sum of w_j P_j M_j v.
"""
from dataclasses import dataclass, field

import numpy as np

from .link_frames import LinkFrames
from .pose import Pose
from .ragdoll import Ragdoll, SkeletonFrame
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

    Its joints are ``bones`` (b,), indices of the doll's bones that have riders, and then ``links``
    (l,), indices among all links of the doll of those that have riders. ``weights`` (v, b + l) are
    the joints' skin weights; ``positions`` (b + l, 3) m and ``orientations`` (b + l, 4) are the
    joints' poses in which the skin is bound: the doll's bind pose, unless a limb was moved with its
    skin. Without ``appearance`` the whole skin has the ``color`` red, green, blue, opacity.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray
    appearance: Appearance | None = None
    color: tuple[float, float, float, float] = SKIN_COLOR
    links: np.ndarray = field(default_factory=lambda: np.zeros(0, int))

    def joint_poses(self, bones: Pose, links: Pose) -> Pose:
        """Poses (..., b + l) of its joints from those of the doll's bones and links."""
        both = zip(bones.at(self.bones), links.at(self.links), strict=True)
        return Pose(*(np.concatenate(parts, axis=-2) for parts in both))


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
        links: list[int] = []
        riders: list[SkeletonFrame] = []
        for placement, own, swings in zip(scene.dolls, scene.bone_slices, scene.link_slices,
                                          strict=True):
            index = {bone.name: k for k, bone in enumerate(placement.doll.bones, own.start)}
            bones += [index[rider.bone] for rider in placement.doll.riders]
            moved = links_of_riders(placement.doll)
            links += [swings.start + moved[rider.name] if rider.name in moved else -1
                      for rider in placement.doll.riders]
            riders += placement.doll.riders
        self.names = rider_names(scene)
        """Names of the m riders, in the order of poses()."""
        self._bones = np.array(bones, dtype=int)
        self._offsets = Pose(np.array([rider.position for rider in riders]).reshape(-1, 3),
                             np.array([rider.orientation for rider in riders]).reshape(-1, 4))

        self._frames = LinkFrames(scene)
        self._linked = np.flatnonzero(np.array(links, int) >= 0)
        self._links = np.array(links, int)[self._linked]
        self._link_offsets = self._frames.rest.at(self._links).relative(
            self._offsets.at(self._linked))

    def poses(self, state: State, rods: np.ndarray | None = None) -> Pose:
        """Poses of all riders.

        Args:
            state: of the scene's bones.
            rods: (s, 2, 3) m, both ends of each rod of the scene's swings, world frame, as
                ``simulation.swings.rods``: riders of hair follow them. None: they keep their place
                on their bones.

        Returns:
            Positions (m, 3) m and orientations (m, 4) x, y, z, w, world frame.
        """
        found = state.poses(self._bones).compose(self._offsets)
        if rods is None or not len(self._linked):
            return found
        links = self._frames.poses(state.poses(slice(None)), rods).at(self._links)
        for all_riders, moved in zip(found, links.compose(self._link_offsets), strict=True):
            all_riders[self._linked] = moved
        return found


def links_of_riders(doll: Ragdoll) -> dict[str, int]:
    """Index, among all links of the doll, of the link that moves a rider, by the rider's name; only
    of riders that a link moves.
    """
    links = (link for swing in doll.swings for link in swing.links)
    return {name: number for number, link in enumerate(links) for name in link.riders}
