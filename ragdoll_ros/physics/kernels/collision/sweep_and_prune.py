"""Sweep and prune: which dolls may touch within a time, by spheres around their bones.

Speeds count relative to each other, so that dolls that fall side by side do not pair. Where the
ground may deflect one of two dolls, its speed counts relative to the ground.
"""
from __future__ import annotations

import collections

import numpy as np

from ..compiling.decorators import compiled, entry, type_like
from ..maths.vectors import Vec3, add, divide, dot, norm, put, scale, sub, vec

MARGIN = 0.05
"""m that is added to the distance at which spheres overlap."""

IMPACT_SPEEDUP = 2.0
"""Largest speed after an impact, as a multiple of the speed before."""

DOLL_SPHERE = np.dtype([
    ('center', float, 3), ('displacement', float, 3), ('radius', float), ('ground_radius', float),
    ('sweep_radius', float), ('deflected', np.int64)], align=True)
"""A sphere around a doll. center: mean of its bones', m; displacement: their mean one in the time,
m. radius, m, and ground_radius: contain its bones for the time, in the frame of its mean velocity
and in the ground's. sweep_radius: see set_sweep_radii(). deflected: whether the ground may deflect
it, or one of its cluster."""

Dolls = collections.namedtuple(
    'Dolls', 'first reach ground order spheres radii ground_radii near_ground')
"""The d dolls of a scene of n bones. ``first`` (d + 1,): bone at which each begins, and n;
``reach`` (n,) m of each bone; ``ground`` (4,): its normal, and its offset, m, -inf: none.
``order`` (d,): of the centers along x, nearly. Scratch: ``spheres`` (d,); ``radii`` (n,) and
``ground_radii`` (n,) m of the bones' spheres, as of the dolls'; ``near_ground`` (d,): of each
cluster."""


def make_dolls(first: np.ndarray, reach: np.ndarray, normal: np.ndarray, offset: float) -> Dolls:
    """Make Dolls for find_pairs(). ``first`` (d + 1,), ``reach`` (n,), m: as in Dolls. ``normal``,
    ``offset``, m: of the ground; -inf: none.
    """
    count = len(first) - 1
    return Dolls(first, reach, np.array([*normal, offset], float), np.arange(count),
                 np.zeros(count, DOLL_SPHERE), np.zeros(len(reach)), np.zeros(len(reach)),
                 np.zeros(count, np.int64))


@compiled
def set_spheres(dolls: Dolls, states: np.ndarray, clusters: np.ndarray, ahead: float) -> None:
    """Write the spheres of all dolls and bones for ``ahead`` s, except sweep_radius. ``clusters``
    (d,): of each doll, for ``deflected``.
    """
    normal, offset = vec(dolls.ground), dolls.ground[3]
    for d in range(len(dolls.spheres)):
        dolls.near_ground[d] = 0
    for d in range(len(dolls.spheres)):
        sphere, first, end = dolls.spheres[d], dolls.first[d], dolls.first[d + 1]
        center, velocity = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for i in range(first, end):
            center, velocity = add(center, vec(states[i])), add(velocity, vec(states[i, 7:]))
        center, velocity = divide(center, end - first), divide(velocity, end - first)
        radius, ground_radius = 0.0, 0.0
        for i in range(first, end):
            own, reach = vec(states[i, 7:]), dolls.reach[i]
            still = reach + ahead * (reach * norm(vec(states[i, 10:]))) + MARGIN / 2
            dolls.radii[i] = still + ahead * norm(sub(own, velocity))
            dolls.ground_radii[i] = still + ahead * norm(own)
            away = norm(sub(vec(states[i]), center))
            radius = max(radius, away + dolls.radii[i])
            ground_radius = max(ground_radius, away + dolls.ground_radii[i])
            if dot(vec(states[i]), normal) - offset < dolls.ground_radii[i]:
                dolls.near_ground[clusters[d]] = 1
        put(sphere.center, center)
        put(sphere.displacement, scale(ahead, velocity))
        sphere.radius, sphere.ground_radius = radius, ground_radius
    for d in range(len(dolls.spheres)):
        dolls.spheres[d].deflected = dolls.near_ground[clusters[d]]


