"""A step with contacts, by Moreau's centered scheme.

Forces, contacts and their rows are those at the middle of the step, so that it is of order 2 where
no contact begins or ends (Moreau 1988; Studer, Numerics of Unilateral Contacts and Friction, 2009).
The velocities there include half of the change by contacts, for which that of the step before
stands in. Joint damping, springs and drives are taken implicitly at the middle as well. Then
penetrations are corrected, and the momentum of dolls that are not on the ground is conserved.
"""
from __future__ import annotations

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.cycles import cycles
from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts, had_met
from ..contact.gaps import update_kinematics_and_gaps
from ..contact.jacobian import contact_velocities
from ..contact.patch_friction import set_slip_friction
from ..contact.point_gaps import track_points, update_point_gaps
from ..contact_kind import LIMIT
from ..dynamics.bias_forces import bias_forces
from ..dynamics.kinematics import (forward_kinematics, integrate_positions, place_geoms,
                                   root_motion_subspaces, rotate_inertias, update_velocities)
from ..dynamics.mass_matrix import factor_ltl, mass_matrix, solve_lower, solve_upper
from ..dynamics.passive import passive_torque
from ..impulses.solve_contacts import solve_contacts
from ..impulses.solver import UNSOLVED
from ..system import NO_SLIP, System
from ..workspace import Workspace
from .momentum import add_contact_impulses, conserve_momentum, sum_dolls
from .impact import closes_fast
from .position_correction import (clip_to_joint_limits, correction_energy, write_correction_motion,
                                  limit_correction_energy)
from .springs import add_implicit_spring, add_spring_force, saturate_springs, theta_weight
from .warm_start import warm_start
from .work import account_kinematic_work, account_work, load_potential

SOLVED_SPEED = 1e-3
"""m/s: contacts of small islands are solved to this times solve_error, see physics/accuracy.py."""

MAX_PENETRATION = 5e-4
"""m by which a step may penetrate the ground or a body."""

STEADY = 1.0
"""m/s^2 or rad/s^2, over a step: contacts that close faster do not persist as they are."""


@compiled
def begin_contact_step(s: System, ws: Workspace, cluster: ClusterState) -> None:
    """Prepare a step from cluster.q and v. Write the contacts that touch by ws.gaps, with their
    velocities, to contacts.start, their number and the load potential to step.scalars, and
    step.sums_before. The manifold points of touching pairs get gaps of their own in ws.gaps, see
    track_points(). step.start becomes the kinematics of q and v. Overwrites contacts.found.
    """
    q, v, kin, scalars = cluster.q, cluster.v, ws.step.start, ws.step.scalars[0]
    forward_kinematics(s.tree, q, v, kin)
    sum_dolls(s, ws, kin, q, ws.step.sums_before)
    scalars.start_load_potential = load_potential(s, kin, q, cluster.loads)
    place_geoms(s.tree, s.body_root, s.geoms, q, kin)
    track_points(s, ws, kin)
    m = find_contacts(s, ws, kin, q, ws.gaps, 0.0)
    for i in range(m):
        contact_velocities(s, kin, q, v, ws.contacts.found[i])
        ws.contacts.start[i] = ws.contacts.found[i]
    scalars.start_contact_count = m


@compiled
def approaches_fast(s: System, ws: Workspace, cluster: ClusterState) -> bool:
    """Whether an impact is due before the step: a contact of contacts.start closes fast, and was
    not one that had_met() in the last step. False if the last step ended without an impact.
    """
    if ws.stats[0].ended_without_impact:
        return False
    for i in range(ws.step.scalars[0].start_contact_count):
        c = ws.contacts.start[i]
        if closes_fast(c) and not (
                had_met(s, cluster.contacts, ws.stats[0].contact_count, c.id)):
            return True
    return False


