"""Ranges of a joint, drawn as filled sectors and a cone whose edges can be dragged."""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import viser

from ....model import errors, rotation
from ....model.pose import Pose
from ....model.ragdoll import MAX_SWING, Joint, Limits, Ragdoll
from ...drawing.joint_limits import angle_axes, child_needle, cone_rim, range_arc
from . import snapping

COLORS = ((40, 90, 220), (220, 50, 30), (30, 150, 70))
"""By the number of the angle; the first two are those of the axes."""

OPACITY = 0.3

REACH = 1.1
"""Radius of a sector, relative to how far the child reaches from the joint."""

SPHERE = 0.045
"""Radius of a sphere to drag by, relative to that of its sector."""

Edge = tuple[int, int]
"""Number of an angle of the joint, and 0 for its lower limit or 1 for its upper one."""


class JointHandles:
    """Ranges of one joint; ``on_limits`` takes its new limits, rad, at the end of a drag."""

    def __init__(self, server: viser.ViserServer,
                 on_limits: Callable[[tuple[Limits | None, ...]], None]) -> None:
        self._server, self._on_limits = server, on_limits
        self.snap = False
        """Whether drags go in steps: see snapping.py."""
        self.spheres: dict[Edge, viser.IcosphereHandle] = {}
        """What is dragged."""

    def show(self, root: str, frame: Pose, doll: Ragdoll, joint: Joint) -> None:
        """Draw the ranges below node ``root``, at the doll's frame, whose pose is ``frame``."""
        self._frame, self._doll, self._joint, self._dragged = frame, doll, joint, joint
        child = doll.bone(joint.child)
        self._radius = REACH * (math.dist(child.position, joint.anchor)
                                + max(child.shape.half_extents))
        self._meshes = {
            key: self._server.scene.add_mesh_simple(
                f'{root}/range_{key}', vertices, fan(len(vertices)), color=COLORS[key],
                opacity=OPACITY, side='double', cast_shadow=False, receive_shadow=False)
            for key, vertices in self._fans(joint).items()}
        self.spheres = {
            edge: self._server.scene.add_icosphere(
                f'{root}/limit_{edge[0]}_{edge[1]}', SPHERE * self._radius, color=COLORS[edge[0]],
                position=self._tip(joint, edge), cast_shadow=False)
            for edge in self._edges(joint)}
        for edge, sphere in self.spheres.items():
            self._listen(edge, sphere)

    def _edges(self, joint: Joint) -> list[Edge]:
        return [(order, side) for order, pair in enumerate(joint.angle_limits) if pair
                for side in (0, 1)]

    def _needle(self, order: int) -> np.ndarray:
        """Vector (3,) m from the anchor to the rim of an angle's sector where the angle is 0."""
        return self._radius * rotation.normalized(child_needle(self._doll, self._joint, order))

    def _tip(self, joint: Joint, edge: Edge) -> np.ndarray:
        order, side = edge
        pair = joint.angle_limits[order]
        return joint.anchor + range_arc(angle_axes(joint)[order], self._needle(order), pair)[-side]

    def _fans(self, joint: Joint) -> dict[int, np.ndarray]:
        """Vertices (v, 3) m of each sector, the anchor first, by its angle's number; a cone has the
        number 0.
        """
        rims = {order: range_arc(angle_axes(joint)[order], self._needle(order), pair)
                for order, pair in enumerate(joint.angle_limits) if pair}
        if joint.kind == 'ball' and 0 in rims and 1 in rims:
            rims[0] = self._radius * rotation.normalized(cone_rim(self._doll, joint))
            del rims[1]
        return {key: np.vstack([np.zeros(3), rim]) + joint.anchor for key, rim in rims.items()}

    def _listen(self, edge: Edge, sphere: viser.IcosphereHandle) -> None:
        async def on_drag(event: viser.SceneNodeDragEvent) -> None:
            eye = self._frame.apply_inverse(event.client.camera.position)
            pointer = self._frame.apply_inverse(np.array(event.end_position))
            self.drag(edge, eye, pointer, event.phase == 'end')

        sphere.on_drag('left')(on_drag)

    def drag(self, edge: Edge, eye: np.ndarray, pointer: np.ndarray, is_end: bool) -> None:
        """Take the limit to where the line of sight from ``eye`` through ``pointer`` points.

        Both are (3,) m in the doll's frame. A limit that the joint cannot have is not taken.
        """
        order, side = edge
        axis, needle = angle_axes(self._joint)[order], self._needle(order)
        spoke = plane_point(eye, pointer, np.array(self._joint.anchor), axis) - self._joint.anchor
        angle = math.atan2(axis @ np.cross(needle, spoke), needle @ spoke)
        # Of all turns the one nearest to the limit: a range may pass half a turn.
        last = self._dragged.angle_limits[order][side]
        angle += 2 * math.pi * round((last - angle) / (2 * math.pi))
        if self.snap:
            angle = snapping.snapped_angle(angle)
        with suppress(errors.ModelError):
            self._show_dragged(_with_limit(self._dragged, edge, angle))
        if is_end and self._dragged.limits != self._joint.limits:
            self._on_limits(self._dragged.limits)

    def _show_dragged(self, joint: Joint) -> None:
        self._dragged = joint
        with self._server.atomic():
            for key, vertices in self._fans(joint).items():
                self._meshes[key].vertices = vertices.astype(np.float32)
            for edge, sphere in self.spheres.items():
                sphere.position = self._tip(joint, edge)


def fan(count: int) -> np.ndarray:
    """Faces (count - 2, 3) of a fan of vertices, the first of which is its apex."""
    rim = np.arange(1, count - 1)
    return np.stack([np.zeros_like(rim), rim, rim + 1], axis=1)


def plane_point(eye: np.ndarray, pointer: np.ndarray, anchor: np.ndarray,
                normal: np.ndarray) -> np.ndarray:
    """Where a line of sight meets a plane; if nearly parallel, ``pointer`` projected onto it."""
    direction = pointer - eye
    steepness = float(direction @ normal)
    if abs(steepness) < 0.1 * float(np.linalg.norm(direction)):
        return pointer - normal * float((pointer - anchor) @ normal)
    return eye + direction * (float((anchor - eye) @ normal) / steepness)


def _with_limit(joint: Joint, edge: Edge, angle: float) -> Joint:
    """The joint with another limit; a cone stays symmetric. Raises ModelError."""
    order, side = edge
    limits = list(joint.limits)
    if joint.kind == 'ball' and len(limits) == 2 and order < 2:
        swing = min(abs(angle), MAX_SWING)
        limits[0] = -swing, swing
    else:
        index = order - (len(joint.angle_limits) - len(limits))
        low, high = limits[index]
        limits[index] = (angle, high) if side == 0 else (low, angle)
    return dataclasses.replace(joint, limits=tuple(limits))
