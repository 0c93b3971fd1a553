"""The links of robot_description as a tree of frames, each relative to its parent link."""
from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...files.urdf import link_axes, link_frames, link_names
from ...model.pose import Pose
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene
from ...model.state import State


class TreeLink(NamedTuple):
    """A link with its joint as in URDF: ``origin`` in the parent link at angle zero, and ``axis``.

    ``angle`` is one of the doll's angle_names; '' for a fixed joint, whose axis is zero.
    """

    parent: str
    child: str
    angle: str
    origin: Pose
    axis: np.ndarray


class LinkTree:
    """Frames of all links of a scene, as robot_state_publisher publishes them: root links relative
    to the world frame ``frame``, other links relative to their parent link.

    ``edges`` are the (parent, child) names of the m frames: first the roots, then the others,
    which ``roots_only`` omits.
    """

    def __init__(self, scene: Scene, frame: str, roots_only: bool = False) -> None:
        roots = [(placement, placement.doll.root) for placement in scene.dolls]
        names = [scene.qualified(placement, root.name) for placement, root in roots]
        at = {name: index for index, name in enumerate(scene.bone_names)}
        self._roots = np.array([at[name] for name in names])
        self._root_links = _stacked([root.pose.relative(Pose(np.array(root.position)))
                                for _, root in roots])
        """Pose of each root link's frame relative to its root bone."""
        links = [] if roots_only else list(_links(scene))
        self.edges = [(frame, name) for name in names] + [
            (scene.qualified(placement, link.parent), scene.qualified(placement, link.child))
            for placement, link in links]
        angles = {name: index for index, name in enumerate(scene.angle_names)}
        self._angles = np.array([angles[scene.qualified(placement, link.angle)] if link.angle
                                 else -1 for placement, link in links], int)
        self._origins = _stacked([link.origin for _, link in links])
        self._axes = np.array([link.axis for _, link in links]).reshape(-1, 3)

    def poses(self, state: State, angles: np.ndarray) -> np.ndarray:
        """Pose (m, 7) of each frame relative to its parent, from state and joint angles, rad."""
        roots = state.poses(self._roots).compose(self._root_links)
        half = np.append(angles, 0.0)[self._angles, None] / 2
        turns = np.concatenate([self._axes * np.sin(half), np.cos(half)], axis=1)
        links = self._origins.compose(Pose(np.zeros_like(self._axes), turns))
        return np.concatenate([np.concatenate(roots, axis=1), np.concatenate(links, axis=1)])


def _links(scene: Scene) -> Iterator[tuple[Placement, TreeLink]]:
    """The links below the roots, doll by doll; equal dolls share the objects."""
    made: dict[int, list[TreeLink]] = {}
    for placement in scene.dolls:
        key = id(placement.doll)
        if key not in made:
            made[key] = list(_links_of(placement.doll))
        yield from ((placement, link) for link in made[key])


def _links_of(doll: Ragdoll) -> Iterator[TreeLink]:
    frames = link_frames(doll)
    for joint in doll.joints_from_root():
        parent, origin = joint.parent, frames[joint.parent].relative(frames[joint.child])
        turns = list(zip(joint.angle_names, link_axes(joint), strict=True)) or [('', np.zeros(3))]
        names = link_names(joint.child, len(turns))
        for child, (angle, axis) in zip(names, turns, strict=True):
            yield TreeLink(parent, child, angle, origin, axis)
            parent, origin = child, Pose()


def _stacked(poses: list[Pose]) -> Pose:
    return Pose(np.array([pose.position for pose in poses]).reshape(-1, 3),
                np.array([pose.orientation for pose in poses]).reshape(-1, 4))
