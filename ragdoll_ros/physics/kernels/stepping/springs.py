"""Springs of grabs, drives and joints: their forces, and their implicit terms in the mass matrix. A
drive is a spring without stiffness.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..dynamics.kinematics import Kinematics, linear, point_of_body, root_position
from ..dynamics.loads import ANGULAR_DRIVE, GRAB, JOINT_SPRING
from ..maths.vectors import Vec3, add, cross, dot, norm, put, scale, sub, vec
from ..system import System


@compiled
def theta_weight(rate: float) -> float:
    """Share of a step at which damping with decay ``rate`` (per step) is evaluated: its middle,
    later where it is stiff (Liniger and Willoughby, SIAM J. Numer. Anal. 7, 1970).
    """
    return max(0.5, 1 - 1 / rate) if rate > 0 else 0.5


@compiled
def implicit_damping(spring: np.record, h: float) -> float:
    """Minus the derivative of a spring's mean force over a step of h s by the velocity at its end,
    N s/m; of torques N m s/rad. 0 of a saturated spring. Damping counts a half for a grab, else by
    theta_weight().
    """
    if spring.saturated:
        return 0.0
    if spring.kind == GRAB:
        return spring.stiffness * h / 4 + spring.damping / 2
    weight = theta_weight(h * spring.damping * spring.mobility)
    if spring.kind == JOINT_SPRING:
        return spring.stiffness * h / 4 + spring.damping * weight
    return spring.damping * weight


@compiled
def spring_jacobian(axis: np.ndarray, spring: np.record, arm: Vec3) -> Vec3:
    """Velocity of a spring's point, ``arm`` m from the root, or its angular velocity, per unit
    velocity of the degree of freedom with motion subspace ``axis``.
    """
    if spring.kind == ANGULAR_DRIVE:
        return vec(axis)
    return add(linear(axis), cross(vec(axis), arm))


@compiled
def add_implicit_spring(s: System, kin: Kinematics, H: np.ndarray, spring: np.record,
                        h: float) -> None:
    """Add the implicit stiffness and damping of a spring in a step of h s to H:
    h implicit_damping() J^T J, to the lower triangle; nothing if it is saturated.
    The degrees of freedom of a body are on one path to the root, so H keeps its sparsity.
    """
    i = spring.body
    share = h * implicit_damping(spring, h)
    if spring.kind == JOINT_SPRING:
        a = s.tree[i].v_start + spring.axis
        H[a, a] += share
        return
    arm = point_of_body(s.tree[i], kin, i, spring.point)
    a = s.body_last_dof[i]
    while a >= 0:
        u = spring_jacobian(kin.motion_subspaces[a], spring, arm)
        b = a
        while b >= 0:
            H[a, b] += share * dot(u, spring_jacobian(kin.motion_subspaces[b], spring, arm))
            b = s.dof_parent[b]
        a = s.dof_parent[a]


@compiled
def spring_force(s: System, kin: Kinematics, q: np.ndarray, v: np.ndarray, spring: np.record,
                 time: float) -> tuple[Vec3, Vec3]:
    """Force, N, of a spring at q and v, and velocity, m/s, of the point that it acts on; world.

    Of an angular drive: torque, N m, and angular velocity, rad/s. Of a joint spring: torque and
    joint rate, as the first entries, the others zero. A saturated spring has its saturated_force.
    ``kin`` is that of q. ``time``: s since the spring's target was set;
    it moves at target_velocity until time_left.
    """
    i = spring.body
    gone = min(time, spring.time_left)
    moving = 1.0 if time < spring.time_left else 0.0
    if spring.kind == JOINT_SPRING:
        speed, rate = v[s.tree[i].v_start + spring.axis], spring.target_velocity[0]
        if spring.saturated:
            return (spring.saturated_force[0], 0.0, 0.0), (speed, 0.0, 0.0)
        stretch = q[s.tree[i].q_start + spring.axis] - spring.target_angle - gone * rate
        torque = -spring.stiffness * stretch - spring.damping * (speed - moving * rate)
        return (torque, 0.0, 0.0), (speed, 0.0, 0.0)
    arm = point_of_body(s.tree[i], kin, i, spring.point)
    velocity = 0.0, 0.0, 0.0
    j = s.body_last_dof[i]
    while j >= 0:
        velocity = add(velocity, scale(v[j], spring_jacobian(kin.motion_subspaces[j], spring, arm)))
        j = s.dof_parent[j]
    if spring.saturated:
        return vec(spring.saturated_force), velocity
    at = add(root_position(q, s.tree[s.body_root[i]].q_start), arm)
    away = sub(sub(at, vec(spring.target)), scale(gone, vec(spring.target_velocity)))
    slip = sub(velocity, scale(moving, vec(spring.target_velocity)))
    return sub(scale(-spring.stiffness, away), scale(spring.damping, slip)), velocity


@compiled
def add_spring_force(s: System, kin: Kinematics, q: np.ndarray, v: np.ndarray, spring: np.record,
                     time: float, out: np.ndarray) -> None:
    """Add a spring's generalized forces to ``out`` (nv,); arguments as spring_force()."""
    force, _ = spring_force(s, kin, q, v, spring, time)
    i = spring.body
    if spring.kind == JOINT_SPRING:
        out[s.tree[i].v_start + spring.axis] += force[0]
        return
    arm = point_of_body(s.tree[i], kin, i, spring.point)
    j = s.body_last_dof[i]
    while j >= 0:
        out[j] += dot(force, spring_jacobian(kin.motion_subspaces[j], spring, arm))
        j = s.dof_parent[j]


@compiled
def mean_spring_force(s: System, kin: Kinematics, q: np.ndarray, v: np.ndarray, v_end: np.ndarray,
                      spring: np.record, time: float, h: float) -> tuple[Vec3, Vec3]:
    """Force that a spring applies in a step of h s from v to ``v_end``, and mean velocity of the
    point that it acts on; units as of spring_force(). The force is that at v, less
    implicit_damping() times the change of velocity. ``kin``, q and ``time``: of the step's middle.
    """
    force, start = spring_force(s, kin, q, v, spring, time)
    _, end = spring_force(s, kin, q, v_end, spring, time)
    mean = add(start, end)
    return (sub(force, scale(implicit_damping(spring, h), sub(end, start))),
            (mean[0] / 2, mean[1] / 2, mean[2] / 2))


@compiled
def saturate_springs(s: System, kin: Kinematics, q: np.ndarray, v: np.ndarray, v_free: np.ndarray,
                     springs: np.ndarray, time: float, h: float) -> bool:
    """Write saturated_force, and ``saturated`` 1, to springs whose mean force from v to ``v_free``
    would exceed max_force. Returns whether there are any. ``kin``, q, ``time``: of the middle.

    The force has the direction of that at v: the mean of a force without limit, far from its
    target, turns within the step. Of a joint spring, and where that at v is zero, it has that of
    the mean.
    """
    some = False
    for k in range(len(springs)):
        spring = springs[k]
        force, _ = mean_spring_force(s, kin, q, v, v_free, spring, time, h)
        if norm(force) > spring.max_force:
            start, _ = spring_force(s, kin, q, v, spring, time)
            if spring.kind != JOINT_SPRING and norm(start) > 0:
                force = start
            put(spring.saturated_force, scale(spring.max_force / norm(force), force))
            spring.saturated = 1
            some = True
    return some
