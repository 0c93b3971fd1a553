"""Workspace: scratch of the kernels, in one bundle for each stage of a step."""
from __future__ import annotations

import collections

import numpy as np

from .cluster_state import CONTACT, DOLL_SUMS, ClusterState, make_cluster_state
from .compiling.bundle import bundle_type
from .dynamics.forward_dynamics import make_dynamics
from .dynamics.kinematics import make_kinematics
from .maths.anderson import make_anderson
from .maths.minimum_degree import make_minimum_degree
from .maths.sparse_lu import make_sparse_lu
from .system import (CONTACT_POINT, MAX_DENSE_ROWS, MAX_MANIFOLD_POINTS, System,
                     blank_system, coordinate_count, gap_count, tree_depth)

MOTION = np.dtype([('speed', float), ('angular_speed', float), ('correction', float),
                   ('correction_angle', float)], align=True)
"""Bounds on how far points of a body move in a step: speed of the center of mass, m/s, and angular
speed, rad/s, at its end; displacement, m, and rotation, rad, by position correction."""

FLIGHT_MOTION = np.dtype([('velocity', float, 3), ('angular_speed', float), ('reach', float)],
                         align=True)
"""Of a body at the start of a step of flight: velocity of the center of mass, m/s, angular speed,
rad/s, and its largest reach, m."""

EXTERNAL_IMPULSE = np.dtype([
    ('impulse', float, 3), ('moment', float, 3), ('center', float, 3), ('on_ground', np.int64),
    ('touches_other', np.int64)], align=True)
"""What acts on a doll from outside in a step: impulse, N s, and its moment about the world's
origin; its center of mass before position correction, m; whether the ground bears it; whether
another doll touches it."""

ISLAND_SUMS = np.dtype([
    ('mass', float), ('momentum', float, 3), ('moved', float, 3), ('on_ground', np.int64)],
    align=True)
"""Of the dolls of an island that touch others: mass, kg; momentum at a step's end, N s; mass times
the displacement by position correction, kg m; whether the ground bears any."""

BRACKET = np.dtype([('low', float), ('high', float), ('moved', np.int64), ('halved_width', float),
                    ('chords', np.int64)], align=True)
"""Bracket of a time of impact, step lengths in s: ``low``, at whose end nothing has met, and
``high``, at whose end something has; which of them moved last, -1 or 1 (0: neither); its width when
it was last halved, and the chords since."""

STEP_SCALARS = np.dtype([
    ('start_contact_count', np.int64), ('start_point_count', np.int64), ('tried_count', np.int64),
    ('tracks_points', np.int64), ('seeks_impacts', np.int64), ('correction_energy', float),
    ('start_load_potential', float), ('residual', float), ('solve_error', float),
    ('touching', float)], align=True)
"""Of a contact step: contacts at its start, points that have gaps of their own then, and contacts
in its last trial if that was as long; whether points have gaps now; whether it ends at impacts;
potential energy that position correction adds, J; load_potential() at its start, J; the largest
residual velocity of its large islands, m/s, and the share of the velocities that is allowed, and
the gap, m or rad, up to which something touches, see physics/accuracy.py."""

GAP_COUNTS = np.dtype([('fixed', np.int64), ('live', np.int64)], align=True)
"""Gaps of ground points, limits and pairs; these and those of contacts.points."""

OCCURRENCE = np.dtype([('member', np.int64), ('place', np.int64)], align=True)
"""A member of an island that a degree of freedom moves, and its place in the member's support."""

MEMBER = np.dtype([
    ('contact', np.int64), ('kind', np.int64), ('row', np.int64), ('friction', float),
    ('rolling_friction', float), ('correction', float), ('correction_compliance', float),
    ('compliance', float), ('separating', np.int64)], align=True)
"""A contact of the island that is solved: its index among all contacts; its kind and first row;
coefficients of friction; the penetration, m or rad, that position correction is to remove;
compliances, as shares of the diagonal of W, of position correction and of impulses; whether it
separates as the step begins."""

Contacts = collections.namedtuple(
    'Contacts', 'found start tried gaps_end gaps_active points point_pair '
    'first_point manifold edge_manifold motion joint_outside angles u v')
"""Contacts (c,) that are ``found`` at a pose, those at the ``start`` of the step, and those that
were ``tried`` in its last trial. Gaps: ``gaps_end`` at the end of a step; ``gaps_active``, by which
contacts are found in it. ``points`` that have gaps of their own, the ``point_pair`` of each, and
the ``first_point`` (p,) among them of each pair, see point_gaps.py. ``manifold``: of one pair;
``edge_manifold``: of one at an internal edge. ``motion`` (n,); ``joint_outside`` (n,): whether the
joint of a body is outside its limits. ``angles``, ``u``, ``v`` (c,): the corners of a patch in
order, see patch.py."""

