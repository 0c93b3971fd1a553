"""All that is compiled: vectors, kinematics and dynamics of dolls in the air, steps, sums.

Dynamics: Featherstone's articulated-body algorithm (Rigid Body Dynamics Algorithms, 2008, table
7.1). All spatial vectors, angular part first, are along the world's axes about a point that stands
where the doll's root is at that instant: nothing is transformed from bone to bone, and nothing
loses digits far from the origin. A joint of several axes is a row of hinges with no mass between.

``tree`` is the table of tree.py. q and v are those of GeneralizedState, but where angular
velocities of roots are said to be the roots' own they are along the root's axes: so a steady spin
hardly changes them.
"""
from __future__ import annotations

import collections
import math

import numba
import numpy as np

from .dop853 import CONTINUED, ERRORS, STAGES
from .machine import ANY_ROW, COUNTS, FLAGS, REAL, ROW, TABLE, TREE, YES, compiled, entry, inlined

SLOWEST = 0.1
"""s: an error of 1 in a velocity counts as much as one of this in its coordinate."""


@compiled
def times(ax: float, ay: float, az: float, aw: float, bx: float, by: float, bz: float,
          bw: float) -> tuple[float, float, float, float]:
    """Hamilton product a * b of two quaternions: first b, then a."""
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


@compiled
def turned(x: float, y: float, z: float, w: float, a: float, b: float,
           c: float) -> tuple[float, float, float]:
    """The vector (a, b, c) of a body's frame in the outer frame; with -w: the other way."""
    d, e, f = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * d + y * f - z * e, b + w * e + z * d - x * f, c + w * f + x * e - y * d


