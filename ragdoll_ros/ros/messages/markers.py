"""Markers of bones, swings and pushes, for RViz."""
from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, partial

import numpy as np
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from ...model import rotation, static_body
from ...model.mesh import Hull
from ...model.pose import Pose
from ...model.push import Push
from ...model.ragdoll import DEFAULT_COLOR, Ragdoll
from ...model.scene import Scene
from ...model.shapes import Part
from ...model.state import State
from ...physics.swing.pose import SwingState
from .convert import count_masses, to_header, to_point, to_pose, to_vector
from .serialized import STAMP_SENTINEL, SerializedTemplate, sentinels
from .serialized_markers import MarkerArrayBuilder, append_markers

RED = (0.9, 0.2, 0.1, 1.0)
BROWN = (0.35, 0.2, 0.1, 1.0)
ROD_WIDTH = 0.01
"""m: line width of the swings' rods."""

SURFACE_PERIOD = 100
"""Messages from one with the surfaces to the next: they never move, and may be large."""

MARKER_TYPES = {'box': Marker.CUBE, 'sphere': Marker.SPHERE, 'cylinder': Marker.CYLINDER}


class SceneMarkers:
    """The MarkerArray of a scene: shapes of its bones and of its static bodies, rods of its swings,
    arrows of the pushes.

    All but the few arrows have a template.
    """

    def __init__(self, scene: Scene, frame: str) -> None:
        self._scene, self._frame = scene, frame
        parts = [(index, part) for index, bone in enumerate(scene.bones)
                 for part in bone.shape.primitives]
        self._bones = np.array([index for index, _ in parts])
        self._part_poses = Pose(np.array([part.position for _, part in parts]),
                                np.array([part.orientation for _, part in parts]))
        self._static = [(body, part) for body in scene.bodies for part in body.primitives]
        self._static_poses = np.array([(*part.position, *part.orientation)
                                       for _, part in self._static]).reshape(-1, 7)
        self._surfaces = [body for body in scene.bodies if not body.shape.primitives]
        self._arrow_count = self._message_count = 0

    def serialize(self, stamp: int, state: State, pushes: Sequence[Push],
                  swings: SwingState | None = None) -> bytes:
        """Serialized MarkerArray of a state; ``stamp`` in ns. Deletes arrows of ended pushes.

        The first message deletes all markers of the last scene. It and each hundredth message after
        it contain the surfaces.
        """
        poses = np.concatenate([np.concatenate(
            state.poses(self._bones).compose(self._part_poses), axis=1), self._static_poses])
        ends = np.zeros((0, 3)) if swings is None else np.stack(
            [swings.roots, swings.positions], axis=1).reshape(-1, 3)
        template = self._template
        if self._message_count == 0:
            template = self._make_template(first=True, surfaces=True)
        elif self._surfaces and self._message_count % SURFACE_PERIOD == 0:
            template = self._template_with_surfaces
        self._message_count += 1
        return append_markers(template.serialize(stamp, poses, ends),
                              self._push_markers(stamp, pushes, state))

    @cached_property
    def _template(self) -> SerializedTemplate:
        return self._make_template()

    @cached_property
    def _template_with_surfaces(self) -> SerializedTemplate:
        return self._make_template(surfaces=True)

    def _make_template(self, first: bool = False, surfaces: bool = False) -> SerializedTemplate:
        """Make the template: parts of bones and static bodies with poses (p, 7), and rods with end
        points (2 m, 3) m. ``first``: delete all other markers; ``surfaces``: with the surfaces.
        """
        header, scene = to_header(STAMP_SENTINEL, self._frame), self._scene
        array = MarkerArrayBuilder()
        if first:
            array.append('all', '', lambda _: (
                [Marker(header=header, action=Marker.DELETEALL)], np.zeros((1, 0))))
        if surfaces and self._surfaces:
            array.append('surfaces', '', lambda _: _surface_markers(header, self._surfaces))
        poses = [array.append(id(placement.doll), scene.qualified(placement, ''),
                              partial(_part_markers, header, placement.doll))
                 for placement in scene.dolls]
        if self._static:
            poses.append(array.append('static', '', lambda _: _static_markers(
                header, self._static)))
        masses, ends = count_masses(scene), np.zeros(0, int)
        if masses:
            ends = array.append('swings', '', lambda _: _rod_marker(
                header, sentinels(1, (2 * masses, 3))))
        return array.template(np.concatenate(poses), ends)

    def _push_markers(self, stamp: int, pushes: Sequence[Push], state: State) -> list[Marker]:
        """Arrows of the active pushes that have a force, and DELETE for those of ended ones."""
        arrows = [self._arrow(number, push, state) for number, push in enumerate(
            push for push in pushes if any(push.force))]
        deleted = [Marker(ns='push', id=number, action=Marker.DELETE)
                for number in range(len(arrows), self._arrow_count)]
        self._arrow_count = len(arrows)
        for marker in arrows + deleted:
            marker.header = to_header(stamp, self._frame)
        return arrows + deleted

    def _arrow(self, number: int, push: Push, state: State) -> Marker:
        """Arrow whose tip is the push's point of application."""
        bone = self._scene.bone_index(push.bone)
        tail, tip = push.arrow(state.positions[bone], state.orientations[bone])
        marker = Marker(ns='push', id=number, type=Marker.ARROW, action=Marker.ADD)
        marker.scale = to_vector((np.linalg.norm(tip - tail), 0.04, 0.06))
        orientation = rotation.shortest_arc(np.array([1.0, 0, 0]), tip - tail)
        marker.pose = to_pose((*tail.tolist(), *orientation.tolist()))
        set_color(marker, RED)
        return marker


