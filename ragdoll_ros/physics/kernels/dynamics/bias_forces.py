"""Bias forces of a motion, by the recursive Newton-Euler algorithm.

Featherstone, Rigid Body Dynamics Algorithms, 2008, table 5.1; spatial vectors as in kinematics.py.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import add, cross, neg, scale, sub, vec
from .forward_dynamics import Dynamics, subtract_load
from .kinematics import Kinematics, inertia_times, linear, put_spatial, velocity_at


@compiled
def bias_forces(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, v: np.ndarray,
                kin: Kinematics, dyn: Dynamics, out: np.ndarray) -> None:
    """Write -C to ``out`` (nv,), C being Featherstone's bias force with ``loads`` (LOAD) as
    external forces: H dv/dt without joint damping, springs and contacts.

    ``kin``: of velocities v (nv,), with inertias and the roots' motion subspaces. ``dyn``: scratch.
    """
    for i in range(len(tree)):
        newton_euler_forward(tree, i, gravity, v, kin, dyn)
    for k in range(len(loads)):
        for i in range(len(tree)):
            if loads[k].bone == tree[i].bone:
                subtract_load(tree[i], i, kin, loads[k], dyn.bias_forces[i])
    for i in range(len(tree) - 1, -1, -1):
        body, force = tree[i], dyn.bias_forces[i]
        for dof in range(body.v_start, body.v_start + (
                6 if body.parent < 0 else body.dof_count)):
            axis, total = kin.motion_subspaces[dof], 0.0
            for j in range(6):
                total += axis[j] * force[j]
            out[dof] = -total
        if body.parent >= 0:
            for j in range(6):
                dyn.bias_forces[body.parent, j] += force[j]


@compiled
def newton_euler_forward(tree: np.ndarray, i: int, gravity: np.ndarray, v: np.ndarray,
                         kin: Kinematics, dyn: Dynamics) -> None:
    """Write dyn.accelerations[i] at dv/dt = 0, less gravity, and the spatial force that this takes
    to dyn.bias_forces[i].
    """
    body, velocity, acceleration = tree[i], kin.spatial_velocities[i], dyn.accelerations[i]
    w = vec(velocity)
    if body.parent < 0:
        put_spatial(acceleration, (0.0, 0.0, 0.0),
                    sub(neg(cross(w, linear(velocity))), vec(gravity)))
    else:
        add_axis_accelerations(tree, i, v, kin, dyn)
    c, mass, inertia = vec(kin.positions[i]), body.mass, kin.inertias[i]
    turn = vec(acceleration)
    force = scale(mass, add(add(linear(acceleration), cross(turn, c)),
                            cross(w, velocity_at(kin, i, c))))
    torque = add(cross(w, inertia_times(inertia, w)), inertia_times(inertia, turn))
    put_spatial(dyn.bias_forces[i], add(torque, cross(c, force)), force)


@compiled
def add_axis_accelerations(tree: np.ndarray, i: int, v: np.ndarray, kin: Kinematics,
                           dyn: Dynamics) -> None:
    """Write dyn.accelerations[i]: the parent's plus the rate-dependent terms of the joint."""
    body, acceleration = tree[i], dyn.accelerations[i]
    carrier = kin.spatial_velocities[body.parent]
    w, u = vec(carrier), linear(carrier)
    for k in range(6):
        acceleration[k] = dyn.accelerations[body.parent, k]
    for dof in range(body.v_start, body.v_start + body.dof_count):
        axis, rate = kin.motion_subspaces[dof], v[dof]
        s, t = scale(rate, vec(axis)), scale(rate, linear(axis))
        put_spatial(acceleration, add(vec(acceleration), cross(w, s)),
                    add(add(linear(acceleration), cross(u, s)), cross(w, t)))
        if not body.has_quaternion:
            w, u = add(w, s), add(u, t)
