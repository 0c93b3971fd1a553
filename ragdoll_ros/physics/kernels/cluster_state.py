"""ClusterState: the state of a cluster of dolls, kept from tick to tick."""
from __future__ import annotations

import collections

import numpy as np

from .compiling.bundle import bundle_type
from .dynamics.loads import LOAD, SPRING
from .system import System, blank_system, coordinate_count, gap_count

CONTACT = np.dtype([
    ('kind', np.int64), ('body_a', np.int64), ('body_b', np.int64), ('dof', np.int64),
    ('limit_sign', float), ('id', np.int64), ('patch', np.int64), ('island', np.int64),
    ('first_row', np.int64), ('dof_count', np.int64), ('point', float, 3),
    ('friction_point', float, 3), ('normal', float, 3), ('tangents', float, (2, 3)),
    ('gap', float), ('friction', float), ('patch_share', float),
    ('rolling_friction', float), ('restitution', float),
    ('normal_velocity', float), ('impulse', float, 5), ('persistent', np.int64),
    ('start_velocity', float, 5), ('spin', float)], align=True)
"""A contact of two bodies (``body_b`` WORLD: the ground or a static geom), or a joint at a limit.

kind: see contact_kind.py. dof, limit_sign: of a limit, its degree of freedom and the direction back
inside. id: the same from step to step; patch: the same for all points of one contact patch. point,
where the normal force acts, and friction_point, where friction acts: world, m. normal: from b to a;
tangents: two directions across it. gap: m or rad. patch_share: factor on
friction, see contact/patch_friction.py. rolling_friction: m. normal_velocity: before the
step, m/s. impulse: along the rows, N s or N m s. persistent: whether it existed as the step began,
with the velocities start_velocity along its rows and ``spin`` about the normal. island, first_row,
dof_count: of the solver."""

IMPACT = np.dtype([
    ('kind', np.int64), ('body_a', np.int64), ('body_b', np.int64), ('patch', np.int64),
    ('time', float), ('point', float, 3), ('normal', float, 3), ('speed', float),
    ('impulse', float), ('effective_mass', float), ('mobility', float, 2)], align=True)
"""A contact patch that met in an impact. kind, body_a, body_b, patch, normal: as of a CONTACT.
time: since the beginning of the advance, s. point: center of pressure, world, m. speed: of
approach along the normal, m/s. impulse: along the normal, N s. effective_mass: along the normal at
the point, of both bodies with what hangs on them, kg. mobility: speed of the center of mass of body
a, and of b, per impulse along the normal, 1/kg."""

DOLL_SUMS = np.dtype([
    ('energy', float), ('kinetic', float), ('center', float, 3), ('momentum', float, 3),
    ('angular_momentum', float, 3), ('inertia', float, (3, 3))])
"""Sums over a doll, in the order of the arrays that engines hand out: total and kinetic energy, J;
center of mass, m; momentum; angular momentum about the center of mass; inertia about it with all
joints locked."""

DENSE_STEP = np.dtype([
    ('valid', np.int64), ('first_rate_known', np.int64), ('elapsed', float), ('length', float),
    ('next_length', float), ('event_time', float), ('error', float), ('rounding', float)],
    align=True)
"""A step of flight with dense output: whether there is one; whether the state derivative at its
start is known; time advanced along it, s; its length, s; the length of the next one, by its error;
the time of its first contact, or infinity; its estimated error, m or rad; the error by rounding, m
or rad, that was found of late for each second of a step, 0: none."""

LEDGER = np.dtype([
    *((name, np.int64) for name in (
        'trials', 'too_much_energy', 'too_deep', 'too_coarse', 'closed_unseen', 'new_contacts',
        'past_impact', 'solves', 'contacts', 'rows', 'dofs', 'newton_steps', 'gap_updates',
        'narrow_phases')),
    *((name, np.int64) for name in (
        'gaps_cycles', 'flight_cycles', 'begin_cycles', 'dynamics_cycles', 'find_cycles',
        'solve_cycles', 'finish_cycles', 'impact_cycles', 'all_cycles'))], align=True)
"""What a cluster's steps are made of, since the start. Trials of contact steps, and those that were
rejected: for the energy that they added, for penetration, for the local error of a step longer than
the nominal one or for what met in it, for what closed faster than is allowed where impacts are not
sought, for contacts that they had not known, to end at an impact. Islands that were solved, with
their contacts, rows, and degrees of freedom of their dolls; Newton steps. Times that all gaps were
found, and pairs of which that took a narrow phase. Cycles of the processor in: finding gaps outside
of steps, flight, the beginning of steps, motion without contacts, finding contacts, their solve,
the end of steps with its gaps, impacts, and all."""