@compiled
def contact_step(s: System, ws: Workspace, cluster: ClusterState, h: float, since: float) -> int:
    """Compute one step of h s, after begin_contact_step(). Writes step.q_end, without position
    correction; step.v_end; step.correction, scaled by clip_to_joint_limits(), and its energy;
    contacts.found with their impulses; and cluster.contact_accelerations, 0 unless there are
    contacts and all_persist(). Returns the number of contacts.

    ``since``: time, s, since the targets of springs were at spring.target.
    """
    q, v, step, kin = cluster.q, cluster.v, ws.step, ws.step.middle
    ledger, start_cycles = ws.stats[0].ledger, cycles()
    integrate_positions(s.tree, q, v, h / 2, step.q_middle)
    forward_kinematics(s.tree, step.q_middle, v, kin)
    unconstrained_velocity(s, ws, cluster, h, since + h / 2)
    moved = cycles()
    ledger.dynamics_cycles += moved - start_cycles
    place_geoms(s.tree, s.body_root, s.geoms, step.q_middle, kin)
    m = find_contacts(s, ws, kin, step.q_middle, ws.contacts.gaps_active, h)
    found = cycles()
    ledger.find_cycles += found - moved
    step.scalars[0].residual = 0.0
    if m:
        warm_start(s, ws, m, cluster.contacts, h)
        slips = set_slip_friction(s, ws, kin, step.q_middle, m, h)
        for turn in range(2 if slips else 1):
            if turn:
                if step.scalars[0].residual > UNSOLVED:
                    break
                for j in range(len(v)):
                    step.v_middle[j] = (v[j] + step.v_end[j]) / 2
                update_velocities(s.tree, step.q_middle, step.v_middle, kin)
                if not set_slip_friction(s, ws, kin, step.q_middle, m, h):
                    break
            solve_contacts(s, ws, kin, step.q_middle, v, step.v_free, m, h,
                           SOLVED_SPEED * step.scalars[0].solve_error)
            for j in range(len(v)):
                step.v_end[j] = step.v_free[j] + step.v_change[j]
    else:
        for j in range(len(v)):
            step.v_end[j], step.correction[j] = step.v_free[j], 0.0
    ledger.solve_cycles += cycles() - found
    persist = m > 0 and all_persist(ws, m, h)
    for j in range(len(v)):
        cluster.contact_accelerations[j] = step.v_change[j] / h if persist else 0.0
    integrate_positions(s.tree, step.q_middle, step.v_end, h / 2, step.q_end)
    clip_to_joint_limits(s, step.q_end, step.correction)
    step.scalars[0].correction_energy = (
        correction_energy(s, ws, kin, step.correction) if m else 0.0)
    ws.stats[0].steps += 1
    return m


@compiled
def all_persist(ws: Workspace, m: int, h: float) -> bool:
    """Whether all m contacts of a step of h s are persistent and steady as it begins: their normal
    velocity is at most STEADY h in size; where friction has no limit, the tangential ones as
    well.
    """
    for i in range(m):
        c = ws.contacts.found[i]
        if not c.persistent or abs(c.start_velocity[0]) > STEADY * h:
            return False
        if c.kind != LIMIT and c.friction >= NO_SLIP and (
                max(abs(c.start_velocity[1]), abs(c.start_velocity[2])) > STEADY * h):
            return False
    return True


@compiled
def unconstrained_velocity(s: System, ws: Workspace, cluster: ClusterState, h: float,
                           time: float) -> None:
    """Write to step.v_free (nv,) the velocities after h s without contacts, and to dynamics.H the
    factor of the mass matrix with implicit terms. Requires step.middle to be of step.q_middle and
    v; its velocities are overwritten.

    Bias forces are evaluated twice: at v, and at the velocities of the step's middle that follow,
    with half the change by contact_accelerations. Springs and damping are evaluated at v; their
    change is implicit. If springs saturate, this is done again with their largest forces. ``time``:
    s since the springs' targets were at spring.target.
    """
    v, springs, step, kin, dyn = cluster.v, cluster.springs, ws.step, ws.step.middle, (
        ws.step.dynamics)
    change, middle = step.v_change, step.v_middle
    root_motion_subspaces(s.tree, step.q_middle, kin)
    rotate_inertias(s.tree, kin, dyn.matrix)
    for k in range(len(springs)):
        springs[k].saturated = 0
    for turn in range(2 if len(springs) else 1):
        implicit_mass_matrix(s, ws, springs, h)
        for stage in range(2):
            if stage or turn:
                for j in range(len(v)):
                    middle[j] = v[j] + (
                        (change[j] + h * cluster.contact_accelerations[j]) / 2 if stage else 0.0)
                update_velocities(s.tree, step.q_middle, middle, kin)
            bias_forces(s.tree, s.gravity, cluster.loads, middle if stage else v, kin, dyn, change)
            for k in range(len(springs)):
                add_spring_force(s, kin, step.q_middle, v, springs[k], time, change)
            add_passive_torques(s.tree, step.q_middle, change)
            for j in range(len(v)):
                change[j] = h * (change[j] - s.dof_damping[j] * v[j])
            solve_upper(dyn.H, s.dof_parent, change)
            solve_lower(dyn.H, s.dof_parent, change)
        for j in range(len(v)):
            step.v_free[j] = v[j] + change[j]
        if turn or not saturate_springs(s, kin, step.q_middle, v, step.v_free, springs, time, h):
            break


