"""Rows of contacts: the Jacobian J of their normal, tangents and rolling."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT, ROLLING
from ..dynamics.body import WORLD
from ..dynamics.kinematics import Kinematics, linear, root_position, velocity_at
from ..maths.vectors import Vec3, add, cross, dot, sub, vec
from ..system import System
from ..workspace import Island


@compiled
def contact_jacobian(s: System, kin: Kinematics, q: np.ndarray, island: Island, c: np.record,
                     index: int, v: np.ndarray, v_free: np.ndarray) -> None:
    """Write the Jacobian J of contact c, found[index], to island.Y from row c.first_row on. Its
    columns are those of the last degrees of freedom of the bodies, or that of the limit, and of all
    their parents: written, descending, to island.support[index], their number to c.dof_count. Of a
    limit all but the first are 0. Writes J v_free to island.rhs and J v to
    island.start_velocity.
    """
    row, Y, support = c.first_row, island.Y, island.support[index]
    b, was = island.rhs, island.start_velocity
    for k in range(c.kind):
        b[row + k] = was[row + k] = 0.0
    n = 0
    if c.kind == LIMIT:
        j, own = c.dof, Y[row]
        b[row], was[row] = c.limit_sign * v_free[j], c.limit_sign * v[j]
        while j >= 0:
            support[n], own[n] = j, 0.0
            n, j = n + 1, s.dof_parent[j]
        own[0], c.dof_count = c.limit_sign, n
        return
    i, k = s.body_last_dof[c.body_a], -1
    if c.body_b >= 0:
        k = s.body_last_dof[c.body_b]
    while i >= 0 or k >= 0:
        j = max(i, k)
        support[n] = j
        for e in range(row, row + c.kind):
            Y[e, n] = 0.0
        if i == j:
            add_jacobian_column(kin.motion_subspaces[j], root_of(s, q, c.body_a), c, 1.0, Y, n)
            i = s.dof_parent[i]
        if k == j:
            add_jacobian_column(kin.motion_subspaces[j], root_of(s, q, c.body_b), c, -1.0, Y, n)
            k = s.dof_parent[k]
        for e in range(row, row + c.kind):
            b[e] += Y[e, n] * v_free[j]
            was[e] += Y[e, n] * v[j]
        n += 1
    c.dof_count = n


@compiled
def root_of(s: System, q: np.ndarray, body: int) -> Vec3:
    """Position, m, of the root of a body's doll."""
    return root_position(q, s.tree[s.body_root[body]].q_start)


@compiled
def add_jacobian_column(axis: np.ndarray, root: Vec3, c: np.record, sign: float, Y: np.ndarray,
                        j: int) -> None:
    """Add one degree of freedom, times ``sign``, to column j of a contact's rows in Y: the velocity
    along each row per unit rate. Rows: normal at c.point, two tangents at c.friction_point, of
    ROLLING contacts also the rotation about both tangents. ``axis`` (6,): motion subspace about
    ``root``, m, world.
    """
    row, turn = c.first_row, vec(axis)
    n, t, w = vec(c.normal), vec(c.tangents[0]), vec(c.tangents[1])
    at_point = add(linear(axis), cross(turn, sub(vec(c.point), root)))
    Y[row, j] += sign * dot(n, at_point)
    at_friction = add(linear(axis), cross(turn, sub(vec(c.friction_point), root)))
    Y[row + 1, j] += sign * dot(t, at_friction)
    Y[row + 2, j] += sign * dot(w, at_friction)
    if c.kind == ROLLING:
        Y[row + 3, j] += sign * dot(t, turn)
        Y[row + 4, j] += sign * dot(w, turn)


@compiled
def apply_inverse_factor(dof_parent: np.ndarray, L: np.ndarray, island: Island, index: int,
                         c: np.record) -> None:
    """Replace the rows J of contact c, found[index], by J L^-1; mass matrix L^T L."""
    Y, place, support = island.Y, island.place, island.support[index]
    for n in range(c.dof_count):
        place[support[n]] = n
    first, end = c.first_row, c.first_row + c.kind
    for n in range(c.dof_count):
        i = support[n]
        own, j = L[i, i], dof_parent[i]
        for e in range(first, end):
            Y[e, n] /= own
        while j >= 0:
            at, factor = place[j], L[i, j]
            for e in range(first, end):
                Y[e, at] -= factor * Y[e, n]
            j = dof_parent[j]


@compiled
def contact_velocities(s: System, kin: Kinematics, q: np.ndarray, v: np.ndarray,
                       c: np.record) -> None:
    """Write the velocities of body a relative to b along a contact's rows to c.start_velocity:
    normal at c.point, tangential at c.friction_point, m/s, then rolling, rad/s; and the one about
    the normal, rad/s, to c.spin. Of a joint limit only the first entry is written, the joint's rate
    in the direction c.limit_sign, rad/s; its spin is 0. ``kin``: of q and v.
    """
    start = c.start_velocity
    c.spin = 0.0
    if c.kind == LIMIT:
        start[0] = c.limit_sign * v[c.dof]
        return
    n, t, w = vec(c.normal), vec(c.tangents[0]), vec(c.tangents[1])
    for e in range(5):
        start[e] = 0.0
    for side in range(2 if c.body_b >= 0 else 1):
        i, sign = (c.body_a, 1.0) if side == 0 else (c.body_b, -1.0)
        root, turn = root_of(s, q, i), vec(kin.spatial_velocities[i])
        start[0] += sign * dot(n, velocity_at(kin, i, sub(vec(c.point), root)))
        at_friction = velocity_at(kin, i, sub(vec(c.friction_point), root))
        start[1] += sign * dot(t, at_friction)
        start[2] += sign * dot(w, at_friction)
        start[3] += sign * dot(t, turn)
        start[4] += sign * dot(w, turn)
        c.spin += sign * dot(n, turn)


@compiled
def normal_velocity(s: System, kin: Kinematics, q: np.ndarray, body: int, point: Vec3,
                    normal: Vec3) -> float:
    """Velocity, m/s, along ``normal`` of the point of a body that is at ``point``, m, world; 0 of
    the WORLD.
    """
    if body == WORLD:
        return 0.0
    return dot(normal, velocity_at(kin, body, sub(point, root_of(s, q, body))))