def _part_markers(header: Header, doll: Ragdoll, name: str) -> tuple[list[Marker], np.ndarray]:
    """Markers of the parts of a doll's bones, and the sentinels (p, 7) in place of their poses;
    ``name`` is the prefix of their namespaces.
    """
    parts = [(bone, number, part) for bone in doll.bones
             for number, part in enumerate(bone.shape.primitives)]
    poses = sentinels(1, (len(parts), 7))
    markers = []
    for (bone, number, part), row in zip(parts, poses.tolist(), strict=True):
        marker = Marker(header=header, ns=name + bone.name, id=number, action=Marker.ADD,
                        pose=to_pose(row))
        set_shape(marker, part)
        set_color(marker, bone.color or DEFAULT_COLOR)
        markers.append(marker)
    return markers, poses


def _static_markers(header: Header, parts: Sequence[tuple[static_body.StaticBody, Part]]
                    ) -> tuple[list[Marker], np.ndarray]:
    """Markers of the parts of static bodies, and the sentinels (p, 7) in place of their poses."""
    poses = sentinels(1, (len(parts), 7))
    markers = []
    for number, ((body, part), row) in enumerate(zip(parts, poses.tolist(), strict=True)):
        marker = Marker(header=header, ns=f'bodies/{body.name}', id=number, action=Marker.ADD,
                        pose=to_pose(row))
        set_shape(marker, part)
        set_color(marker, body.color or static_body.DEFAULT_COLOR)
        markers.append(marker)
    return markers, poses


def _surface_markers(header: Header, bodies: Sequence[static_body.StaticBody]
                     ) -> tuple[list[Marker], np.ndarray]:
    """Markers of static bodies that are surfaces or planes, in which no number changes."""
    markers = []
    for body in bodies:
        marker = Marker(header=header, ns=f'bodies/{body.name}', action=Marker.ADD,
                        pose=to_pose((*body.position, *body.orientation)))
        set_triangles(marker, *body.shape.mesh())
        set_color(marker, body.color or static_body.DEFAULT_COLOR)
        markers.append(marker)
    return markers, np.zeros((len(markers), 0))


def _rod_marker(header: Header, ends: np.ndarray) -> tuple[list[Marker], np.ndarray]:
    """One LINE_LIST of all rods, each from root to mass, and its end points."""
    marker = Marker(header=header, ns='swings', id=0, type=Marker.LINE_LIST, action=Marker.ADD)
    marker.scale.x = ROD_WIDTH
    marker.pose.orientation.w = 1.0
    marker.points = [to_point(end) for end in ends]
    set_color(marker, BROWN)
    return [marker], ends.reshape(1, -1)


def set_shape(marker: Marker, part: Part, scale: float = 1.0) -> None:
    """Set a marker's type and size from those of a part times ``scale``; a hull becomes its
    triangles.
    """
    if isinstance(part.shape, Hull):
        vertices, faces = part.shape.mesh()
        set_triangles(marker, scale * vertices, faces)
    else:
        marker.type = MARKER_TYPES[part.kind]
        marker.scale = to_vector([scale * side for side in part.size])


def set_triangles(marker: Marker, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Make a marker a list of triangles: ``faces`` (t, 3) of vertices (v, 3), m."""
    marker.type, marker.scale = Marker.TRIANGLE_LIST, to_vector((1.0, 1.0, 1.0))
    points = [to_point(vertex) for vertex in vertices]
    marker.points = [points[index] for index in faces.ravel().tolist()]


def set_color(marker: Marker, color: tuple[float, ...]) -> None:
    """Set a marker's colour: red, green, blue, opacity."""
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = map(float, color)
