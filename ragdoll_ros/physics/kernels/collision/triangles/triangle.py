"""A triangle of a surface, and which normals its edges allow.

Its frame: the centroid is the origin, z the normal, x along its first edge. ``size``, m: x of the
first corner, length of the first edge, y of the third corner.

An edge is internal where the surface goes on. What touches a shape there is on the next face as
well, whose normal is the one that counts: the normals that an edge allows are those between the two
faces' (its Voronoi region), none but the face's own where the surface is flat or bends up. So
nothing is caught at edges that are no obstacle; see Box2D's chain shapes, Bullet's
btInternalEdgeUtility and Jolt's active edges. ``edges``: tangent of half the angle by which the
surface bends down at each edge, negative where it bends up; OPEN where there is no next face.
"""
from __future__ import annotations

from ...compiling.decorators import compiled
from ...maths.vectors import Vec3, add, cross, divide, dot, norm, scale, sub, to_world
from ..shapes import Shape

OPEN = 1e9
"""Of an edge that ends the surface: it allows every normal from one side to the other."""

FLAT = 1e-5
"""Tangent of half the angle up to which an edge that bends down counts as flat: 20 urad."""

ROUNDING = 1e-12
"""By which a direction may be beyond the last that an edge allows, as a sine."""

Corners = tuple[Vec3, Vec3, Vec3]
"""Corners of a triangle from its centroid, anticlockwise about its normal, m, world axes; or one
vector for each edge, from a corner to the next."""


@compiled
def corners_of(t: Shape) -> Corners:
    """Corners from the centroid, m, world axes."""
    x, length, y = t.size
    return (to_world(t.rotation, (x, -y / 2, 0.0)), to_world(t.rotation, (x + length, -y / 2, 0.0)),
            to_world(t.rotation, (-2 * x - length, y, 0.0)))


@compiled
def edge_vectors(corners: Corners) -> Corners:
    """Unit vectors along the edges."""
    first, second, third = (sub(corners[1], corners[0]), sub(corners[2], corners[1]),
                            sub(corners[0], corners[2]))
    return (divide(first, norm(first)), divide(second, norm(second)), divide(third, norm(third)))


@compiled
def outward_vectors(directions: Corners, normal: Vec3) -> Corners:
    """Unit vectors across the edges ``directions``, in the triangle's plane, away from it."""
    return cross(directions[0], normal), cross(directions[1], normal), cross(directions[2], normal)


@compiled
def supporting_corner(corners: Corners, n: Vec3) -> int:
    """Index of the corner that is farthest along n."""
    a, b, c = dot(corners[0], n), dot(corners[1], n), dot(corners[2], n)
    if a >= b and a >= c:
        return 0
    return 1 if b >= c else 2


@compiled
def seen_from_below(edges: Vec3) -> Vec3:
    """The values of ``edges`` seen from the other side: negated, as what bends down there bends up
    here, except OPEN.
    """
    a, b, c = edges
    return (a if a == OPEN else -a, b if b == OPEN else -b, c if c == OPEN else -c)


@compiled
def bend(edge: float) -> tuple[float, float]:
    """Sine and cosine of the angle by which the surface bends down at an edge, from its ``edge``;
    of one that is flat or bends up 0 and 1.
    """
    if not edge > FLAT:
        return 0.0, 1.0
    return 2 * edge / (1 + edge * edge), (1 - edge * edge) / (1 + edge * edge)


@compiled
def allowed_at_edge(d: Vec3, n: Vec3, outward: Vec3, edge: float) -> Vec3:
    """The direction nearest to ``d`` that an edge allows; all are perpendicular to it."""
    across, sine_cosine = dot(d, outward), bend(edge)
    if across <= 0 or sine_cosine[0] == 0:
        return n
    if sine_cosine[0] * dot(d, n) - sine_cosine[1] * across >= 0:
        return d
    return add(scale(sine_cosine[1], n), scale(sine_cosine[0], outward))


@compiled
def is_allowed_at_corner(d: Vec3, n: Vec3, outward: Corners, edges: Vec3, k: int) -> bool:
    """Whether both edges at corner k allow the direction ``d``."""
    for turn in range(2):
        j = k if turn == 0 else (k + 2) % 3
        sine, cosine = bend(edges[j])
        across = dot(d, outward[j])
        if across > ROUNDING and sine * dot(d, n) - cosine * across < -ROUNDING:
            return False
    return True
