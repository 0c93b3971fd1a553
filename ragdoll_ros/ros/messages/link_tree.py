"""The links of robot_description as a tree of frames: where each one stands in its parent."""
from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...files.urdf import link_axes, link_frames, link_names
from ...model.pose import Pose
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene
from ...model.state import State


class Link(NamedTuple):
    """At ``place`` in its parent while the joint's ``angle`` is zero, about ``axis`` as that turns.

    ``angle`` is one of a doll's angle_names; empty for a fixed joint, whose axis is zero.
    """

    parent: str
    child: str
    angle: str
    place: Pose
    axis: np.ndarray


class LinkTree:
    """Frames of all links of a scene: of the roots in the world's ``frame``, of the others in their
    parents along the URDF's joints, as robot_state_publisher has them.

    ``edges`` names parent and child of each of the m frames: the roots, then the others, which
    ``roots_alone`` leaves out.
    """

    def __init__(self, scene: Scene, frame: str, roots_alone: bool = False) -> None:
        roots = [(placement, placement.doll.root) for placement in scene.dolls]
        names = [scene.qualified(placement, root.name) for placement, root in roots]
        at = {name: index for index, name in enumerate(scene.bone_names)}
        self._roots = np.array([at[name] for name in names])
        self._seats = _stacked([root.pose.relative(Pose(np.array(root.position)))
                                for _, root in roots])
        """Where in its root bone each root link's frame is."""
        links = [] if roots_alone else list(_links(scene))
        self.edges = [(frame, name) for name in names] + [
            (scene.qualified(placement, link.parent), scene.qualified(placement, link.child))
            for placement, link in links]
        angles = {name: index for index, name in enumerate(scene.angle_names)}
        self._angles = np.array([angles[scene.qualified(placement, link.angle)] if link.angle
                                 else -1 for placement, link in links], int)
        self._places = _stacked([link.place for _, link in links])
        self._axes = np.array([link.axis for _, link in links]).reshape(-1, 3)

    def poses(self, state: State, angles: np.ndarray) -> np.ndarray:
        """Pose (m, 7) of each frame in its parent's, from the bones and all joint angles, rad."""
        roots = state.poses(self._roots).compose(self._seats)
        half = np.append(angles, 0.0)[self._angles, None] / 2
        turns = np.concatenate([self._axes * np.sin(half), np.cos(half)], axis=1)
        links = self._places.compose(Pose(np.zeros_like(self._axes), turns))
        return np.concatenate([np.concatenate(roots, axis=1), np.concatenate(links, axis=1)])


def _links(scene: Scene) -> Iterator[tuple[Placement, Link]]:
    """The links below the roots, doll by doll; equal dolls share them."""
    made: dict[int, list[Link]] = {}
    for placement in scene.dolls:
        key = id(placement.doll)
        if key not in made:
            made[key] = list(_links_of(placement.doll))
        yield from ((placement, link) for link in made[key])


def _links_of(doll: Ragdoll) -> Iterator[Link]:
    frames = link_frames(doll)
    for joint in doll.joints_from_root():
        parent, place = joint.parent, frames[joint.parent].relative(frames[joint.child])
        turns = list(zip(joint.angle_names, link_axes(joint), strict=True)) or [('', np.zeros(3))]
        names = link_names(joint.child, len(turns))
        for child, (angle, axis) in zip(names, turns, strict=True):
            yield Link(parent, child, angle, place, axis)
            parent, place = child, Pose()


def _stacked(poses: list[Pose]) -> Pose:
    return Pose(np.array([pose.position for pose in poses]).reshape(-1, 3),
                np.array([pose.orientation for pose in poses]).reshape(-1, 4))