@compiled
def set_sweep_radii(spheres: np.ndarray) -> None:
    """Write sweep_radius, m: the radius of a sphere at rest around each doll. Such spheres overlap
    wherever the dolls' spheres do, swept along their displacements. It is radius + |u - w|;
    ground_radius + |w| if ``deflected``.

    For displacements u and v, and any common w: |u - v| <= |u - w| + |v - w|. The mean is used as
    w, to which deflected dolls contribute zero. If one of a pair is ``deflected``, speeds count
    relative to the ground: the other one's sphere must be wider by |u|. As |u| <= |u - w| + |w|,
    |w| is added to the radius of the deflected one.
    """
    total = (0.0, 0.0, 0.0)
    for d in range(len(spheres)):
        if not spheres[d].deflected:
            total = add(total, vec(spheres[d].displacement))
    common = divide(total, len(spheres))
    for d in range(len(spheres)):
        sphere = spheres[d]
        sphere.sweep_radius = (
            sphere.ground_radius + norm(common) if sphere.deflected
            else sphere.radius + norm(sub(vec(sphere.displacement), common)))


@compiled
def sort_along_x(spheres: np.ndarray, order: np.ndarray) -> None:
    """Sort ``order`` (d,) by the centers' x, by insertion: it is nearly so from the last time."""
    for k in range(1, len(order)):
        doll, at = order[k], k
        x = spheres[doll].center[0]
        while at > 0 and spheres[order[at - 1]].center[0] > x:
            order[at] = order[at - 1]
            at -= 1
        order[at] = doll


@compiled
def distance(a: Vec3, b: Vec3) -> float:
    """Distance, m, of two points."""
    return norm(sub(a, b))


@compiled
def may_touch(dolls: Dolls, states: np.ndarray, a: int, b: int) -> bool:
    """Whether the swept spheres of two dolls, and then those of two of their bones, meet. After
    set_spheres() and set_sweep_radii().
    """
    one, other = dolls.spheres[a], dolls.spheres[b]
    center = vec(one.center)
    apart = distance(center, vec(other.center))
    if not apart < one.sweep_radius + other.sweep_radius:
        return False
    closing = 0.0
    if one.deflected or other.deflected:
        radii, size = dolls.ground_radii, one.ground_radius + other.ground_radius
    else:
        radii = dolls.radii
        closing = distance(vec(one.displacement), vec(other.displacement))
        size = one.radius + other.radius
    if not apart < size + closing:
        return False
    for i in range(dolls.first[a], dolls.first[a + 1]):
        at, reach = vec(states[i]), radii[i] + closing
        for j in range(dolls.first[b], dolls.first[b + 1]):
            if distance(at, vec(states[j])) < reach + radii[j]:
                return True
    return False


DOLLS = type_like(make_dolls(np.zeros(1, np.int64), np.zeros(0), np.zeros(3), 0.0))
STATES, MASK, INDICES, PAIRS = (type_like(each) for each in (
    np.zeros((0, 13)), np.zeros(0, bool), np.zeros(0, np.int64), np.zeros((0, 2), np.int64)))


@entry(DOLLS, STATES, MASK, MASK, INDICES, type_like(0.0), PAIRS)
def find_pairs(dolls: Dolls, states: np.ndarray, moving: np.ndarray, yielding: np.ndarray,
               clusters: np.ndarray, ahead: float, pairs: np.ndarray) -> int:
    """Find the pairs of dolls that may touch within ``ahead`` s, by sweep and prune along x.

    ``states`` (n, 13) of all n bones. Of the d dolls: ``moving`` (d,): awake; ``yielding`` (d,):
    not kinematic; ``clusters`` (d,): index of the cluster, for set_spheres(): pairs within a
    cluster are found as well. A pair needs one that moves and one that yields, which may be the
    same. Dolls are swept for IMPACT_SPEEDUP times ``ahead``, as impacts may make them faster; what
    overlaps is tested by may_touch(). Writes the pairs, lower index first, to ``pairs`` (k, 2).
    Returns the number found; if it exceeds k, the others are not written. Overwrites dolls.order
    and the scratch of ``dolls``.
    """
    set_spheres(dolls, states, clusters, IMPACT_SPEEDUP * ahead)
    spheres, order, count, widest = dolls.spheres, dolls.order, 0, 0.0
    set_sweep_radii(spheres)
    sort_along_x(spheres, order)
    for d in range(len(order)):
        widest = max(widest, spheres[d].sweep_radius)
    for k in range(len(order)):
        a = order[k]
        far = spheres[a].center[0] + spheres[a].sweep_radius + widest
        for e in range(k + 1, len(order)):
            b = order[e]
            if spheres[b].center[0] > far:
                break
            if (moving[a] or moving[b]) and (yielding[a] or yielding[b]) and (
                    may_touch(dolls, states, a, b)):
                if count < len(pairs):
                    pairs[count] = min(a, b), max(a, b)
                count += 1
    return count
