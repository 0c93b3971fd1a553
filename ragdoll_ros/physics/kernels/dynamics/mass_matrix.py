"""Mass matrix of kinematic trees, and its sparse factor.

The composite-rigid-body algorithm builds H, and L^T L = H is factored without fill-in, as nonzero
entries are those of degrees of freedom on one path to the root (Featherstone, Rigid Body Dynamics
Algorithms, 2008, tables 6.2 and 6.3). Spatial vectors as in kinematics.py.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import put, vec
from .forward_dynamics import Dynamics
from .kinematics import Kinematics, linear


@compiled
def composite_inertias(tree: np.ndarray, kin: Kinematics, composite: np.ndarray) -> None:
    """Write the composite-rigid-body inertia of each body's subtree to ``composite`` (n,), about
    its doll's root, world axes: mass, kg, first moment m c, kg m, and inertia xx, xy, xz, yy, yz,
    zz, kg m^2. After rotate_inertias().
    """
    for i in range(len(tree)):
        m, own, row = tree[i].mass, kin.inertias[i], composite[i]
        x, y, z = vec(kin.positions[i])
        row.mass = m
        put(row.moment, (m * x, m * y, m * z))
        row.inertia[0] = own[0] + m * (y * y + z * z)
        row.inertia[1] = own[1] - m * x * y
        row.inertia[2] = own[2] - m * x * z
        row.inertia[3] = own[3] + m * (x * x + z * z)
        row.inertia[4] = own[4] - m * y * z
        row.inertia[5] = own[5] + m * (x * x + y * y)
    for i in range(len(tree) - 1, 0, -1):
        parent = tree[i].parent
        if parent >= 0:
            row, own = composite[parent], composite[i]
            row.mass += own.mass
            for k in range(3):
                row.moment[k] += own.moment[k]
            for k in range(6):
                row.inertia[k] += own.inertia[k]


@compiled
def mass_matrix(tree: np.ndarray, dof_parent: np.ndarray, dof_body: np.ndarray, kin: Kinematics,
                dyn: Dynamics) -> None:
    """Write the mass matrix to dyn.H: the entries of its lower triangle that are not zero by
    structure. Also write dyn.composite_inertias. ``kin`` must have the inertias and all motion
    subspaces, also the roots'. Rows of kinematic bodies get an infinite diagonal and else zeros, so
    that no force or impulse changes their velocities.
    """
    composite_inertias(tree, kin, dyn.composite_inertias)
    for d in range(len(dof_parent)):
        if tree[dof_body[d]].kinematic:
            j = dof_parent[d]
            dyn.H[d, d] = math.inf
            while j >= 0:
                dyn.H[d, j] = 0.0
                j = dof_parent[j]
            continue
        axis, subtree = kin.motion_subspaces[d], dyn.composite_inertias[dof_body[d]]
        wx, wy, wz = vec(axis)
        vx, vy, vz = linear(axis)
        m, I = subtree.mass, subtree.inertia
        cx, cy, cz = vec(subtree.moment)
        px, py, pz = (m * vx + wy * cz - wz * cy, m * vy + wz * cx - wx * cz,
                      m * vz + wx * cy - wy * cx)
        lx = I[0] * wx + I[1] * wy + I[2] * wz + cy * vz - cz * vy
        ly = I[1] * wx + I[3] * wy + I[4] * wz + cz * vx - cx * vz
        lz = I[2] * wx + I[4] * wy + I[5] * wz + cx * vy - cy * vx
        j = d
        while j >= 0:
            s = kin.motion_subspaces[j]
            dyn.H[d, j] = (s[0] * lx + s[1] * ly + s[2] * lz + s[3] * px + s[4] * py + s[5] * pz)
            j = dof_parent[j]


@compiled
def factor_ltl(H: np.ndarray, dof_parent: np.ndarray) -> None:
    """Replace the lower triangle of H (nv, nv) by its factor L, H = L^T L."""
    for k in range(len(dof_parent) - 1, -1, -1):
        H[k, k] = math.sqrt(H[k, k])
        inverse, i = 1 / H[k, k], dof_parent[k]
        while i >= 0:
            H[k, i] *= inverse
            i = dof_parent[i]
        i = dof_parent[k]
        while i >= 0:
            j = i
            while j >= 0:
                H[i, j] -= H[k, i] * H[k, j]
                j = dof_parent[j]
            i = dof_parent[i]


@compiled
def solve_lower(L: np.ndarray, dof_parent: np.ndarray, x: np.ndarray) -> None:
    """Solve L x = b in place: x (nv,) holds b before."""
    for i in range(len(dof_parent)):
        s, j = x[i], dof_parent[i]
        while j >= 0:
            s -= L[i, j] * x[j]
            j = dof_parent[j]
        x[i] = s / L[i, i]


@compiled
def solve_upper(L: np.ndarray, dof_parent: np.ndarray, x: np.ndarray) -> None:
    """Solve L^T x = b in place: x (nv,) holds b before."""
    for i in range(len(dof_parent) - 1, -1, -1):
        x[i] /= L[i, i]
        s, j = x[i], dof_parent[i]
        while j >= 0:
            x[j] -= L[i, j] * s
            j = dof_parent[j]
