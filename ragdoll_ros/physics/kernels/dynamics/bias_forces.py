"""The forces that a motion asks for, and where it leads.

By the recursive Newton-Euler algorithm (Featherstone, Rigid Body Dynamics Algorithms, 2008, table
5.1); spatial vectors as in forward.py.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.quaternion import cross, times, turned
from ..maths.transcendental import sine_and_cosine
from .forward_dynamics import Kinematics


@compiled
def bias_forces(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray,
                v: np.ndarray, work: Kinematics, own: np.ndarray, out: np.ndarray) -> None:
    """Generalised forces (nv,) of gravity, loads and the motion itself: H dv/dt where no joint
    resists. work is posed at q and v; its biases and inertias are lost.

    ``loads`` (m, 11) are those of dynamics.accelerations().
    """
    forces, moves = work.bias_forces, work.spatial_velocities
    acceleration = work.articulated_inertias  # room: (n, 6) of it, a bone's spatial acceleration
    for i in range(len(tree)):
        bone, move, here = tree[i], moves[i], acceleration[i, 0]
        wx, wy, wz = move[0], move[1], move[2]
        if bone.parent < 0:
            here[0] = here[1] = here[2] = 0.0
            x, y, z = cross(wx, wy, wz, move[3], move[4], move[5])
            here[3], here[4], here[5] = -x - gravity[0], -y - gravity[1], -z - gravity[2]
        else:
            above = acceleration[bone.parent, 0]
            for k in range(6):
                here[k] = above[k]
            by = moves[bone.parent]
            bx, by_, bz, cx, cy, cz = by[0], by[1], by[2], by[3], by[4], by[5]
            for k in range(bone.dof_count):
                axis, rate = work.motion_subspaces[bone.v_start + k], v[bone.v_start + k]
                sx, sy, sz = axis[0] * rate, axis[1] * rate, axis[2] * rate
                tx, ty, tz = axis[3] * rate, axis[4] * rate, axis[5] * rate
                x, y, z = cross(bx, by_, bz, sx, sy, sz)
                here[0] += x
                here[1] += y
                here[2] += z
                x, y, z = cross(cx, cy, cz, sx, sy, sz)
                here[3] += x
                here[4] += y
                here[5] += z
                x, y, z = cross(bx, by_, bz, tx, ty, tz)
                here[3] += x
                here[4] += y
                here[5] += z
                if not bone.has_quaternion:
                    bx, by_, bz, cx, cy, cz = (bx + sx, by_ + sy, bz + sz, cx + tx, cy + ty,
                                               cz + tz)
        c, m, I = work.positions[i], bone.mass, own[i]
        x, y, z = cross(wx, wy, wz, c[0], c[1], c[2])
        ux, uy, uz = move[3] + x, move[4] + y, move[5] + z
        x, y, z = cross(wx, wy, wz, ux, uy, uz)
        ax, ay, az = cross(here[0], here[1], here[2], c[0], c[1], c[2])
        fx, fy, fz = m * (here[3] + ax + x), m * (here[4] + ay + y), m * (here[5] + az + z)
        lx = I[0] * wx + I[1] * wy + I[2] * wz
        ly = I[1] * wx + I[3] * wy + I[4] * wz
        lz = I[2] * wx + I[4] * wy + I[5] * wz
        nx, ny, nz = cross(wx, wy, wz, lx, ly, lz)
        nx += I[0] * here[0] + I[1] * here[1] + I[2] * here[2]
        ny += I[1] * here[0] + I[3] * here[1] + I[4] * here[2]
        nz += I[2] * here[0] + I[4] * here[1] + I[5] * here[2]
        x, y, z = cross(c[0], c[1], c[2], fx, fy, fz)
        force = forces[i]
        force[0], force[1], force[2] = nx + x, ny + y, nz + z
        force[3], force[4], force[5] = fx, fy, fz
    for n in range(len(loads)):
        subtract_load(tree, loads[n], work, forces)
    for i in range(len(tree) - 1, -1, -1):
        bone, force = tree[i], forces[i]
        if bone.parent < 0:
            for k in range(6):
                axis, s = work.motion_subspaces[bone.v_start + k], 0.0
                for j in range(6):
                    s += axis[j] * force[j]
                out[bone.v_start + k] = -s
        else:
            for k in range(bone.dof_count):
                axis, s = work.motion_subspaces[bone.v_start + k], 0.0
                for j in range(6):
                    s += axis[j] * force[j]
                out[bone.v_start + k] = -s
            for j in range(6):
                forces[bone.parent, j] += force[j]


@compiled
def subtract_load(tree: np.ndarray, load: np.ndarray, work: Kinematics, forces: np.ndarray) -> None:
    """Take a load (11,) off the forces (n, 6) about the root that its bone's motion asks for."""
    for i in range(len(tree)):
        if load[0] == tree[i].bone:
            bone, turn, c = tree[i], work.orientations[i], work.positions[i]
            a, b, d, e = times(turn[0], turn[1], turn[2], turn[3], bone.inertial_orientation[0], bone.inertial_orientation[1],
                               bone.inertial_orientation[2], bone.inertial_orientation[3])
            fx, fy, fz, nx, ny, nz = load[1], load[2], load[3], load[4], load[5], load[6]
            if load[10] > 0:
                fx, fy, fz = turned(a, b, d, e, fx, fy, fz)
                nx, ny, nz = turned(a, b, d, e, nx, ny, nz)
            x, y, z = turned(a, b, d, e, load[7], load[8], load[9])
            x, y, z = cross(c[0] + x, c[1] + y, c[2] + z, fx, fy, fz)
            forces[i, 0] -= nx + x
            forces[i, 1] -= ny + y
            forces[i, 2] -= nz + z
            forces[i, 3] -= fx
            forces[i, 4] -= fy
            forces[i, 5] -= fz