@compiled
def cross(ax: float, ay: float, az: float, bx: float, by: float,
          bz: float) -> tuple[float, float, float]:
    """Cross product of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled
def to_matrix(x: float, y: float, z: float, w: float, out: np.ndarray) -> None:
    """Rotation matrix (3, 3) of a quaternion."""
    out[0, 0] = x * x - y * y - z * z + w * w
    out[1, 1] = y * y - x * x - z * z + w * w
    out[2, 2] = z * z - x * x - y * y + w * w
    out[0, 1], out[1, 0] = 2 * (x * y - z * w), 2 * (x * y + z * w)
    out[0, 2], out[2, 0] = 2 * (x * z + y * w), 2 * (x * z - y * w)
    out[1, 2], out[2, 1] = 2 * (y * z - x * w), 2 * (y * z + x * w)


@compiled
def solve(a: np.ndarray, b: np.ndarray) -> None:
    """Put the x of a x = b in b's place, by Cholesky; a is symmetric and positive, and is lost."""
    n = len(b)
    for j in range(n):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        a[j, j] = math.sqrt(a[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]
    for j in range(n):
        for k in range(j):
            b[j] -= a[j, k] * b[k]
        b[j] /= a[j, j]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            b[j] -= a[k, j] * b[k]
        b[j] /= a[j, j]


Work = collections.namedtuple(
    'Work', 'turns centres moves axes inertias biases drifts pulls matrix')
"""Room for n bones and nv velocities: turns (n, 4) from the bind pose, centres of mass (n, 3) from
the root, spatial velocities (n, 6), motion subspaces (nv, 6), articulated inertias (n, 6, 6),
bias forces (n, 6), what is left of an axis' acceleration at dv/dt = 0 (nv, 6), and of each axis the
inertia times it, the inverse of its own part and the force along it (nv, 8); a matrix (3, 3)."""


@compiled
def room(bones: int, velocities: int) -> Work:
    """Room to work in."""
    return Work(np.empty((bones, 4)), np.empty((bones, 3)), np.empty((bones, 6)),
                np.empty((velocities, 6)), np.empty((bones, 6, 6)), np.empty((bones, 6)),
                np.empty((velocities, 6)), np.empty((velocities, 8)), np.empty((3, 3)))


@compiled
def pose(tree: np.ndarray, q: np.ndarray, v: np.ndarray, work: Work) -> None:
    """Go from the roots to the leaves: turns, centres, velocities and axes."""
    turns, centres, moves, axes = work.turns, work.centres, work.moves, work.axes
    for i in range(len(tree)):
        bone = tree[i]
        at, rate, up = bone.q, bone.v, bone.parent
        if up < 0:
            x, y, z, w = q[at + 3], q[at + 4], q[at + 5], q[at + 6]
            moves[i, 0], moves[i, 1], moves[i, 2] = turned(
                x, y, z, w, v[rate + 3], v[rate + 4], v[rate + 5])
            moves[i, 3], moves[i, 4], moves[i, 5] = v[rate], v[rate + 1], v[rate + 2]
            centres[i, 0] = centres[i, 1] = centres[i, 2] = 0.0
            turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3] = times(
                x, y, z, w, -bone.bind[0], -bone.bind[1], -bone.bind[2], bone.bind[3])
            continue
        x, y, z, w = turns[up, 0], turns[up, 1], turns[up, 2], turns[up, 3]
        a, b, c = turned(x, y, z, w, bone.before[0], bone.before[1], bone.before[2])
        a, b, c = centres[up, 0] + a, centres[up, 1] + b, centres[up, 2] + c
        for k in range(6):
            moves[i, k] = moves[up, k]
        if bone.free:
            # frame * q * frame^-1: the joint's frame is not that of the doll
            d, e, f = q[at], q[at + 1], q[at + 2]
            x, y, z, w = times(
                x, y, z, w, bone.axes[0, 0] * d + bone.axes[1, 0] * e + bone.axes[2, 0] * f,
                bone.axes[0, 1] * d + bone.axes[1, 1] * e + bone.axes[2, 1] * f,
                bone.axes[0, 2] * d + bone.axes[1, 2] * e + bone.axes[2, 2] * f, q[at + 3])
        for k in range(bone.dof):
            d, e, f = bone.axes[k, 0], bone.axes[k, 1], bone.axes[k, 2]
            sx, sy, sz = turned(x, y, z, w, d, e, f)
            axes[rate, 0], axes[rate, 1], axes[rate, 2] = sx, sy, sz
            axes[rate, 3], axes[rate, 4], axes[rate, 5] = cross(a, b, c, sx, sy, sz)
            for j in range(6):
                moves[i, j] += axes[rate, j] * v[rate]
            if not bone.free:
                sine, cosine = math.sin(q[at + k] / 2), math.cos(q[at + k] / 2)
                x, y, z, w = times(x, y, z, w, d * sine, e * sine, f * sine, cosine)
            rate += 1
        turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3] = x, y, z, w
        d, e, f = turned(x, y, z, w, bone.after[0], bone.after[1], bone.after[2])
        centres[i, 0], centres[i, 1], centres[i, 2] = a + d, b + e, c + f


@compiled
def accelerations(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray,
                  v: np.ndarray, work: Work, out: np.ndarray) -> None:
    """Rates of change (nv,) of v. ``loads`` (m, 11): the bone's place in the scene, force and
    torque, the force's point on the bone, and 1 if all are along the bone's axes.
    """
    pose(tree, q, v, work)
    for i in range(len(tree)):
        _inertia(tree[i], work.turns[i], work.centres[i], work.moves[i], work.inertias[i],
                 work.biases[i], loads, work.matrix)
    for i in range(len(tree) - 1, -1, -1):
        if tree[i].parent >= 0:
            aba_backward(tree[i], i, v, work)
    for i in range(len(tree)):
        bone, bias, move = tree[i], work.biases[i], work.moves[i]
        if bone.parent < 0:
            for k in range(6):
                bias[k] = -bias[k]
            solve(work.inertias[i], bias)
            at, rate = bone.q + 3, bone.v
            x, y, z = cross(move[0], move[1], move[2], move[3], move[4], move[5])
            out[rate] = bias[3] + x + gravity[0]
            out[rate + 1] = bias[4] + y + gravity[1]
            out[rate + 2] = bias[5] + z + gravity[2]
            out[rate + 3], out[rate + 4], out[rate + 5] = turned(
                q[at], q[at + 1], q[at + 2], -q[at + 3], bias[0], bias[1], bias[2])
        else:
            aba_forward(bone, i, work, out)


