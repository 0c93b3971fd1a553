"""Internal edges: where the faces of two static boxes are one, their common edge is no obstacle.

A shape on one face would be stopped by the edge of the next, where it penetrates by rounding only:
a ghost collision. Such a contact is left out, since the face that the shape is on covers it; see
Box2D's ghost vertices, Bullet's btInternalEdgeUtility and Jolt's enhanced internal edge removal.
"""
from __future__ import annotations

import numpy as np

from ..collision.narrow_phase import collide
from ..collision.shapes import BOX, Shape, half_width
from ..compiling.decorators import compiled
from ..dynamics.body import WORLD
from ..dynamics.kinematics import Kinematics
from ..maths.vectors import Vec3, column, dot, scale, sub, vec
from ..system import System
from .placed_shape import placed_shape

FLUSH = 2e-5
"""m: faces that are less apart are one, and contacts that are less apart from a face are on it:
more than shapes penetrate before they are corrected (flight/first_contact.py, DEEPEST_START)."""

SAME_NORMAL = 1 - 1e-10
"""Cosine of two normals from which on they are one: 14 urad."""


@compiled
def is_at_internal_edge(s: System, kin: Kinematics, k: int, manifold: np.ndarray) -> bool:
    """Whether pair k is a ghost collision at an internal edge of its static box.

    It is if the same geom rests on a face of another static box that is coplanar with a face of
    this one, all its points on this box that are nearer than FLUSH lie on that face, and none of
    them has the normal of that face. Overwrites ``manifold``.
    """
    pair = s.pairs[k]
    if s.geoms[pair.b].body != WORLD or s.geoms[pair.b].kind != BOX:
        return False
    for other in range(len(s.pairs)):
        b = s.pairs[other].b
        if s.pairs[other].a == pair.a and other != k and (
                s.geoms[b].body == WORLD and s.geoms[b].kind == BOX) and _is_covered(
                placed_shape(s, kin, pair.a), placed_shape(s, kin, pair.b), placed_shape(s, kin, b),
                manifold):
            return True
    return False


@compiled
def _is_covered(a: Shape, box: Shape, other: Shape, manifold: np.ndarray) -> bool:
    """Whether ``a`` rests on a face of ``other`` that is coplanar with one of ``box``, and touches
    ``box`` only within that face and with other normals. Overwrites ``manifold``.
    """
    for axis in range(3):
        for side in range(2):
            normal = scale(1.0 if side else -1.0, column(other.rotation, axis))
            if _is_flush(box, other, normal) and _touches_edge(
                    a, box, other, normal, manifold) and _touches_face(a, other, normal, manifold):
                return True
    return False


@compiled
def _is_flush(box: Shape, other: Shape, normal: Vec3) -> bool:
    """Whether a face of ``box`` lies in the plane of the face of ``other`` with this normal."""
    cosine = 0.0
    for axis in range(3):
        cosine = max(cosine, abs(dot(normal, column(box.rotation, axis))))
    rise = dot(normal, sub(box.position, other.position))
    return cosine > SAME_NORMAL and abs(
        rise + half_width(box, normal) - half_width(other, normal)) < FLUSH


@compiled
def _touches_edge(a: Shape, box: Shape, other: Shape, normal: Vec3, manifold: np.ndarray) -> bool:
    """Whether ``a`` has contacts with ``box``, nearer than FLUSH, and all of them lie on the face
    of ``other`` with this normal, but have another normal. Overwrites ``manifold``.
    """
    found = collide(a, box, FLUSH, manifold)
    for j in range(found):
        if dot(vec(manifold[j].normal), normal) > SAME_NORMAL:
            return False
        arm = sub(vec(manifold[j].point), other.position)
        for axis in range(3):
            direction = column(other.rotation, axis)
            if abs(dot(arm, direction)) > other.size[axis] + FLUSH:
                return False
        if abs(dot(arm, normal) - half_width(other, normal)) > FLUSH:
            return False
    return found > 0


@compiled
def _touches_face(a: Shape, other: Shape, normal: Vec3, manifold: np.ndarray) -> bool:
    """Whether ``a`` is within FLUSH of the face of ``other`` with this normal. Overwrites
    ``manifold``.
    """
    return collide(a, other, FLUSH, manifold) > 0 and dot(
        vec(manifold[0].normal), normal) > SAME_NORMAL