UNKNOWN = np.dtype([
    ('row', np.int64), ('width', np.int64), ('share', float), ('slack', float),
    ('direction', float, 5)], align=True)
"""An unknown of Newton's method on a small island: an impulse along so many rows (``width``) from
``row`` on, along their ``direction``. That of friction across a slip, with two rows, has the
equation ``share`` * (velocity) + ``slack`` * (impulse) = its residual; that of others is the
velocity of their row."""

Island = collections.namedtuple(
    'Island', 'members label Y YT support place W G blocks rhs impulses free_velocity '
    'start_velocity curvature correction soft velocity residual direction best step_start active '
    'places is_normal normal_rhs normal_impulses normal_row z z_direction anderson '
    'bodies body_number elimination dof_place A B BY coupled phi local lu occurrence_start '
    'occurrences newton_steps newton_dofs unknowns combined')
"""An island of m contacts (``members``) and their rows, and scratch to solve it.

``label`` (d,): island of each doll. Rows ``Y`` = J L^-1 have entries for the degrees of freedom
that they depend on, listed in ``support``, alone; columns of ``YT`` are for all. ``place`` (nv,):
where a degree of freedom stands in a row. ``W`` = Y Y^T and ``G``, flat (rows * rows): of a small
island; ``blocks`` (m, 5, 5): diagonal blocks of W of a large one. Of each row: ``rhs`` b of
u = W p + b; ``impulses`` p; ``free_velocity`` without impulses; ``start_velocity`` at the step's
start; ``curvature`` bias; ``correction`` impulses; ``soft`` impulses without restitution. The
others are scratch of the solvers that use them; ``z`` (nv,) = Y^T p; of sparse_newton.py:
``bodies`` (n,) that contacts move, ``body_number`` (n,) of each among them, their order of
``elimination``, the ``dof_place`` (nv,) that follows, ``lu`` and ``occurrences``; ``anderson``: of
sweeps. ``newton_steps`` (1,): counted by both of Newton's methods;
``newton_dofs`` (1,): those of sparse_newton.py, 0 if sweeps cost less, -1 as long as that is not
known; ``unknowns`` of newton.py, and a row of its matrix, ``combined``."""

Step = collections.namedtuple(
    'Step', 'scalars start middle end dynamics q_middle q_end v_end v_free v_middle v_change '
    'correction sums_before sums_after external islands bracket gaps_low gaps_high gaps_middle '
    'spin')
"""A contact step or an impact: its kinematics at ``start``, ``middle`` and ``end``; coordinates and
velocities there; ``v_free`` without contacts, ``v_change`` by contacts; ``correction`` (nv,): the
displacement of position correction. ``sums_before``, ``sums_after``, ``external`` (d,): of the
dolls; ``islands`` (d,): of islands, at their labels. ``bracket`` (1,) with the gaps at its ends,
and those at the middle of the first trial. ``spin`` (3,) rad/s: scratch."""

Flight = collections.namedtuple(
    'Flight', 'kinematics q v stages derivative contact_gaps motion')
"""A step of flight: ``kinematics``, ``q`` and ``v`` at an instant of it; state derivatives of all
``stages`` (16, nq + nv) and a ``derivative`` (nq + nv,); ``contact_gaps``:
at which gaps count as contacts; ``motion`` (n,)."""

Workspace = collections.namedtuple(
    'Workspace', 'contacts island step flight stats excluded gaps gap_counts')
"""Scratch for clusters of one system; ``stats``, ``excluded`` and ``gaps`` are the cluster's.
``gap_counts`` (1,): how many gaps there are, all others are room for those of points."""


