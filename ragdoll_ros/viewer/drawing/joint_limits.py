"""Joint limits: an arc from the lowest to the highest angle, and a needle where the angle is."""
from __future__ import annotations

import numpy as np
import viser

from ...model import rotation
from ...model.ragdoll import Joint, Ragdoll, joint_frame
from ...model.scene import Scene
from ...model.state import State

PIECES = 12
"""Lines that make up an arc."""

DEPTH = 3
"""Most angles of a joint."""

GRAY, GREEN, RED = (120, 125, 130), (30, 150, 70), (225, 40, 30)
NEAR = np.radians(1.0)
"""rad from a limit, or past it, where the needle turns red."""

SIZES = (0.04, 0.15)
"""m: shortest and longest needle; else half the child's length."""


class Limits:
    """Dials of all limited angles of a scene.

    A joint's angles are rotations one after the other, each about an axis that the ones before
    have rotated; all is kept along the axes of the parent bone.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self._server = server
        self._handle: viser.LineSegmentsHandle | None = None
        parents, anchors, axes, numbers, dials = [], [], [], [], []
        angle = 0
        for placement, part in zip(scene.dolls, scene.bone_slices, strict=True):
            doll = placement.doll
            for joint in doll.joints:
                parent = doll.bone(joint.parent)
                into_parent = rotation.inverse(parent.orientation)
                local_axes = rotation.rotate(into_parent, _axes(joint))
                for depth, pair in enumerate(joint.angle_limits):
                    if pair:
                        needle = rotation.rotate(into_parent, _needle(doll, joint, depth))
                        dials.append((len(parents), depth, angle + depth, pair,
                                      _arc(local_axes[depth], needle, pair), needle))
                parents.append(part.start + doll.bones.index(parent))
                anchors.append(rotation.rotate(into_parent,
                                               np.subtract(joint.anchor, parent.position)))
                axes.append(local_axes)
                numbers.append([angle + k if k < joint.dof else -1 for k in range(DEPTH)])
                angle += joint.dof
        self._parents, self._anchors = np.array(parents, int), np.array(anchors)
        self._axes, self._numbers = np.array(axes), np.array(numbers, int)
        self._some = bool(dials)
        if dials:
            self._joints, self._depths, self._angles, self._pairs, self._arcs, self._needles = (
                np.array(column) for column in zip(*dials, strict=True))

    def show(self, state: State, angles: np.ndarray | None) -> None:
        """Draw the dials for all joint angles (k,) rad; None hides them."""
        if angles is None or not self._some or len(angles) != self._numbers.max() + 1:
            if self._handle is not None:
                self._handle.visible = False
            return
        points, colors = self._lines(state, angles), self._colors(angles)
        if self._handle is None:
            self._handle = self._server.scene.add_line_segments(
                '/scene/limits', points, colors, thickness=2.5, thickness_units='screen')
            return
        self._handle.points, self._handle.colors = points, colors
        self._handle.visible = True

    def _lines(self, state: State, angles: np.ndarray) -> np.ndarray:
        """Both ends (l, 2, 3) m of all lines, needles last, world frame."""
        frames = [state.orientations[self._parents]]
        centres = state.positions[self._parents] + rotation.rotate(frames[0], self._anchors)
        padded = np.append(angles, 0.0)
        for depth in range(DEPTH):
            vectors = self._axes[:, depth] * padded[self._numbers[:, depth], None]
            frames.append(rotation.multiply(frames[-1], rotation.from_rotation_vector(vectors)))
        frames, centres = np.array(frames), centres[self._joints]
        arcs = centres[:, None] + rotation.rotate(
            frames[self._depths, self._joints][:, None], self._arcs)
        tips = centres + rotation.rotate(frames[self._depths + 1, self._joints], self._needles)
        lines = np.stack([arcs[:, :-1], arcs[:, 1:]], axis=2).reshape(-1, 2, 3)
        return np.concatenate([lines, np.stack([centres, tips], axis=1)]).astype(np.float32)

    def _colors(self, angles: np.ndarray) -> np.ndarray:
        values = angles[self._angles]
        red = (values < self._pairs[:, 0] + NEAR) | (values > self._pairs[:, 1] - NEAR)
        arcs = np.tile(np.array(GRAY, np.uint8), (len(red) * PIECES, 2, 1))
        needles = np.where(red[:, None], RED, GREEN).astype(np.uint8)
        return np.concatenate([arcs, np.stack([needles, needles], axis=1)])


def _axes(joint: Joint) -> np.ndarray:
    """Axes (3, 3) of a joint's angles in the bind pose, doll's frame; zero for those it lacks."""
    if joint.kind == 'ball':
        return rotation.matrix(joint_frame(joint)).T
    axes = np.zeros((DEPTH, 3))
    axes[:len(joint.axes)] = joint.axes or np.zeros((0, 3))
    return axes


def _needle(doll: Ragdoll, joint: Joint, depth: int) -> np.ndarray:
    """From the anchor toward the child, across the axis (3,) m, in the bind pose; doll's frame."""
    child, axis = doll.bone(joint.child), _axes(joint)[depth]
    toward = np.subtract(child.position, joint.anchor)
    toward = toward - axis * (axis @ toward)
    if np.linalg.norm(toward) < 1e-6:
        toward = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return rotation.normalized(toward) * np.clip(max(child.shape.half_extents), *SIZES)


def _arc(axis: np.ndarray, needle: np.ndarray, pair: tuple[float, float]) -> np.ndarray:
    """Points (PIECES + 1, 3) m that the needle's tip may reach."""
    angles = np.linspace(*pair, PIECES + 1)
    return rotation.rotate(rotation.from_rotation_vector(angles[:, None] * axis), needle)
