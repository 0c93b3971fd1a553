"""Bones as interactive markers: a ghost of each bone's shape that a mouse can drag."""
from __future__ import annotations

import copy
from functools import cached_property

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    Marker,
)

from ...model.ragdoll import DEFAULT_COLOR, Bone
from ...model.scene import Scene
from ...model.shapes import Part
from ...model.state import State
from .convert import poses_of, to_pose, to_vector
from .markers import KINDS, paint
from .serialized import Packed

OPACITY = 0.15
"""Of a ghost: seen when it is left behind, out of the way where the bone itself is shown."""

GROWTH = 1.02
"""Times as large as its bone that a ghost is, so that their faces do not flicker."""

AXES = 0.2
"""m: length of the axes that RViz draws on demand."""


class Handles:
    """Interactive markers of all bones of a scene, named as the bones, which ``server`` tells of.

    Nothing is made of them before it is asked for. Stamps are zero: RViz then answers in the
    marker's own frame, not in its fixed one.
    """

    def __init__(self, scene: Scene, frame: str, server: str) -> None:
        self._scene, self._server = scene, server
        self._header = Header(frame_id=frame)
        self.names = frozenset(scene.bone_names)

    def markers(self, state: State) -> list[InteractiveMarker]:
        """A marker where each bone is; in those of equal bones, what is equal is one object."""
        models, markers = {}, []
        for name, bone, row in zip(self._scene.bone_names, self._scene.bones,
                                   poses_of(state).tolist(), strict=True):
            if id(bone) not in models:
                models[id(bone)] = _marker(bone, self._header)
            marker = copy.copy(models[id(bone)])
            marker.name, marker.pose = name, to_pose(row)
            markers.append(marker)
        return markers

    def update(self, sequence: int, state: State) -> bytes:
        """Serialized update that bears this number: where all markers are."""
        return self._packed.message(0, _as_float(sequence), poses_of(state))

    def to_update(self, sequence: int, **content: list) -> InteractiveMarkerUpdate:
        """An update that bears this number, in the plain way."""
        return InteractiveMarkerUpdate(server_id=self._server, seq_num=sequence,
                                       type=InteractiveMarkerUpdate.UPDATE, **content)

    @cached_property
    def _packed(self) -> Packed:
        return Packed(self._to_poses, (1,), (len(self._scene.bones), 7))

    def _to_poses(self, _: int, sequence: np.ndarray, poses: np.ndarray) -> InteractiveMarkerUpdate:
        """An update of poses (n, 7); its number comes as a float64 of the same bytes."""
        return self.to_update(int(sequence.view(np.uint64)[0]), poses=[
            InteractiveMarkerPose(header=self._header, name=name, pose=to_pose(row))
            for name, row in zip(self._scene.bone_names, poses.tolist(), strict=True)])


def _as_float(number: int) -> np.ndarray:
    """(1,) float64 of the same bytes as a number of 64 bits."""
    return np.array([number], np.uint64).view(float)


def _marker(bone: Bone, header: Header) -> InteractiveMarker:
    control = InteractiveMarkerControl(
        name='drag', interaction_mode=InteractiveMarkerControl.MOVE_3D,
        orientation_mode=InteractiveMarkerControl.INHERIT, always_visible=False,
        markers=[_ghost(bone, part) for part in bone.shape.primitives])
    control.orientation.w = 1.0
    return InteractiveMarker(header=header, scale=AXES, controls=[control])


def _ghost(bone: Bone, part: Part) -> Marker:
    """A part of a bone, relative to it: a frame of its own would be looked up."""
    ghost = Marker(type=KINDS[part.kind], action=Marker.ADD)
    ghost.scale = to_vector([GROWTH * side for side in part.size])
    ghost.pose = to_pose((*part.position, *part.orientation))
    paint(ghost, (*(bone.color or DEFAULT_COLOR)[:3], OPACITY))
    return ghost
