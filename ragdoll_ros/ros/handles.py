"""Bones as interactive markers: a ghost of each bone's shape that a mouse can drag."""
from __future__ import annotations

from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerPose,
    Marker,
)

from ..model.ragdoll import DEFAULT_COLOR, Bone
from ..model.scene import Scene
from ..model.shapes import Part
from ..model.state import State
from .markers import KINDS, paint, place
from .messages import to_vector

OPACITY = 0.15
"""Of a ghost: seen when it is left behind, out of the way where the bone itself is shown."""

GROWTH = 1.02
"""Times as large as its bone that a ghost is, so that their faces do not flicker."""

AXES = 0.2
"""m: length of the axes that RViz draws on demand."""


class Handles:
    """Interactive markers of all bones of a scene, named as the bones; made once, moved after.

    Stamps are zero: RViz then answers in the marker's own frame, not in its fixed one.
    """

    def __init__(self, scene: Scene, frame: str) -> None:
        self.names = scene.bone_names
        self.markers = [_marker(name, bone, frame)
                        for name, bone in zip(scene.bone_names, scene.bones, strict=True)]
        self.poses = [InteractiveMarkerPose(header=marker.header, name=marker.name,
                                            pose=marker.pose) for marker in self.markers]

    def move(self, state: State) -> None:
        """Put all where the bones are; markers and poses are the same objects."""
        for marker, position, orientation in zip(self.markers, state.positions.tolist(),
                                          state.orientations.tolist(), strict=True):
            place(marker.pose, position, orientation)


def _marker(name: str, bone: Bone, frame: str) -> InteractiveMarker:
    control = InteractiveMarkerControl(
        name='drag', interaction_mode=InteractiveMarkerControl.MOVE_3D,
        orientation_mode=InteractiveMarkerControl.INHERIT, always_visible=False,
        markers=[_ghost(bone, part) for part in bone.shape.primitives])
    control.orientation.w = 1.0
    marker = InteractiveMarker(name=name, scale=AXES, controls=[control])
    marker.header.frame_id = frame
    return marker


def _ghost(bone: Bone, part: Part) -> Marker:
    """A part of a bone, relative to it: a frame of its own would be looked up."""
    ghost = Marker(type=KINDS[part.kind], action=Marker.ADD)
    ghost.scale = to_vector([GROWTH * side for side in part.size])
    place(ghost.pose, list(part.position), list(part.orientation))
    paint(ghost, (*(bone.color or DEFAULT_COLOR)[:3], OPACITY))
    return ghost
