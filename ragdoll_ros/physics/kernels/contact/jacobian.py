"""Rows of contacts: what they see of velocities, and do to them."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.quaternion import cross
from ..system import Workspace, System


@compiled
def contact_jacobian(s: System, q: np.ndarray, r: Workspace, c: np.record, index: int, v: np.ndarray,
             free: np.ndarray, b: np.ndarray, was: np.ndarray) -> None:
    """The velocities that a contact's rows see, descending, into r.support, and the rows' entries
    for these into r.Y from c.row on; its velocities under ``free`` into b, under v into ``was``.
    """
    row, Y, list_ = c.first_row, r.Y, r.support[index]
    for k in range(c.kind):
        b[row + k] = was[row + k] = 0.0
    if c.kind == 1:
        j, n = c.a, 0
        b[row], was[row] = c.normal[0] * free[j], c.normal[0] * v[j]
        while j >= 0:
            list_[n], Y[row, n] = j, 0.0
            n, j = n + 1, s.dof_parent[j]
        Y[row, 0], c.dof_count = c.normal[0], n
        return
    i, k = s.body_last_dof[c.a], -1
    if c.b >= 0:
        k = s.body_last_dof[c.b]
    n = 0
    while i >= 0 or k >= 0:
        j = max(i, k)
        list_[n] = j
        for e in range(c.kind):
            Y[row + e, n] = 0.0
        if i == j:
            add_column(r.kinematics.motion_subspaces[j], q, s.tree[s.body_root[c.a]].q_start, c, 1.0, Y, n)
            i = s.dof_parent[i]
        if k == j:
            add_column(r.kinematics.motion_subspaces[j], q, s.tree[s.body_root[c.b]].q_start, c, -1.0, Y, n)
            k = s.dof_parent[k]
        for e in range(c.kind):
            b[row + e] += Y[row + e, n] * free[j]
            was[row + e] += Y[row + e, n] * v[j]
        n += 1
    c.dof_count = n


@compiled
def add_column(axis: np.ndarray, q: np.ndarray, at: int, c: np.record, sign: float,
               Y: np.ndarray, j: int) -> None:
    """Add what a velocity of a bone, whose root stands in q at ``at``, does to column j of a
    contact's rows.
    """
    row = c.first_row
    n, t, w = c.normal, c.tangents[0], c.tangents[1]
    x, y, z = cross(axis[0], axis[1], axis[2], c.point[0] - q[at], c.point[1] - q[at + 1],
                    c.point[2] - q[at + 2])
    Y[row, j] += sign * (n[0] * (axis[3] + x) + n[1] * (axis[4] + y) + n[2] * (axis[5] + z))
    x, y, z = cross(axis[0], axis[1], axis[2], c.friction_point[0] - q[at], c.friction_point[1] - q[at + 1],
                    c.friction_point[2] - q[at + 2])
    x, y, z = axis[3] + x, axis[4] + y, axis[5] + z
    Y[row + 1, j] += sign * (t[0] * x + t[1] * y + t[2] * z)
    Y[row + 2, j] += sign * (w[0] * x + w[1] * y + w[2] * z)
    if c.kind == 5:
        Y[row + 3, j] += sign * (t[0] * axis[0] + t[1] * axis[1] + t[2] * axis[2])
        Y[row + 4, j] += sign * (w[0] * axis[0] + w[1] * axis[1] + w[2] * axis[2])


@compiled
def apply_inverse_factor(up: np.ndarray, H: np.ndarray, Y: np.ndarray, seen: np.ndarray, c: np.record,
                   place: np.ndarray) -> None:
    """Put L^-T J^T in place of a contact's rows; ``seen``: the velocities that they see; ``place``
    (nv,): room for where these stand in the rows.
    """
    for n in range(c.dof_count):
        place[seen[n]] = n
    for e in range(c.first_row, c.first_row + c.kind):
        for n in range(c.dof_count):
            i = seen[n]
            Y[e, n] /= H[i, i]
            f, j = Y[e, n], up[i]
            while j >= 0:
                Y[e, place[j]] -= H[i, j] * f
                j = up[j]


@compiled
def contact_velocities(s: System, r: Workspace, q: np.ndarray, v: np.ndarray, c: np.record) -> None:
    """Enter a contact's velocities along its rows into c.start; work is posed at q and v."""
    if c.kind == 1:
        c.start_velocity[0] = c.normal[0] * v[c.a]
        return
    n, t, w = c.normal, c.tangents[0], c.tangents[1]
    for e in range(5):
        c.start_velocity[e] = 0.0
    for side in range(2 if c.b >= 0 else 1):
        i, sign = (c.a, 1.0) if side == 0 else (c.b, -1.0)
        m, root = r.kinematics.spatial_velocities[i], s.tree[s.body_root[i]].q_start
        x, y, z = cross(m[0], m[1], m[2], c.point[0] - q[root], c.point[1] - q[root + 1],
                        c.point[2] - q[root + 2])
        c.start_velocity[0] += sign * (n[0] * (m[3] + x) + n[1] * (m[4] + y) + n[2] * (m[5] + z))
        x, y, z = cross(m[0], m[1], m[2], c.friction_point[0] - q[root], c.friction_point[1] - q[root + 1],
                        c.friction_point[2] - q[root + 2])
        x, y, z = m[3] + x, m[4] + y, m[5] + z
        c.start_velocity[1] += sign * (t[0] * x + t[1] * y + t[2] * z)
        c.start_velocity[2] += sign * (w[0] * x + w[1] * y + w[2] * z)
        c.start_velocity[3] += sign * (t[0] * m[0] + t[1] * m[1] + t[2] * m[2])
        c.start_velocity[4] += sign * (w[0] * m[0] + w[1] * m[1] + w[2] * m[2])
