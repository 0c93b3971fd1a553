"""Forward dynamics of kinematic trees in flight.

Featherstone's articulated-body algorithm (Rigid Body Dynamics Algorithms, 2008, table 7.1), with
the spatial vectors of kinematics.py. U, D_inverse and u are his, one for each degree of freedom.
"""
from __future__ import annotations

import collections

import numpy as np

from ..compiling.decorators import compiled, inlined
from ..maths.cholesky import solve
from ..maths.vectors import (add, add_scaled, cross, neg, quat, quat_mul, quat_rotate_inverse,
                             quat_to_matrix, scale, sub, vec)
from .kinematics import (Kinematics, forward_kinematics, inertial_frame, linear, point_of_body,
                         put_spatial, root_orientation)
from .loads import load_in_world
from .passive import passive_torque

COMPOSITE_INERTIA = np.dtype([('mass', float), ('moment', float, 3), ('inertia', float, 6)],
                             align=True)
"""Inertia of a subtree about its doll's root: mass, kg; mass times the center of mass, kg m; the
inertia xx, xy, xz, yy, yz, zz, kg m^2."""

Dynamics = collections.namedtuple(
    'Dynamics', 'articulated_inertias bias_forces accelerations bias_accelerations U D_inverse u '
    'composite_inertias H matrix')
"""Scratch of the dynamics of n bodies and nv degrees of freedom: articulated inertias (n, 6, 6);
bias forces (n, 6); spatial accelerations (n, 6); bias accelerations (nv, 6) of the joints' axes; U
(nv, 6) = I_A S; D_inverse (nv,) = 1 / (S . U); u (nv,) = tau - S . p_A; composite inertias (n,); H
(nv, nv), the mass matrix or its factor; a matrix (3, 3)."""


def make_dynamics(bodies: int, dofs: int) -> Dynamics:
    """Allocate zeroed scratch for so many bodies and degrees of freedom."""
    return Dynamics(np.zeros((bodies, 6, 6)), np.zeros((bodies, 6)), np.zeros((bodies, 6)),
                    np.zeros((dofs, 6)), np.zeros((dofs, 6)), np.zeros(dofs), np.zeros(dofs),
                    np.zeros(bodies, COMPOSITE_INERTIA), np.zeros((dofs, dofs)), np.zeros((3, 3)))


@compiled
def forward_dynamics(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray,
                     v: np.ndarray, kin: Kinematics, dyn: Dynamics, out: np.ndarray) -> None:
    """Write to ``out`` dv/dt (nv,) at q and v under gravity (3,) m/s^2, loads, joint damping
    and passive torques; 0 of kinematic bodies. ``kin`` is updated to q and v; overwrites ``dyn``.
    """
    forward_kinematics(tree, q, v, kin)
    for i in range(len(tree)):
        begin_articulated_body(tree[i], i, kin, loads, dyn)
    for i in range(len(tree) - 1, -1, -1):
        if tree[i].parent >= 0:
            aba_backward(tree[i], i, q, v, kin, dyn)
    for i in range(len(tree)):
        body, bias, velocity = tree[i], dyn.bias_forces[i], kin.spatial_velocities[i]
        if body.kinematic:
            for k in range(6 if body.parent < 0 else body.dof_count):
                out[body.v_start + k] = 0.0
            # As in newton_euler_forward(): what does not accelerate does so against gravity.
            put_spatial(bias, (0.0, 0.0, 0.0), sub(
                neg(cross(vec(velocity), linear(velocity))), vec(gravity)))
        elif body.parent < 0:
            for k in range(6):
                bias[k] = -bias[k]
            solve(dyn.articulated_inertias[i], bias)
            dof = body.v_start
            out[dof], out[dof + 1], out[dof + 2] = add(
                add(linear(bias), cross(vec(velocity), linear(velocity))), vec(gravity))
            out[dof + 3], out[dof + 4], out[dof + 5] = quat_rotate_inverse(
                root_orientation(q, body.q_start), vec(bias))
        else:
            aba_forward(body, i, kin, dyn, out)


@inlined
def begin_articulated_body(body: np.record, i: int, kin: Kinematics, loads: np.ndarray,
                           dyn: Dynamics) -> None:
    """Write dyn.articulated_inertias[i], and dyn.bias_forces[i]: v x* I v less the loads."""
    matrix, inertia, bias = dyn.matrix, dyn.articulated_inertias[i], dyn.bias_forces[i]
    com, velocity = kin.positions[i], kin.spatial_velocities[i]
    quat_to_matrix(inertial_frame(body, kin, i), matrix)
    c, mass = vec(com), body.mass
    x, y, z = c
    far = mass * (x * x + y * y + z * z)
    for j in range(3):
        for k in range(j, 3):
            value = -mass * com[j] * com[k] + (far if j == k else 0.0)
            for e in range(3):
                value += matrix[j, e] * body.inertia[e] * matrix[k, e]
            inertia[j, k] = inertia[k, j] = value
            inertia[3 + j, 3 + k] = inertia[3 + k, 3 + j] = mass if j == k else 0.0
        inertia[j, 3 + j] = inertia[3 + j, j] = 0.0
    inertia[0, 4] = inertia[4, 0] = -mass * z
    inertia[0, 5] = inertia[5, 0] = mass * y
    inertia[1, 3] = inertia[3, 1] = mass * z
    inertia[1, 5] = inertia[5, 1] = -mass * x
    inertia[2, 3] = inertia[3, 2] = -mass * y
    inertia[2, 4] = inertia[4, 2] = mass * x
    w, u = vec(velocity), linear(velocity)
    # momentum p, angular momentum n of I v, and the force v x* (n, p)
    p = scale(mass, add(u, cross(w, c)))
    n = add_scaled((inertia[0, 0] * w[0] + inertia[0, 1] * w[1] + inertia[0, 2] * w[2],
                    inertia[1, 0] * w[0] + inertia[1, 1] * w[1] + inertia[1, 2] * w[2],
                    inertia[2, 0] * w[0] + inertia[2, 1] * w[1] + inertia[2, 2] * w[2]),
                   mass, cross(c, u))
    put_spatial(bias, add(cross(w, n), cross(u, p)), cross(w, p))
    for k in range(len(loads)):
        if loads[k].bone == body.bone:
            subtract_load(body, i, kin, loads[k], bias)


