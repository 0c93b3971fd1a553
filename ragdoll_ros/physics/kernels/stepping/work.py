"""What pushes, hands and drives give in a step: work, impulse and moment."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..dynamics.forward_dynamics import Kinematics, forward_kinematics
from ..dynamics.mass_matrix import root_motion_subspaces
from ..maths.quaternion import cross, times, turned
from ..system import GRAB, JOINT_SPRING, TURNS, Workspace, System
from .springs import mean_force, root_q, spring_point
from .momentum import give


@compiled
def account_work(s: System, r: Workspace, v: np.ndarray, end_v: np.ndarray, h: float,
               loads: np.ndarray, springs: np.ndarray, since: float) -> None:
    """Book the work, J, of loads, hands and drives in a step of h s, and their impulses in
    r.given; that of forces along the world's axes is that of reached() alone.
    """
    middle, mean = r.states[0], r.vectors[0]
    for j in range(len(v)):
        mean[j] = (v[j] + end_v[j]) / 2
    forward_kinematics(s.tree, middle, mean, r.kinematics)
    for k in range(len(loads)):
        r.stats[0].work_pushes += h * power(s.tree, r.kinematics, loads[k], loads[k, 10] == 0)
        add_load_impulse(s, r, middle, loads[k], h)
    if len(springs):
        root_motion_subspaces(s.tree, middle, r.kinematics.motion_subspaces)
    for k in range(len(springs)):
        fx, fy, fz, ux, uy, uz = mean_force(
            s.tree, s.dof_parent, s.body_last_dof, r.kinematics, middle, root_q(s, springs[k]), v, end_v, springs[k],
            since + h / 2, h)
        done = h * (fx * ux + fy * uy + fz * uz)
        i = int(springs[k, 0])
        if springs[k, 18] == GRAB or springs[k, 18] == JOINT_SPRING:
            r.stats[0].work_hands += done
        else:
            r.stats[0].work_pushes += done
        if springs[k, 18] == JOINT_SPRING:
            continue
        if springs[k, 18] == TURNS:
            moment = r.external[s.body_doll[i]].moment
            moment[0], moment[1], moment[2] = moment[0] + h * fx, moment[1] + h * fy, (
                moment[2] + h * fz)
            continue
        x, y, z = spring_point(s.tree[i], r.kinematics, i, springs[k, 1:4])
        root = s.tree[s.body_root[i]].q_start
        give(r.external[s.body_doll[i]], h, middle[root] + x, middle[root + 1] + y,
             middle[root + 2] + z, fx, fy, fz)


@compiled
def record_of(tree: np.ndarray, bone: int) -> int:
    """Record of a bone of the scene."""
    for i in range(len(tree)):
        if tree[i].bone == bone:
            return i
    return 0


@compiled
def load_in_world(bone: np.record, work: Kinematics, i: int,
                load: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """Force, N, and torque, N m, of a load on bone i along the world's axes."""
    if load[10] == 0:
        return load[1], load[2], load[3], load[4], load[5], load[6]
    t, b = work.orientations[i], bone.inertial_orientation
    x, y, z, w = times(t[0], t[1], t[2], t[3], b[0], b[1], b[2], b[3])
    fx, fy, fz = turned(x, y, z, w, load[1], load[2], load[3])
    nx, ny, nz = turned(x, y, z, w, load[4], load[5], load[6])
    return fx, fy, fz, nx, ny, nz


@compiled
def add_load_impulse(s: System, r: Workspace, q: np.ndarray, load: np.ndarray, h: float) -> None:
    """Enter what a load gives in h s."""
    i = record_of(s.tree, int(load[0]))
    x, y, z = spring_point(s.tree[i], r.kinematics, i, load[7:10])
    fx, fy, fz, nx, ny, nz = load_in_world(s.tree[i], r.kinematics, i, load)
    root, given = s.tree[s.body_root[i]].q_start, r.external[s.body_doll[i]]
    give(given, h, q[root] + x, q[root + 1] + y, q[root + 2] + z, fx, fy, fz)
    given.moment[0] += h * nx
    given.moment[1] += h * ny
    given.moment[2] += h * nz


@compiled
def load_potential(s: System, r: Workspace, q: np.ndarray, loads: np.ndarray) -> float:
    """Sum of F x, J, over forces along the world's axes, x where they act at q: what it grows by is
    the work of a steady force, whatever the way. Work is posed at q.
    """
    total = 0.0
    for k in range(len(loads)):
        load = loads[k]
        if load[10] == 0:
            i = record_of(s.tree, int(load[0]))
            x, y, z = spring_point(s.tree[i], r.kinematics, i, load[7:10])
            root = s.tree[s.body_root[i]].q_start
            total += (load[1] * (q[root] + x) + load[2] * (q[root + 1] + y)
                      + load[3] * (q[root + 2] + z))
    return total


@compiled
def power(tree: np.ndarray, work: Kinematics, load: np.ndarray, turning: bool) -> float:
    """Power, W, of a load on what moves as work says; ``turning``: of its torque alone."""
    i = record_of(tree, int(load[0]))
    move = work.spatial_velocities[i]
    x, y, z = spring_point(tree[i], work, i, load[7:10])
    fx, fy, fz, nx, ny, nz = load_in_world(tree[i], work, i, load)
    ux, uy, uz = cross(move[0], move[1], move[2], x, y, z)
    if turning:
        fx = fy = fz = 0.0
    return (fx * (move[3] + ux) + fy * (move[4] + uy) + fz * (move[5] + uz)
            + nx * move[0] + ny * move[1] + nz * move[2])
