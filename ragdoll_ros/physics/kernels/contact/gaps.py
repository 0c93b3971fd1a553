"""How far apart is all that may touch.

Gaps, in ``gaps``: of each geom's points from the ground, m; of each bound the room to its lower and
its upper side, rad; of each pair of geoms the separation, m.
"""
from __future__ import annotations

import math

import numpy as np

from ..collision.narrow_phase import separation
from ..collision.shapes import BOX, CAPSULE, SPHERE, extent, shape_at
from ..compiling.decorators import compiled
from ..dynamics.forward import Work, pose
from ..maths.quaternion import cross, times, to_matrix, turned
from ..maths.vectors import divide, norm, sub, vec
from ..system import OUTSIDE, WITHIN, Room, System

TOUCHING = 1e-6
"""m or rad: what is nearer touches."""

FAR = 0.02
"""m: nobody asks for the gap of what is farther apart, but that it is."""

NEAR = 5e-3
"""m: two bones that were apart by more, less twice what their speeds may have taken, are."""

NEARLY = 1e-3
"""m: two bones that began within each other collide from when they are no deeper than this."""

BEYOND = 2e-3
"""rad by which a joint is outside its limits."""

BURIED = 1e-3
"""m: what is deeper in the ground comes out whatever it costs; bones, as far as the motion pays."""

NEVER = 1e6
"""m: the gap of two bones that do not collide."""


@compiled
def place_geoms(tree: np.ndarray, root_of: np.ndarray, geoms: np.ndarray, work: Work,
                q: np.ndarray, centres: np.ndarray, turns: np.ndarray) -> None:
    """Centres (g, 3) m and rotation matrices (g, 3, 3) of all geoms; work is posed at q."""
    for k in range(len(geoms)):
        geom = geoms[k]
        i = geom.bone
        t, c, root = work.turns[i], work.centres[i], tree[root_of[i]].q
        x, y, z = turned(t[0], t[1], t[2], t[3], geom.offset[0], geom.offset[1], geom.offset[2])
        at = centres[k]
        at[0], at[1], at[2] = q[root] + c[0] + x, q[root + 1] + c[1] + y, q[root + 2] + c[2] + z
        x, y, z, w = times(t[0], t[1], t[2], t[3], geom.turn[0], geom.turn[1], geom.turn[2],
                           geom.turn[3])
        to_matrix(x, y, z, w, turns[k])


@compiled
def ground_gaps(geom: np.record, at: np.ndarray, turn: np.ndarray, n: np.ndarray, offset: float,
                out: np.ndarray) -> None:
    """Heights of a geom's points over the ground: see ground_point()."""
    high = at[0] * n[0] + at[1] * n[1] + at[2] * n[2] - offset
    first = geom.first
    if high > geom.radius + FAR:
        for k in range(geom.count):
            out[first + k] = high - geom.radius
        return
    a = turn[0, 0] * n[0] + turn[1, 0] * n[1] + turn[2, 0] * n[2]
    b = turn[0, 1] * n[0] + turn[1, 1] * n[1] + turn[2, 1] * n[2]
    c = turn[0, 2] * n[0] + turn[1, 2] * n[1] + turn[2, 2] * n[2]
    size = geom.size
    if geom.kind == SPHERE:
        out[first] = high - size[0]
    elif geom.kind == CAPSULE:
        out[first], out[first + 1] = high - size[1] * c - size[0], high + size[1] * c - size[0]
    elif geom.kind == BOX:
        a, b, c = a * size[0], b * size[1], c * size[2]
        for k in range(8):
            out[first + k] = (high + (a if k & 1 else -a) + (b if k & 2 else -b)
                              + (c if k & 4 else -c))
    else:
        low = size[0] * math.sqrt(max(0.0, 1 - c * c))
        a, b, c = a * size[0], b * size[0], c * size[1]
        flat = low < 0.1 * size[0]
        for end in range(2):
            rim, here = high + (c if end else -c), first + 5 * end
            out[here] = rim - low
            out[here + 1] = rim + a if flat else rim
            out[here + 2] = rim - a if flat else rim
            out[here + 3] = rim + b if flat else rim
            out[here + 4] = rim - b if flat else rim
            if not flat:
                for k in range(1, 5):
                    out[here + k] = max(rim, FAR)


