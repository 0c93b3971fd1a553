"""Transform controls that move, rotate and resize a body in the bind pose."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import viser

from ....model import rotation
from ....model.mesh import Hull
from ....model.pose import Pose
from ....model.ragdoll import Bone, Joint
from ....model.scene import Placement, Scene, height
from ....model.shapes import SHAPES
from ...drawing.bodies import WXYZ
from ...drawing.meshes import MESHES
from ..changes import find, joint_of
from . import snapping
from .joint_handles import JointHandles

Mode = Literal['move', 'turn', 'size']
"""What the handles change."""

ROOT = '/editor'
"""Node of all handles in viser's scene tree."""

YELLOW, BLUE, RED = (255, 200, 0), (40, 90, 220), (220, 50, 30)

OUTLINE_SCALE = 1.03
"""Of the wireframe around the body."""

XYZW = [1, 2, 3, 0]
"""Indices that turn viser's quaternion wxyz into xyzw."""

TOLERANCE = 1e-6
"""m, and rad: smaller motions of a drag are ignored."""


class BodyHandles:
    """Handles of one body and of one mode at a time, with callbacks at the end of a drag.

    Handles are replaced only if what they show has changed: replacing one ends its drag.

    ``on_pose`` takes the new centre of mass (3,) m and orientation (4,), doll's frame; ``on_size``
    the new half extents (3,) m in the body's frame. ``ranges``: handles of the joint's ranges,
    shown together with these.
    """

    def __init__(self, server: viser.ViserServer, ranges: JointHandles,
                 on_pose: Callable[[np.ndarray, np.ndarray], None],
                 on_size: Callable[[np.ndarray], None]) -> None:
        self._server, self._ranges = server, ranges
        self._on_pose, self._on_size = on_pose, on_size
        self.mode: Mode = 'move'
        self.snap = False
        """Whether drags go in steps: see snapping.py."""
        self.body: viser.TransformControlsHandle | None = None
        self.size: viser.TransformControlsHandle | None = None
        self.root = ROOT
        """Node of the current handles. The name is new each time: viser keeps the old pose of a
        node that is added again at the origin."""
        self._count = 0
        self._shown: object = None
        """What the handles depend on."""
        self._reset: Callable[[], None] = lambda: None

    def hide(self) -> None:
        """Remove all handles."""
        if self._shown is not None:
            self._server.scene.remove_by_name(self.root)
        self.body = self.size = self._shown = None

    def reset(self) -> None:
        """Put the handles back after a drag that has changed nothing."""
        if self._shown is not None:
            self.hide()
            self._reset()

    def show(self, scene: Scene, name: str, limb: bool) -> None:
        """Show handles of a bone; with ``limb`` they rotate it about its joint, not its centre."""
        (placement, bone), joint = find(scene, name), joint_of(scene, name)
        origin = placement.position + _lift(scene, placement)
        shown = name, self.mode, limb, *origin, placement.orientation, bone, joint
        if shown == self._shown:
            return
        self._begin(shown, lambda: self.show(scene, name, limb))
        at = joint.anchor if limb and joint else bone.position
        with self._server.atomic():
            self._add_frame(self.root, origin, placement.orientation)
            self._frame = self._add_outline(f'{self.root}/frame', bone)
            if joint is not None:
                self._add_pivot(joint, bone)
                self._ranges.show(self.root, Pose(origin, np.array(placement.orientation)),
                                  placement.doll, joint)
            if self.mode != 'size':
                self._add_body(bone, at)
            elif bone.shape.kind in SHAPES:
                self._add_size(bone)

    def show_outlines(self, scene: Scene, names: Sequence[str]) -> None:
        """Show the outlines of several bones, without handles."""
        found = [find(scene, name) for name in names]
        if found == self._shown:
            return
        self._begin(found, lambda: self.show_outlines(scene, names))
        with self._server.atomic():
            self._add_frame(self.root, (0.0, 0.0, 0.0), rotation.IDENTITY)
            for number, (placement, bone) in enumerate(found):
                node = f'{self.root}/{number}'
                self._add_frame(node, placement.position + _lift(scene, placement),
                                placement.orientation)
                self._add_outline(f'{node}/frame', bone)

    def _begin(self, shown: object, reset: Callable[[], None]) -> None:
        """Remove all handles, and name a new root; ``reset`` draws what depends on ``shown``."""
        self.hide()
        self._shown, self._reset = shown, reset
        self._count += 1
        self.root = f'{ROOT}/{self._count}'

    def _add_frame(self, node: str, position: Sequence[float],
                   orientation: Sequence[float]) -> viser.FrameHandle:
        return self._server.scene.add_frame(node, position=position, wxyz=_wxyz(orientation),
                                            show_axes=False)

    def _add_outline(self, node: str, bone: Bone) -> viser.FrameHandle:
        frame = self._add_frame(node, bone.position, bone.orientation)
        for number, part in enumerate(bone.shape.primitives):
            if isinstance(part.shape, Hull):
                vertices, faces = part.shape.mesh()
            else:
                vertices, faces = MESHES[part.kind]
                vertices = vertices * part.size
            self._server.scene.add_mesh_simple(
                f'{node}/outline_{number}', vertices * OUTLINE_SCALE, faces,
                color=YELLOW, wireframe=True, cast_shadow=False, receive_shadow=False,
                position=part.position, wxyz=_wxyz(part.orientation))
        return frame

    def _add_pivot(self, joint: Joint, bone: Bone) -> None:
        """Draw the joint: a sphere at its anchor, a line along each axis, the first in blue."""
        length = 1.5 * max(bone.shape.half_extents)
        self._server.scene.add_icosphere(f'{self.root}/pivot', radius=0.08 * length, color=BLUE,
                                         position=joint.anchor, cast_shadow=False)
        if joint.axes:
            ends = joint.anchor + length * np.array(joint.axes)[:, None] * [[-1], [1]]
            colors = np.array([[color, color] for color in (BLUE, RED)[:len(ends)]], np.uint8)
            self._server.scene.add_line_segments(f'{self.root}/axes', ends, colors,
                                                 thickness=0.03 * length)

    def _add_body(self, bone: Bone, at: Sequence[float]) -> None:
        self.body = self._server.scene.add_transform_controls(
            f'{self.root}/body', scale=2.5 * max(bone.shape.half_extents), depth_test=False,
            opacity=0.8, position=at, wxyz=_wxyz(bone.orientation),
            disable_axes=self.mode == 'turn', disable_sliders=self.mode == 'turn',
            disable_rotations=self.mode == 'move')
        # Centre of the body in the handle's frame.
        back = rotation.inverse(bone.orientation)
        arm = rotation.rotate(back, np.subtract(bone.position, at))
        body, frame, start = self.body, self._frame, _wxyz(bone.orientation)

        @body.on_update
        def _(event: viser.TransformControlsEvent) -> None:
            orientation = rotation.normalized(np.array(body.wxyz)[XYZW])
            position = np.array(body.position)
            if self.snap:
                orientation = snapping.snapped_orientation(orientation, bone.orientation)
                position = snapping.snapped_position(position, at, bone.orientation)
            position = position + rotation.rotate(orientation, arm)
            frame.position, frame.wxyz = position, _wxyz(orientation)
            if event.phase == 'end':
                if rotation.angle_between(orientation, bone.orientation) < TOLERANCE:
                    orientation = np.array(bone.orientation)
                position = _unless_unchanged(position, bone.position)
                if np.any(position != bone.position) or np.any(orientation != bone.orientation):
                    self._on_pose(position, orientation)
                elif np.any(body.position != np.array(at)) or np.any(body.wxyz != start):
                    self.reset()

    def _add_size(self, bone: Bone) -> None:
        # Cylinders and capsules have equal x and y, spheres equal x, y and z.
        active = (True, bone.shape.kind == 'box', bone.shape.kind != 'sphere')
        half = np.array(bone.shape.half_extents)
        self.size = size = self._server.scene.add_transform_controls(
            f'{self.root}/frame/size', scale=0.8 * float(half.max()), active_axes=active,
            disable_rotations=True, disable_sliders=True, depth_test=False,
            position=np.where(active, half, 0.0))

        @size.on_update
        def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == 'end':
                x, y, z = size.position
                new = np.array((x, y if active[1] else x, z if active[2] else x))
                new = _unless_unchanged(new, half)
                if np.any(new != half):
                    self._on_size(snapping.snapped_half_extents(new, half) if self.snap else new)


def _lift(scene: Scene, placement: Placement) -> np.ndarray:
    """Offset (3,) m by which the simulation lifts a doll that starts below the ground."""
    if scene.ground is None:
        return np.zeros(3)
    lowest = min(height(bone, *placement.bone_pose(bone), scene.ground)
                 for bone in placement.doll.bones)
    return max(0.0, -lowest) * np.array(scene.ground.normal)


def _unless_unchanged(new: np.ndarray, old: Sequence[float]) -> np.ndarray:
    return np.where(np.abs(new - old) < TOLERANCE, old, new)


def _wxyz(quaternion: Sequence[float]) -> np.ndarray:
    return np.asarray(quaternion)[WXYZ]
