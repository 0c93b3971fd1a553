"""What touches: gaps of all that may touch, contacts with whole patches, and their rows.

Gaps, in ``gaps``: of each geom's points from the ground, m; of each bound the room to its lower and
its upper side, rad; of each pair of geoms the separation, m.
"""
from __future__ import annotations

import math

import numpy as np

from .collision import collide, separation
from .dynamics import Work, pose
from .machine import compiled
from .quaternion import cross, times, to_matrix, turned
from .system import OUTSIDE, WITHIN, Room, System
from .transcendental import asinh

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

SEGMENT = 0.5
"""Mean distance of a segment's points from its middle over that of its ends."""


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
    if geom.kind == 0:
        out[first] = high - size[0]
    elif geom.kind == 1:
        out[first], out[first + 1] = high - size[1] * c - size[0], high + size[1] * c - size[0]
    elif geom.kind == 2:
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
    if geom.kind <= 1:
        z = 0.0 if geom.kind == 0 else (size[1] if k else -size[1])
        for j in range(3):
            out[j] = at[j] + turn[j, 2] * z - size[0] * n[j]
        return
    if geom.kind == 2:
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
    """All gaps; work is posed at q. ``before``: those h s earlier; h infinite: unknown."""
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
        least = before[n + k] - 2 * h * (
            r.own[a.bone, 0] + r.own[b.bone, 0] + r.own[a.bone, 1] * a.reach
            + r.own[b.bone, 1] * b.reach)
        out[n + k] = least if least > NEAR else pair_gap(
            a, b, r.at[s.pairs[k].a], r.turn[s.pairs[k].a], r.at[s.pairs[k].b],
            r.turn[s.pairs[k].b])


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
    """Separation of two geoms, m; of what is farther apart than NEAR, a bound below it."""
    far = math.sqrt((pa[0] - pb[0]) ** 2 + (pa[1] - pb[1]) ** 2 + (pa[2] - pb[2]) ** 2) - (
        a.radius + b.radius)
    if far > NEAR:
        return far
    return separation(a.kind, a.size, pa, ra, b.kind, b.size, pb, rb)


@compiled
def of_limit(s: System, gaps: np.ndarray, j: int) -> bool:
    """Whether gap j of all is a joint's from a limit, in rad."""
    first = len(gaps) - len(s.pairs) - 2 * len(s.bounds)
    return first <= j < first + 2 * len(s.bounds)


@compiled
def find_contacts(s: System, q: np.ndarray, r: Room, gaps: np.ndarray, margin: float) -> int:
    """Enter all contacts whose gap in ``gaps`` says that they touch, as they are at q, into
    r.contacts; of a pair those points that are nearer than ``margin``. Their number.

    Work is posed at q and the geoms are placed.
    """
    m, n, most = 0, 0, len(r.contacts)
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if s.offset[0] > -math.inf:
            for j in range(geom.count):
                if gaps[n + j] <= TOUCHING and m < most:
                    c = r.contacts[m]
                    c.kind = 5 if geom.rolling > 0 else 3
                    c.a, c.b, c.key, c.group = geom.bone, -1, n + j, k
                    ground_point(geom, j, r.at[k], r.turn[k], s.normal, c.point)
                    high = -s.offset[0]
                    for e in range(3):
                        c.normal[e] = s.normal[e]
                        high += c.point[e] * s.normal[e]
                    c.gap = high
                    c.friction, c.rolling = geom.friction, geom.rolling
                    c.restitution = geom.restitution
                    m += 1
        n += geom.count
    for k in range(len(s.bounds)):
        for side in range(2):
            if gaps[n + side] <= TOUCHING and m < most:
                c, bound = r.contacts[m], s.bounds[k]
                c.kind, c.a, c.b, c.key, c.group = 1, bound.v, -1, n + side, -1
                c.normal[0] = 1.0 if side == 0 else -1.0
                c.gap = q[bound.q] - bound.lower if side == 0 else bound.upper - q[bound.q]
                c.friction = c.rolling = c.restitution = 0.0
                m += 1
        n += 2
    for k in range(len(s.pairs)):
        if gaps[n + k] <= TOUCHING:
            m = enter_pair(s, k, r, m, margin, n + len(s.pairs) + 4096 * k)
    arms(s, r, m)
    return m


