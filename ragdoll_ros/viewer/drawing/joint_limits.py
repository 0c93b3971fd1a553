"""Joint limits: an arc from the lowest to the highest angle, and a needle where the angle is.

Of a ball joint also the cone within which the limb stays: that of its two swings, a pyramid's.
"""
from __future__ import annotations

import numpy as np
import viser

from ...model import rotation
from ...model.ragdoll import Joint, Ragdoll, joint_frame
from ...model.scene import Scene
from ...model.state import State

PIECES = 12
"""Lines that make up an arc."""

MOST = 25
"""Dolls that have dials at once: those of one are some 130 lines, 4 kB with each picture."""

RIM, SPOKES = 32, 8
"""Lines that make up a cone's rim, and lines from its tip to that."""

DEPTH = 3
"""Most angles of a joint."""

GRAY, GREEN, RED, BLUE = (120, 125, 130), (30, 150, 70), (225, 40, 30), (120, 160, 210)
NEAR = np.radians(1.0)
"""rad from a limit, or past it, where the needle turns red."""

SIZES = (0.04, 0.15)
"""m: shortest and longest needle; else half the child's length."""


class Limits:
    """Dials of the limited angles of a scene's dolls: in a crowd, of those that are looked at."""

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self._server, self._scene = server, scene
        self._handle: viser.LineSegmentsHandle | None = None
        self._roots = np.array([part.start for part in scene.bone_slices])
        self._starts = np.cumsum([0, *(sum(joint.dof for joint in placement.doll.joints)
                                       for placement in scene.dolls)])
        self._dials: _Dials | None = None

    def show(self, state: State, angles: np.ndarray | None) -> None:
        """Draw the dials for all joint angles (k,) rad; None hides them."""
        if angles is None or len(angles) != self._starts[-1]:
            self._hide()
            return
        dolls = self._looked_at(state)
        if self._dials is None or self._dials.dolls != dolls:
            self._dials = _Dials(self._scene, dolls, self._starts)
        if not self._dials.some:
            self._hide()
            return
        points, colors = self._dials.lines(state, angles), self._dials.colors(angles)
        if self._handle is None:
            self._handle = self._server.scene.add_line_segments(
                '/scene/limits', points, colors, thickness=2.5, thickness_units='screen')
            return
        self._handle.points, self._handle.colors = points, colors
        self._handle.visible = True

    def _hide(self) -> None:
        if self._handle is not None:
            self._handle.visible = False

    def _looked_at(self, state: State) -> list[int]:
        """All dolls, or the MOST that are nearest to what the pages look at."""
        if len(self._roots) <= MOST:
            return list(range(len(self._roots)))
        points = [client.camera.look_at for client in self._server.get_clients().values()]
        offsets = state.positions[self._roots, None] - np.array(points).reshape(-1, 3)
        away = np.linalg.norm(offsets, axis=2).min(axis=1, initial=np.inf)
        return sorted(np.argpartition(away, MOST)[:MOST].tolist())


