"""Work, impulse and moment of pushes, grabs and drives in a step; work of kinematic bodies."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT, ROLLING
from ..dynamics.kinematics import (Kinematics, forward_kinematics, point_of_body,
                                   root_motion_subspaces, root_position, velocity_at)
from ..dynamics.loads import ANGULAR_DRIVE, GRAB, JOINT_SPRING, load_in_world
from ..maths.vectors import add, dot, put, scale, sub, vec
from ..system import System
from ..workspace import Workspace
from .momentum import add_impulse
from .springs import mean_spring_force


@compiled
def account_work(s: System, ws: Workspace, v: np.ndarray, v_end: np.ndarray, h: float,
                 loads: np.ndarray, springs: np.ndarray, since: float) -> None:
    """Add the work, J, in a step of h s of loads and drives to stats.work_pushes, of grabs and
    joint springs to stats.work_grabs, and the impulses of all but joint springs to step.external.
    The work of load forces that are constant in the world (local = 0) is left out: load_potential()
    gives it. step.middle and step.v_middle become those of the mean of v and ``v_end``. ``since``:
    see contact_step().
    """
    kin, q, mean, stats = ws.step.middle, ws.step.q_middle, ws.step.v_middle, ws.stats[0]
    for j in range(len(v)):
        mean[j] = (v[j] + v_end[j]) / 2
    forward_kinematics(s.tree, q, mean, kin)
    for k in range(len(loads)):
        stats.work_pushes += h * load_power(s.tree, kin, loads[k], loads[k].local == 0)
        add_load_impulse(s, ws, kin, q, loads[k], h)
    if len(springs):
        root_motion_subspaces(s.tree, q, kin)
    for k in range(len(springs)):
        spring = springs[k]
        force, velocity = mean_spring_force(s, kin, q, v, v_end, spring, since + h / 2, h)
        done = h * dot(force, velocity)
        if spring.kind == GRAB or spring.kind == JOINT_SPRING:
            stats.work_grabs += done
        else:
            stats.work_pushes += done
        i = spring.body
        external = ws.step.external[s.body_doll[i]]
        if spring.kind == ANGULAR_DRIVE:
            put(external.moment, add(vec(external.moment), scale(h, force)))
        elif spring.kind != JOINT_SPRING:
            arm = point_of_body(s.tree[i], kin, i, spring.point)
            at = add(root_position(q, s.tree[s.body_root[i]].q_start), arm)
            add_impulse(external, h, at, force)


@compiled
def account_kinematic_work(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray,
                           m: int) -> None:
    """Add the work, J, that kinematic bodies do by the impulses of m contacts found at q to
    stats.work_pushes. ``kin``: of q, with their velocities.
    """
    for n in range(m):
        c = ws.contacts.found[n]
        if c.kind == LIMIT:
            continue
        p, t, w = c.impulse, vec(c.tangents[0]), vec(c.tangents[1])
        for side in range(2 if c.body_b >= 0 else 1):
            i, sign = (c.body_a, -1.0) if side == 0 else (c.body_b, 1.0)
            if not s.tree[i].kinematic:
                continue
            root = root_position(q, s.tree[s.body_root[i]].q_start)
            turn = vec(kin.spatial_velocities[i])
            at_friction = velocity_at(kin, i, sub(vec(c.friction_point), root))
            work = (p[0] * dot(vec(c.normal), velocity_at(kin, i, sub(vec(c.point), root)))
                    + p[1] * dot(t, at_friction) + p[2] * dot(w, at_friction))
            if c.kind == ROLLING:
                work += p[3] * dot(t, turn) + p[4] * dot(w, turn)
            ws.stats[0].work_pushes += sign * work


@compiled
def body_of_bone(tree: np.ndarray, bone: int) -> int:
    """Index in ``tree`` of the body of a bone; 0 if there is none."""
    for i in range(len(tree)):
        if tree[i].bone == bone:
            return i
    return 0


@compiled
def add_load_impulse(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, load: np.record,
                     h: float) -> None:
    """Add the impulse of a load in h s to step.external; ``kin`` is that of q."""
    i = body_of_bone(s.tree, load.bone)
    arm = point_of_body(s.tree[i], kin, i, load.point)
    force, torque = load_in_world(s.tree[i], kin, i, load)
    external = ws.step.external[s.body_doll[i]]
    at = add(root_position(q, s.tree[s.body_root[i]].q_start), arm)
    add_impulse(external, h, at, force)
    put(external.moment, add(vec(external.moment), scale(h, torque)))


@compiled
def load_potential(s: System, kin: Kinematics, q: np.ndarray, loads: np.ndarray) -> float:
    """Minus the potential energy, J, of the loads whose force is constant in the world (local = 0)
    at q: the sum of force times position. Its increase is their work, whatever the path. Torques
    and forces in a bone's axes are left out. ``kin`` is that of q.
    """
    total = 0.0
    for k in range(len(loads)):
        load = loads[k]
        if load.local == 0:
            i = body_of_bone(s.tree, load.bone)
            arm = point_of_body(s.tree[i], kin, i, load.point)
            total += dot(vec(load.force),
                         add(root_position(q, s.tree[s.body_root[i]].q_start), arm))
    return total


@compiled
def load_power(tree: np.ndarray, kin: Kinematics, load: np.record, torque_only: bool) -> float:
    """Power, W, of a load, or of its torque alone, at the velocities of ``kin``."""
    i = body_of_bone(tree, load.bone)
    velocity = velocity_at(kin, i, point_of_body(tree[i], kin, i, load.point))
    force, torque = load_in_world(tree[i], kin, i, load)
    if torque_only:
        force = 0.0, 0.0, 0.0
    turn = kin.spatial_velocities[i]
    return (dot(force, velocity) + torque[0] * turn[0] + torque[1] * turn[1] + torque[2] * turn[2])
