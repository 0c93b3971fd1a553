"""Collision shapes: kinds, support functions and signed distances.

Kinds and sizes, m: sphere (radius, 0, 0); capsule (radius, half length of its axis, 0); box (half
extents); cylinder (radius, half length, 0). The axis of a capsule or cylinder is its own z axis.
These are symmetric about their center, so that their support functions are even. A hull (radius
about its centroid, 0, 0) is not: see hulls/polyhedron.py. Nor is a triangle, of a surface, which
has functions of its own: see triangles/triangle.py. A plane through its position, its z axis the
normal, is no shape of these functions: contact/gaps.py treats it as the ground.
"""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..compiling.decorators import compiled
from ..compiling.bundle import address_of
from ..maths.vectors import Vec3, divide, dot, neg, norm, to_local, to_world, vec
from ..system import System
from .hulls.polyhedron import hull_distance, hull_support

SPHERE, CAPSULE, BOX, CYLINDER, TRIANGLE, PLANE, HULL = 0, 1, 2, 3, 4, 5, 6
"""Kinds of shapes. Spheres and capsules, which are a core with a radius, come first."""

SHAPE_KIND = {'sphere': SPHERE, 'capsule': CAPSULE, 'box': BOX, 'cylinder': CYLINDER}
"""The kind of each name in scenes."""


class Shape(NamedTuple):
    """A shape at a pose: kind, size, center (m, world), rotation matrix (3, 3) to the world, the
    edges of a triangle; of a hull the address of its System and its index in System.hulls.
    """

    kind: int
    size: Vec3
    position: Vec3
    rotation: np.ndarray
    edges: Vec3 = (0.0, 0.0, 0.0)
    system: int = 0
    hull: int = 0


@compiled
def shape_at(s: System, geom: np.record, position: np.ndarray, rotation: np.ndarray) -> Shape:
    """The shape of a geom whose center (3,), m, and rotation (3, 3) in the world are given."""
    return Shape(geom.kind, vec(geom.size), vec(position), rotation, vec(geom.edges),
                 address_of(s), geom.hull)


@compiled
def moved_to(shape: Shape, position: Vec3) -> Shape:
    """A shape with its center at ``position``, m."""
    return Shape(shape.kind, shape.size, position, shape.rotation, shape.edges, shape.system,
                 shape.hull)


@compiled
def bounding_radius(shape: Shape) -> float:
    """Radius, m, of the bounding sphere about the center."""
    size = shape.size
    if shape.kind == BOX:
        return norm(size)
    if shape.kind == CYLINDER:
        return math.sqrt(size[0] * size[0] + size[1] * size[1])
    if shape.kind == TRIANGLE:
        x, length, y = size
        widest = max(x * x, (x + length) * (x + length)) + y * y / 4
        return math.sqrt(max(widest, (2 * x + length) * (2 * x + length) + y * y))
    return size[0] + size[1]


@compiled
def half_width(shape: Shape, n: Vec3) -> float:
    """Half-width, m, of the core of a symmetric shape along the unit vector n (world): its support
    function about the center, of a capsule that of its axis, without the radius. No spheres.
    """
    size, (x, y, z) = shape.size, to_local(shape.rotation, n)
    if shape.kind == BOX:
        return size[0] * abs(x) + size[1] * abs(y) + size[2] * abs(z)
    if shape.kind == CAPSULE:
        return size[1] * abs(z)
    return size[0] * math.sqrt(x * x + y * y) + size[1] * abs(z)


@compiled
def core_extent(shape: Shape, n: Vec3) -> float:
    """Extent, m, of a shape's core along the unit vector n, world: half_width(), or a hull's
    support function. No spheres or triangles.
    """
    if shape.kind == HULL:
        d = to_local(shape.rotation, n)
        return dot(hull_support(shape.system, shape.hull, d), d)
    return half_width(shape, n)


@compiled
def extent(shape: Shape, n: Vec3) -> float:
    """Extent, m, of a shape along the unit vector n (world): its support function; of a triangle
    the radius of its bounding sphere, which is more.
    """
    if shape.kind == SPHERE:
        return shape.size[0]
    if shape.kind == TRIANGLE:
        return bounding_radius(shape)
    reach = core_extent(shape, n)
    return reach + shape.size[0] if shape.kind == CAPSULE else reach