class _Dials:
    """Dials of some of a scene's dolls; ``starts`` is where each doll's joint angles begin.

    A joint's angles are rotations one after the other, each about an axis that the ones before
    have rotated; all is kept along the axes of the parent bone.
    """

    def __init__(self, scene: Scene, dolls: list[int], starts: np.ndarray) -> None:
        self.dolls = dolls
        parents, anchors, axes, numbers, dials, cones = [], [], [], [], [], []
        for index in dolls:
            doll, first = scene.dolls[index].doll, scene.bone_slices[index].start
            angle = starts[index]
            for joint in doll.joints:
                parent = doll.bone(joint.parent)
                into_parent = rotation.inverse(parent.orientation)
                local_axes = rotation.rotate(into_parent, _axes(joint))
                for depth, pair in enumerate(joint.angle_limits):
                    if pair:
                        needle = rotation.rotate(into_parent, _needle(doll, joint, depth))
                        dials.append((len(parents), depth, angle + depth, pair,
                                      _arc(local_axes[depth], needle, pair), needle))
                if joint.kind == 'ball' and all(joint.angle_limits[:2]):
                    cones.append((len(parents), rotation.rotate(into_parent, _rim(doll, joint))))
                parents.append(first + doll.bones.index(parent))
                anchors.append(rotation.rotate(into_parent,
                                               np.subtract(joint.anchor, parent.position)))
                axes.append(local_axes)
                numbers.append([angle + k if k < joint.dof else -1 for k in range(DEPTH)])
                angle += joint.dof
        self._parents, self._anchors = np.array(parents, int), np.array(anchors)
        self._axes, self._numbers = np.array(axes), np.array(numbers, int)
        self.some = bool(dials)
        self._coned = np.array([joint for joint, _ in cones], int)
        self._rims = np.array([rim for _, rim in cones]).reshape(-1, RIM + 1, 3)
        if dials:
            self._joints, self._depths, self._angles, self._pairs, self._arcs, self._needles = (
                np.array(column) for column in zip(*dials, strict=True))

    def lines(self, state: State, angles: np.ndarray) -> np.ndarray:
        """Both ends (l, 2, 3) m of all lines, cones first, needles last, world frame."""
        frames = [state.orientations[self._parents]]
        centres = state.positions[self._parents] + rotation.rotate(frames[0], self._anchors)
        padded = np.append(angles, 0.0)
        for depth in range(DEPTH):
            vectors = self._axes[:, depth] * padded[self._numbers[:, depth], None]
            frames.append(rotation.multiply(frames[-1], rotation.from_rotation_vector(vectors)))
        tips = centres[self._coned, None]
        rims = tips + rotation.rotate(frames[0][self._coned, None], self._rims)
        spokes = rims[:, :-1:RIM // SPOKES]
        cones = np.concatenate([np.stack([rims[:, :-1], rims[:, 1:]], axis=2), np.stack(
            [np.broadcast_to(tips, spokes.shape), spokes], axis=2)], axis=1).reshape(-1, 2, 3)
        frames, centres = np.array(frames), centres[self._joints]
        arcs = centres[:, None] + rotation.rotate(
            frames[self._depths, self._joints][:, None], self._arcs)
        tips = centres + rotation.rotate(frames[self._depths + 1, self._joints], self._needles)
        lines = np.stack([arcs[:, :-1], arcs[:, 1:]], axis=2).reshape(-1, 2, 3)
        return np.concatenate([cones, lines, np.stack([centres, tips], axis=1)]).astype(np.float32)

    def colors(self, angles: np.ndarray) -> np.ndarray:
        """Of both ends (l, 2, 3) of all lines, for joint angles (k,) rad."""
        values = angles[self._angles]
        red = (values < self._pairs[:, 0] + NEAR) | (values > self._pairs[:, 1] - NEAR)
        arcs = np.tile(np.array(GRAY, np.uint8), (len(red) * PIECES, 2, 1))
        needles = np.where(red[:, None], RED, GREEN).astype(np.uint8)
        cones = np.tile(np.array(BLUE, np.uint8), (len(self._rims) * (RIM + SPOKES), 2, 1))
        return np.concatenate([cones, arcs, np.stack([needles, needles], axis=1)])


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


def _rim(doll: Ragdoll, joint: Joint) -> np.ndarray:
    """Where the limb of a ball joint points at the ends of its swings, (RIM + 1, 3) m from the
    anchor, as long as its needles; doll's frame, bind pose of the parent.
    """
    (low_x, high_x), (low_y, high_y) = joint.angle_limits[:2]
    along = np.linspace(0, 4, RIM + 1)
    x = np.interp(along, range(5), (low_x, high_x, high_x, low_x, low_x))
    y = np.interp(along, range(5), (low_y, low_y, high_y, high_y, low_y))
    axes, child = _axes(joint), doll.bone(joint.child)
    ahead = axes[2] * np.copysign(1.0, axes[2] @ np.subtract(child.position, joint.anchor))
    turns = rotation.multiply(rotation.from_rotation_vector(x[:, None] * axes[0]),
                              rotation.from_rotation_vector(y[:, None] * axes[1]))
    return rotation.rotate(turns, ahead) * np.clip(max(child.shape.half_extents), *SIZES)
