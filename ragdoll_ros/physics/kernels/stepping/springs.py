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
    """Weight of the velocity at a step's end in damping that decays by ``rate`` per step: 1/2, or 1
    - 1/rate where the damping is stiff, rate > 2 (Liniger and Willoughby, SIAM J. Numer. Anal. 7,
    1970).
    """
    return max(0.5, 1 - 1 / rate) if rate > 0 else 0.5


@compiled
def implicit_damping(spring: np.record, h: float) -> float:
    """Minus the derivative of a spring's mean force in a step of h s with respect to the velocity
    at its end, N s/m; for torques N m s/rad. It is stiffness h/4 plus damping times 1/2 for a grab,
    times theta_weight(h damping mobility) for others; 0 for a saturated spring.
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
    """Set ``saturated`` to 1 and write saturated_force, of size max_force, for springs whose mean
    force from v to ``v_free`` exceeds max_force. Returns whether there are any. ``kin``, q,
    ``time``: of the middle.

    The force has the direction of the spring's force at v, because the mean force without limit,
    far from the target, turns within the step. For a joint spring, and where the force at v is
    zero, it has the direction of the mean force.
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
