"""Joint limits: an arc over the range of each limited angle, with a needle at its value.

For a ball joint with two swing limits also their cone, which has the shape of a pyramid.
"""
from __future__ import annotations

import numpy as np
import viser

from ...model import rotation
from ...model.ragdoll import Joint, Ragdoll, joint_frame
from ...model.scene import Scene
from ...model.state import State

ARC_SEGMENTS = 12
"""Line segments of an arc."""

MAX_DOLLS = 25
"""Dolls with arcs at once: those of one are some 130 lines, 4 kB per frame."""

RIM, SPOKES = 32, 8
"""Line segments of a cone's rim, and lines from its apex to the rim."""

MAX_ANGLES = 3
"""Of a joint."""

GRAY, GREEN, RED, BLUE = (90, 95, 102), (30, 150, 70), (225, 40, 30), (120, 160, 210)
MARGIN = np.radians(1.0)
"""rad from a limit within which, or beyond which, the needle is red."""

NEEDLE_LENGTHS = (0.04, 0.15)
"""m: shortest and longest needle; between them, half the child's length."""


class JointLimits:
    """Range arcs of the limited angles of a scene's dolls; in a crowd, of the nearest ones."""

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self._server, self._scene = server, scene
        self._handle: viser.LineSegmentsHandle | None = None
        self._roots = np.array([part.start for part in scene.bone_slices])
        self._starts = np.cumsum([0, *(sum(joint.dof for joint in placement.doll.joints)
                                       for placement in scene.dolls)])
        self._arcs: _RangeArcs | None = None

    def show(self, state: State, angles: np.ndarray | None) -> None:
        """Draw the arcs for all joint angles (k,) rad; None hides them."""
        if angles is None or len(angles) != self._starts[-1]:
            self._hide()
            return
        dolls = self._nearest_dolls(state)
        if self._arcs is None or self._arcs.dolls != dolls:
            self._arcs = _RangeArcs(self._scene, dolls, self._starts)
        if not self._arcs.has_limits:
            self._hide()
            return
        points, colors = self._arcs.lines(state, angles), self._arcs.colors(angles)
        if self._handle is None:
            self._handle = self._server.scene.add_line_segments(
                '/scene/limits', points, colors, thickness=3.5, thickness_units='screen')
            return
        self._handle.points, self._handle.colors = points, colors
        self._handle.visible = True

    def _hide(self) -> None:
        if self._handle is not None:
            self._handle.visible = False

    def _nearest_dolls(self, state: State) -> list[int]:
        """All dolls, or the MAX_DOLLS nearest to the camera targets of the pages."""
        if len(self._roots) <= MAX_DOLLS:
            return list(range(len(self._roots)))
        points = [client.camera.look_at for client in self._server.get_clients().values()]
        offsets = state.positions[self._roots, None] - np.array(points).reshape(-1, 3)
        away = np.linalg.norm(offsets, axis=2).min(axis=1, initial=np.inf)
        return sorted(np.argpartition(away, MAX_DOLLS)[:MAX_DOLLS].tolist())