def make_workspace(system: System, cluster: ClusterState) -> Workspace:
    """Allocate the scratch for a cluster of a system, with room for as many contacts as it has."""
    bodies, nv, nq = len(system.tree), len(system.dof_parent), coordinate_count(system)
    dolls, contacts, gaps = len(system.doll_masses), len(cluster.contacts), len(cluster.gaps)
    rolls = max(system.geoms['rolling_friction'].max(initial=0.0),
                system.pairs['rolling_friction'].max(initial=0.0)) > 0

    counts = np.full(1, gap_count(system), GAP_COUNTS)

    def kinematics() -> object:
        return make_kinematics(bodies, nv, len(system.geoms))

    step = Step(
        scalars=np.zeros(1, STEP_SCALARS), start=kinematics(), middle=kinematics(),
        end=kinematics(), dynamics=make_dynamics(bodies, nv), q_middle=np.zeros(nq),
        q_end=np.zeros(nq), v_end=np.zeros(nv), v_free=np.zeros(nv), v_middle=np.zeros(nv),
        v_change=np.zeros(nv), correction=np.zeros(nv), sums_before=np.zeros(dolls, DOLL_SUMS),
        sums_after=np.zeros(dolls, DOLL_SUMS), external=np.zeros(dolls, EXTERNAL_IMPULSE),
        islands=np.zeros(dolls, ISLAND_SUMS),
        bracket=np.zeros(1, BRACKET), gaps_low=np.zeros(gaps), gaps_high=np.zeros(gaps),
        gaps_middle=np.zeros(gaps), spin=np.zeros(3))
    flight = Flight(
        kinematics=kinematics(), q=np.zeros(nq), v=np.zeros(nv), stages=np.zeros((16, nq + nv)),
        derivative=np.zeros(nq + nv), contact_gaps=np.zeros(gaps),
        motion=np.zeros(bodies, FLIGHT_MOTION))
    found = Contacts(
        found=np.zeros(contacts, CONTACT), start=np.zeros(contacts, CONTACT),
        tried=np.zeros(contacts, CONTACT), gaps_end=np.zeros(gaps), gaps_active=np.zeros(gaps),
        points=np.zeros(contacts, CONTACT_POINT), point_pair=np.zeros(contacts, np.int64),
        first_point=np.zeros(len(system.pairs), np.int64),
        manifold=np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT),
        edge_manifold=np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT), motion=np.zeros(bodies, MOTION),
        joint_outside=np.zeros(bodies, np.int64), angles=np.zeros(max(contacts, 8)),
        u=np.zeros(max(contacts, 8)), v=np.zeros(max(contacts, 8)))
    return Workspace(
        contacts=found, island=_make_island(system, contacts, contacts * (5 if rolls else 3)),
        step=step, flight=flight, stats=cluster.stats, excluded=cluster.excluded,
        gaps=cluster.gaps, gap_counts=counts)


def _make_island(system: System, contacts: int, rows: int) -> Island:
    """Allocate an island with room for so many contacts and rows."""
    nv, few = len(system.dof_parent), min(rows, MAX_DENSE_ROWS)
    wide = min(nv, 2 * tree_depth(system)) + 1

    def each_row() -> np.ndarray:
        return np.zeros(max(rows, 8))

    return Island(
        members=np.zeros(contacts, MEMBER), label=np.zeros(len(system.doll_masses), np.int64),
        Y=np.zeros((rows, wide)), YT=np.zeros((nv, few)),
        support=np.zeros((contacts, wide), np.int64), place=np.zeros(nv, np.int64),
        W=np.zeros(few * few), G=np.zeros(few * few), blocks=np.zeros((contacts, 5, 5)),
        rhs=each_row(), impulses=each_row(), free_velocity=each_row(), start_velocity=each_row(),
        curvature=each_row(), correction=each_row(), soft=each_row(), velocity=each_row(),
        residual=each_row(), direction=each_row(), best=each_row(),
        step_start=each_row(),
        active=np.zeros(2 * max(rows, 8)), places=np.zeros(max(rows, 8), np.int64),
        is_normal=np.zeros(max(rows, 8), np.int64), normal_rhs=each_row(),
        normal_impulses=each_row(), normal_row=np.zeros(max(rows, 8), np.int64),
        z=np.zeros(nv), z_direction=np.zeros(nv), anderson=make_anderson(max(rows, 8), nv),
        bodies=np.zeros(len(system.tree), np.int64),
        body_number=np.zeros(len(system.tree), np.int64),
        elimination=make_minimum_degree(len(system.tree)), dof_place=np.zeros(nv, np.int64),
        A=np.zeros((contacts, 5, 5)), B=np.zeros((contacts, 5, 5)), BY=np.zeros((rows, wide)),
        coupled=np.zeros(max(rows, 8), np.int64),
        phi=np.zeros((contacts, 5)), local=np.zeros(5), lu=make_sparse_lu(nv, contacts, wide),
        occurrence_start=np.zeros(nv + 1, np.int64),
        occurrences=np.zeros(contacts * wide, OCCURRENCE), newton_steps=np.zeros(1, np.int64),
        newton_dofs=np.zeros(1, np.int64), unknowns=np.zeros(max(few, 8), UNKNOWN),
        combined=each_row())


WORKSPACE = bundle_type(make_workspace(blank_system(), make_cluster_state(blank_system())))
