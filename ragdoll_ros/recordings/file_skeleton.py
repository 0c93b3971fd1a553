"""The skeleton of the file that a doll was fitted to, as the doll's bones carry it.

Each bone of the file is fixed to a bone of the doll, or to a link of its swings, as a rider. So
bones that the doll does not simulate, such as fingers, keep their transform relative to the bones
around them.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..files.gltf.character_file import (
    CharacterFile,
    bind_pose,
    file_to_doll,
    read_character_file,
    rider_pose,
)
from ..files.gltf.nodes import Nodes
from ..model import errors, rotation
from ..model.link_frames import LinkFrames
from ..model.pose import Pose
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, Scene
from ..model.skeleton import links_of_riders


@dataclass(frozen=True, eq=False)
class FileSkeleton:
    """The n bones of a file that a doll carries, parents first."""

    source: CharacterFile
    to_doll: np.ndarray
    """(4, 4) from the file's world to the doll's frame, m."""
    names: tuple[str, ...]
    nodes: tuple[int, ...]
    parents: tuple[int, ...]
    """Index of the nearest bone above each, -1 where there is none."""
    carriers: np.ndarray
    """(n,) index of the doll's bone that carries each; of links after all bones."""
    offsets: Pose
    """(n,) poses in their carriers."""
    binds: Pose
    """(n,) poses in the file's bind pose, doll's frame."""
    stretches: np.ndarray
    """(n, 3, 3) scales, in the bones' axes: a node's linear part is its orientation's times this,
    so that its unit is the file's."""

    def poses(self, carriers: Pose) -> Pose:
        """World poses (k, n) from those of the doll's bones and links (k, b + l)."""
        return carriers.at(self.carriers).compose(self.offsets)


def read_file_skeleton(doll: Ragdoll) -> FileSkeleton:
    """Read the skeleton of a doll's file. Raises WrongForm for a doll without one, another
    RagdollError if the file cannot be read or does not match.
    """
    source = read_character_file(doll)
    to_doll = file_to_doll(doll, source)
    index = {name: k for k, name in enumerate(source.bones.names)}
    riders = sorted(doll.riders, key=lambda rider: index[rider.name])
    chosen = [index[rider.name] for rider in riders]
    nodes = [source.bones.nodes[bone] for bone in chosen]
    bodies = {bone.name: k for k, bone in enumerate(doll.bones)}
    links = links_of_riders(doll)
    rests = LinkFrames(Scene('bind', (Placement(doll),))).rest
    offsets = [rider_pose(rider) for rider in riders]
    # A limb of the doll may have been moved, with its bones; then its bind pose is not the file's.
    binds = [bind_pose(to_doll, source.bones.bind_matrices[bone])
             or doll.bone(rider.bone).pose.compose(offset)
             for bone, rider, offset in zip(chosen, riders, offsets, strict=True)]
    # Of riders on links, from the link's frame, which has the place at rest in its bone.
    local = [Pose(*(part[links[rider.name]] for part in rests)).relative(offset)
             if rider.name in links else offset
             for rider, offset in zip(riders, offsets, strict=True)]
    carriers = [len(bodies) + links[rider.name] if rider.name in links else bodies[rider.bone]
                for rider in riders]
    bound = Pose(*map(np.array, zip(*binds, strict=True)))
    linear = to_doll[:3, :3] @ source.bones.bind_matrices[chosen, :3, :3]
    return FileSkeleton(
        source, to_doll, tuple(rider.name for rider in riders), tuple(nodes),
        _parents(nodes, source.nodes), np.array(carriers),
        Pose(*map(np.array, zip(*local, strict=True))), bound,
        rotation.matrix(rotation.inverse(bound.orientation)) @ linear)


def carrier_poses(scene: Scene, bones: Pose, rods: np.ndarray | None) -> list[Pose]:
    """World poses (k, b + l) of the bones and then of the links of each doll, from those of the
    scene's bones (k, n) and from both ends of each rod (k, m, 2, 3) m; without rods, at rest.
    """
    links = LinkFrames(scene).poses(bones, rods)
    return [Pose(*(np.concatenate([some[:, own], others[:, hung]], axis=1)
                   for some, others in zip(bones, links, strict=True)))
            for own, hung in zip(scene.bone_slices, scene.link_slices, strict=True)]


def find_file_skeleton(placement: Placement, warn: Callable[[str], None]) -> FileSkeleton | None:
    """Return the skeleton of a doll's file. None where it has none; None, and a warning, where the
    file can not be read or does not match.
    """
    if placement.doll.model is None or not placement.doll.riders:
        return None
    try:
        return read_file_skeleton(placement.doll)
    except errors.RagdollError as error:
        warn(not_of_its_file(placement, error))
    return None


def not_of_its_file(placement: Placement, error: Exception) -> str:
    """A warning of a file that can not be read."""
    return f"{placement.name} is saved with its doll's bones, not as its file: {error}"


def _parents(own: list[int], nodes: Nodes) -> tuple[int, ...]:
    """Index of the nearest bone above each bone, by the bones' ``own`` nodes."""
    place = {node: bone for bone, node in enumerate(own)}
    return tuple(place.get(nodes.nearest(nodes.parents[node], place), -1) for node in own)
