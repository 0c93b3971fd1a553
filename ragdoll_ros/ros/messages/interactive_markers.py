"""Interactive markers of bones: a translucent copy of each bone's shape that can be dragged."""
from __future__ import annotations

import copy
from collections.abc import Collection

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
from .convert import poses_of, to_pose
from .markers import set_color, set_shape
from .serialized import SerializedTemplate

OPACITY = 0.15
"""Of the copies: visible where they lag behind, faint where the bone itself is shown."""

SCALE = 1.02
"""Scale of the copies, so that their faces do not flicker with the bone's."""

AXES_LENGTH = 0.2
"""m: axes that RViz draws on demand."""


class InteractiveMarkers:
    """Interactive markers of all bones of a scene, with the bones' names; created on demand.

    Stamps are zero: RViz then sends feedback in the marker's frame, not in its fixed frame.
    """

    def __init__(self, scene: Scene, frame: str, server_id: str) -> None:
        self._scene, self._server_id = scene, server_id
        self._header = Header(frame_id=frame)
        self.names = frozenset(scene.bone_names)
        self._template: SerializedTemplate | None = None

    def at(self, state: State, names: Collection[str] | None = None) -> list[InteractiveMarker]:
        """A marker at the pose of each bone, or of those of these names; markers of equal bones
        share their controls.
        """
        models, markers = {}, []
        for name, bone, row in zip(self._scene.bone_names, self._scene.bones,
                                   poses_of(state).tolist(), strict=True):
            if names is not None and name not in names:
                continue
            if id(bone) not in models:
                models[id(bone)] = _marker(bone, self._header)
            marker = copy.copy(models[id(bone)])
            marker.name, marker.pose = name, to_pose(row)
            markers.append(marker)
        return markers

    def serialize_update(self, sequence: int, state: State) -> bytes:
        """Serialized update of all poses, with this sequence number."""
        if self._template is None:
            self.make_template()
        number = np.array([sequence], np.uint64).view(float)
        return self._template.serialize(0, number, poses_of(state))

    def make_update(self, sequence: int, **content: list) -> InteractiveMarkerUpdate:
        """An update message with this sequence number."""
        return InteractiveMarkerUpdate(server_id=self._server_id, seq_num=sequence,
                                       type=InteractiveMarkerUpdate.UPDATE, **content)

    def make_template(self) -> None:
        """Make what serialize_update() needs."""
        self._template = SerializedTemplate.trace(self._pose_update, (1,),
                                                  (len(self._scene.bones), 7))

    def _pose_update(self, _: int, sequence: np.ndarray,
                     poses: np.ndarray) -> InteractiveMarkerUpdate:
        """An update of poses (n, 7); the sequence number is a uint64 viewed as float64."""
        return self.make_update(int(sequence.view(np.uint64)[0]), poses=[
            InteractiveMarkerPose(header=self._header, name=name, pose=to_pose(row))
            for name, row in zip(self._scene.bone_names, poses.tolist(), strict=True)])


def _marker(bone: Bone, header: Header) -> InteractiveMarker:
    control = InteractiveMarkerControl(
        name='drag', interaction_mode=InteractiveMarkerControl.MOVE_3D,
        orientation_mode=InteractiveMarkerControl.INHERIT, always_visible=False,
        markers=[_part_marker(bone, part) for part in bone.shape.primitives])
    control.orientation.w = 1.0
    return InteractiveMarker(header=header, scale=AXES_LENGTH, controls=[control])


def _part_marker(bone: Bone, part: Part) -> Marker:
    """Marker of a part of a bone. It has no frame_id, so its pose is relative to that of the
    interactive marker.
    """
    marker = Marker(action=Marker.ADD)
    set_shape(marker, part, SCALE)
    marker.pose = to_pose((*part.position, *part.orientation))
    set_color(marker, (*(bone.color or DEFAULT_COLOR)[:3], OPACITY))
    return marker
