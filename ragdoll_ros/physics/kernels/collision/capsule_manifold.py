"""Contact manifolds of a sphere or capsule with any shape: a ball that slides along a segment.

The signed distance of a point from a convex shape is a convex function of the point; so along a
capsule's axis it has one minimum. Each contact is that of one ball of the axis, with a normal and a
gap of its own. Only where the axis itself is inside a box, cylinder or hull, which may be deep, the
contact is along the axis of largest separation of the whole segment.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import Vec3, add, add_scaled, column, dot, put, scale, sub, to_local, to_world
from .hulls.polyhedron import hull_faces, hull_plane
from .separating_axis import max_separation_axis
from .shapes import BOX, CAPSULE, CYLINDER, HULL, SPHERE, Shape, signed_distance

CAP_COSINE = 0.7
"""Cosine between normal and cylinder axis above which the cap, not the side, is the support."""

FACE_SINE = 0.5
"""Component of the normal along a box's axis, or a hull's other normals, up to which the face ends
there."""

TIE = 1e-10
"""m: an end of the axis within this of the deepest point is the deepest point."""

DEEPEST = 2
"""Feature id of the deepest point; those of the ends are 0 and 1."""

MIN_DISTANCE_RATIO = 0.1
"""Least distance of two contacts of one capsule, as a part of its radius."""


@compiled
def closest_parameter(shape: Shape, p: Vec3, u: Vec3, half: float) -> float:
    """Parameter t of the point of p + t u, |t| <= ``half``, nearest to the shape, in its frame; u
    is a unit vector.
    """
    if half <= 0:
        return 0.0
    if shape.kind >= BOX:
        return _find_minimum(shape, p, u, half)
    # Ericson 5.1.9 for two segments given by their midpoints
    projection, across, other = dot(p, u), u[0] * u[0] + u[1] * u[1], 0.0
    if shape.kind == CAPSULE:
        end = shape.size[1]
        t = (u[2] * p[2] - projection) / across if across > 1e-16 else 0.0
        t = min(max(t, -half), half)
        other = min(max(p[2] + t * u[2], -end), end)
    return min(max(u[2] * other - projection, -half), half)


@compiled
def _find_minimum(shape: Shape, p: Vec3, u: Vec3, half: float) -> float:
    """Parameter t, |t| <= ``half``, of the least signed distance: the root of its slope, which
    increases with t, or an end of the segment if the slope does not change its sign.

    The Illinois method, with bisection at every third step: deep in a shape the slope jumps.
    """
    a, b = -half, half
    low = _slope(shape, p, u, a)
    if low >= 0:
        return a
    high = _slope(shape, p, u, b)
    if high <= 0:
        return b
    t, side = a, 0
    for k in range(100):
        t = (a + b) / 2 if k % 3 == 2 else a + (b - a) * low / (low - high)
        slope = _slope(shape, p, u, t)
        if abs(slope) < 1e-13 or b - a < 1e-13 * half:
            break
        if slope < 0:
            a, low = t, slope
            if side < 0:
                high /= 2
            side = -1
        else:
            b, high = t, slope
            if side > 0:
                low /= 2
            side = 1
    return t


@compiled
def _slope(shape: Shape, p: Vec3, u: Vec3, t: float) -> float:
    """Slope of the signed distance at p + t u."""
    _, n = signed_distance(shape, add_scaled(p, t, u), u)
    return dot(n, u)


@compiled
def _clip_to_slab(interval: tuple[float, float], p: float, u: float,
                  width: float) -> tuple[float, float]:
    """The part of an interval of t where |p + t u| <= ``width``; end < start if empty. p and u are
    components along the slab's normal.
    """
    lo, hi = interval
    if abs(u) < 1e-12:
        return (lo, hi) if abs(p) <= width else (1.0, 0.0)
    a, b = (-width - p) / u, (width - p) / u
    return max(lo, min(a, b)), min(hi, max(a, b))


@compiled
def _clip_to_half_space(interval: tuple[float, float], p: float, u: float) -> tuple[float, float]:
    """The part of an interval of t where p + t u <= 0; end < start if empty. p: height above the
    plane at t = 0; u: its slope.
    """
    lo, hi = interval
    if abs(u) < 1e-12:
        return (lo, hi) if p <= 0 else (1.0, 0.0)
    return (lo, min(hi, -p / u)) if u > 0 else (max(lo, -p / u), hi)


@compiled
def _clip_to_face(shape: Shape, p: Vec3, u: Vec3, half: float, n: Vec3) -> tuple[float, float]:
    """Interval of t, |t| <= ``half``, where p + t u is above the support along the contact normal
    n; end < start if empty. Shape's frame. Limits: a cap's rim; the ends of a capsule or a
    cylinder's side; the faces of a box or hull whose normals have less than FACE_SINE along n.
    """
    size, interval = shape.size, (-half, half)
    if shape.kind == BOX:
        if abs(n[0]) < FACE_SINE:
            interval = _clip_to_slab(interval, p[0], u[0], size[0])
        if abs(n[1]) < FACE_SINE:
            interval = _clip_to_slab(interval, p[1], u[1], size[1])
        if abs(n[2]) < FACE_SINE:
            interval = _clip_to_slab(interval, p[2], u[2], size[2])
    elif shape.kind == HULL:
        first, end = hull_faces(shape.system, shape.hull)
        for k in range(first, end):
            normal, offset = hull_plane(shape.system, k)
            if abs(dot(normal, n)) < FACE_SINE:
                interval = _clip_to_half_space(interval, dot(normal, p) - offset, dot(normal, u))
    elif shape.kind == CYLINDER and abs(n[2]) > CAP_COSINE:
        across = u[0] * u[0] + u[1] * u[1]
        middle = -(p[0] * u[0] + p[1] * u[1]) / max(across, 1e-12)
        x, y = p[0] + middle * u[0], p[1] + middle * u[1]
        chord = (size[0] * size[0] - x * x - y * y) / max(across, 1e-12)
        if chord < 0:
            return 1.0, 0.0
        chord = math.sqrt(chord)
        return max(-half, middle - chord), min(half, middle + chord)
    elif shape.kind != SPHERE:
        interval = _clip_to_slab(interval, p[2], u[2], size[1])
    return interval


@compiled
def capsule_separation(a: Shape, b: Shape) -> float:
    """Signed distance, m, of a sphere or capsule a from a solid shape b."""
    c, half = sub(a.position, b.position), a.size[1]
    p, u = to_local(b.rotation, c), to_local(b.rotation, column(a.rotation, 2))
    t = closest_parameter(b, p, u, half)
    gap, _ = signed_distance(b, add_scaled(p, t, u), u)
    if gap < 0 and b.kind >= BOX and half > 0:
        gap, _ = max_separation_axis(a, b, c, math.inf)
    return gap - a.size[0]


@compiled
def capsule_manifold(a: Shape, b: Shape, margin: float, sign: float,
                     manifold: np.ndarray) -> int:
    """Write the manifold of a sphere or capsule a with a solid shape b to ``manifold``, as
    collide(). ``sign``: factor of the normals, -1 if the caller has swapped the shapes. Points:
    where the axis enters and leaves the space above b's nearest face (feature ids 0 and 1), and the
    deepest (DEEPEST), unless an end is as deep. If the axis enters a box, cylinder or hull, only
    the deepest.
    """
    c, radius, half = sub(a.position, b.position), a.size[0], a.size[1]
    p, u = to_local(b.rotation, c), to_local(b.rotation, column(a.rotation, 2))
    deepest = closest_parameter(b, p, u, half)
    gap, n = signed_distance(b, add_scaled(p, deepest, u), u)
    if gap - radius > margin:
        return 0
    at_end, count = False, 0
    if gap < 0 and b.kind >= BOX and half > 0:
        gap, n = max_separation_axis(a, b, c, math.inf)
        n = to_local(b.rotation, n)
    elif half > 0:
        ends = _clip_to_face(b, p, u, half, n)
        if ends[1] - ends[0] > MIN_DISTANCE_RATIO * radius:
            for k in range(2):
                t = ends[k]
                center = add_scaled(p, t, u)
                other, normal = signed_distance(b, center, u)
                if other <= gap + TIE:
                    at_end = True
                elif abs(t - deepest) < MIN_DISTANCE_RATIO * radius:
                    continue
                if other - radius <= margin:
                    manifold[count].feature_id = k
                    _put_ball(manifold[count], b, center, normal, other, radius, sign)
                    count += 1
    if not at_end:
        manifold[count].feature_id = DEEPEST
        _put_ball(manifold[count], b, add_scaled(p, deepest, u), n, gap, radius, sign)
        count += 1
    return count


@compiled
def _put_ball(contact: np.record, b: Shape, center: Vec3, n: Vec3, distance: float, radius: float,
              sign: float) -> None:
    """Write the point, normal and gap of the contact of a ball with b. ``center``, normal ``n``: in
    b's frame; ``distance``, m: of the center from b's surface.
    """
    point = to_world(b.rotation, add_scaled(center, -((distance + radius) / 2), n))
    put(contact.point, add(b.position, point))
    put(contact.normal, scale(sign, to_world(b.rotation, n)))
    contact.gap = distance - radius
