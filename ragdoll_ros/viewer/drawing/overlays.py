"""Lines, arrows and points for swings, pushes, hands, contacts and impacts."""
from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
import viser

from ...model import rotation
from ...model.push import Push
from ...model.ragdoll import Bone
from ..sources.source import Frame

WEIGHT_LENGTH, MAX_LENGTH = 1.0, 2.0
"""m: line of a force equal to the first doll's weight at 9.8 m/s^2; longest line of a force."""

LEAST_FORCE = 0.01
"""Of the first doll's weight: smaller forces have no arrow."""

MOST_ARROWS, MOST_LABELS = 100, 12
"""Of forces, the strongest first."""

LABEL_GAP = 0.15
"""m: a force whose tip is nearer to that of a stronger one has no label, which would lie on it."""

BROWN, RED, BLUE, ORANGE = (90, 50, 25), (230, 50, 25), (30, 110, 230), (235, 110, 0)
PURPLE, CRIMSON = (140, 64, 204), (217, 13, 64)
"""Of impacts within their limit, and above it."""

ROD_THICKNESS = 0.012
"""m: of a swing's rods."""

MIN_PUSH_DISPLAY = 0.3
"""s of wall time that a push is drawn at least: a tap is too short to be seen."""


class Overlays:
    """Draws swings, pushes, hands, contacts and impacts.

    Each kind gets its scene node when it is first needed.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        add = server.scene
        self._makers: dict[str, Callable[[str, np.ndarray], viser.SceneNodeHandle]] = {
            'rods': lambda name, points: add.add_line_segments(
                name, points, BROWN, thickness=ROD_THICKNESS),
            'pushes': lambda name, points: add.add_arrows(
                name, points, RED, shaft_radius=0.02, head_radius=0.05, head_length=0.12),
            'hands': lambda name, points: add.add_line_segments(
                name, points, BLUE, thickness=3.0, thickness_units='screen'),
            'pointers': lambda name, points: add.add_point_cloud(
                name, points, BLUE, point_size=0.05, point_shape='circle'),
            'contacts': lambda name, points: add.add_point_cloud(
                name, points, ORANGE, point_size=0.02, point_shape='circle'),
            'forces': lambda name, points: add.add_arrows(
                name, points, ORANGE, shaft_radius=0.01, head_radius=0.03, head_length=0.07),
            'impacts': lambda name, points: add.add_arrows(
                name, points, PURPLE, shaft_radius=0.01, head_radius=0.03, head_length=0.07),
            'impacts_above': lambda name, points: add.add_arrows(
                name, points, CRIMSON, shaft_radius=0.01, head_radius=0.03, head_length=0.07)}
        self._scene = server.scene
        self._labels: dict[str, list[viser.LabelHandle]] = {'newtons': [], 'impacts': []}
        """At the tips of arrows of forces and of impacts."""
        self._handles: dict[str, viser.SceneNodeHandle] = {}
        self._pushes: tuple[Push, ...] = ()
        self._last_push = 0.0

    def show(self, frame: Frame, rods: np.ndarray | None = None) -> None:
        """Draw the overlays of a frame, with ``rods`` (m, 2, 3) m of its swings; hide the rest."""
        scene, state = frame.scene, frame.state
        now = time.monotonic()
        pushes = tuple(push for push in frame.pushes if any(push.force))
        if pushes or now - self._last_push > MIN_PUSH_DISPLAY:
            self._pushes, self._last_push = pushes, now
        arrows = [arrow_to_surface(scene.bones[bone], push, state.positions[bone],
                                   state.orientations[bone])
                  for push in self._pushes for bone in (scene.bone_index(push.bone),)]
        self._set('rods', rods)
        self._set('pushes', arrows)
        self._set('hands', [(grab.point, grab.target) for grab in frame.grabs])
        self._set('pointers', [grab.target for grab in frame.grabs])
        self._set('contacts', frame.contacts)
        arrows, newtons = force_arrows(frame)
        self._set('forces', arrows)
        self._label('newtons', arrows[:, 1], [f'{force:.0f} N' for force in newtons])
        impacts = sorted(frame.impacts, key=lambda arrow: -arrow.length)[:MOST_ARROWS]
        for kind, is_above in (('impacts', False), ('impacts_above', True)):
            self._set(kind, [(arrow.tail, arrow.tip) for arrow in impacts
                             if arrow.is_above == is_above])
        self._label('impacts', np.array([arrow.tip for arrow in impacts]).reshape(-1, 3),
                    [arrow.text for arrow in impacts])

    def _label(self, kind: str, tips: np.ndarray, texts: Sequence[str]) -> None:
        """Write the texts at those tips (k, 3) m of arrows that `apart` selects."""
        labels, labelled = self._labels[kind], apart(tips)
        while len(labels) > len(labelled):
            labels.pop().remove()
        for index, number in enumerate(labelled):
            text, tip = texts[number], tips[number]
            if index == len(labels):
                labels.append(self._scene.add_label(
                    f'/scene/{kind}_labels/{index}', text, position=tip, anchor='bottom-center'))
            else:
                labels[index].text, labels[index].position = text, tip

    def _set(self, kind: str, points: object) -> None:
        handle = self._handles.get(kind)
        if points is None or not len(points):
            if handle is not None:
                handle.visible = False
            return
        points = np.asarray(points, np.float32)
        if handle is None:
            self._handles[kind] = self._makers[kind](f'/scene/{kind}', points)
            return
        handle.points = points
        handle.visible = True


def force_arrows(frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Tails and tips (k, 2, 3) m of force arrows, and the forces (k,) N, the largest first.

    One arrow for all contact points of a bone with another, with a static body or with the ground,
    at their centre of pressure. None where forces are unknown, or below LEAST_FORCE.
    """
    if frame.forces is None or not len(frame.forces):
        return np.zeros((0, 2, 3)), np.zeros(0)
    weight = 9.8 * frame.scene.dolls[0].doll.mass
    _, group = np.unique(frame.pairs, axis=0, return_inverse=True)
    sizes = np.linalg.norm(frame.forces, axis=1)
    group = group.ravel()
    forces, moments = np.zeros((2, group.max() + 1, 3))
    np.add.at(forces, group, frame.forces)
    np.add.at(moments, group, sizes[:, None] * frame.contacts)
    total = np.bincount(group, sizes)
    newtons = np.linalg.norm(forces, axis=1)
    order = np.argsort(-newtons)[:MOST_ARROWS]
    order = order[newtons[order] >= LEAST_FORCE * weight]
    tails = moments[order] / total[order, None]
    lengths = np.minimum(WEIGHT_LENGTH / weight, MAX_LENGTH / newtons[order])
    return np.stack([tails, tails + forces[order] * lengths[:, None]], axis=1), newtons[order]


def apart(tips: np.ndarray) -> list[int]:
    """Indices of at most MOST_LABELS tips (k, 3) m, each LABEL_GAP or more from those before.

    A tip that is too near is skipped, and does not count for later ones.
    """
    found: list[int] = []
    for index, tip in enumerate(tips):
        if all(np.linalg.norm(tip - tips[other]) >= LABEL_GAP for other in found):
            found.append(index)
        if len(found) == MOST_LABELS:
            break
    return found


def arrow_to_surface(bone: Bone, push: Push, position: np.ndarray,
                     orientation: np.ndarray) -> np.ndarray:
    """Tail and tip (2, 3) m, world frame, of a push's arrow that ends at the bone's surface.

    ``position`` (3,) m and ``orientation`` (4,) are the bone's.
    """
    arrow = push.arrow(position, orientation)
    direction = rotation.normalized(arrow[1] - arrow[0])
    local = rotation.rotate(rotation.inverse(orientation), direction)
    depth = (arrow[1] - position) @ direction + bone.shape.support(local)
    return arrow - direction * depth
