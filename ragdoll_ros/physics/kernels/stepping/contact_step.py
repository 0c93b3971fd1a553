"""A step where something touches, by Moreau's centred scheme.

Forces, contacts and their rows are those at the middle of the way, so that it is of order 2 where
no contact begins or ends (Moreau 1988; Studer, Numerics of Unilateral Contacts and Friction,
2009). Of the velocities there, half of what contacts change is a part: what they changed in the
step before stands in for it. Joint damping, hands' springs and drives are taken implicitly at the
middle as well. Then depths are given back in position alone, and momentum is kept where the ground
bears nothing.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts
from ..contact.gaps import TOUCHING, update_kinematics_and_gaps, place_geoms
from ..contact.jacobian import contact_velocities
from ..dynamics.bias_forces import bias_forces, integrate_positions, update_velocities
from ..dynamics.forward_dynamics import forward_kinematics
from ..dynamics.mass_matrix import composite_rigid_body, factor_ltl, root_motion_subspaces, solve_lower, solve_upper, rotate_inertias
from ..impulses.solve_contacts import solve_contacts
from ..system import NO_SLIP, ClusterState, Workspace, System
from .springs import theta_weight, add_spring_force, root_q, add_implicit_stiffness, saturate_springs
from .position_correction import note_correction, clip_to_joint_limits, correction_energy, limit_correction_energy
from .momentum import add_contact_impulses, conserve_momentum, sum_dolls
from .warm_start import warm_start
from .work import account_work, load_potential

STEP_TOLERANCE = 1e-8
"""m/s to which contacts are solved."""

SLOW = 0.02
"""m/s, and SLOW_TURN rad/s: what meets more slowly where something touches already is taken on
by the next step, without restitution, and not sought out."""

SLOW_TURN = 0.1

DEEP = 5e-4
"""m into the ground or a bone to which a step may press."""

STEADY = 1.0
"""m/s^2 or rad/s^2, over a step: what contacts stop that is faster, they do not stop again."""


@compiled
def begin_contact_step(s: System, r: Workspace, course: ClusterState, loads: np.ndarray) -> None:
    """Note what touches as a step begins and how it moves, and the sums over the dolls.

    On a curved way the rows at the step's middle see J v as h/2 dJ/dt v where it is zero at the
    start: what they see of v' is to be its opposite, for it to be zero at the end.
    """
    q, v = course.q, course.v
    forward_kinematics(s.tree, q, v, r.kinematics)
    sum_dolls(s, q, r, r.sums_before)
    r.lift[1] = load_potential(s, r, q, loads)
    place_geoms(s.tree, s.body_root, s.geoms, r.kinematics, q, r.geom_positions, r.geom_rotations)
    m = find_contacts(s, q, r, r.gaps, TOUCHING)
    for i in range(m):
        contact_velocities(s, r, q, v, r.contacts[i])
        r.start_contacts[i] = r.contacts[i]
    r.count[0] = m


@compiled
def contact_step(s: System, r: Workspace, course: ClusterState, h: float, loads: np.ndarray,
                 springs: np.ndarray, since: float, end_q: np.ndarray, end_v: np.ndarray) -> int:
    """Go on by h s to ``end_q`` and ``end_v``; the number of contacts. What gives depths back is
    still to come: r.vectors[3], at the cost of r.lift[0] J.

    ``since``: s since the hands of ``springs`` were where these say.
    """
    q, v, middle = course.q, course.v, r.states[0]
    free, change, shift = r.vectors[0], r.vectors[2], r.vectors[3]
    integrate_positions(s.tree, q, v, h / 2, middle)
    forward_kinematics(s.tree, middle, v, r.kinematics)
    unconstrained_velocity(s, r, v, h, loads, springs, since + h / 2, course.contact_accelerations)
    place_geoms(s.tree, s.body_root, s.geoms, r.kinematics, middle, r.geom_positions, r.geom_rotations)
    m = find_contacts(s, middle, r, r.gaps_active, SLOW * h)
    r.left[0] = 0.0
    if m:
        warm_start(s, r, m, course.contacts, h)
        solve_contacts(s, r, middle, v, free, m, h, STEP_TOLERANCE, change, shift)
        for j in range(len(v)):
            end_v[j] = free[j] + change[j]
    else:
        for j in range(len(v)):
            end_v[j], shift[j] = free[j], 0.0
    lasts = m > 0 and all_persist(r, m, h)
    for j in range(len(v)):
        course.contact_accelerations[j] = change[j] / h if lasts else 0.0
    integrate_positions(s.tree, middle, end_v, h / 2, end_q)
    clip_to_joint_limits(s, end_q, shift)
    r.lift[0] = correction_energy(s, r, shift) if m else 0.0
    r.stats[0].steps += 1
    return m


@compiled
def all_persist(r: Workspace, m: int, h: float) -> bool:
    """Whether all contacts of a step of h s were there before, and neither closed nor opened."""
    for i in range(m):
        c = r.contacts[i]
        if not c.persistent or abs(c.start_velocity[0]) > STEADY * h:
            return False
        if c.kind > 1 and c.friction >= NO_SLIP and (
                max(abs(c.start_velocity[1]), abs(c.start_velocity[2])) > STEADY * h):
            return False
    return True


@compiled
def unconstrained_velocity(s: System, r: Workspace, v: np.ndarray, h: float, loads: np.ndarray,
                springs: np.ndarray, time: float, reaction: np.ndarray) -> None:
    """Velocities r.vectors[0] into which those at the start, v, come in h s without contacts, and
    the factor of the mass matrix, r.H; work is posed at the middle r.states[0].

    ``reaction`` (nv,): what contacts are taken to accelerate. ``time``: s since the hands were
    where ``springs`` say.
    """
    middle, free, smooth, change = r.states[0], r.vectors[0], r.vectors[1], r.vectors[2]
    root_motion_subspaces(s.tree, middle, r.kinematics.motion_subspaces)
    rotate_inertias(s.tree, r.kinematics, r.own)
    for k in range(len(springs)):
        springs[k, 14] = 1.0
    for turn in range(2 if len(springs) else 1):
        composite_rigid_body(s.tree, s.dof_parent, s.dof_body, r.kinematics, r.own, r.composite, r.H)
        for j in range(len(v)):
            r.H[j, j] += h * theta_weight(h * s.dof_damping[j] / r.H[j, j]) * s.dof_damping[j]
        for k in range(len(springs)):
            add_implicit_stiffness(s.tree, s.dof_parent, s.body_last_dof, r.kinematics, r.H, springs[k], h)
        factor_ltl(r.H, s.dof_parent)
        for stage in range(2):
            if stage or turn:
                for j in range(len(v)):
                    smooth[j] = v[j] + ((change[j] + h * reaction[j]) / 2 if stage else 0.0)
                update_velocities(s.tree, middle, smooth, r.kinematics)
            bias_forces(s.tree, s.gravity, loads, middle, smooth if stage else v, r.kinematics, r.own,
                        change)
            for k in range(len(springs)):
                add_spring_force(s.tree, s.dof_parent, s.body_last_dof, r.kinematics, middle, root_q(s, springs[k]), v, springs[k],
                     time, change)
            for j in range(len(v)):
                change[j] = h * (change[j] - s.dof_damping[j] * v[j])
            solve_upper(r.H, s.dof_parent, change)
            solve_lower(r.H, s.dof_parent, change)
        for j in range(len(v)):
            free[j] = v[j] + change[j]
        if turn or not saturate_springs(s, r, middle, v, free, springs, time, h):
            break


@compiled
def finish_step(s: System, r: Workspace, course: ClusterState, h: float, loads: np.ndarray, springs: np.ndarray,
           since: float, m: int, end_q: np.ndarray, end_v: np.ndarray) -> None:
    """Book the work of a step of h s, give depths back by r.vectors[3], keep the momentum of what
    the ground does not bear; then the gaps and the sums at the end.
    """
    free = False
    for d in range(len(r.external)):
        given = r.external[d]
        given.on_ground = given.touches_other = 0
        for k in range(3):
            given.impulse[k] = given.moment[k] = 0.0
    add_contact_impulses(s, r, m, r.external)
    if len(loads) or len(springs):
        account_work(s, r, course.v, end_v, h, loads, springs, since)
    forward_kinematics(s.tree, end_q, end_v, r.kinematics)
    sum_dolls(s, end_q, r, r.sums_after)
    for d in range(len(r.external)):
        free |= not r.external[d].on_ground
        for k in range(3):
            r.external[d].centre[k] = r.sums_after[d].centre[k]
    limit_correction_energy(s, r, m, r.vectors[3])
    integrate_positions(s.tree, end_q, r.vectors[3], 1.0, end_q)
    if free:
        forward_kinematics(s.tree, end_q, end_v, r.kinematics)
        sum_dolls(s, end_q, r, r.sums_after)
        conserve_momentum(s, r, h, end_q, end_v)
    note_correction(s, r, end_q, r.vectors[3])
    update_kinematics_and_gaps(s, r, end_q, end_v, r.gaps, h, r.gaps_end)
    sum_dolls(s, end_q, r, r.sums_after)
    r.stats[0].work_pushes += load_potential(s, r, end_q, loads) - r.lift[1]
