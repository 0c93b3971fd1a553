"""Kinematics and forward dynamics of dolls in the air.

Featherstone's articulated-body algorithm (Rigid Body Dynamics Algorithms, 2008, table 7.1). All
spatial vectors, angular part first, are along the world's axes about a point that stands where the
doll's root is at that instant: nothing is transformed from bone to bone, and nothing loses digits
far from the origin. A joint of several axes is a row of hinges with no mass between.

``tree`` is the table of tree.py. q and v are those of GeneralizedState, but for angular velocities
of roots: these are along the root's axes, where a steady spin hardly changes them.
"""
from __future__ import annotations

import collections
import math

import numpy as np

from ..compiling.decorators import compiled, inlined
from ..maths.cholesky import solve
from ..maths.quaternion import cross, times, to_matrix, turned
from ..maths.transcendental import sine_and_cosine

Kinematics = collections.namedtuple(
    'Work', 'turns centres moves axes inertias biases drifts pulls matrix')
"""Room for n bones and nv velocities: turns (n, 4) from the bind pose, centres of mass (n, 3) from
the root, spatial velocities (n, 6), motion subspaces (nv, 6), articulated inertias (n, 6, 6),
bias forces (n, 6), what is left of an axis' acceleration at dv/dt = 0 (nv, 6), and of each axis the
inertia times it, the inverse of its own part and the force along it (nv, 8); a matrix (3, 3)."""


@compiled
def forward_kinematics(tree: np.ndarray, q: np.ndarray, v: np.ndarray, work: Kinematics) -> None:
    """Go from the roots to the leaves: turns, centres, velocities and axes."""
    turns, centres, moves, axes = work.orientations, work.positions, work.spatial_velocities, work.motion_subspaces
    for i in range(len(tree)):
        bone = tree[i]
        at, rate, up = bone.q_start, bone.v_start, bone.parent
        if up < 0:
            x, y, z, w = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
            moves[i, 0], moves[i, 1], moves[i, 2] = turned(
                x, y, z, w, v[rate + 3], v[rate + 4], v[rate + 5])
            moves[i, 3], moves[i, 4], moves[i, 5] = v[rate], v[rate + 1], v[rate + 2]
            centres[i, 0] = centres[i, 1] = centres[i, 2] = 0.0
            turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3] = times(
                x, y, z, w, -bone.inertial_orientation[0], -bone.inertial_orientation[1], -bone.inertial_orientation[2], bone.inertial_orientation[3])
            continue
        x, y, z, w = turns[up, 0], turns[up, 1], turns[up, 2], turns[up, 3]
        a, b, c = turned(x, y, z, w, bone.parent_to_joint[0], bone.parent_to_joint[1], bone.parent_to_joint[2])
        a, b, c = centres[up, 0] + a, centres[up, 1] + b, centres[up, 2] + c
        for k in range(6):
            moves[i, k] = moves[up, k]
        if bone.has_quaternion:
            # frame * q * frame^-1: the joint's frame is not that of the doll
            d, e, f = q[at], q[at + 1], q[at + 2]
            x, y, z, w = times(
                x, y, z, w, bone.joint_axes[0, 0] * d + bone.joint_axes[1, 0] * e + bone.joint_axes[2, 0] * f,
                bone.joint_axes[0, 1] * d + bone.joint_axes[1, 1] * e + bone.joint_axes[2, 1] * f,
                bone.joint_axes[0, 2] * d + bone.joint_axes[1, 2] * e + bone.joint_axes[2, 2] * f, q[at + 3])
        for k in range(bone.dof_count):
            d, e, f = bone.joint_axes[k, 0], bone.joint_axes[k, 1], bone.joint_axes[k, 2]
            sx, sy, sz = turned(x, y, z, w, d, e, f)
            axes[rate, 0], axes[rate, 1], axes[rate, 2] = sx, sy, sz
            axes[rate, 3], axes[rate, 4], axes[rate, 5] = cross(a, b, c, sx, sy, sz)
            for j in range(6):
                moves[i, j] += axes[rate, j] * v[rate]
            if not bone.has_quaternion:
                sine, cosine = sine_and_cosine(q[at + k] / 2)
                x, y, z, w = times(x, y, z, w, d * sine, e * sine, f * sine, cosine)
            rate += 1
        turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3] = x, y, z, w
        d, e, f = turned(x, y, z, w, bone.joint_to_com[0], bone.joint_to_com[1], bone.joint_to_com[2])
        centres[i, 0], centres[i, 1], centres[i, 2] = a + d, b + e, c + f