@compiled
def ground_point(geom: np.record, k: int, at: np.ndarray, turn: np.ndarray, n: np.ndarray,
                 out: np.ndarray) -> None:
    """Point k (3,) m of a geom: a ball's lowest, a capsule's two, a box's corners; of each end of
    a cylinder its lowest and four corners of its rim.
    """
    size = geom.size
    x = y = z = 0.0
    if geom.kind <= CAPSULE:
        z = 0.0 if geom.kind == SPHERE else (size[1] if k else -size[1])
        for j in range(3):
            out[j] = at[j] + turn[j, 2] * z - size[0] * n[j]
        return
    if geom.kind == BOX:
        x, y, z = (size[0] if k & 1 else -size[0], size[1] if k & 2 else -size[1],
                   size[2] if k & 4 else -size[2])
    else:
        z, k = (size[1] if k >= 5 else -size[1]), k % 5
        if k == 0:
            x = -(turn[0, 0] * n[0] + turn[1, 0] * n[1] + turn[2, 0] * n[2])
            y = -(turn[0, 1] * n[0] + turn[1, 1] * n[1] + turn[2, 1] * n[2])
            far = math.sqrt(x * x + y * y)
            x, y = (x * size[0] / far, y * size[0] / far) if far > 1e-12 else (size[0], 0.0)
        else:
            x = (0.0, size[0], -size[0], 0.0, 0.0)[k]
            y = (0.0, 0.0, 0.0, size[0], -size[0])[k]
    for j in range(3):
        out[j] = at[j] + turn[j, 0] * x + turn[j, 1] * y + turn[j, 2] * z


@compiled
def all_gaps(s: System, q: np.ndarray, r: Room, before: np.ndarray, h: float,
             out: np.ndarray) -> None:
    """All gaps; work is posed at q. ``before``: those h s earlier; h infinite: unknown. What bones
    were moved and turned since beside their velocities: r.own[:, 2] m, r.own[:, 3] rad.
    """
    place_geoms(s.tree, s.root_of, s.geoms, r.work, q, r.at, r.turn)
    n = 0
    for k in range(len(s.geoms)):
        if s.offset[0] > -math.inf:
            ground_gaps(s.geoms[k], r.at[k], r.turn[k], s.normal, s.offset[0], out)
        n += s.geoms[k].count
    for k in range(len(s.bounds)):
        bound = s.bounds[k]
        out[n], out[n + 1] = q[bound.q] - bound.lower, bound.upper - q[bound.q]
        n += 2
    if len(s.pairs):
        for i in range(len(s.tree)):
            x, y, z, w = bone_velocity(r.work, i)
            r.own[i, 0], r.own[i, 1] = math.sqrt(x * x + y * y + z * z), w
    for k in range(len(s.pairs)):
        if k < len(r.within) and r.within[k]:
            out[n + k] = NEVER
            continue
        a, b = s.geoms[s.pairs[k].a], s.geoms[s.pairs[k].b]
        least = before[n + k] - 2 * (
            way(r.own[a.bone], a.reach, h) + way(r.own[b.bone], b.reach, h))
        out[n + k] = least if least > NEAR else pair_gap(
            a, b, r.at[s.pairs[k].a], r.turn[s.pairs[k].a], r.at[s.pairs[k].b],
            r.turn[s.pairs[k].b])


@compiled
def way(own: np.ndarray, reach: float, h: float) -> float:
    """How far, m, a point of a bone within its reach goes in h s; see all_gaps()."""
    return h * (own[0] + own[1] * reach) + own[2] + own[3] * reach


