"""A convex polyhedron: its support function, the distance of a point, and its features.

All is in the hull's frame, whose origin, the centroid, is inside. A hull is found by the address of
its System, whose tables have it, and its index there: see HULL_TABLE of system.py.
"""
from __future__ import annotations

import math

import numpy as np

from ...compiling.decorators import compiled
from ...maths.vectors import (Vec3, add, add_scaled, cross, divide, dot, norm, put, scale, sub, vec)
from ...system import System, system_at

ON_PLANE = 1e-6
"""Of the hull's size: how far a corner of a face may be from its plane, as model.mesh.CONVEX."""

ROUNDING = 1e-9
"""Sine of the angle that a face may rise by beside an edge that supports."""

INSIDE = 1e-12
"""m: a point that is nearer to an edge or corner has the normal of a face there."""


@compiled
def hull_support(system: int, hull: int, d: Vec3) -> Vec3:
    """Vertex of a hull that is farthest along d, of any length, m, in its own frame. ``system``:
    address of the System.
    """
    s = system_at(system)
    return vec(s.hull_vertices[supporting_vertex(s, hull, d)].point)


@compiled
def supporting_vertex(s: System, hull: int, d: Vec3) -> int:
    """Index in System.hull_vertices of the vertex that is farthest along d. Hill climbing from one
    that is farthest along an axis to the best neighbor; a convex hull has no other maximum.
    """
    table = s.hulls[hull]
    first, axis = table.first_vertex, 0 if abs(d[0]) > abs(d[1]) else 1
    axis = axis if abs(d[axis]) > abs(d[2]) else 2
    best = first + table.extremes[2 * axis + (0 if d[axis] > 0 else 1)]
    most, before = dot(vec(s.hull_vertices[best].point), d), np.int64(-1)
    while best != before:
        before, vertex = best, s.hull_vertices[best]
        begin = table.first_index + vertex.first_neighbor
        for k in range(begin, begin + vertex.neighbor_count):
            other = first + s.hull_indices[k]
            found = dot(vec(s.hull_vertices[other].point), d)
            if found > most:
                most, best = found, other
    return best


@compiled
def hull_edges(system: int, hull: int) -> tuple[int, int]:
    """Index in System.hull_edges of a hull's first edge, and that after its last."""
    table = system_at(system).hulls[hull]
    return table.first_edge, table.first_edge + table.edge_count


@compiled
def edge_vector(system: int, hull: int, edge: int) -> Vec3:
    """From one corner of an edge to the other, m."""
    s = system_at(system)
    first, corners = s.hulls[hull].first_vertex, s.hull_edges[edge].corners
    return sub(vec(s.hull_vertices[first + corners[1]].point),
               vec(s.hull_vertices[first + corners[0]].point))


@compiled
def is_supporting_edge(system: int, edge: int, d: Vec3) -> bool:
    """Whether an edge supports along d, a unit vector perpendicular to it: no point of the hull is
    farther along d than the edge.
    """
    inward = system_at(system).hull_edges[edge].inward
    return dot(vec(inward[0]), d) <= ROUNDING and dot(vec(inward[1]), d) <= ROUNDING


@compiled
def hull_distance(system: int, hull: int, p: Vec3) -> tuple[float, Vec3]:
    """Signed distance, m, of a point from the surface, and its gradient: inside, that from the
    plane of the nearest face.
    """
    s = system_at(system)
    first = s.hulls[hull].first_face
    depth, inner = -math.inf, (0.0, 0.0, 1.0)
    least, outer = math.inf, (0.0, 0.0, 1.0)
    for i in range(first, first + s.hulls[hull].triangle_count):
        normal = vec(s.hull_faces[i].normal)
        height = dot(normal, p) - s.hull_faces[i].offset
        if height > depth:
            depth, inner = height, normal
        if 0 < height < least:
            found, n = _triangle_distance(
                s, s.hulls[hull].first_vertex, i, p, normal, height)
            if found < least:
                least, outer = found, n
    return (depth, inner) if depth <= 0 else (least, outer)


