"""Bones, swings and pushes as markers, for RViz."""
from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, partial

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from ...model import rotation
from ...model.pose import Pose
from ...model.push import Push
from ...model.ragdoll import DEFAULT_COLOR, Ragdoll
from ...model.scene import Scene
from ...model.state import State
from ...physics.swing.pose import SwingState
from .convert import count_masses, to_header, to_point, to_pose, to_vector
from .serialized import STAMP_MARK, Form, marked
from .serialized_markers import MarkerList, joined

RED = (0.9, 0.2, 0.1, 1.0)
BROWN = (0.35, 0.2, 0.1, 1.0)
ROD = 0.01
"""m: thickness of the rods of swings."""

KINDS = {'box': Marker.CUBE, 'sphere': Marker.SPHERE, 'cylinder': Marker.CYLINDER}


class Markers:
    """A MarkerArray of a scene's bones, of the rods of its swings and of the pushes that act.

    Bones and rods have a form; the few arrows are made anew for each message.
    """

    def __init__(self, scene: Scene, frame: str) -> None:
        self._scene, self._frame = scene, frame
        parts = [(index, part) for index, bone in enumerate(scene.bones)
                 for part in bone.shape.primitives]
        self._bones = np.array([index for index, _ in parts])
        self._within = Pose(np.array([part.position for _, part in parts]),
                            np.array([part.orientation for _, part in parts]))
        self._arrows = 0
        self._fresh = True

    def message(self, stamp: int, state: State, pushes: Sequence[Push],
                swings: SwingState | None = None) -> bytes:
        """Serialized markers where the bones are; arrows of pushes that have ended are taken away.

        The first message takes away whatever the scene before has left.
        """
        poses = np.concatenate(state.poses(self._bones).compose(self._within), axis=1)
        ends = np.zeros((0, 3)) if swings is None else np.stack(
            [swings.roots, swings.positions], axis=1).reshape(-1, 3)
        form = self._make_form(first=True) if self._fresh else self._form
        self._fresh = False
        return joined(form.message(stamp, poses, ends), self._pushes(stamp, pushes, state))

    @cached_property
    def _form(self) -> Form:
        return self._make_form()

    def _make_form(self, first: bool = False) -> Form:
        """The form of all bones' parts, with poses (p, 7), and of all rods, with ends (2 m, 3) m.

        The ``first`` takes away what there was.
        """
        header, scene, array = to_header(STAMP_MARK, self._frame), self._scene, MarkerList()
        if first:
            array.append('all', '', lambda _: (
                [Marker(header=header, action=Marker.DELETEALL)], np.zeros((1, 0))))
        poses = [array.append(id(placement.doll), scene.qualified(placement, ''),
                              partial(_parts, header, placement.doll)) for placement in scene.dolls]
        masses, ends = count_masses(scene), np.zeros(0, int)
        if masses:
            ends = array.append('swings', '', lambda _: _rods(header, marked(1, (2 * masses, 3))))
        return array.form(np.concatenate(poses), ends)

    def _pushes(self, stamp: int, pushes: Sequence[Push], state: State) -> list[Marker]:
        """Arrows of the pushes that act, and the end of those that have been and are no more."""
        arrows = [self._arrow(number, push, state) for number, push in enumerate(
            push for push in pushes if any(push.force))]
        gone = [Marker(ns='push', id=number, action=Marker.DELETE)
                for number in range(len(arrows), self._arrows)]
        self._arrows = len(arrows)
        for marker in arrows + gone:
            marker.header = to_header(stamp, self._frame)
        return arrows + gone

    def _arrow(self, number: int, push: Push, state: State) -> Marker:
        """Arrow whose tip is where the push attacks."""
        bone = self._scene.bone_index(push.bone)
        tail, tip = push.arrow(state.positions[bone], state.orientations[bone])
        marker = Marker(ns='push', id=number, type=Marker.ARROW, action=Marker.ADD)
        marker.scale = to_vector((np.linalg.norm(tip - tail), 0.04, 0.06))
        orientation = rotation.shortest_arc(np.array([1.0, 0, 0]), tip - tail)
        marker.pose = to_pose((*tail.tolist(), *orientation.tolist()))
        paint(marker, RED)
        return marker


def _parts(header: Header, doll: Ragdoll, name: str) -> tuple[list[Marker], np.ndarray]:
    """Markers of the parts of all bones of a doll of that name, and the poses (p, 7) they have."""
    parts = [(bone, number, part) for bone in doll.bones
             for number, part in enumerate(bone.shape.primitives)]
    poses = marked(1, (len(parts), 7))
    markers = []
    for (bone, number, part), row in zip(parts, poses.tolist(), strict=True):
        marker = Marker(header=header, ns=name + bone.name, id=number, type=KINDS[part.kind],
                        action=Marker.ADD, pose=to_pose(row), scale=to_vector(part.size))
        paint(marker, bone.color or DEFAULT_COLOR)
        markers.append(marker)
    return markers, poses


def _rods(header: Header, ends: np.ndarray) -> tuple[list[Marker], np.ndarray]:
    """All rods of the swings, each from root to mass, as one list of lines; and its numbers."""
    marker = Marker(header=header, ns='swings', id=0, type=Marker.LINE_LIST, action=Marker.ADD)
    marker.scale.x = ROD
    marker.pose.orientation.w = 1.0
    marker.points = [to_point(end) for end in ends]
    paint(marker, BROWN)
    return [marker], ends.reshape(1, -1)


def paint(marker: Marker, color: tuple[float, ...]) -> None:
    """Set a marker's colour: red, green, blue, opacity."""
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = map(float, color)
