"""Narrow phase: contact manifold and separation of two shapes.

Spheres and capsules are cores with a radius (capsule_manifold.py); boxes and cylinders have
separating axes (separating_axis.py) and faces that are clipped (convex_manifold.py), and so have
hulls. Triangles, of surfaces, limit the normals at their edges (triangles/); they never move, and
are the second shape of a pair.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import dot, sub
from .capsule_manifold import capsule_manifold, capsule_separation
from .convex_manifold import convex_manifold
from .separating_axis import max_separation_axis
from .shapes import CAPSULE, TRIANGLE, Shape, bounding_radius
from .triangles.limited_axis import triangle_separation
from .triangles.triangle_manifold import triangle_manifold


@compiled
def collide(a: Shape, b: Shape, margin: float, manifold: np.ndarray) -> int:
    """Write the contact manifold of two shapes to ``manifold``: points with a gap of at most
    ``margin``, m, and normals from b to a, world. A triangle must be b; neither may be a plane.
    ``manifold`` has room for MAX_MANIFOLD_POINTS of CONTACT_POINT. Returns the number of points.
    """
    c = sub(a.position, b.position)
    reach = bounding_radius(a) + bounding_radius(b) + margin
    if dot(c, c) > reach * reach:
        return 0
    if b.kind == TRIANGLE:
        return triangle_manifold(a, b, margin, manifold)
    sign = 1.0
    if b.kind <= CAPSULE < a.kind:
        a, b, sign = b, a, -1.0
    if a.kind <= CAPSULE:
        return capsule_manifold(a, b, margin, sign, manifold)
    return convex_manifold(a, b, margin, manifold)


@compiled
def separation(a: Shape, b: Shape, cutoff: float) -> float:
    """Signed distance of two shapes, m: positive if and only if they are disjoint. If it exceeds
    ``cutoff``, a lower bound that does so too may be returned. A triangle must be b: see
    triangle_separation(); the rest is for other shapes.

    It is continuous; while the shapes touch, its rate is the relative velocity along the normal.
    Disjoint shapes: the distance, of two boxes the largest separation along an axis of SAT.
    Overlapping shapes: minus the penetration depth.
    """
    if b.kind == TRIANGLE:
        return triangle_separation(a, b, cutoff)
    if b.kind <= CAPSULE < a.kind:
        a, b = b, a
    if a.kind <= CAPSULE:
        return capsule_separation(a, b)
    return max_separation_axis(a, b, sub(a.position, b.position), cutoff)[0]