@compiled
def update_velocities(tree: np.ndarray, q: np.ndarray, v: np.ndarray, work: Kinematics) -> None:
    """Spatial velocities of all bones at ``v``, where work is posed at q already."""
    moves = work.spatial_velocities
    for i in range(len(tree)):
        bone, move = tree[i], moves[i]
        if bone.parent < 0:
            at, rate = bone.q_start, bone.v_start
            move[0], move[1], move[2] = turned(q[at + 3], q[at + 4], q[at + 5], q[at + 6],
                                               v[rate + 3], v[rate + 4], v[rate + 5])
            move[3], move[4], move[5] = v[rate], v[rate + 1], v[rate + 2]
        else:
            for j in range(6):
                move[j] = moves[bone.parent, j]
            for k in range(bone.dof_count):
                axis, rate_ = work.motion_subspaces[bone.v_start + k], v[bone.v_start + k]
                for j in range(6):
                    move[j] += axis[j] * rate_


@compiled
def integrate_positions(tree: np.ndarray, q: np.ndarray, v: np.ndarray, h: float, out: np.ndarray) -> None:
    """Coordinates ``out`` after h s at the velocities v, roots' angular ones along own axes."""
    for i in range(len(tree)):
        bone = tree[i]
        at, rate = bone.q_start, bone.v_start
        if bone.parent < 0:
            for k in range(3):
                out[at + k] = q[at + k] + h * v[rate + k]
            at, rate = at + 3, rate + 3
        if bone.has_quaternion:
            a, b, c = v[rate] * h, v[rate + 1] * h, v[rate + 2] * h
            n = math.sqrt(a * a + b * b + c * c)
            sine, cosine = sine_and_cosine(n / 2)
            s = 0.5 - n * n / 48 if n < 1e-3 else sine / n
            x, y, z, w = times(q[at], q[at + 1], q[at + 2], q[at + 3], a * s, b * s, c * s, cosine)
            n = math.sqrt(x * x + y * y + z * z + w * w)
            out[at], out[at + 1], out[at + 2], out[at + 3] = x / n, y / n, z / n, w / n
        else:
            for k in range(bone.dof_count):
                out[at + k] = q[at + k] + h * v[rate + k]