@compiled
def support_point(shape: Shape, n: Vec3) -> Vec3:
    """Point of a shape's core farthest along n, from the center, m, world axes; no spheres."""
    size, (x, y, z) = shape.size, to_local(shape.rotation, n)
    if shape.kind == BOX:
        return to_world(shape.rotation, (
            math.copysign(size[0], x), math.copysign(size[1], y), math.copysign(size[2], z)))
    if shape.kind == HULL:
        return to_world(shape.rotation, hull_support(shape.system, shape.hull, (x, y, z)))
    across = math.sqrt(x * x + y * y)
    radius = 0.0 if shape.kind == CAPSULE or across == 0 else size[0] / across
    return to_world(shape.rotation, (x * radius, y * radius, math.copysign(size[1], z)))


@compiled
def opposite_point(shape: Shape, n: Vec3) -> Vec3:
    """Minus the point of a shape's core farthest against n: of one that is symmetric the point
    farthest along n.
    """
    return neg(support_point(shape, neg(n))) if shape.kind == HULL else support_point(shape, n)


@compiled
def _perpendicular(u: Vec3) -> Vec3:
    """Unit vector perpendicular to z and u, for points whose gradient is not unique."""
    length = math.sqrt(u[0] * u[0] + u[1] * u[1])
    if length < 1e-12:
        return 1.0, 0.0, 0.0
    return u[1] / length, -u[0] / length, 0.0


@compiled
def signed_distance(shape: Shape, p: Vec3, u: Vec3) -> tuple[float, Vec3]:
    """Signed distance, m, of a point from the surface, negative inside, and its unit gradient, in
    the frame of the shape: a sphere, capsule, cylinder, box or hull.

    It is convex, as the shapes are. At the center of a sphere and on the axis of a capsule or
    cylinder, the gradient is perpendicular to the axis and to the direction u; where a cylinder's
    cap is nearer, it is along the axis. Ericson, Real-Time Collision Detection (2005), section
    5.1.
    """
    size = shape.size
    if shape.kind == BOX:
        return _box_distance(size, p)
    if shape.kind == HULL:
        return hull_distance(shape.system, shape.hull, p)
    if shape.kind == CYLINDER:
        return _cylinder_distance(size, p, u)
    if shape.kind == CAPSULE:
        p = p[0], p[1], p[2] - min(max(p[2], -size[1]), size[1])
    length = norm(p)
    if length < 1e-12:
        return -size[0], _perpendicular(u)
    return length - size[0], divide(p, length)


@compiled
def _box_distance(size: Vec3, p: Vec3) -> tuple[float, Vec3]:
    """signed_distance() of a box: m, negative inside, and its unit gradient; size: half extents."""
    x, y, z = p
    a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    if a <= 0 and b <= 0 and c <= 0:
        if c >= a and c >= b:
            return c, (0.0, 0.0, math.copysign(1.0, z))
        if b >= a:
            return b, (0.0, math.copysign(1.0, y), 0.0)
        return a, (math.copysign(1.0, x), 0.0, 0.0)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    length = math.sqrt(a * a + b * b + c * c)
    return length, (math.copysign(a, x) / length, math.copysign(b, y) / length,
                    math.copysign(c, z) / length)


@compiled
def _cylinder_distance(size: Vec3, p: Vec3, u: Vec3) -> tuple[float, Vec3]:
    """Signed distance, m, and outward normal of a cylinder along z at p, in its frame. On the axis
    the normal is perpendicular to u, or along z.
    """
    x, y, z = p
    across = math.sqrt(x * x + y * y)
    a, c = across - size[0], abs(z) - size[1]
    if across < 1e-12:
        x, y, _ = _perpendicular(u)
    else:
        x, y = x / across, y / across
    if a <= 0 and c <= 0:
        if c >= a:
            return c, (0.0, 0.0, math.copysign(1.0, z))
        return a, (x, y, 0.0)
    a, c = max(a, 0.0), max(c, 0.0)
    length = math.sqrt(a * a + c * c)
    return length, (x * a / length, y * a / length, math.copysign(c, z) / length)
