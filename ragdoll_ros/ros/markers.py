"""Bones and pushes as markers, for RViz."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Pose as PoseMessage
from visualization_msgs.msg import Marker, MarkerArray

from ..model import rotation
from ..model.pose import Pose
from ..model.push import Push
from ..model.ragdoll import DEFAULT_COLOR, Bone
from ..model.scene import Scene
from ..model.shapes import Part
from ..model.state import State
from ..physics.swing.pose import SwingState
from .messages import to_header, to_point, to_vector

RED = (0.9, 0.2, 0.1, 1.0)
BROWN = (0.35, 0.2, 0.1, 1.0)
ROD = 0.01
"""m: thickness of the rods of swings."""

KINDS = {'box': Marker.CUBE, 'sphere': Marker.SPHERE, 'cylinder': Marker.CYLINDER}


class Markers:
    """A MarkerArray of a scene's bones and of the pushes that act, made once and moved after."""

    def __init__(self, scene: Scene, frame: str) -> None:
        self._scene = scene
        self._frame = frame
        parts = [(index, number, part) for index, bone in enumerate(scene.bones)
                 for number, part in enumerate(bone.shape.primitives)]
        self._bones = [index for index, _, _ in parts]
        self._within = Pose(np.array([part.position for _, _, part in parts]),
                            np.array([part.orientation for _, _, part in parts]))
        self._markers = [_part(scene.bone_names[index], scene.bones[index], number, part)
                         for index, number, part in parts]
        self._arrows = 0
        self._fresh = True

    def message(self, stamp: int, state: State, pushes: Sequence[Push],
                swings: SwingState | None = None) -> MarkerArray:
        """Markers where the bones are; arrows of pushes that have ended are taken away.

        The first message takes away whatever the scene before has left.
        """
        header = to_header(stamp, self._frame)
        positions, orientations = state.poses(self._bones).compose(self._within)
        for marker, position, orientation in zip(self._markers, positions.tolist(),
                                          orientations.tolist(), strict=True):
            marker.header = header
            place(marker.pose, position, orientation)
        arrows = [self._arrow(number, push, state) for number, push in enumerate(
            push for push in pushes if any(push.force))]
        gone = [Marker(ns='push', id=number, action=Marker.DELETE)
                for number in range(len(arrows), self._arrows)]
        self._arrows = len(arrows)
        rods = [] if swings is None else [_rods(swings)]
        before = [Marker(action=Marker.DELETEALL)] if self._fresh else []
        self._fresh = False
        for marker in before + arrows + gone + rods:
            marker.header = header
        return MarkerArray(markers=before + self._markers + arrows + gone + rods)

    def _arrow(self, number: int, push: Push, state: State) -> Marker:
        """Arrow whose tip is where the push attacks."""
        bone = self._scene.bone_index(push.bone)
        tail, tip = push.arrow(state.positions[bone], state.orientations[bone])
        marker = Marker(ns='push', id=number, type=Marker.ARROW, action=Marker.ADD)
        marker.scale = to_vector((np.linalg.norm(tip - tail), 0.04, 0.06))
        orientation = rotation.shortest_arc(np.array([1.0, 0, 0]), tip - tail)
        place(marker.pose, tail.tolist(), orientation.tolist())
        paint(marker, RED)
        return marker


def _part(name: str, bone: Bone, number: int, part: Part) -> Marker:
    marker = Marker(ns=name, id=number, type=KINDS[part.kind], action=Marker.ADD)
    marker.scale = to_vector(part.size)
    paint(marker, bone.color or DEFAULT_COLOR)
    return marker


def _rods(swings: SwingState) -> Marker:
    """All rods of the swings, from root to mass, as one list of lines."""
    marker = Marker(ns='swings', id=0, type=Marker.LINE_LIST, action=Marker.ADD)
    marker.scale.x = ROD
    marker.pose.orientation.w = 1.0
    ends = np.stack([swings.roots, swings.positions], axis=1).reshape(-1, 3)
    marker.points = [to_point(end) for end in ends]
    paint(marker, BROWN)
    return marker


def place(pose: PoseMessage, position: list[float], orientation: list[float]) -> None:
    """Set a pose from m and x, y, z, w; the message stays the same object."""
    pose.position.x, pose.position.y, pose.position.z = position
    q = pose.orientation
    q.x, q.y, q.z, q.w = orientation


def paint(marker: Marker, color: tuple[float, ...]) -> None:
    """Set a marker's colour: red, green, blue, opacity."""
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = map(float, color)