STEP_STATS = np.dtype([
    ('flight_steps', np.int64), ('steps', np.int64), ('impacts', np.int64), ('sweeps', np.int64),
    ('unsolved', np.int64), ('contacts_dropped', np.int64), ('toi_failures', np.int64),
    ('restitution_reduced', np.int64), ('energy_gains', np.int64), ('contact_count', np.int64),
    ('ended_without_impact', np.int64), ('last_dt', float), ('next_dt', float),
    ('smooth_dt', float), ('acceleration_dt', float),
    ('work_pushes', float), ('work_grabs', float), ('work_position_correction', float),
    ('energy_removed', float), ('energy_unremoved', float), ('gaps_current', np.int64),
    ('twist_changed', np.int64), ('flights_cut', np.int64), ('ledger', LEDGER)], align=True)
"""Since the start: flight steps, contact steps, impacts, Gauss-Seidel sweeps; islands that stayed
unsolved, contacts dropped for want of space, searches for a time of impact that failed, impacts
whose restitution was reduced to gain no energy, steps that gained some all the same. Of the last
step: its contacts, whether it ended without an impact, its length and the longest that the next may
have, s (0: any); ``smooth_dt``, s, if the next may be longer than the nominal step, else 0;
``acceleration_dt``, s, the length of the step of which ``accelerations`` are, 0 if there is none.
Work of pushes, of grabs, and of position correction beyond its share of the kinetic energy, J.
Spurious energy gained in steps, J: removed from the motion, and left, where nothing moved.
``gaps_current``: whether the gaps are those at q. ``twist_changed``: whether a kinematic body has
another velocity than in the last step. ``flights_cut``: ticks, or parts of them, in which flight
steps reached their bound. ``ledger``: see above."""

ClusterState = collections.namedtuple(
    'ClusterState', 'q v dense_output end_rates dense_step stats excluded contacts gaps '
    'contact_accelerations accelerations bone_states doll_sums contact_impulses impact_count '
    'impact_log loads springs')
"""The state of a cluster. ``q`` (nq,), ``v`` (nv,): generalized coordinates and velocities, angular
velocities of roots along the roots' own axes. ``dense_step`` (1,), with its polynomial
``dense_output`` (8, nq + nv) and the state derivatives at its ends, ``end_rates`` (2, nq + nv).
``stats`` (1,). ``excluded`` (p,): flags of the pairs within dolls, see system.py. ``contacts``: of
the last step. ``gaps``: see contact/gaps.py, with room for those of points.
``contact_accelerations`` (nv,): by contacts in the last step, zero unless all of them persist;
``accelerations`` (nv,): all, in the mean.
Output: ``bone_states`` (n, 13), ``doll_sums`` (d,), and ``contact_impulses`` (n, 3) N s: of
contacts on each bone since the start, world frame; ``impact_log`` (k,): of the last advance, where
k is not 0, and ``impact_count`` (1,), how many there were, more than k if there was no room for
some. Input: ``loads``, ``springs``."""


def make_cluster_state(system: System, contacts: int = 0) -> ClusterState:
    """Make a cluster state with room for ``contacts`` contacts. All values are 0, also the
    quaternions in q, which the caller must write.
    """
    nv, nq = len(system.dof_parent), coordinate_count(system)
    return ClusterState(
        q=np.zeros(nq), v=np.zeros(nv), dense_output=np.zeros((8, nq + nv)),
        end_rates=np.zeros((2, nq + nv)), dense_step=np.zeros(1, DENSE_STEP),
        stats=np.zeros(1, STEP_STATS), excluded=np.zeros(len(system.pairs), np.int64),
        contacts=np.zeros(contacts, CONTACT), gaps=np.zeros(gap_count(system) + contacts),
        contact_accelerations=np.zeros(nv), accelerations=np.zeros(nv),
        bone_states=np.zeros((len(system.tree), 13)),
        doll_sums=np.zeros(len(system.doll_masses), DOLL_SUMS),
        contact_impulses=np.zeros((len(system.tree), 3)), impact_count=np.zeros(1, np.int64),
        impact_log=np.zeros(0, IMPACT), loads=np.zeros(0, LOAD),
        springs=np.zeros(0, SPRING))


CLUSTER_STATE = bundle_type(make_cluster_state(blank_system()))