@compiled
def enter_pair(s: System, k: int, r: Room, m: int, margin: float, key: int) -> int:
    """Enter the points of a pair's patch; the number of contacts after."""
    pair = s.pairs[k]
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    found = collide(a.kind, a.size, r.at[pair.a], r.turn[pair.a], b.kind, b.size, r.at[pair.b],
                    r.turn[pair.b], margin, r.table)
    for j in range(found):
        if m >= len(r.contacts):
            break
        c, row = r.contacts[m], r.table[j]
        c.kind = 5 if pair.rolling > 0 else 3
        c.a, c.b, c.key, c.group = a.bone, b.bone, key + int(row[7]), len(s.geoms) + k
        for e in range(3):
            c.point[e], c.normal[e] = row[e], row[3 + e]
        c.gap = row[6]
        c.friction, c.rolling, c.restitution = pair.friction, pair.rolling, pair.restitution
        m += 1
    return m


@compiled
def arms(s: System, r: Room, m: int) -> None:
    """Where friction acts: in a patch nearer its middle than the points that bear it.

    Under an even pressure p a patch that turns about its middle brakes with mu times the integral
    of p times the distance: with the mean distance of its area, not that of its corners.
    """
    c = 0
    while c < m:
        d = c + 1
        group = r.contacts[c].group
        while d < m and r.contacts[d].group == group and group >= 0:
            d += 1
        for e in range(c, d):
            basis(r.contacts[e])
            for k in range(3):
                r.contacts[e].arm[k] = r.contacts[e].point[k]
        if d - c > 2 and group < len(s.geoms) and s.geoms[group].kind == 3:
            on_disc(s.geoms[group], r.at[group], r.turn[group], r.contacts, c, d)
        elif d - c > 1:
            shrink(r, c, d)
        c = d


@compiled
def on_disc(geom: np.record, at: np.ndarray, turn: np.ndarray, contacts: np.ndarray, begin: int,
            end: int) -> None:
    """Draw the arms of a cylinder's face, which stands on the ground, to two thirds of its radius,
    the mean distance of a disc.
    """
    c = contacts[begin]
    side = turn[0, 2] * c.normal[0] + turn[1, 2] * c.normal[1] + turn[2, 2] * c.normal[2]
    low = -geom.size[1] if side > 0 else geom.size[1]
    for e in range(begin, end):
        c = contacts[e]
        for k in range(3):
            middle = at[k] + turn[k, 2] * low
            c.arm[k] = middle + 2 / 3 * (c.point[k] - middle)


@compiled
def basis(c: np.record) -> None:
    """Two directions across a contact's normal."""
    n = c.normal
    if abs(n[2]) > 0.7:
        x, y, z = 1 - n[0] * n[0], -n[0] * n[1], -n[0] * n[2]
    else:
        x, y, z = -n[2] * n[0], -n[2] * n[1], 1 - n[2] * n[2]
    size = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    c.across[0, 0], c.across[0, 1], c.across[0, 2] = x, y, z
    c.across[1, 0], c.across[1, 1], c.across[1, 2] = cross(n[0], n[1], n[2], x, y, z)