@inlined
def _inertia(bone: np.record, turn: np.ndarray, centre: np.ndarray, move: np.ndarray,
             inertia: np.ndarray, bias: np.ndarray, loads: np.ndarray, matrix: np.ndarray) -> None:
    """A bone's own inertia, and the force that its motion and loads ask for."""
    a, b, c, d = times(turn[0], turn[1], turn[2], turn[3], bone.bind[0], bone.bind[1],
                       bone.bind[2], bone.bind[3])
    to_matrix(a, b, c, d, matrix)
    x, y, z, mass = centre[0], centre[1], centre[2], bone.mass
    far = mass * (x * x + y * y + z * z)
    for j in range(3):
        for k in range(j, 3):
            value = -mass * centre[j] * centre[k] + (far if j == k else 0.0)
            for e in range(3):
                value += matrix[j, e] * bone.inertia[e] * matrix[k, e]
            inertia[j, k] = inertia[k, j] = value
            inertia[3 + j, 3 + k] = inertia[3 + k, 3 + j] = mass if j == k else 0.0
        inertia[j, 3 + j] = inertia[3 + j, j] = 0.0
    inertia[0, 4] = inertia[4, 0] = -mass * z
    inertia[0, 5] = inertia[5, 0] = mass * y
    inertia[1, 3] = inertia[3, 1] = mass * z
    inertia[1, 5] = inertia[5, 1] = -mass * x
    inertia[2, 3] = inertia[3, 2] = -mass * y
    inertia[2, 4] = inertia[4, 2] = mass * x
    wx, wy, wz, vx, vy, vz = move[0], move[1], move[2], move[3], move[4], move[5]
    # momentum p, n = I (w, v) and the force (w, v) x* (n, p) that turns it
    ax, ay, az = cross(wx, wy, wz, x, y, z)
    px, py, pz = mass * (vx + ax), mass * (vy + ay), mass * (vz + az)
    ax, ay, az = cross(x, y, z, vx, vy, vz)
    nx = inertia[0, 0] * wx + inertia[0, 1] * wy + inertia[0, 2] * wz + mass * ax
    ny = inertia[1, 0] * wx + inertia[1, 1] * wy + inertia[1, 2] * wz + mass * ay
    nz = inertia[2, 0] * wx + inertia[2, 1] * wy + inertia[2, 2] * wz + mass * az
    ax, ay, az = cross(vx, vy, vz, px, py, pz)
    nx, ny, nz = cross(wx, wy, wz, nx, ny, nz)
    bias[0], bias[1], bias[2] = nx + ax, ny + ay, nz + az
    bias[3], bias[4], bias[5] = cross(wx, wy, wz, px, py, pz)
    for i in range(len(loads)):
        load = loads[i]
        if load[0] == bone.bone:
            ax, ay, az, nx, ny, nz = load[1], load[2], load[3], load[4], load[5], load[6]
            if load[10] > 0:
                ax, ay, az = turned(a, b, c, d, ax, ay, az)
                nx, ny, nz = turned(a, b, c, d, nx, ny, nz)
            px, py, pz = turned(a, b, c, d, load[7], load[8], load[9])
            px, py, pz = cross(x + px, y + py, z + pz, ax, ay, az)
            bias[0] -= nx + px
            bias[1] -= ny + py
            bias[2] -= nz + pz
            bias[3] -= ax
            bias[4] -= ay
            bias[5] -= az


