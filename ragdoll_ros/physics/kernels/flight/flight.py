"""Flight: whether everything that touches separates, and the motion along a dense step."""
from __future__ import annotations

import math

from ..cluster_state import ClusterState
from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts
from ..contact.gaps import update_kinematics_and_gaps
from ..contact.jacobian import normal_velocity
from ..contact_kind import LIMIT
from ..dynamics.body import WORLD
from ..dynamics.forward_dynamics import state_derivative
from ..dynamics.kinematics import forward_kinematics, place_geoms
from ..maths.vectors import dot, norm, vec
from ..stepping.local_error import forget_accelerations
from ..stepping.step_control import clear_contact_accelerations
from ..stepping.work import load_power
from ..system import System
from ..workspace import Workspace
from .dense_step import evaluate_dense_step
from .first_contact import set_contact_gaps, time_without_contact

SEPARATION_SPEED = 5e-3
"""m/s or rad/s at which contacts separate for a flight: to 1.3 um under gravity, which is what
first_contact.TOUCHING can tell."""

STILL = 1e-6
"""rad/s, or rad/s^2, at which a joint that leans on its limit does not press on it."""

WEIGHTLESS = 1e-9
"""Share of a doll's weight below which no contact presses: what falls with all its joints at their
limits presses on them by rounding alone."""

WORTHWHILE = 6
"""Contact steps that cost as much as a step of flight."""

GAUSS_LEGENDRE = (
    (0.046910077030668, 0.118463442528095), (0.230765344947158, 0.239314335249683),
    (0.5, 0.284444444444444), (0.769234655052842, 0.239314335249683),
    (0.953089922969332, 0.118463442528095))
"""Nodes and weights of Gauss-Legendre quadrature with five points on (0, 1)."""


@compiled
def can_fly(s: System, ws: Workspace, cluster: ClusterState, nominal: float) -> bool:
    """Return whether a flight may begin. No contact may have carried weight in the last step,
    unless that step ended with an impact. All contacts must separate. Where something touches and
    dolls have joints, no gap may be able to close within WORTHWHILE times ``nominal``, the length
    of a contact step, s. ws.gaps must be current. Overwrites contacts.found, ws.flight and, with
    values at the same pose, ws.gaps.
    """
    q, v, stats, flight = cluster.q, cluster.v, ws.stats[0], ws.flight
    kin, g = flight.kinematics, norm(vec(s.gravity))
    least = WEIGHTLESS * g * s.doll_masses[0] * stats.last_dt
    for i in range(stats.contact_count):
        if stats.ended_without_impact and cluster.contacts[i].impulse[0] > least:
            return False
    forward_kinematics(s.tree, q, v, kin)
    place_geoms(s.tree, s.body_root, s.geoms, q, kin)
    m = find_contacts(s, ws, kin, q, ws.gaps, 0.0)
    if not contacts_separate(s, ws, cluster, m):
        return False
    if m == 0 or len(s.tree) == len(ws.step.external):
        return True
    update_kinematics_and_gaps(s, ws, kin, q, v, ws.gaps, math.inf, ws.gaps)
    fast = 0.0
    for k in range(len(s.geoms)):
        if s.geoms[k].body != WORLD:
            turn = vec(kin.spatial_velocities[s.geoms[k].body])
            fast = max(fast, dot(turn, turn) * s.geoms[k].reach)
    set_contact_gaps(ws)
    bound = g + 2 * fast + 1e-3
    return time_without_contact(s, ws, kin, q, v, ws.gaps, bound, bound,
                                cluster.end_rates) > WORTHWHILE * nominal


@compiled
def contacts_separate(s: System, ws: Workspace, cluster: ClusterState, m: int) -> bool:
    """Return whether all m contacts found separate: points faster than SEPARATION_SPEED, joint
    limits neither approaching nor, if slower than that, accelerated towards the limit.
    flight.kinematics: of q and v.
    """
    q, v, flight = cluster.q, cluster.v, ws.flight
    kin, leaning = flight.kinematics, False
    for i in range(m):
        c = ws.contacts.found[i]
        if c.kind == LIMIT:
            leaning |= c.limit_sign * v[c.dof] < SEPARATION_SPEED
            if c.limit_sign * v[c.dof] < -STILL:
                return False
            continue
        point, normal = vec(c.point), vec(c.normal)
        speed = (normal_velocity(s, kin, q, c.body_a, point, normal)
                 - normal_velocity(s, kin, q, c.body_b, point, normal))
        if speed < SEPARATION_SPEED:
            return False
    if leaning:
        state_derivative(s.tree, s.gravity, cluster.loads, q, v, kin, ws.step.dynamics,
                         flight.derivative)
        for i in range(m):
            c = ws.contacts.found[i]
            if c.kind == LIMIT and c.limit_sign * v[c.dof] < SEPARATION_SPEED and (
                    c.limit_sign * flight.derivative[len(q) + c.dof] < -STILL):
                return False
    return True


@compiled
def follow_dense_step(s: System, ws: Workspace, cluster: ClusterState,
                      left: float) -> tuple[float, bool]:
    """Advance cluster.q and v along the step by ``left`` s, or to its end or its first contact.
    Returns the time advanced, s, and whether something touches. Adds the work of loads to the
    stats. At its end or a contact the step becomes invalid; without contact, its end rates are kept
    for the start of the next one.
    """
    step, flight, loads = cluster.dense_step[0], ws.flight, cluster.loads
    end = min(step.length, step.event_time)
    gone = min(left, end - step.elapsed)
    if len(loads):
        for node, weight in GAUSS_LEGENDRE:
            evaluate_dense_step(s.tree, cluster, step.elapsed + node * gone, flight.q, flight.v)
            forward_kinematics(s.tree, flight.q, flight.v, flight.kinematics)
            for k in range(len(loads)):
                ws.stats[0].work_pushes += weight * gone * load_power(
                    s.tree, flight.kinematics, loads[k], False)
    step.elapsed += gone
    clear_contact_accelerations(cluster)
    forget_accelerations(cluster)
    evaluate_dense_step(s.tree, cluster, step.elapsed, cluster.q, cluster.v)
    if step.elapsed < end - 1e-15:
        return gone, False
    step.valid = 0
    touched = step.event_time <= step.length
    step.first_rate_known = 0 if touched else 1
    if touched:
        step.next_length = 0.0
    else:
        for j in range(cluster.end_rates.shape[1]):
            cluster.end_rates[0, j] = cluster.end_rates[1, j]
    return gone, touched