@compiled
def shrink(r: Room, begin: int, end: int) -> None:
    """Draw the arms of one patch towards the middle by the ratio of the mean distances."""
    contacts, count = r.contacts, end - begin
    x = y = z = 0.0
    for e in range(begin, end):
        p = contacts[e].point
        x, y, z = x + p[0] / count, y + p[1] / count, z + p[2] / count
    t, w = contacts[begin].across[0], contacts[begin].across[1]
    flat = r.solver  # room for angle, and the place along t and w, in the order of the angles
    corners = 0.0
    for e in range(begin, end):
        p = contacts[e].point
        a, b, c = p[0] - x, p[1] - y, p[2] - z
        u, v = a * t[0] + b * t[1] + c * t[2], a * w[0] + b * w[1] + c * w[2]
        corners += math.sqrt(u * u + v * v) / count
        angle, k = way(u, v), e - begin
        while k > 0 and flat[0, k - 1] > angle:
            flat[0, k], flat[1, k], flat[2, k] = flat[0, k - 1], flat[1, k - 1], flat[2, k - 1]
            k -= 1
        flat[0, k], flat[1, k], flat[2, k] = angle, u, v
    area = moment = 0.0
    for k in range(count):
        j = (k + 1) % count
        part, mean = triangle(flat[1, k], flat[2, k], flat[1, j], flat[2, j])
        area, moment = area + part, moment + mean
    share = SEGMENT
    if area > 1e-3 * corners * corners:
        share = min(1.0, moment / area / corners)
    elif corners == 0.0:
        share = 1.0
    for e in range(begin, end):
        c = contacts[e]
        c.arm[0] = x + share * (c.point[0] - x)
        c.arm[1] = y + share * (c.point[1] - y)
        c.arm[2] = z + share * (c.point[2] - z)


@compiled
def way(x: float, y: float) -> float:
    """What orders directions as their angle does: -2 to 2 for -pi to pi."""
    size = abs(x) + abs(y)
    return math.copysign(1 - x / size, y) if size > 0.0 else 0.0


@compiled
def triangle(ax: float, ay: float, bx: float, by: float) -> tuple[float, float]:
    """Area of the triangle of the origin, a and b, and the integral over it of the distance from
    the origin: d^3/6 (sec tan + ln(sec + tan)) from foot to corner, d the height of the side ab.
    """
    area = (ax * by - ay * bx) / 2
    side = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    if not area > 0.0 or side == 0.0:
        return 0.0, 0.0
    height = 2 * area / side
    along = (bx * (bx - ax) + by * (by - ay)) / side
    before = (ax * (bx - ax) + ay * (by - ay)) / side
    return area, height ** 3 / 6 * (sector(along / height) - sector(before / height))


@compiled
def sector(tangent: float) -> float:
    """The sum sec tan + ln(sec + tan) of the angle of that tangent."""
    return tangent * math.sqrt(1 + tangent * tangent) + asinh(tangent)


@compiled
def jacobian(s: System, q: np.ndarray, r: Room, c: np.record, index: int, v: np.ndarray,
             free: np.ndarray, b: np.ndarray, was: np.ndarray) -> None:
    """The velocities that a contact's rows see, descending, into r.support, and the rows' entries
    for these into r.Y from c.row on; its velocities under ``free`` into b, under v into ``was``.
    """
    row, Y, list_ = c.row, r.Y, r.support[index]
    for k in range(c.kind):
        b[row + k] = was[row + k] = 0.0
    if c.kind == 1:
        j, n = c.a, 0
        b[row], was[row] = c.normal[0] * free[j], c.normal[0] * v[j]
        while j >= 0:
            list_[n], Y[row, n] = j, 0.0
            n, j = n + 1, s.up[j]
        Y[row, 0], c.support = c.normal[0], n
        return
    i, k = s.last[c.a], -1
    if c.b >= 0:
        k = s.last[c.b]
    n = 0
    while i >= 0 or k >= 0:
        j = max(i, k)
        list_[n] = j
        for e in range(c.kind):
            Y[row + e, n] = 0.0
        if i == j:
            add_column(r.work.axes[j], q, s.tree[s.root_of[c.a]].q, c, 1.0, Y, n)
            i = s.up[i]
        if k == j:
            add_column(r.work.axes[j], q, s.tree[s.root_of[c.b]].q, c, -1.0, Y, n)
            k = s.up[k]
        for e in range(c.kind):
            b[row + e] += Y[row + e, n] * free[j]
            was[row + e] += Y[row + e, n] * v[j]
        n += 1
    c.support = n


