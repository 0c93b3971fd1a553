"""What hands, drives and held joints do: springs, and how stiff a step is for them.

A drive is two rows of ``springs`` that only damp: one its bone's velocity, one its turning. A held
angle is one row: [1] which of its joint's axes it is about, [4] rad where it is held.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..dynamics.forward_dynamics import Kinematics
from ..maths.quaternion import cross, times, turned
from ..system import GRAB, JOINT_SPRING, TURNS, Workspace, System


@compiled
def spring_point(bone: np.record, work: Kinematics, i: int,
                 point: np.ndarray) -> tuple[float, float, float]:
    """Where a point of bone i, along its axes from its centre, is from its root, m."""
    t, b, c = work.orientations[i], bone.inertial_orientation, work.positions[i]
    x, y, z, w = times(t[0], t[1], t[2], t[3], b[0], b[1], b[2], b[3])
    x, y, z = turned(x, y, z, w, point[0], point[1], point[2])
    return c[0] + x, c[1] + y, c[2] + z


@compiled
def theta_weight(fast: float) -> float:
    """Share of a step's end at which damping is taken: the middle, later where it is stiff
    (Liniger and Willoughby, SIAM J. Numer. Anal. 7, 1970).
    """
    return max(0.5, 1 - 1 / fast) if fast > 0 else 0.5


@compiled
def resistance(spring: np.ndarray, h: float) -> float:
    """What a spring's mean force in a step of h s loses for each m/s that its end gains, N s/m."""
    if spring[14] == 0.0:
        return 0.0
    if spring[18] == GRAB:
        return spring[11] * h / 4 + spring[12] / 2
    if spring[18] == JOINT_SPRING:
        return spring[11] * h / 4 + spring[12] * theta_weight(h * spring[12] * spring[19])
    return spring[12] * theta_weight(h * spring[12] * spring[19])


@compiled
def rate(axis: np.ndarray, spring: np.ndarray, x: float, y: float,
         z: float) -> tuple[float, float, float]:
    """What moves for each unit of the velocity along an axis: the point x, y, z, or the turning."""
    if spring[18] == TURNS:
        return axis[0], axis[1], axis[2]
    ux, uy, uz = cross(axis[0], axis[1], axis[2], x, y, z)
    return axis[3] + ux, axis[4] + uy, axis[5] + uz


@compiled
def add_implicit_stiffness(tree: np.ndarray, up: np.ndarray, last: np.ndarray, work: Kinematics, H: np.ndarray,
            spring: np.ndarray, h: float) -> None:
    """Add to H what a spring's end resists, of a hand h (k h / 4 + c / 2) J^T J. A bone's
    velocities are of one branch, so that H keeps its pattern.
    """
    i = int(spring[0])
    share = h * resistance(spring, h)
    if spring[18] == JOINT_SPRING:
        a = tree[i].v_start + int(spring[1])
        H[a, a] += share
        return
    x, y, z = spring_point(tree[i], work, i, spring[1:4])
    a = last[i]
    while a >= 0:
        ux, uy, uz = rate(work.motion_subspaces[a], spring, x, y, z)
        b = a
        while b >= 0:
            wx, wy, wz = rate(work.motion_subspaces[b], spring, x, y, z)
            H[a, b] += share * (ux * wx + uy * wy + uz * wz)
            b = up[b]
        a = up[a]


@compiled
def root_q(s: System, spring: np.ndarray) -> int:
    """Where in q the root stands of the doll that a spring pulls."""
    return s.tree[s.body_root[int(spring[0])]].q