@compiled
def subtract_load(body: np.record, i: int, kin: Kinematics, load: np.record,
                  bias: np.ndarray) -> None:
    """Subtract a load on body i from its bias force ``bias`` (6,)."""
    force, torque = load_in_world(body, kin, i, load)
    moment = cross(point_of_body(body, kin, i, load.point), force)
    put_spatial(bias, sub(vec(bias), add(torque, moment)), sub(linear(bias), force))


@inlined
def aba_backward(body: np.record, i: int, q: np.ndarray, v: np.ndarray, kin: Kinematics,
                 dyn: Dynamics) -> None:
    """Second pass, after all children of body i: write U, D_inverse, u and bias accelerations of
    its joint, and add the articulated inertia and bias force that it transmits to the parent's.
    """
    inertia, bias = dyn.articulated_inertias[i], dyn.bias_forces[i]
    # an axis is carried by a body that moves as this one does less that axis and those after it
    carrier = kin.spatial_velocities[body.parent if body.has_quaternion else i]
    w, u = vec(carrier), linear(carrier)
    for d in range(body.dof_count - 1, -1, -1):
        dof = body.v_start + d
        axis, drift, U = kin.motion_subspaces[dof], dyn.bias_accelerations[dof], dyn.U[dof]
        rate = v[dof]
        s, t = scale(rate, vec(axis)), scale(rate, linear(axis))
        if not body.has_quaternion:
            w, u = sub(w, s), sub(u, t)
        put_spatial(drift, cross(w, s), add(cross(u, s), cross(w, t)))
        own, force = 0.0, -body.joint_damping * rate
        if body.has_passive:
            force += passive_torque(body, d, q[body.q_start + d])[0]
        for j in range(6):
            value = 0.0
            for k in range(6):
                value += inertia[j, k] * axis[k]
            U[j] = value
            own += value * axis[j]
            force -= axis[j] * bias[j]
        inverse = 1 / own
        dyn.D_inverse[dof], dyn.u[dof] = inverse, force
        for j in range(6):
            share = U[j] * inverse
            for k in range(j, 6):
                inertia[j, k] = inertia[k, j] = inertia[j, k] - share * U[k]
        for j in range(6):
            value = bias[j] + U[j] * inverse * force
            for k in range(6):
                value += inertia[j, k] * drift[k]
            bias[j] = value
    for j in range(6):
        for k in range(6):
            dyn.articulated_inertias[body.parent, j, k] += inertia[j, k]
        dyn.bias_forces[body.parent, j] += bias[j]


@inlined
def aba_forward(body: np.record, i: int, kin: Kinematics, dyn: Dynamics, out: np.ndarray) -> None:
    """Third pass, after the parent of body i: dyn.bias_forces[i] becomes its spatial acceleration
    less gravity; write dv/dt of its joint to ``out`` (nv,).
    """
    acceleration = dyn.bias_forces[i]
    for k in range(6):
        acceleration[k] = dyn.bias_forces[body.parent, k]
    for dof in range(body.v_start, body.v_start + body.dof_count):
        axis, drift, U = kin.motion_subspaces[dof], dyn.bias_accelerations[dof], dyn.U[dof]
        left = dyn.u[dof]
        for k in range(6):
            acceleration[k] += drift[k]
            left -= U[k] * acceleration[k]
        out[dof] = left * dyn.D_inverse[dof]
        for k in range(6):
            acceleration[k] += axis[k] * out[dof]


@compiled
def state_derivative(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray,
                     v: np.ndarray, kin: Kinematics, dyn: Dynamics, out: np.ndarray) -> None:
    """Write to ``out`` dq/dt and dv/dt (nq + nv,) at q and v; ``kin`` becomes that of q and v."""
    for i in range(len(tree)):
        body = tree[i]
        at, dof = body.q_start, body.v_start
        if body.parent < 0:
            out[at], out[at + 1], out[at + 2] = v[dof], v[dof + 1], v[dof + 2]
            at, dof = at + 3, dof + 3
        if body.has_quaternion:
            out[at], out[at + 1], out[at + 2], out[at + 3] = quat_mul(
                quat(q[at:at + 4]), (v[dof] / 2, v[dof + 1] / 2, v[dof + 2] / 2, 0.0))
        else:
            for k in range(body.dof_count):
                out[at + k] = v[dof + k]
    forward_dynamics(tree, gravity, loads, q, v, kin, dyn, out[len(q):])