@compiled
def forward_dynamics(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray,
                  v: np.ndarray, work: Kinematics, out: np.ndarray) -> None:
    """Rates of change (nv,) of v. ``loads`` (m, 11): the bone's place in the scene, force and
    torque, the force's point on the bone, and 1 if all are along the bone's axes.
    """
    forward_kinematics(tree, q, v, work)
    for i in range(len(tree)):
        _inertia(tree[i], work.orientations[i], work.positions[i], work.spatial_velocities[i], work.articulated_inertias[i],
                 work.bias_forces[i], loads, work.matrix)
    for i in range(len(tree) - 1, -1, -1):
        if tree[i].parent >= 0:
            aba_backward(tree[i], i, v, work)
    for i in range(len(tree)):
        bone, bias, move = tree[i], work.bias_forces[i], work.spatial_velocities[i]
        if bone.parent < 0:
            for k in range(6):
                bias[k] = -bias[k]
            solve(work.articulated_inertias[i], bias)
            at, rate = bone.q_start + 3, bone.v_start
            x, y, z = cross(move[0], move[1], move[2], move[3], move[4], move[5])
            out[rate] = bias[3] + x + gravity[0]
            out[rate + 1] = bias[4] + y + gravity[1]
            out[rate + 2] = bias[5] + z + gravity[2]
            out[rate + 3], out[rate + 4], out[rate + 5] = turned(
                q[at], q[at + 1], q[at + 2], -q[at + 3], bias[0], bias[1], bias[2])
        else:
            aba_forward(bone, i, work, out)


@inlined
def _inertia(bone: np.record, turn: np.ndarray, centre: np.ndarray, move: np.ndarray,
             inertia: np.ndarray, bias: np.ndarray, loads: np.ndarray, matrix: np.ndarray) -> None:
    """A bone's own inertia, and the force that its motion and loads ask for."""
    a, b, c, d = times(turn[0], turn[1], turn[2], turn[3], bone.inertial_orientation[0], bone.inertial_orientation[1],
                       bone.inertial_orientation[2], bone.inertial_orientation[3])
    to_matrix(a, b, c, d, matrix)
    x, y, z, mass = centre[0], centre[1], centre[2], bone.mass
    far = mass * (x * x + y * y + z * z)
    for j in range(3):
        for k in range(j, 3):
            value = -mass * centre[j] * centre[k] + (far if j == k else 0.0)
            for e in range(3):
                value += matrix[j, e] * bone.inertia[e] * matrix[k, e]
            inertia[j, k] = inertia[k, j] = value
            inertia[3 + j, 3 + k] = inertia[3 + k, 3 + j] = mass if j == k else 0.0
        inertia[j, 3 + j] = inertia[3 + j, j] = 0.0
    inertia[0, 4] = inertia[4, 0] = -mass * z
    inertia[0, 5] = inertia[5, 0] = mass * y
    inertia[1, 3] = inertia[3, 1] = mass * z
    inertia[1, 5] = inertia[5, 1] = -mass * x
    inertia[2, 3] = inertia[3, 2] = -mass * y
    inertia[2, 4] = inertia[4, 2] = mass * x
    wx, wy, wz, vx, vy, vz = move[0], move[1], move[2], move[3], move[4], move[5]
    # momentum p, n = I (w, v) and the force (w, v) x* (n, p) that turns it
    ax, ay, az = cross(wx, wy, wz, x, y, z)
    px, py, pz = mass * (vx + ax), mass * (vy + ay), mass * (vz + az)
    ax, ay, az = cross(x, y, z, vx, vy, vz)
    nx = inertia[0, 0] * wx + inertia[0, 1] * wy + inertia[0, 2] * wz + mass * ax
    ny = inertia[1, 0] * wx + inertia[1, 1] * wy + inertia[1, 2] * wz + mass * ay
    nz = inertia[2, 0] * wx + inertia[2, 1] * wy + inertia[2, 2] * wz + mass * az
    ax, ay, az = cross(vx, vy, vz, px, py, pz)
    nx, ny, nz = cross(wx, wy, wz, nx, ny, nz)
    bias[0], bias[1], bias[2] = nx + ax, ny + ay, nz + az
    bias[3], bias[4], bias[5] = cross(wx, wy, wz, px, py, pz)
    for i in range(len(loads)):
        load = loads[i]
        if load[0] == bone.bone:
            ax, ay, az, nx, ny, nz = load[1], load[2], load[3], load[4], load[5], load[6]
            if load[10] > 0:
                ax, ay, az = turned(a, b, c, d, ax, ay, az)
                nx, ny, nz = turned(a, b, c, d, nx, ny, nz)
            px, py, pz = turned(a, b, c, d, load[7], load[8], load[9])
            px, py, pz = cross(x + px, y + py, z + pz, ax, ay, az)
            bias[0] -= nx + px
            bias[1] -= ny + py
            bias[2] -= nz + pz
            bias[3] -= ax
            bias[4] -= ay
            bias[5] -= az