@compiled
def add_column(axis: np.ndarray, q: np.ndarray, at: int, c: np.record, sign: float,
               Y: np.ndarray, j: int) -> None:
    """Add what a velocity of a bone, whose root stands in q at ``at``, does to column j of a
    contact's rows.
    """
    row = c.row
    n, t, w = c.normal, c.across[0], c.across[1]
    x, y, z = cross(axis[0], axis[1], axis[2], c.point[0] - q[at], c.point[1] - q[at + 1],
                    c.point[2] - q[at + 2])
    Y[row, j] += sign * (n[0] * (axis[3] + x) + n[1] * (axis[4] + y) + n[2] * (axis[5] + z))
    x, y, z = cross(axis[0], axis[1], axis[2], c.arm[0] - q[at], c.arm[1] - q[at + 1],
                    c.arm[2] - q[at + 2])
    x, y, z = axis[3] + x, axis[4] + y, axis[5] + z
    Y[row + 1, j] += sign * (t[0] * x + t[1] * y + t[2] * z)
    Y[row + 2, j] += sign * (w[0] * x + w[1] * y + w[2] * z)
    if c.kind == 5:
        Y[row + 3, j] += sign * (t[0] * axis[0] + t[1] * axis[1] + t[2] * axis[2])
        Y[row + 4, j] += sign * (w[0] * axis[0] + w[1] * axis[1] + w[2] * axis[2])


@compiled
def through_factor(up: np.ndarray, H: np.ndarray, Y: np.ndarray, seen: np.ndarray, c: np.record,
                   place: np.ndarray) -> None:
    """Put L^-T J^T in place of a contact's rows; ``seen``: the velocities that they see; ``place``
    (nv,): room for where these stand in the rows.
    """
    for n in range(c.support):
        place[seen[n]] = n
    for e in range(c.row, c.row + c.kind):
        for n in range(c.support):
            i = seen[n]
            Y[e, n] /= H[i, i]
            f, j = Y[e, n], up[i]
            while j >= 0:
                Y[e, place[j]] -= H[i, j] * f
                j = up[j]


@compiled
def contact_rates(s: System, r: Room, q: np.ndarray, v: np.ndarray, c: np.record) -> None:
    """Enter a contact's velocities along its rows into c.start; work is posed at q and v."""
    if c.kind == 1:
        c.start[0] = c.normal[0] * v[c.a]
        return
    n, t, w = c.normal, c.across[0], c.across[1]
    for e in range(5):
        c.start[e] = 0.0
    for side in range(2 if c.b >= 0 else 1):
        i, sign = (c.a, 1.0) if side == 0 else (c.b, -1.0)
        m, root = r.work.moves[i], s.tree[s.root_of[i]].q
        x, y, z = cross(m[0], m[1], m[2], c.point[0] - q[root], c.point[1] - q[root + 1],
                        c.point[2] - q[root + 2])
        c.start[0] += sign * (n[0] * (m[3] + x) + n[1] * (m[4] + y) + n[2] * (m[5] + z))
        x, y, z = cross(m[0], m[1], m[2], c.arm[0] - q[root], c.arm[1] - q[root + 1],
                        c.arm[2] - q[root + 2])
        x, y, z = m[3] + x, m[4] + y, m[5] + z
        c.start[1] += sign * (t[0] * x + t[1] * y + t[2] * z)
        c.start[2] += sign * (w[0] * x + w[1] * y + w[2] * z)
        c.start[3] += sign * (t[0] * m[0] + t[1] * m[1] + t[2] * m[2])
        c.start[4] += sign * (w[0] * m[0] + w[1] * m[1] + w[2] * m[2])


@compiled
def look(s: System, r: Room, q: np.ndarray, v: np.ndarray, before: np.ndarray, h: float,
         out: np.ndarray) -> None:
    """Pose all at q and v, and enter all gaps; see all_gaps()."""
    pose(s.tree, q, v, r.work)
    all_gaps(s, q, r, before, h, out)
