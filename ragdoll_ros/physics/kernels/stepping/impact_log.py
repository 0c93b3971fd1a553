"""The impact log: what met in an impact, for who asked for it; see cluster_state.py, IMPACT.

With the factor L of the mass matrix, H = L^T L, and the Jacobian J of a velocity, J L^-1 = Y: a
unit impulse along a contact's normal changes that velocity by Y . Y_n, and the normal velocity by
Y_n . Y_n, whose reciprocal is the effective mass.
"""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.decorators import compiled
from ..contact.find_contacts import patch_end
from ..contact.jacobian import apply_inverse_factor, contact_jacobian
from ..contact_kind import LIMIT
from ..dynamics.body import WORLD
from ..dynamics.kinematics import Kinematics, root_position
from ..maths.vectors import Vec3, add, add_scaled, divide, put, vec
from ..system import System
from ..workspace import Workspace

NORMAL_ROWS, CENTER_ROWS = 0, 5
"""First rows of island.Y for the Jacobians of a contact and of a center of mass."""

NORMAL_COLUMNS, CENTER_COLUMNS = 0, 1
"""Indices of island.support for the columns of these rows."""


@compiled
def log_impacts(s: System, ws: Workspace, cluster: ClusterState, m: int, in_step: bool,
                slowest: float, time: float) -> None:
    """Log an impact for each patch of the m contacts with an impulse, at its center of pressure, if
    the patch closed faster than ``slowest``, m/s; joint limits are not logged. ``time``: s since
    the advance began. cluster.impact_count also counts those that do not fit in the log.

    Call it after solve_contacts() of an impact, or, with ``in_step``, of a step that does not seek
    impacts: then persistent contacts are not logged. Overwrites contacts.found: merge_patch()
    merges the contacts of each patch, and ``in_step`` sets the normal impulses of persistent
    contacts to zero.
    """
    kin, q = ws.step.start, cluster.q
    if in_step:
        kin, q = ws.step.middle, ws.step.q_middle
        for i in range(m):
            if ws.contacts.found[i].persistent:
                ws.contacts.found[i].impulse[0] = 0.0
    for i in range(m):
        c = ws.contacts.found[i]
        if c.kind == LIMIT or c.impulse[0] <= 0.0:
            continue
        merge_patch(ws.contacts.found, i, patch_end(ws.contacts.found, i, m))
        if c.normal_velocity >= -slowest:
            continue
        k = cluster.impact_count[0]
        cluster.impact_count[0] += 1
        if k >= len(cluster.impact_log):
            continue
        entry = cluster.impact_log[k]
        entry.kind, entry.body_a, entry.body_b, entry.patch = c.kind, c.body_a, c.body_b, c.patch
        entry.time, entry.speed, entry.impulse = time, -c.normal_velocity, c.impulse[0]
        put(entry.point, vec(c.point))
        put(entry.normal, vec(c.normal))
        write_mobilities(s, ws, q, kin, c, entry)


@compiled
def merge_patch(found: np.ndarray, begin: int, end: int) -> None:
    """Merge the normal impulses of contacts begin to end - 1, of one patch, into the first, with
    their center of pressure and its velocity; those of the others become zero.
    """
    c, total, velocity, point = found[begin], 0.0, 0.0, (0.0, 0.0, 0.0)
    for j in range(begin, end):
        share = max(0.0, found[j].impulse[0])  # a solver leaves some a rounding below
        total += share
        velocity += share * found[j].normal_velocity
        point = add_scaled(point, share, vec(found[j].point))
        found[j].impulse[0] = 0.0
    c.impulse[0], c.normal_velocity = total, velocity / total
    put(c.point, divide(point, total))


@compiled
def write_mobilities(s: System, ws: Workspace, q: np.ndarray, kin: Kinematics, c: np.record,
                     entry: np.record) -> None:
    """Write to the ``entry`` of contact c in the log its effective mass along the normal, kg, and
    its mobilities: the speed of each body's center of mass per unit normal impulse, 1/kg.
    entry.body_a and body_b must be set; dynamics.H is the factor of the mass matrix. Overwrites
    c.friction_point, the row fields of c and rows of island.Y.
    """
    island, point = ws.island, vec(c.point)
    for side in range(2):
        body = entry.body_a if side == 0 else entry.body_b
        entry.mobility[side] = 0.0
        if body == WORLD:
            continue
        root = root_position(q, s.tree[s.body_root[body]].q_start)
        write_rows(s, ws, q, kin, c, CENTER_ROWS, CENTER_COLUMNS, body, WORLD,
                   add(root, vec(kin.positions[body])))
        columns = c.dof_count
        write_rows(s, ws, q, kin, c, NORMAL_ROWS, NORMAL_COLUMNS, entry.body_a, entry.body_b,
                   point)
        squares = 0.0
        for e in range(CENTER_ROWS, CENTER_ROWS + 3):
            change = 0.0
            for n in range(columns):
                j = island.support[CENTER_COLUMNS, n]
                change += island.Y[e, n] * island.Y[NORMAL_ROWS, island.place[j]]
            squares += change * change
        entry.mobility[side] = math.sqrt(squares)
    inverse = 0.0
    for n in range(c.dof_count):
        inverse += island.Y[NORMAL_ROWS, n] ** 2
    entry.effective_mass = 1 / inverse


@compiled
def write_rows(s: System, ws: Workspace, q: np.ndarray, kin: Kinematics, c: np.record, row: int,
               index: int, body_a: int, body_b: int, point: Vec3) -> None:
    """Write the rows J L^-1 of the velocity of body_a relative to body_b at ``point``, m, along the
    normal and tangents of c, and those of rolling if c has them, to island.Y from ``row`` on. Write
    the degrees of freedom of their columns to island.support[index], and the column of each to
    island.place. dynamics.H is L. Overwrites the bodies, points, first_row and dof_count of c.
    """
    c.first_row, c.body_a, c.body_b = row, body_a, body_b
    put(c.point, point)
    put(c.friction_point, point)
    contact_jacobian(s, kin, q, ws.island, c, index, ws.step.v_change, ws.step.v_change)
    apply_inverse_factor(s.dof_parent, ws.step.dynamics.H, ws.island, index, c)