@compiled
def _triangle_distance(s: System, first: int, face: int, p: Vec3, normal: Vec3,
                       height: float) -> tuple[float, Vec3]:
    """Distance, m, of a point from a triangle, and the unit direction to the point, which is
    ``height`` > 0 above the triangle's plane. ``first``: the hull's first vertex. Ericson,
    Real-Time Collision Detection (2005), section 5.1.5.
    """
    least, nearest, is_inside = math.inf, p, True
    corners = s.hull_faces[face].corners
    for k in range(3):
        a = vec(s.hull_vertices[first + corners[k]].point)
        edge = sub(vec(s.hull_vertices[first + corners[(k + 1) % 3]].point), a)
        arm = sub(p, a)
        if dot(cross(edge, normal), arm) <= 0:
            continue
        is_inside = False
        t = min(max(dot(arm, edge) / dot(edge, edge), 0.0), 1.0)
        arm = add_scaled(arm, -t, edge)
        square = dot(arm, arm)
        if square < least:
            least, nearest = square, arm
    if is_inside:
        return height, normal
    distance = math.sqrt(least)
    return distance, divide(nearest, distance) if distance > INSIDE else normal


@compiled
def hull_faces(system: int, hull: int) -> tuple[int, int]:
    """Index in System.hull_faces of a hull's first face, and that after its last."""
    table = system_at(system).hulls[hull]
    return table.first_face, table.first_face + table.face_count


@compiled
def supporting_hull_face(system: int, hull: int, d: Vec3) -> int:
    """Index in System.hull_faces of the face whose normal is closest to d, of those that have the
    vertex farthest along d. On a sharp hull, the face with the closest normal of all may not have
    that vertex.
    """
    s = system_at(system)
    first, most = s.hulls[hull].first_face, -math.inf
    best, top = first, hull_support(system, hull, d)
    for i in range(first, first + s.hulls[hull].face_count):
        normal = vec(s.hull_faces[i].normal)
        found = dot(normal, d)
        if found > most and (
                dot(normal, top) >= s.hull_faces[i].offset - ON_PLANE * s.hulls[hull].size):
            most, best = found, i
    return best


@compiled
def hull_plane(system: int, face: int) -> tuple[Vec3, float]:
    """Unit normal n of a face of a hull, outwards, and offset d, m, of its plane n x = d."""
    s = system_at(system)
    return vec(s.hull_faces[face].normal), s.hull_faces[face].offset


@compiled
def face_polygon(system: int, hull: int, face: int, d: Vec3, most: int,
                 corners: np.ndarray) -> int:
    """Write at most ``most`` corners of a face, anticlockwise from outside, to ``corners`` of
    CLIP_VERTEX; their feature ids are indices of vertices in the hull. The first is the hull's
    vertex farthest along d, if it is on the face. Returns their number.
    """
    s = system_at(system)
    table, polygon = s.hulls[hull], s.hull_faces[face]
    begin, number = table.first_index + polygon.first_corner, polygon.corner_count
    top = supporting_vertex(s, hull, d) - table.first_vertex
    start, count = 0, min(number, most)
    for k in range(number):
        if s.hull_indices[begin + k] == top:
            start = k
    for k in range(count):
        vertex = s.hull_indices[begin + (start + k * number // count) % number]
        put(corners[k].point, vec(s.hull_vertices[table.first_vertex + vertex].point))
        corners[k].feature_id = vertex
    return count


@compiled
def supporting_hull_edge(system: int, hull: int, d: Vec3, sine: float) -> tuple[Vec3, Vec3]:
    """Middle, m, and half vector of the edge at the vertex farthest along d that is most nearly
    perpendicular to d; the half is 0 where none is up to this ``sine`` of an angle.
    """
    s = system_at(system)
    top, begin = supporting_vertex(s, hull, d), s.hulls[hull].first_vertex
    least, half, corner = sine, (0.0, 0.0, 0.0), vec(s.hull_vertices[top].point)
    first, end = hull_edges(system, hull)
    for i in range(first, end):
        for k in range(2):
            if begin + s.hull_edges[i].corners[k] != top:
                continue
            edge = sub(vec(s.hull_vertices[begin + s.hull_edges[i].corners[1 - k]].point), corner)
            found = abs(dot(edge, d)) / norm(edge)
            if found < least:
                least, half = found, scale(0.5, edge)
    return add(corner, half), half
