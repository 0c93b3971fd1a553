"""Mass matrix, and its factors along the tree.

Spatial vectors as in forward.py: about the doll's root, along the world's axes. H is built by the
composite-rigid-body algorithm and factored as L^T L without fill-in (Featherstone, Rigid Body
Dynamics Algorithms, 2008, tables 6.2 and 6.3).
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.quaternion import times, to_matrix, turned
from .forward_dynamics import Kinematics


@compiled
def root_motion_subspaces(tree: np.ndarray, q: np.ndarray, axes: np.ndarray) -> None:
    """Motion subspaces of the roots' six velocities, which pose() leaves out."""
    for i in range(len(tree)):
        if tree[i].parent < 0:
            at, row = tree[i].q_start + 3, tree[i].v_start
            for k in range(3):
                for j in range(6):
                    axes[row + k, j] = axes[row + 3 + k, j] = 0.0
                axes[row + k, 3 + k] = 1.0
                axes[row + 3 + k, 0], axes[row + 3 + k, 1], axes[row + 3 + k, 2] = turned(
                    q[at], q[at + 1], q[at + 2], q[at + 3],
                    1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)


@compiled
def rotate_inertias(tree: np.ndarray, work: Kinematics, own: np.ndarray) -> None:
    """Inertias (n, 6) about the bones' centres along the world's axes: xx, xy, xz, yy, yz, zz."""
    matrix = work.matrix
    for i in range(len(tree)):
        bone, turn = tree[i], work.orientations[i]
        x, y, z, w = times(turn[0], turn[1], turn[2], turn[3], bone.inertial_orientation[0], bone.inertial_orientation[1],
                           bone.inertial_orientation[2], bone.inertial_orientation[3])
        to_matrix(x, y, z, w, matrix)
        a, b, c = bone.inertia[0], bone.inertia[1], bone.inertia[2]
        n = 0
        for j in range(3):
            for k in range(j, 3):
                own[i, n] = (matrix[j, 0] * a * matrix[k, 0] + matrix[j, 1] * b * matrix[k, 1]
                             + matrix[j, 2] * c * matrix[k, 2])
                n += 1


@compiled
def composite_rigid_body(tree: np.ndarray, up: np.ndarray, bone_of: np.ndarray, work: Kinematics, own: np.ndarray,
         composite: np.ndarray, H: np.ndarray) -> None:
    """Mass matrix, its lower triangle, at each pair of velocities of one branch alone."""
    for i in range(len(tree)):
        m, c = tree[i].mass, work.positions[i]
        x, y, z = c[0], c[1], c[2]
        row = composite[i]
        row[0], row[1], row[2], row[3] = m, m * x, m * y, m * z
        row[4] = own[i, 0] + m * (y * y + z * z)
        row[5] = own[i, 1] - m * x * y
        row[6] = own[i, 2] - m * x * z
        row[7] = own[i, 3] + m * (x * x + z * z)
        row[8] = own[i, 4] - m * y * z
        row[9] = own[i, 5] + m * (x * x + y * y)
    for i in range(len(tree) - 1, 0, -1):
        p = tree[i].parent
        if p >= 0:
            for k in range(10):
                composite[p, k] += composite[i, k]
    for d in range(len(up)):
        a, I = work.motion_subspaces[d], composite[bone_of[d]]
        wx, wy, wz, vx, vy, vz = a[0], a[1], a[2], a[3], a[4], a[5]
        m, cx, cy, cz = I[0], I[1], I[2], I[3]
        px, py, pz = (m * vx + wy * cz - wz * cy, m * vy + wz * cx - wx * cz,
                      m * vz + wx * cy - wy * cx)
        lx = I[4] * wx + I[5] * wy + I[6] * wz + cy * vz - cz * vy
        ly = I[5] * wx + I[7] * wy + I[8] * wz + cz * vx - cx * vz
        lz = I[6] * wx + I[8] * wy + I[9] * wz + cx * vy - cy * vx
        j = d
        while j >= 0:
            s = work.motion_subspaces[j]
            H[d, j] = (s[0] * lx + s[1] * ly + s[2] * lz + s[3] * px + s[4] * py + s[5] * pz)
            j = up[j]


@compiled
def factor_ltl(H: np.ndarray, up: np.ndarray) -> None:
    """Put L, H = L^T L, in H's place."""
    for k in range(len(up) - 1, -1, -1):
        H[k, k] = math.sqrt(H[k, k])
        inverse, i = 1 / H[k, k], up[k]
        while i >= 0:
            H[k, i] *= inverse
            i = up[i]
        i = up[k]
        while i >= 0:
            j = i
            while j >= 0:
                H[i, j] -= H[k, i] * H[k, j]
                j = up[j]
            i = up[i]


@compiled
def solve_lower(L: np.ndarray, up: np.ndarray, x: np.ndarray) -> None:
    """Solve L x = b in b's place."""
    for i in range(len(up)):
        s, j = x[i], up[i]
        while j >= 0:
            s -= L[i, j] * x[j]
            j = up[j]
        x[i] = s / L[i, i]


@compiled
def solve_upper(L: np.ndarray, up: np.ndarray, x: np.ndarray) -> None:
    """Solve L^T x = b in b's place."""
    for i in range(len(up) - 1, -1, -1):
        x[i] /= L[i, i]
        s, j = x[i], up[i]
        while j >= 0:
            x[j] -= L[i, j] * s
            j = up[j]