@inlined
def aba_backward(bone: np.record, i: int, v: np.ndarray, work: Kinematics) -> None:
    """Hand a bone's inertia and bias on to its parent, through the axes of its joint."""
    inertia, bias = work.articulated_inertias[i], work.bias_forces[i]
    # what carries an axis moves as the bone does but for that axis and those behind it
    by = bone.parent if bone.has_quaternion else i
    wx, wy, wz = work.spatial_velocities[by, 0], work.spatial_velocities[by, 1], work.spatial_velocities[by, 2]
    vx, vy, vz = work.spatial_velocities[by, 3], work.spatial_velocities[by, 4], work.spatial_velocities[by, 5]
    for d in range(bone.dof_count - 1, -1, -1):
        at = bone.v_start + d
        axis, drift, pull, rate = work.motion_subspaces[at], work.bias_accelerations[at], work.aba_terms[at], v[at]
        sx, sy, sz = axis[0] * rate, axis[1] * rate, axis[2] * rate
        tx, ty, tz = axis[3] * rate, axis[4] * rate, axis[5] * rate
        if not bone.has_quaternion:
            wx, wy, wz, vx, vy, vz = wx - sx, wy - sy, wz - sz, vx - tx, vy - ty, vz - tz
        drift[0], drift[1], drift[2] = cross(wx, wy, wz, sx, sy, sz)
        sx, sy, sz = cross(vx, vy, vz, sx, sy, sz)
        tx, ty, tz = cross(wx, wy, wz, tx, ty, tz)
        drift[3], drift[4], drift[5] = sx + tx, sy + ty, sz + tz
        own, force = 0.0, -bone.damping * rate
        for j in range(6):
            value = 0.0
            for k in range(6):
                value += inertia[j, k] * axis[k]
            pull[j] = value
            own += value * axis[j]
            force -= axis[j] * bias[j]
        pull[6], pull[7] = 1 / own, force
        for j in range(6):
            share = pull[j] * pull[6]
            for k in range(j, 6):
                inertia[j, k] = inertia[k, j] = inertia[j, k] - share * pull[k]
        for j in range(6):
            value = bias[j] + pull[j] * pull[6] * force
            for k in range(6):
                value += inertia[j, k] * drift[k]
            bias[j] = value
    for j in range(6):
        for k in range(6):
            work.articulated_inertias[bone.parent, j, k] += inertia[j, k]
        work.bias_forces[bone.parent, j] += bias[j]


@inlined
def aba_forward(bone: np.record, i: int, work: Kinematics, out: np.ndarray) -> None:
    """Take a bone's acceleration, in its bias' place, and its joint's from the parent's."""
    rate = work.bias_forces[i]
    for k in range(6):
        rate[k] = work.bias_forces[bone.parent, k]
    for d in range(bone.dof_count):
        at = bone.v_start + d
        axis, drift, pull = work.motion_subspaces[at], work.bias_accelerations[at], work.aba_terms[at]
        left = pull[7]
        for k in range(6):
            rate[k] += drift[k]
            left -= pull[k] * rate[k]
        out[at] = left * pull[6]
        for k in range(6):
            rate[k] += axis[k] * out[at]


@compiled
def state_derivative(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray, v: np.ndarray,
          work: Kinematics, out: np.ndarray) -> None:
    """Rates of change (nq + nv,) of q and v."""
    for i in range(len(tree)):
        bone = tree[i]
        at, rate = bone.q_start, bone.v_start
        if bone.parent < 0:
            out[at], out[at + 1], out[at + 2] = v[rate], v[rate + 1], v[rate + 2]
            at, rate = at + 3, rate + 3
        if bone.has_quaternion:
            out[at], out[at + 1], out[at + 2], out[at + 3] = times(
                q[at], q[at + 1], q[at + 2], q[at + 3], v[rate] / 2, v[rate + 1] / 2,
                v[rate + 2] / 2, 0.0)
        else:
            for k in range(bone.dof_count):
                out[at + k] = v[rate + k]
    forward_dynamics(tree, gravity, loads, q, v, work, out[len(q):])


@compiled
def normalize(tree: np.ndarray, q: np.ndarray) -> None:
    """Bring all quaternions in q to length one."""
    for i in range(len(tree)):
        if tree[i].has_quaternion:
            at = tree[i].q_start + (3 if tree[i].parent < 0 else 0)
            size = math.sqrt(q[at] ** 2 + q[at + 1] ** 2 + q[at + 2] ** 2 + q[at + 3] ** 2)
            for k in range(at, at + 4):
                q[k] /= size