@inlined
def aba_backward(bone: np.record, i: int, v: np.ndarray, work: Work) -> None:
    """Hand a bone's inertia and bias on to its parent, through the axes of its joint."""
    inertia, bias = work.inertias[i], work.biases[i]
    # what carries an axis moves as the bone does but for that axis and those behind it
    by = bone.parent if bone.free else i
    wx, wy, wz = work.moves[by, 0], work.moves[by, 1], work.moves[by, 2]
    vx, vy, vz = work.moves[by, 3], work.moves[by, 4], work.moves[by, 5]
    for d in range(bone.dof - 1, -1, -1):
        at = bone.v + d
        axis, drift, pull, rate = work.axes[at], work.drifts[at], work.pulls[at], v[at]
        sx, sy, sz = axis[0] * rate, axis[1] * rate, axis[2] * rate
        tx, ty, tz = axis[3] * rate, axis[4] * rate, axis[5] * rate
        if not bone.free:
            wx, wy, wz, vx, vy, vz = wx - sx, wy - sy, wz - sz, vx - tx, vy - ty, vz - tz
        drift[0], drift[1], drift[2] = cross(wx, wy, wz, sx, sy, sz)
        sx, sy, sz = cross(vx, vy, vz, sx, sy, sz)
        tx, ty, tz = cross(wx, wy, wz, tx, ty, tz)
        drift[3], drift[4], drift[5] = sx + tx, sy + ty, sz + tz
        own, force = 0.0, -bone.damping * rate
        for j in range(6):
            value = 0.0
            for k in range(6):
                value += inertia[j, k] * axis[k]
            pull[j] = value
            own += value * axis[j]
            force -= axis[j] * bias[j]
        pull[6], pull[7] = 1 / own, force
        for j in range(6):
            share = pull[j] * pull[6]
            for k in range(j, 6):
                inertia[j, k] = inertia[k, j] = inertia[j, k] - share * pull[k]
        for j in range(6):
            value = bias[j] + pull[j] * pull[6] * force
            for k in range(6):
                value += inertia[j, k] * drift[k]
            bias[j] = value
    for j in range(6):
        for k in range(6):
            work.inertias[bone.parent, j, k] += inertia[j, k]
        work.biases[bone.parent, j] += bias[j]


@inlined
def aba_forward(bone: np.record, i: int, work: Work, out: np.ndarray) -> None:
    """Take a bone's acceleration, in its bias' place, and its joint's from the parent's."""
    rate = work.biases[i]
    for k in range(6):
        rate[k] = work.biases[bone.parent, k]
    for d in range(bone.dof):
        at = bone.v + d
        axis, drift, pull = work.axes[at], work.drifts[at], work.pulls[at]
        left = pull[7]
        for k in range(6):
            rate[k] += drift[k]
            left -= pull[k] * rate[k]
        out[at] = left * pull[6]
        for k in range(6):
            rate[k] += axis[k] * out[at]


@compiled
def rates(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray, v: np.ndarray,
          work: Work, out: np.ndarray) -> None:
    """Rates of change (nq + nv,) of q and v."""
    for i in range(len(tree)):
        bone = tree[i]
        at, rate = bone.q, bone.v
        if bone.parent < 0:
            out[at], out[at + 1], out[at + 2] = v[rate], v[rate + 1], v[rate + 2]
            at, rate = at + 3, rate + 3
        if bone.free:
            out[at], out[at + 1], out[at + 2], out[at + 3] = times(
                q[at], q[at + 1], q[at + 2], q[at + 3], v[rate] / 2, v[rate + 1] / 2,
                v[rate + 2] / 2, 0.0)
        else:
            for k in range(bone.dof):
                out[at + k] = v[rate + k]
    accelerations(tree, gravity, loads, q, v, work, out[len(q):])


@compiled
def normalize(tree: np.ndarray, q: np.ndarray) -> None:
    """Bring all quaternions in q to length one."""
    for i in range(len(tree)):
        if tree[i].free:
            at = tree[i].q + (3 if tree[i].parent < 0 else 0)
            size = math.sqrt(q[at] ** 2 + q[at + 1] ** 2 + q[at + 2] ** 2 + q[at + 3] ** 2)
            for k in range(at, at + 4):
                q[k] /= size


@compiled
def turn_spins(tree: np.ndarray, q: np.ndarray, v: np.ndarray, inward: bool) -> None:
    """Turn roots' angular velocities in v from the world's axes to their own, or back."""
    for i in range(len(tree)):
        if tree[i].parent < 0:
            at, rate = tree[i].q + 3, tree[i].v + 3
            w = -q[at + 3] if inward else q[at + 3]
            v[rate], v[rate + 1], v[rate + 2] = turned(
                q[at], q[at + 1], q[at + 2], w, v[rate], v[rate + 1], v[rate + 2])