@compiled
def spring_force(tree: np.ndarray, up: np.ndarray, last: np.ndarray, work: Kinematics, q: np.ndarray,
                 root: int, v: np.ndarray, spring: np.ndarray, time: float,
                 ) -> tuple[float, float, float, float, float, float]:
    """Force, N, of a spring on its point and the point's velocity, m/s, at q and v; of a drive's
    turning torque, N m, and angular velocity, rad/s; of a held angle the first of both alone.
    """
    i = int(spring[0])
    if spring[18] == JOINT_SPRING:
        d = int(spring[1])
        speed = v[tree[i].v_start + d]
        if spring[14] == 0.0:
            return spring[15], 0.0, 0.0, speed, 0.0, 0.0
        torque = -spring[11] * (q[tree[i].q_start + d] - spring[4]) - spring[12] * speed
        return torque, 0.0, 0.0, speed, 0.0, 0.0
    x, y, z = spring_point(tree[i], work, i, spring[1:4])
    ux = uy = uz = 0.0
    j = last[i]
    while j >= 0:
        a, b, c = rate(work.motion_subspaces[j], spring, x, y, z)
        ux, uy, uz = ux + a * v[j], uy + b * v[j], uz + c * v[j]
        j = up[j]
    if spring[14] == 0.0:
        return spring[15], spring[16], spring[17], ux, uy, uz
    gone = min(time, spring[10])
    moving = 1.0 if time < spring[10] else 0.0
    k, d = spring[11], spring[12]
    fx = -k * (q[root] + x - spring[4] - gone * spring[7]) - d * (ux - moving * spring[7])
    fy = -k * (q[root + 1] + y - spring[5] - gone * spring[8]) - d * (uy - moving * spring[8])
    fz = -k * (q[root + 2] + z - spring[6] - gone * spring[9]) - d * (uz - moving * spring[9])
    return fx, fy, fz, ux, uy, uz


@compiled
def add_spring_force(tree: np.ndarray, up: np.ndarray, last: np.ndarray, work: Kinematics, q: np.ndarray,
         root: int, v: np.ndarray, spring: np.ndarray, time: float, out: np.ndarray) -> None:
    """Add a spring's generalised forces to ``out``."""
    fx, fy, fz, _, _, _ = spring_force(tree, up, last, work, q, root, v, spring, time)
    i = int(spring[0])
    if spring[18] == JOINT_SPRING:
        out[tree[i].v_start + int(spring[1])] += fx
        return
    x, y, z = spring_point(tree[i], work, i, spring[1:4])
    j = last[i]
    while j >= 0:
        a, b, c = rate(work.motion_subspaces[j], spring, x, y, z)
        out[j] += fx * a + fy * b + fz * c
        j = up[j]


@compiled
def mean_force(tree: np.ndarray, up: np.ndarray, last: np.ndarray, work: Kinematics, q: np.ndarray,
               root: int, v: np.ndarray, end_v: np.ndarray, spring: np.ndarray, time: float,
               h: float) -> tuple[float, float, float, float, float, float]:
    """Mean force, N, of a spring in a step of h s, and its point's mean velocity, m/s."""
    fx, fy, fz, ux, uy, uz = spring_force(tree, up, last, work, q, root, v, spring, time)
    _, _, _, wx, wy, wz = spring_force(tree, up, last, work, q, root, end_v, spring, time)
    share = resistance(spring, h)
    return (fx - share * (wx - ux), fy - share * (wy - uy), fz - share * (wz - uz),
            (ux + wx) / 2, (uy + wy) / 2, (uz + wz) / 2)


@compiled
def saturate_springs(s: System, r: Workspace, q: np.ndarray, v: np.ndarray, free: np.ndarray,
           springs: np.ndarray, time: float, h: float) -> bool:
    """Let springs that would pull with more than they may pull with that; whether any does."""
    some = False
    for k in range(len(springs)):
        spring = springs[k]
        fx, fy, fz, _, _, _ = mean_force(s.tree, s.dof_parent, s.body_last_dof, r.kinematics, q, root_q(s, spring), v,
                                            free, spring, time, h)
        size = math.sqrt(fx * fx + fy * fy + fz * fz)
        if size > spring[13]:
            fx, fy, fz, _, _, _ = spring_force(s.tree, s.dof_parent, s.body_last_dof, r.kinematics, q,
                                               root_q(s, spring), v, spring, time)
            share = spring[13] / math.sqrt(fx * fx + fy * fy + fz * fz)
            spring[14], spring[15], spring[16], spring[17] = 0.0, share * fx, share * fy, share * fz
            some = True
    return some