class _RangeArcs:
    """Range arcs of some of a scene's dolls; ``starts``: index of each doll's first angle.

    A joint's angles are successive rotations, each about an axis rotated by those before; all is
    kept in the frame of the parent bone.
    """

    def __init__(self, scene: Scene, dolls: list[int], starts: np.ndarray) -> None:
        self.dolls = dolls
        parents, anchors, axes, numbers, arcs, cones = [], [], [], [], [], []
        for index in dolls:
            doll, first = scene.dolls[index].doll, scene.bone_slices[index].start
            angle = starts[index]
            for joint in doll.joints:
                parent = doll.bone(joint.parent)
                into_parent = rotation.inverse(parent.orientation)
                local_axes = rotation.rotate(into_parent, angle_axes(joint))
                for order, pair in enumerate(joint.angle_limits):
                    if pair:
                        needle = rotation.rotate(into_parent, child_needle(doll, joint, order))
                        arcs.append((len(parents), order, angle + order, pair,
                                      range_arc(local_axes[order], needle, pair), needle))
                if joint.kind == 'ball' and all(joint.angle_limits[:2]):
                    rim = rotation.rotate(into_parent, cone_rim(doll, joint))
                    cones.append((len(parents), rim))
                parents.append(first + doll.bones.index(parent))
                anchors.append(rotation.rotate(into_parent,
                                               np.subtract(joint.anchor, parent.position)))
                axes.append(local_axes)
                numbers.append([angle + k if k < joint.dof else -1 for k in range(MAX_ANGLES)])
                angle += joint.dof
        self._parents, self._anchors = np.array(parents, int), np.array(anchors)
        self._axes, self._numbers = np.array(axes), np.array(numbers, int)
        self.has_limits = bool(arcs)
        self._cone_joints = np.array([joint for joint, _ in cones], int)
        self._rims = np.array([rim for _, rim in cones]).reshape(-1, RIM + 1, 3)
        if arcs:
            self._joints, self._orders, self._angles, self._pairs, self._arcs, self._needles = (
                np.array(column) for column in zip(*arcs, strict=True))

    def lines(self, state: State, angles: np.ndarray) -> np.ndarray:
        """Ends (l, 2, 3) m of all lines, cones first, needles last, world frame."""
        frames = [state.orientations[self._parents]]
        centres = state.positions[self._parents] + rotation.rotate(frames[0], self._anchors)
        padded = np.append(angles, 0.0)
        for order in range(MAX_ANGLES):
            vectors = self._axes[:, order] * padded[self._numbers[:, order], None]
            frames.append(rotation.multiply(frames[-1], rotation.from_rotation_vector(vectors)))
        tips = centres[self._cone_joints, None]
        rims = tips + rotation.rotate(frames[0][self._cone_joints, None], self._rims)
        spokes = rims[:, :-1:RIM // SPOKES]
        cones = np.concatenate([np.stack([rims[:, :-1], rims[:, 1:]], axis=2), np.stack(
            [np.broadcast_to(tips, spokes.shape), spokes], axis=2)], axis=1).reshape(-1, 2, 3)
        frames, centres = np.array(frames), centres[self._joints]
        arcs = centres[:, None] + rotation.rotate(
            frames[self._orders, self._joints][:, None], self._arcs)
        tips = centres + rotation.rotate(frames[self._orders + 1, self._joints], self._needles)
        lines = np.stack([arcs[:, :-1], arcs[:, 1:]], axis=2).reshape(-1, 2, 3)
        return np.concatenate([cones, lines, np.stack([centres, tips], axis=1)]).astype(np.float32)

    def colors(self, angles: np.ndarray) -> np.ndarray:
        """Colours (l, 2, 3) uint8 of the ends of all lines, for joint angles (k,) rad."""
        values = angles[self._angles]
        red = (values < self._pairs[:, 0] + MARGIN) | (values > self._pairs[:, 1] - MARGIN)
        arcs = np.tile(np.array(GRAY, np.uint8), (len(red) * ARC_SEGMENTS, 2, 1))
        needles = np.where(red[:, None], RED, GREEN).astype(np.uint8)
        cones = np.tile(np.array(BLUE, np.uint8), (len(self._rims) * (RIM + SPOKES), 2, 1))
        return np.concatenate([cones, arcs, np.stack([needles, needles], axis=1)])


def angle_axes(joint: Joint) -> np.ndarray:
    """Axes (3, 3) of a joint's angles in the bind pose, doll's frame; zero beyond its angles."""
    if joint.kind == 'ball':
        return rotation.matrix(joint_frame(joint)).T
    axes = np.zeros((MAX_ANGLES, 3))
    axes[:len(joint.axes)] = joint.axes or np.zeros((0, 3))
    return axes


def child_needle(doll: Ragdoll, joint: Joint, order: int) -> np.ndarray:
    """Needle (3,) m from anchor to child, normal to the axis; bind pose, doll's frame."""
    child, axis = doll.bone(joint.child), angle_axes(joint)[order]
    toward = np.subtract(child.position, joint.anchor)
    toward = toward - axis * (axis @ toward)
    if np.linalg.norm(toward) < 1e-6:
        toward = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return rotation.normalized(toward) * np.clip(max(child.shape.half_extents), *NEEDLE_LENGTHS)


def range_arc(axis: np.ndarray, needle: np.ndarray, pair: tuple[float, float]) -> np.ndarray:
    """Points (ARC_SEGMENTS + 1, 3) m of the needle's tip over the range."""
    angles = np.linspace(*pair, ARC_SEGMENTS + 1)
    return rotation.rotate(rotation.from_rotation_vector(angles[:, None] * axis), needle)


def cone_rim(doll: Ragdoll, joint: Joint) -> np.ndarray:
    """Rim (RIM + 1, 3) m of a ball joint's cone from the anchor, at the needles' length.

    Bind pose of the parent, doll's frame.
    """
    (low_x, high_x), (low_y, high_y) = joint.angle_limits[:2]
    along = np.linspace(0, 4, RIM + 1)
    x = np.interp(along, range(5), (low_x, high_x, high_x, low_x, low_x))
    y = np.interp(along, range(5), (low_y, low_y, high_y, high_y, low_y))
    axes, child = angle_axes(joint), doll.bone(joint.child)
    ahead = axes[2] * np.copysign(1.0, axes[2] @ np.subtract(child.position, joint.anchor))
    turns = rotation.multiply(rotation.from_rotation_vector(x[:, None] * axes[0]),
                              rotation.from_rotation_vector(y[:, None] * axes[1]))
    return rotation.rotate(turns, ahead) * np.clip(max(child.shape.half_extents), *NEEDLE_LENGTHS)