@entry(TREE, ANY_ROW, ANY_ROW, TABLE)
def forward_kinematics(tree: np.ndarray, q: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """Position, orientation, linear and angular velocity (n, 13) of all bones of the scene; roots'
    angular velocities are along the world's axes, in ``v`` too.
    """
    work, own_q, own, root = room(len(tree), len(v)), q.copy(), v.copy(), 0
    turn_spins(tree, own_q, own, True)
    pose(tree, own_q, own, work)
    for i in range(len(tree)):
        bone, row, move, centre = tree[i], out[tree[i].bone], work.moves[i], work.centres[i]
        if bone.parent < 0:
            root = bone.q
        turn, bind = work.turns[i], bone.bind
        row[3], row[4], row[5], row[6] = times(turn[0], turn[1], turn[2], turn[3], bind[0],
                                               bind[1], bind[2], bind[3])
        x, y, z = cross(move[0], move[1], move[2], centre[0], centre[1], centre[2])
        row[7], row[8], row[9] = move[3] + x, move[4] + y, move[5] + z
        for k in range(3):
            row[k] = q[root + k] + centre[k]
            row[10 + k] = move[k]


@compiled
def _sum(shares: np.ndarray, count: int, k: np.ndarray, h: float, out: np.ndarray) -> None:
    """Add up the rates of ``count`` stages, times h."""
    for j in range(len(out)):
        out[j] = 0.0
    for stage in range(count):
        if shares[stage] != 0.0:
            share = h * shares[stage]
            for j in range(len(out)):
                out[j] += share * k[stage, j]


@compiled
def _error(k: np.ndarray, h: float, nq: int, room: np.ndarray) -> float:
    """The error that DOP853 takes for that of its order 8 (Hairer, Norsett, Wanner, II.10);
    infinity if a number was none.
    """
    fifth, third, all_of_it = 0.0, 0.0, 0.0
    _sum(ERRORS[0], 16, k, h, room)
    for j in range(len(room)):
        fifth = max(fifth, abs(room[j]) * (1.0 if j < nq else SLOWEST))
        all_of_it += room[j]
    _sum(ERRORS[1], 16, k, h, room)
    for j in range(len(room)):
        third = max(third, abs(room[j]) * (1.0 if j < nq else SLOWEST))
        all_of_it += room[j]
    if not math.isfinite(all_of_it):
        return math.inf
    if fifth == 0.0:
        return 0.0
    return fifth * fifth / np.sqrt(fifth * fifth + 0.01 * third * third)


@entry(TREE, ROW, TABLE, ANY_ROW, ANY_ROW, REAL, YES, TABLE, TABLE)
def step(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray, v: np.ndarray,
         h: float, known: bool, dense: np.ndarray, ends: np.ndarray) -> float:
    """Go one step of ``h`` s and give the error of its end.

    Puts the dense output's coefficients (see interpolate) into ``dense`` (8, nq + nv), and into
    ``ends`` the rates of change at both ends; those at the start are there already if ``known``.
    """
    nq, size = len(q), len(q) + len(v)
    work, k, y, start = room(len(tree), len(v)), np.empty((16, size)), np.empty(size), dense[0]
    start[:nq], start[nq:] = q, v
    normalize(tree, start[:nq])
    turn_spins(tree, start[:nq], start[nq:], True)
    if known:
        k[0] = ends[0]
    else:
        rates(tree, gravity, loads, start[:nq], start[nq:], work, k[0])
    for stage in range(1, 16):
        _sum(STAGES[stage], stage, k, h, y)
        for j in range(size):
            y[j] += start[j]
        normalize(tree, y[:nq])
        if stage == 12:
            dense[1] = y
        rates(tree, gravity, loads, y[:nq], y[nq:], work, k[stage])
    for j in range(size):
        dense[1, j] -= start[j]
        dense[2, j] = h * k[0, j] - dense[1, j]
        dense[3, j] = 2 * dense[1, j] - h * (k[12, j] + k[0, j])
    for row in range(4):
        _sum(CONTINUED[row], 16, k, h, dense[4 + row])
    ends[0], ends[1] = k[0], k[12]
    return _error(k, h, nq, y)


@entry(TREE, TABLE, REAL, ROW, ROW)
def interpolate(tree: np.ndarray, dense: np.ndarray, share: float, q: np.ndarray,
                v: np.ndarray) -> None:
    """GeneralizedState at a share of the step."""
    nq, size = len(q), len(q) + len(v)
    y = np.zeros(size)
    for row in range(7, 0, -1):
        factor = share if row % 2 else 1 - share
        for j in range(size):
            y[j] = (y[j] + dense[row, j]) * factor
    for j in range(nq):
        q[j] = y[j] + dense[0, j]
    for j in range(nq, size):
        v[j - nq] = y[j] + dense[0, j]
    normalize(tree, q)
    turn_spins(tree, q, v, False)


@entry(TREE, ROW, TABLE, ANY_ROW, ANY_ROW, ROW)
def accelerate(tree: np.ndarray, gravity: np.ndarray, loads: np.ndarray, q: np.ndarray,
               v: np.ndarray, out: np.ndarray) -> None:
    """Rates of change of v, roots' angular velocities being along the world's axes."""
    own_q, own = q.copy(), v.copy()
    turn_spins(tree, own_q, own, True)
    accelerations(tree, gravity, loads, own_q, own, room(len(tree), len(v)), out)
    turn_spins(tree, own_q, out, False)


@entry(ROW, TABLE, COUNTS, ROW, TABLE, TABLE)
def motion(masses: np.ndarray, inertias: np.ndarray, doll_of: np.ndarray, gravity: np.ndarray,
           rows: np.ndarray, out: np.ndarray) -> None:
    """Sums over each doll (d, 20), in the order of Motion's fields, of bones' ``rows`` (n, 13)."""
    total, matrix, spin = np.zeros(len(out)), np.empty((3, 3)), np.empty(3)
    out[:] = 0.0
    for i in range(len(rows)):
        sums, mass = out[doll_of[i]], masses[i]
        total[doll_of[i]] += mass
        for k in range(3):
            sums[2 + k] += mass * rows[i, k]
            sums[5 + k] += mass * rows[i, 7 + k]
    for d in range(len(out)):
        for k in range(3):
            out[d, 2 + k] /= total[d]
    for i in range(len(rows)):
        sums, mass, row = out[doll_of[i]], masses[i], rows[i]
        to_matrix(row[3], row[4], row[5], row[6], matrix)
        x, y, z = row[0] - sums[2], row[1] - sums[3], row[2] - sums[4]
        far = mass * (x * x + y * y + z * z)
        for j in range(3):
            spin[j] = 0.0
            for k in range(3):
                value = 0.0
                for e in range(3):
                    value += matrix[j, e] * inertias[i, e] * matrix[k, e]
                spin[j] += value * row[10 + k]
                sums[11 + 3 * j + k] += value - mass * (row[j] - sums[2 + j]) * (
                    row[k] - sums[2 + k]) + (far if j == k else 0.0)
        sums[1] += 0.5 * (mass * (row[7] ** 2 + row[8] ** 2 + row[9] ** 2)
                          + spin[0] * row[10] + spin[1] * row[11] + spin[2] * row[12])
        x, y, z = cross(x, y, z, row[7], row[8], row[9])
        sums[8] += spin[0] + mass * x
        sums[9] += spin[1] + mass * y
        sums[10] += spin[2] + mass * z
    for d in range(len(out)):
        sums = out[d]
        sums[0] = sums[1] - total[d] * (
            sums[2] * gravity[0] + sums[3] * gravity[1] + sums[4] * gravity[2])


@entry(ROW, COUNTS, ROW, REAL, TABLE, YES, FLAGS, TABLE, TABLE, TABLE)
def keep_momentum(masses: np.ndarray, doll_of: np.ndarray, gravity: np.ndarray, duration: float,
                  given: np.ndarray, spun: bool, touched: np.ndarray, before: np.ndarray,
                  sums: np.ndarray, rows: np.ndarray) -> None:
    """Project each doll that is not ``touched`` onto its due momentum and displacement, as one
    rigid body; see ConservationProjection.momentum_due. Changes its ``sums`` (d, 20) and ``rows``
    (n, 13).

    ``given`` (d, 6) are impulse and moment of pushes; not ``spun``: the angular momentum stays.
    """
    change, inertia, spin = np.empty(9), np.empty((3, 3)), np.empty(3)
    for d in range(len(sums)):
        if touched[d]:
            continue
        now, old, mass = sums[d], before[d], masses[d]
        gained = 0.0
        for k in range(3):
            due = old[5 + k] + given[d, k] + mass * gravity[k] * duration
            centre = old[2 + k] + (old[5 + k] + due) * (duration / 2 / mass)
            change[k] = centre - now[2 + k]
            change[3 + k] = (due - now[5 + k]) / mass
            gained += (due + now[5 + k]) * change[3 + k]
            now[5 + k] = due
            spin[k] = old[8 + k] + given[d, 3 + k] - now[8 + k] if spun else 0.0
            change[6 + k] = spin[k]
            for j in range(3):
                inertia[j, k] = now[11 + 3 * j + k]
        if spun:
            solve(inertia, change[6:9])
            for k in range(3):
                gained += (2 * now[8 + k] + spin[k]) * change[6 + k]
                now[8 + k] += spin[k]
        for i in range(len(rows)):
            if doll_of[i] == d:
                row = rows[i]
                x, y, z = cross(change[6], change[7], change[8], row[0] - now[2], row[1] - now[3],
                                row[2] - now[4])
                row[7] += change[3] + x
                row[8] += change[4] + y
                row[9] += change[5] + z
                for k in range(3):
                    row[k] += change[k]
                    row[10 + k] += change[6 + k]
        for k in range(3):
            now[2 + k] += change[k]
        now[1] += gained / 2
        now[0] = now[1] - mass * (now[2] * gravity[0] + now[3] * gravity[1] + now[4] * gravity[2])


@entry(TABLE, ROW, REAL, TABLE, ROW)
def heights(sizes: np.ndarray, normal: np.ndarray, offset: float, rows: np.ndarray,
            out: np.ndarray) -> float:
    """Heights (n,) of the bones' lowest points over the ground; gives the least. ``sizes`` (n, 6)
    are those of Reach.
    """
    least = math.inf
    for i in range(len(rows)):
        row, size = rows[i], sizes[i]
        x, y, z = turned(row[3], row[4], row[5], -row[6], normal[0], normal[1], normal[2])
        x, y, z = abs(x), abs(y), abs(z)
        out[i] = (row[0] * normal[0] + row[1] * normal[1] + row[2] * normal[2] - offset
                  - size[0] * x - size[1] * y - (size[2] + size[3]) * z - size[4]
                  - size[5] * math.sqrt(max(0.0, 1 - z * z)))
        least = min(least, out[i])
    return least


@entry(ROW, ROW, REAL, REAL, TABLE, ROW)
def falling(radii: np.ndarray, normal: np.ndarray, margin: float, soon: float, rows: np.ndarray,
            high: np.ndarray) -> float:
    """Largest speed at which a point of a bone that can reach the ground ``soon`` sinks."""
    most = 0.0
    for i in range(len(rows)):
        row = rows[i]
        speed = radii[i] * math.sqrt(row[10] ** 2 + row[11] ** 2 + row[12] ** 2) - (
            row[7] * normal[0] + row[8] * normal[1] + row[9] * normal[2])
        if high[i] < speed * soon + margin:
            most = max(most, speed)
    return most


@entry(ROW, TABLE)
def fastest(radii: np.ndarray, rows: np.ndarray) -> tuple[float, float, float]:
    """Fastest spin, rad/s, the largest difference, m/s, of two bones' speeds along an axis, and
    the fastest speed of a bone's end about its centre.
    """
    spin, closing, rim = 0.0, 0.0, 0.0
    for i in range(len(rows)):
        own = rows[i, 10] ** 2 + rows[i, 11] ** 2 + rows[i, 12] ** 2
        spin, rim = max(spin, own), max(rim, radii[i] * math.sqrt(own))
    for k in range(7, 10):
        low, high = rows[0, k], rows[0, k]
        for i in range(len(rows)):
            low, high = min(low, rows[i, k]), max(high, rows[i, k])
        closing = max(closing, high - low)
    return math.sqrt(spin), closing, rim


@entry(numba.int64[:, ::1], TABLE, ANY_ROW, ANY_ROW, ROW, ROW)
def limits(places: np.ndarray, bounds: np.ndarray, q: np.ndarray, v: np.ndarray,
           past: np.ndarray, speeds: np.ndarray) -> float:
    """How far past their limits angles are, and how fast they move toward them; gives the most."""
    most = -math.inf
    for i in range(len(past)):
        angle, rate = q[places[0, i]], v[places[1, i]]
        upper, lower = angle - bounds[1, i], bounds[0, i] - angle
        past[i] = max(upper, lower)
        speeds[i] = rate if upper > lower else -rate
        most = max(most, past[i])
    return most


@entry(ROW, ROW, REAL, REAL, FLAGS)
def is_active(past: np.ndarray, speeds: np.ndarray, duration: float, near: float,
          held: np.ndarray) -> bool:
    """Whether a joint presses against its limit; see JointLimits."""
    found = False
    for i in range(len(past)):
        ahead = past[i] + speeds[i] * duration
        held[i] = held[i] and past[i] > -near
        found |= held[i] or past[i] > near or ahead > near or (past[i] >= -near and speeds[i] > 0)
    return found


@entry(ROW, ROW, REAL)
def approach(past: np.ndarray, speeds: np.ndarray, soon: float) -> float:
    """Fastest speed of what reaches its limit soon."""
    most = 0.0
    for i in range(len(past)):
        if past[i] + soon * speeds[i] > 0:
            most = max(most, speeds[i])
    return most


@entry(ROW, REAL, REAL, REAL, COUNTS, TABLE, ROW, FLAGS)
def near_ground(radii: np.ndarray, margin: float, duration: float, gained: float, first: np.ndarray,
                rows: np.ndarray, high: np.ndarray, out: np.ndarray) -> bool:
    """Which dolls (d,), whose bones are those from ``first`` (d + 1,) on, may touch the ground
    within ``duration`` s, at twice the speed of their fastest point, and ``gained`` m/s.
    """
    some = False
    for d in range(len(out)):
        speed, low = 0.0, math.inf
        for i in range(first[d], first[d + 1]):
            row = rows[i]
            speed = max(speed, math.sqrt(row[7] ** 2 + row[8] ** 2 + row[9] ** 2)
                        + radii[i] * math.sqrt(row[10] ** 2 + row[11] ** 2 + row[12] ** 2))
            low = min(low, high[i])
        out[d] = low < 2 * duration * (speed + gained) + margin
        some |= out[d]
    return some


@entry(ROW, TABLE, TABLE)
def change(radii: np.ndarray, before: np.ndarray, after: np.ndarray) -> float:
    """Largest change, m/s, of a velocity at a bone's centre or, by turning, at its surface."""
    most = 0.0
    for i in range(len(before)):
        for k in range(7, 10):
            most = max(most, abs(after[i, k] - before[i, k]))
        for k in range(10, 13):
            most = max(most, abs(after[i, k] - before[i, k]) * radii[i])
    return most


@entry(TREE, ROW, ROW)
def integrate_configuration(tree: np.ndarray, q: np.ndarray, displacement: np.ndarray) -> None:
    """Move q by a small displacement along the directions of v; roots turn about world axes."""
    for i in range(len(tree)):
        bone = tree[i]
        at, rate = bone.q, bone.v
        if bone.parent < 0:
            for k in range(3):
                q[at + k] += displacement[rate + k]
            at, rate = at + 3, rate + 3
        if bone.free:
            a, b, c = (displacement[rate] / 2, displacement[rate + 1] / 2,
                       displacement[rate + 2] / 2)
            size = math.sqrt(1 + a * a + b * b + c * c)
            a, b, c, d = a / size, b / size, c / size, 1 / size
            x, y, z, w = q[at], q[at + 1], q[at + 2], q[at + 3]
            if bone.parent < 0:
                x, y, z, w = times(a, b, c, d, x, y, z, w)
            else:
                x, y, z, w = times(x, y, z, w, a, b, c, d)
            q[at], q[at + 1], q[at + 2], q[at + 3] = x, y, z, w
        else:
            for k in range(bone.dof):
                q[at + k] += displacement[rate + k]
