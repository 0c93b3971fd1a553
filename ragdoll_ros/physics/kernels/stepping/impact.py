"""An impact: Newton's law of restitution and Coulomb's law of friction at an instant."""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts, had_met
from ..contact.gaps import MET, SLOW, SLOW_TURN
from ..contact.jacobian import contact_velocities
from ..contact.patch_friction import set_slip_friction
from ..contact_kind import LIMIT
from ..dynamics.kinematics import (Kinematics, forward_kinematics, place_geoms,
                                   root_motion_subspaces, rotate_inertias)
from ..dynamics.mass_matrix import factor_ltl, mass_matrix
from ..impulses.solve_contacts import solve_contacts
from ..system import System
from ..workspace import Workspace
from .impact_log import log_impacts
from .momentum import count_contact_impulses
from .work import account_kinematic_work

TOLERANCE = 1e-10
"""m/s: tolerance of the contact solve."""


@compiled
def closes_fast(c: np.record) -> bool:
    """Whether a contact closes so fast, by its start_velocity, that it is an impact: faster than
    SLOW, m/s; a joint limit than SLOW_TURN, rad/s.
    """
    return c.start_velocity[0] < -(SLOW_TURN if c.kind == LIMIT else SLOW)


@compiled
def keep_impacting(s: System, ws: Workspace, cluster: ClusterState, kin: Kinematics, m: int,
             landed: float) -> int:
    """Select the contacts that an impact at cluster.q solves, from the first m of contacts.found,
    and move them to its beginning: those with a gap up to MET; those that had_met() in the last
    step; those that close fast and have a gap up to ``landed``, m or rad. Returns their number.
    ``kin``: of cluster.q and v.
    """
    contacts, known, count = ws.contacts.found, ws.stats[0].contact_count, 0
    for i in range(m):
        if contacts[i].gap > MET:
            contact_velocities(s, kin, cluster.q, cluster.v, contacts[i])
            if not (contacts[i].gap <= landed and closes_fast(contacts[i])) and not (
                    had_met(s, cluster.contacts, known, contacts[i].id)):
                continue
        contacts[count] = contacts[i]
        count += 1
    return count


@compiled
def follow_twist(s: System, ws: Workspace, cluster: ClusterState) -> None:
    """If a kinematic body has changed its velocity since the last step (stats.twist_changed), solve
    an impact without restitution, so that what touches the body follows at once, and clear the
    flag. Such a velocity samples a smooth motion: its changes are no impacts. ws.gaps are
    current.
    """
    if ws.stats[0].twist_changed:
        impact(s, ws, cluster, 0.0, math.inf)
        ws.stats[0].twist_changed = 0


@compiled
def impact(s: System, ws: Workspace, cluster: ClusterState, time: float, landed: float) -> int:
    """Solve an impact of those contacts at cluster.q, found by ws.gaps, that keep_impacting()
    selects: add the change of velocity to cluster.v, and log the impacts, where a log is kept, at
    ``time`` s after the beginning of the advance. If stats.twist_changed is set, there is no
    restitution and nothing is logged, see follow_twist(). Returns the number of touching contacts
    that were not selected. ``landed``: see keep_impacting().
    """
    q, v, kin, dyn, contacts = (cluster.q, cluster.v, ws.step.start, ws.step.dynamics,
                                ws.contacts.found)
    ws.step.scalars[0].tracks_points = 0
    forward_kinematics(s.tree, q, v, kin)
    place_geoms(s.tree, s.body_root, s.geoms, q, kin)
    touching = find_contacts(s, ws, kin, q, ws.gaps, 0.0)
    m = keep_impacting(s, ws, cluster, kin, touching, landed)
    if m == 0:
        return touching
    root_motion_subspaces(s.tree, q, kin)
    rotate_inertias(s.tree, kin, dyn.matrix)
    mass_matrix(s.tree, s.dof_parent, s.dof_body, kin, dyn)
    factor_ltl(dyn.H, s.dof_parent)
    for i in range(m):
        for e in range(5):
            contacts[i].impulse[e] = 0.0
    set_slip_friction(s, ws, kin, q, m, 0.0)
    solve_contacts(s, ws, kin, q, v, v, m, 0.0, TOLERANCE)
    for j in range(len(v)):
        v[j] += ws.step.v_change[j]
    count_contact_impulses(s, ws, m, cluster.contact_impulses)
    account_kinematic_work(s, ws, kin, q, m)
    ws.stats[0].impacts += 1
    if len(cluster.impact_log) and not ws.stats[0].twist_changed:
        log_impacts(s, ws, cluster, m, False, SLOW, time)
    return touching - m