@compiled
def part_pairs(s: System, r: Room, q: np.ndarray, v: np.ndarray) -> bool:
    """Let those collide from now on that were within each other and have come apart, and those with
    a joint in between that was outside its limits and is back: nothing is to hold that back.
    Whether there are any, whose gaps are not known yet.
    """
    some = False
    for k in range(len(r.within)):
        some |= r.within[k] != 0
    if not some:
        return False
    some = False
    pose(s.tree, q, v, r.work)
    place_geoms(s.tree, s.root_of, s.geoms, r.work, q, r.at, r.turn)
    for i in range(len(s.tree)):
        r.own[i, 0] = 0.0
    for k in range(len(s.bounds)):
        bound = s.bounds[k]
        if max(bound.lower - q[bound.q], q[bound.q] - bound.upper) > 2 * BEYOND:
            r.own[s.bone_of[bound.v], 0] = 1.0
    for k in range(len(r.within)):
        a, b, before = s.pairs[k].a, s.pairs[k].b, r.within[k]
        if r.within[k] & WITHIN and pair_gap(s.geoms[a], s.geoms[b], r.at[a], r.turn[a], r.at[b],
                                             r.turn[b]) > -NEARLY:
            r.within[k] &= ~WITHIN
        if r.within[k] & OUTSIDE and not outside_between(s, r, s.geoms[a].bone, s.geoms[b].bone):
            r.within[k] &= ~OUTSIDE
        some |= before != 0 and r.within[k] == 0
    return some


@compiled
def outside_between(s: System, r: Room, i: int, j: int) -> bool:
    """Whether a joint on the way from one bone to another is marked in r.own; parents stand before
    their children.
    """
    while i != j:
        if i < j:
            i, j = j, i
        if r.own[i, 0] > 0:
            return True
        i = s.tree[i].parent
    return False


@compiled
def bone_velocity(work: Work, i: int) -> tuple[float, float, float, float]:
    """Velocity (3) m/s of a bone's centre and its angular speed, rad/s; work is posed."""
    m, c = work.moves[i], work.centres[i]
    x, y, z = cross(m[0], m[1], m[2], c[0], c[1], c[2])
    return (m[3] + x, m[4] + y, m[5] + z, math.sqrt(m[0] ** 2 + m[1] ** 2 + m[2] ** 2))


@compiled
def pair_gap(a: np.record, b: np.record, pa: np.ndarray, ra: np.ndarray, pb: np.ndarray,
             rb: np.ndarray) -> float:
    """Separation of two geoms, m; of what is farther apart than NEAR, a bound below it: that of
    spheres around them, then that along the line of their centres.
    """
    c = sub(vec(pa), vec(pb))
    length = norm(c)
    far = length - (a.radius + b.radius)
    if far > NEAR:
        return far
    one, other = shape_at(a, pa, ra), shape_at(b, pb, rb)
    if length > NEAR:
        n = divide(c, length)
        far = length - extent(one, n) - extent(other, n)
        if far > NEAR:
            return far
    return separation(one, other, NEAR)


@compiled
def of_limit(s: System, gaps: np.ndarray, j: int) -> bool:
    """Whether gap j of all is a joint's from a limit, in rad."""
    first = first_limit(s, gaps)
    return first <= j < first + 2 * len(s.bounds)


@compiled
def first_limit(s: System, gaps: np.ndarray) -> int:
    """The first of all gaps that is a joint's from a limit."""
    return len(gaps) - len(s.pairs) - 2 * len(s.bounds)


@compiled
def look(s: System, r: Room, q: np.ndarray, v: np.ndarray, before: np.ndarray, h: float,
         out: np.ndarray) -> None:
    """Pose all at q and v, and enter all gaps; see all_gaps()."""
    pose(s.tree, q, v, r.work)
    all_gaps(s, q, r, before, h, out)