@compiled
def implicit_mass_matrix(s: System, ws: Workspace, springs: np.ndarray, h: float) -> None:
    """Write to dynamics.H the factor of the mass matrix at step.middle with the implicit terms of
    joint damping, passive torques and springs in a step of h s.
    """
    dyn, kin = ws.step.dynamics, ws.step.middle
    mass_matrix(s.tree, s.dof_parent, s.dof_body, kin, dyn)
    for j in range(len(s.dof_damping)):
        dyn.H[j, j] += h * theta_weight(h * s.dof_damping[j] / dyn.H[j, j]) * s.dof_damping[j]
    for i in range(len(s.tree)):
        body = s.tree[i]
        for d in range(body.dof_count if body.has_passive else 0):
            stiffness = passive_torque(body, d, ws.step.q_middle[body.q_start + d])[1]
            dyn.H[body.v_start + d, body.v_start + d] += h * stiffness * h / 4
    for k in range(len(springs)):
        add_implicit_spring(s, kin, dyn.H, springs[k], h)
    factor_ltl(dyn.H, s.dof_parent)


@compiled
def add_passive_torques(tree: np.ndarray, q: np.ndarray, out: np.ndarray) -> None:
    """Add the elastic torques of tissue near the ends of joint ranges, N m, at q to ``out``
    (nv,). Joints without ``passive`` have none.
    """
    for i in range(len(tree)):
        body = tree[i]
        for d in range(body.dof_count if body.has_passive else 0):
            out[body.v_start + d] += passive_torque(body, d, q[body.q_start + d])[0]


@compiled
def finish_step(s: System, ws: Workspace, cluster: ClusterState, h: float, since: float,
                m: int) -> None:
    """After contact_step(): account for the work of a step of h s with m contacts, apply the
    position correction to step.q_end, and conserve the momentum of dolls that are not on the
    ground; write contacts.gaps_end and step.sums_after. step.end becomes the kinematics of the end.
    """
    step, kin, q, v = ws.step, ws.step.end, ws.step.q_end, ws.step.v_end
    clear_external(s, step.external)
    add_contact_impulses(s, ws, m)
    account_kinematic_work(s, ws, step.middle, step.q_middle, m)
    if len(cluster.loads) or len(cluster.springs):
        account_work(s, ws, cluster.v, v, h, cluster.loads, cluster.springs, since)
    forward_kinematics(s.tree, q, v, kin)
    sum_dolls(s, ws, kin, q, step.sums_after)
    some_free = False
    for d in range(len(step.external)):
        some_free |= not step.external[d].on_ground
        for k in range(3):
            step.external[d].center[k] = step.sums_after[d].center[k]
    limit_correction_energy(s, ws, m, step.correction)
    integrate_positions(s.tree, q, step.correction, 1.0, q)
    if some_free:
        forward_kinematics(s.tree, q, v, kin)
        sum_dolls(s, ws, kin, q, step.sums_after)
        conserve_momentum(s, ws, h, q, v)
    write_correction_motion(s, kin, q, step.correction, ws.contacts.motion)
    update_kinematics_and_gaps(s, ws, kin, q, v, ws.gaps, h, ws.contacts.gaps_end)
    update_point_gaps(s, ws, kin, h, ws.contacts.gaps_end)
    sum_dolls(s, ws, kin, q, step.sums_after)
    ws.stats[0].work_pushes += (load_potential(s, kin, q, cluster.loads)
                                - step.scalars[0].start_load_potential)


@compiled
def clear_external(s: System, external: np.ndarray) -> None:
    """Set impulses, moments and flags of all dolls (d,) to zero; on_ground to 1 for those with a
    kinematic bone, which bears their weight.
    """
    for d in range(len(external)):
        own = external[d]
        own.on_ground = own.touches_other = 0
        for k in range(3):
            own.impulse[k] = own.moment[k] = 0.0
    for i in range(len(s.tree)):
        if s.tree[i].kinematic:
            external[s.body_doll[i]].on_ground = 1
