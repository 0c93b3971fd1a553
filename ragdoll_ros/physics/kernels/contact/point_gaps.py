"""Gaps of the points of pairs that touch: another point than the first may land in a step.

The ground and planes have a gap for each point that may touch them. Of other shapes the points are
those of the contact manifold, in a step those of the pairs that touch as it begins: each is known
by its feature id, and has a gap, after those of all pairs, at the step's start and at the end of
each trial. A feature that is in the manifold at the end of a trial alone had, at the start, the gap
between the points of both bodies that are there at the end.
"""
from __future__ import annotations

import numpy as np

from ..collision.narrow_phase import collide
from ..collision.shapes import PLANE, TRIANGLE
from ..compiling.decorators import compiled
from ..dynamics.kinematics import Kinematics
from ..maths.vectors import add, dot, sub, to_local, to_world, vec
from ..system import MAX_MANIFOLD_POINTS, System
from ..workspace import Workspace
from .gaps import EXCLUDED, FAR, NONE, SLOW, one_gap, pair_gap, without_internal_edges
from .jacobian import normal_velocity
from .placed_shape import placed_shape


@compiled
def track_points(s: System, ws: Workspace, kin: Kinematics) -> None:
    """Begin to track the points of pairs that touch by ws.gaps, as a step begins: write them to
    contacts.points and their gaps to ws.gaps, and set scalars.tracks_points. Pairs with planes, and
    those for which there is no room, are left out. ``kin``: of the start, with its geoms.
    """
    counts, contacts, count = ws.gap_counts[0], ws.contacts, 0
    touching = ws.step.scalars[0].touching
    first = counts.fixed - len(s.pairs)
    for k in range(len(s.pairs)):
        contacts.first_point[k] = NONE
        if ws.gaps[first + k] > touching or s.geoms[s.pairs[k].b].kind == PLANE or (
                count + MAX_MANIFOLD_POINTS > len(contacts.points)):
            continue
        contacts.first_point[k] = count
        found = find_manifold(s, kin, k, contacts.points[count:])
        for i in range(count, count + found):
            contacts.point_pair[i] = k
            ws.gaps[counts.fixed + i] = contacts.points[i].gap
        count += found
    counts.live = counts.fixed + count
    ws.step.scalars[0].start_point_count, ws.step.scalars[0].tracks_points = count, 1


@compiled
def find_manifold(s: System, kin: Kinematics, k: int, manifold: np.ndarray) -> int:
    """Write the contact manifold of pair k, points with a gap below FAR, to ``manifold``; their
    number.
    """
    return collide(placed_shape(s, kin, s.pairs[k].a), placed_shape(s, kin, s.pairs[k].b), FAR,
                   manifold)


@compiled
def points_at_start(ws: Workspace, k: int) -> tuple[int, int]:
    """Range begin, end (end excluded) in contacts.points of the points that pair k had as the step
    began. Requires that it had some: first_point[k] is not NONE.
    """
    begin, count = ws.contacts.first_point[k], ws.step.scalars[0].start_point_count
    end = begin
    while end < count and ws.contacts.point_pair[end] == k:
        end += 1
    return begin, end


@compiled
def find_point(ws: Workspace, k: int, feature_id: int) -> int:
    """Index in contacts.points of the tracked point of pair k with this feature id; NONE if it is
    not tracked.
    """
    contacts, count = ws.contacts, ws.gap_counts[0].live - ws.gap_counts[0].fixed
    begin, end = points_at_start(ws, k)
    for i in range(begin, end):
        if contacts.points[i].feature_id == feature_id:
            return i
    for i in range(ws.step.scalars[0].start_point_count, count):
        if contacts.points[i].feature_id == feature_id and contacts.point_pair[i] == k:
            return i
    return NONE


@compiled
def add_point(s: System, ws: Workspace, kin: Kinematics, k: int, at: np.record, h: float) -> int:
    """Begin to track ``at``, a point of pair k's manifold at the end of a trial of h s: write its
    gap at the step's start, by moved_gap(), and at the ends of the bracket: interpolated at the low
    end, EXCLUDED at the high end. Returns its index in contacts.points, NONE if there is no room.
    ``kin``: of the end, with its geoms.
    """
    counts, contacts = ws.gap_counts[0], ws.contacts
    i, j = counts.live - counts.fixed, counts.live
    if j == len(ws.gaps):
        return NONE
    contacts.points[i], contacts.point_pair[i] = at, k
    ws.gaps[j] = contacts.gaps_active[j] = moved_gap(s, kin, ws.step.start, k, at)
    ws.step.gaps_low[j] = ws.gaps[j] + (at.gap - ws.gaps[j]) * ws.step.bracket[0].low / h
    ws.step.gaps_high[j] = EXCLUDED
    counts.live += 1
    return i


@compiled
def moved_gap(s: System, kin: Kinematics, to: Kinematics, k: int, at: np.record) -> float:
    """Gap, m, in ``to`` between the points fixed to both geoms of pair k that are in ``kin`` at the
    point ``at`` of its manifold, along its normal, fixed to geom b. ``kin``, ``to``: with geoms.
    """
    a, b = s.pairs[k].a, s.pairs[k].b
    r, r_to = kin.geom_rotations[b], to.geom_rotations[b]
    normal = to_world(r_to, to_local(r, vec(at.normal)))
    on_b = to_world(r_to, to_local(r, sub(vec(at.point), vec(kin.geom_positions[b]))))
    r, r_to = kin.geom_rotations[a], to.geom_rotations[a]
    on_a = to_world(r_to, to_local(r, sub(vec(at.point), vec(kin.geom_positions[a]))))
    apart = sub(add(on_a, vec(to.geom_positions[a])), add(on_b, vec(to.geom_positions[b])))
    return at.gap + dot(normal, apart)


@compiled
def middle_gap(s: System, ws: Workspace, j: int) -> float:
    """Gap j at the middle of the trial just made, by one_gap(). Of a point of a pair by
    moved_gap(): from step.start if it was tracked when the step began, else from step.end.
    """
    i = j - ws.gap_counts[0].fixed
    if i < 0:
        return one_gap(s, ws, ws.step.middle, ws.step.q_middle, j)
    kin = ws.step.start if i < ws.step.scalars[0].start_point_count else ws.step.end
    return moved_gap(s, kin, ws.step.middle, ws.contacts.point_pair[i], ws.contacts.points[i])


@compiled
def approach_speed(s: System, kin: Kinematics, q: np.ndarray, k: int, at: np.record) -> float:
    """Speed, m/s, at which a point of pair k closes; ``kin``: of q and the velocities."""
    point, normal = vec(at.point), vec(at.normal)
    return (normal_velocity(s, kin, q, s.geoms[s.pairs[k].b].body, point, normal)
            - normal_velocity(s, kin, q, s.geoms[s.pairs[k].a].body, point, normal))


@compiled
def update_point_gaps(s: System, ws: Workspace, kin: Kinematics, h: float,
                      out: np.ndarray) -> None:
    """Write the gaps at the end of a trial step of h s to ``out``, in the order of ws.gaps: those
    of the pairs with tracked points and of these points. After update_gaps(). ``kin``: of the end,
    with its geoms.

    Tracked points that are not in the manifold at the end get FAR; so do all points of a pair that
    touches only at an internal edge. Points that touch and are not tracked yet are added.
    """
    counts, contacts = ws.gap_counts[0], ws.contacts
    first = counts.fixed - len(s.pairs)
    for i in range(counts.live - counts.fixed):
        out[counts.fixed + i] = FAR
    for k in range(len(s.pairs)):
        if contacts.first_point[k] == NONE:
            continue
        found, gap = find_manifold(s, kin, k, contacts.manifold), EXCLUDED
        for j in range(found):
            gap = min(gap, contacts.manifold[j].gap)
        if found == 0 or TRIANGLE in (s.geoms[s.pairs[k].a].kind, s.geoms[s.pairs[k].b].kind):
            gap = pair_gap(s, k, kin)
        out[first + k] = without_internal_edges(s, ws, kin, k, gap)
        if out[first + k] > gap:
            continue
        for j in range(found):
            at = contacts.manifold[j]
            i = find_point(ws, k, at.feature_id)
            if i == NONE and at.gap <= ws.step.scalars[0].touching:
                i = add_point(s, ws, kin, k, at, h)
            if i != NONE:
                out[counts.fixed + i] = at.gap


@compiled
def is_contact_of_step(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, k: int,
                       at: np.record, h: float) -> bool:
    """Whether ``at``, a point of pair k at the middle of a step of h s, is a contact of the step.

    A tracked point is one if its gap in contacts.gaps_active is at most scalars.touching. Any other
    is one if its gap at the step's start is at most SLOW h: too small for an impact. That gap is
    extrapolated back from the middle, by the approach speed there (0 if it recedes). ``kin``: of q
    and v at the middle.
    """
    i = find_point(ws, k, at.feature_id)
    if i != NONE:
        return ws.contacts.gaps_active[ws.gap_counts[0].fixed + i] <= ws.step.scalars[0].touching
    return at.gap + max(0.0, approach_speed(s, kin, q, k, at)) * h / 2 <= SLOW * h


@compiled
def has_point_gaps(s: System, ws: Workspace, j: int) -> bool:
    """Whether gap j is that of a pair whose points have their own."""
    k = j - (ws.gap_counts[0].fixed - len(s.pairs))
    return 0 <= k < len(s.pairs) and ws.contacts.first_point[k] != NONE
