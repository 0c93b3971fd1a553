"""Impulses of contacts and limits: Coulomb's law exactly, by Gauss-Seidel and Newton's method.

Unknown are the impulses p of one island, rows of 1 (a limit), 3 (a contact: normal, two along the
surface) or 5 (the same and two of rolling). The velocities after are u = W p + b. Wanted:
u_n >= 0, p_n >= 0, u_n p_n = 0; |p_t| <= mu p_n, and where u_t is not zero p_t = -mu p_n u_t/|u_t|.

Sweeps of non-smooth contact dynamics (Moreau 1988; Jean, CMAME 177, 1999) come near; where they
stall, as with mass ratios of 1:1000, the semi-smooth Newton method of Alart and Curnier (CMAME 92,
1991) on all rows at once ends it.
"""
from __future__ import annotations

import math

import numpy as np

from .machine import compiled
from .system import STICKS

LIMIT, TOUCH, ROLLING = 1, 3, 5
"""Kinds of contact: how many rows each has."""

NARROWINGS = 50
"""Steps in which a sliding contact is sought at the most; some four are taken."""

NEWTON_STEPS = 40
"""At the most; from the sweeps' end some three are. All are taken in full: on the way the residual
may grow, as contacts change sides. The best is kept."""

PATIENCE = 3
"""Steps in which all rows change sides that are on the wrong one, though no fewer come to be."""

ROUNDS = 3
"""Of sweeps, four times as many as in the round before, and of Newton's method."""

OPENING = 1e-4
"""m/s from which a contact without friction's limit is let go as open."""


@compiled
def one_contact(W: np.ndarray, n: int, a: int, c0: float, c1: float, c2: float, x: float,
                y: float, z: float, mu: float) -> tuple[float, float, float]:
    """Impulse of one contact by itself, whose velocity without it is c; near the last (x, y, z).

    Where it slides, u_t = -d p_t with a drag d > 0, and u_n = 0: linear for a given d. Sought is
    the d at which |p_t| = mu p_n, which there is as d = 0 gives more (it would stick) and an
    endless d none: by Newton's method on mu p_n / |p_t|, nearly a line in d, between bounds.
    """
    at = a * n + a
    w00, w01, w02 = W[at], W[at + 1], W[at + 2]
    w11, w12, w22 = W[at + n + 1], W[at + n + 2], W[at + 2 * n + 2]
    if mu <= 0.0:
        return max(0.0, -c0 / w00), 0.0, 0.0
    d0, d1, d2 = w11 * w22 - w12 * w12, w02 * w12 - w01 * w22, w01 * w12 - w02 * w11
    det = w00 * d0 + w01 * d1 + w02 * d2
    if det > 1e-12 * w00 * w11 * w22:
        e11, e12, e22 = w00 * w22 - w02 * w02, w01 * w02 - w00 * w12, w00 * w11 - w01 * w01
        sx = -(d0 * c0 + d1 * c1 + d2 * c2) / det
        sy = -(d1 * c0 + e11 * c1 + e12 * c2) / det
        sz = -(d2 * c0 + e12 * c1 + e22 * c2) / det
        if sx >= 0 and (mu >= STICKS or sy * sy + sz * sz <= mu * mu * sx * sx):
            return sx, sy, sz
    if mu >= STICKS:
        det = w11 * w22 - w12 * w12
        return 0.0, (w12 * c2 - w22 * c1) / det, (w12 * c1 - w11 * c2) / det
    if c0 >= 0:
        return 0.0, 0.0, 0.0
    drag = first_drag(w11, w22, -c0 * mu / w00, c1 + w01 * x + w11 * y + w12 * z,
                      c2 + w02 * x + w12 * y + w22 * z, c1, c2, y, z)
    least, most = 0.0, math.inf
    for _ in range(NARROWINGS):
        v11, v22 = w11 + drag, w22 + drag
        det = v11 * v22 - w12 * w12
        g1, g2 = (v22 * w01 - w12 * w02) / det, (v11 * w02 - w12 * w01) / det
        k1, k2 = (v22 * c1 - w12 * c2) / det, (v11 * c2 - w12 * c1) / det
        alone = w00 - w01 * g1 - w02 * g2
        x = (w01 * k1 + w02 * k2 - c0) / alone
        y, z = -k1 - g1 * x, -k2 - g2 * x
        size = math.sqrt(y * y + z * z)
        over = mu * x - size
        if abs(over) <= 1e-13 * size:
            break
        if over < 0:
            least = drag
        else:
            most = drag
        q1, q2 = (v22 * y - w12 * z) / det, (v11 * z - w12 * y) / det
        dx = (w01 * q1 + w02 * q2) / alone
        shrinks = (y * (q1 + g1 * dx) + z * (q2 + g2 * dx)) / size
        slope = mu * (dx * size + x * shrinks)
        drag -= over * size / slope if slope > 0 else math.inf
        if not least < drag < most:
            drag = (least + most) / 2 if most < math.inf else 2 * least + w11 + w22
    y, z = on_disc(y, z, mu * x)
    return x, y, z


@compiled
def first_drag(w11: float, w22: float, most: float, u1: float, u2: float, c1: float, c2: float,
               y: float, z: float) -> float:
    """Where to begin to seek u_t / -p_t: from the last impulses (y, z), whose u is known; without
    any, from friction ``most`` against c along a surface that nothing else acts on.
    """
    drag = -(u1 * y + u2 * z)
    if drag > 0:
        return drag / (y * y + z * z)
    return max(0.0, math.sqrt(c1 * c1 + c2 * c2) / most - (w11 + w22) / 2)


@compiled
def on_disc(y: float, z: float, radius: float) -> tuple[float, float]:
    """The point of a disc nearest to (y, z)."""
    size = math.sqrt(y * y + z * z)
    if size > radius:
        share = radius / size
        return y * share, z * share
    return y, z


@compiled
def sweep(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int, n: int,
          W: np.ndarray, b: np.ndarray, p: np.ndarray) -> float:
    """Go once through m contacts; the largest change of a velocity, m/s or rad/s."""
    worst = 0.0
    for c in range(m):
        a = rows[c]
        at = a * n
        if kinds[c] == LIMIT:
            u = b[a]
            for j in range(n):
                u += W[at + j] * p[j]
            own = W[at + a]
            x = max(0.0, p[a] - u / own)
            worst = max(worst, abs(x - p[a]) * own)
            p[a] = x
            continue
        c0, c1, c2 = b[a], b[a + 1], b[a + 2]
        for j in range(n):
            c0 += W[at + j] * p[j]
            c1 += W[at + n + j] * p[j]
            c2 += W[at + 2 * n + j] * p[j]
        x, y, z = p[a], p[a + 1], p[a + 2]
        sticks = mu[c] >= STICKS
        if c0 >= 0 and x == 0.0 and y == 0.0 and z == 0.0 and not sticks:
            continue
        d = at + a
        c0 -= W[d] * x + W[d + 1] * y + W[d + 2] * z
        c1 -= W[d + 1] * x + W[d + n + 1] * y + W[d + n + 2] * z
        c2 -= W[d + 2] * x + W[d + n + 2] * y + W[d + 2 * n + 2] * z
        if c0 >= 0 and (x == 0.0 or mu[c] <= 0.0) and not sticks:
            nx, ny, nz = 0.0, 0.0, 0.0
        else:
            nx, ny, nz = one_contact(W, n, a, c0, c1, c2, x, y, z, mu[c])
        worst = max(worst, abs(nx - x) * W[d], abs(ny - y) * W[d + n + 1],
                    abs(nz - z) * W[d + 2 * n + 2])
        p[a], p[a + 1], p[a + 2] = nx, ny, nz
        if kinds[c] == ROLLING:
            worst = max(worst, roll_one(W, n, a + 3, b, p, roll[c] * nx))
    return worst


@compiled
def roll_one(W: np.ndarray, n: int, a: int, b: np.ndarray, p: np.ndarray, most: float) -> float:
    """Rolling impulse, rows a and a + 1, of at most ``most`` N m s; the largest change of rad/s."""
    u, w = b[a], b[a + 1]
    for j in range(n):
        u += W[a * n + j] * p[j]
        w += W[(a + 1) * n + j] * p[j]
    w11, w12, w22 = W[a * n + a], W[a * n + a + 1], W[(a + 1) * n + a + 1]
    rho = 1 / (0.5 * (w11 + w22) + math.sqrt(0.25 * (w11 - w22) ** 2 + w12 * w12))
    x, y = p[a], p[a + 1]
    for _ in range(4):
        dx, dy = p[a] - x, p[a + 1] - y
        nx, ny = on_disc(p[a] - rho * (u + w11 * dx + w12 * dy),
                         p[a + 1] - rho * (w + w12 * dx + w22 * dy), most)
        p[a], p[a + 1] = nx, ny
    return max(abs(p[a] - x) * w11, abs(p[a + 1] - y) * w22)


@compiled
def residual(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
             n: int, W: np.ndarray, b: np.ndarray, p: np.ndarray, u: np.ndarray,
             phi: np.ndarray) -> float:
    """Alart and Curnier's function, in velocities: zero where p is the solution; its largest."""
    worst = 0.0
    for i in range(n):
        s = b[i]
        for j in range(n):
            s += W[i * n + j] * p[j]
        u[i] = s
    for c in range(m):
        a = rows[c]
        own = W[a * n + a]
        push = max(0.0, p[a] - u[a] / own)
        phi[a] = (p[a] - push) * own
        worst = max(worst, abs(phi[a]))
        for k in range(1, kinds[c], 2):
            i = a + k
            own = max(W[i * n + i], W[(i + 1) * n + i + 1])
            if k == 1 and mu[c] >= STICKS:
                phi[i], phi[i + 1] = u[i], u[i + 1]
            else:
                most = push * max(0.0, mu[c] if k == 1 else roll[c])
                y, z = on_disc(p[i] - u[i] / own, p[i + 1] - u[i + 1] / own, most)
                phi[i], phi[i + 1] = (p[i] - y) * own, (p[i + 1] - z) * own
            worst = max(worst, abs(phi[i]), abs(phi[i + 1]))
    return worst


@compiled
def newton_matrix(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                  n: int, W: np.ndarray, p: np.ndarray, u: np.ndarray, sides: np.ndarray,
                  G: np.ndarray) -> None:
    """Jacobian of residual(), flat (n * n), where the rows stand on their ``sides`` (n,)."""
    for c in range(m):
        a = rows[c]
        own = W[a * n + a]
        push = p[a] - u[a] / own
        active = sides[a] > 0
        for j in range(n):
            G[a * n + j] = W[a * n + j] if active else 0.0
        if not active:
            G[a * n + a] = own
        for k in range(1, kinds[c], 2):
            i = a + k
            own_t = max(W[i * n + i], W[(i + 1) * n + i + 1])
            law = max(0.0, mu[c] if k == 1 else roll[c])
            y, z = p[i] - u[i] / own_t, p[i + 1] - u[i + 1] / own_t
            size, most = math.sqrt(y * y + z * z), law * max(0.0, push)
            sticks = k == 1 and law >= STICKS
            for e in range(2):
                at = (i + e) * n
                if not active and not sticks:
                    for j in range(n):
                        G[at + j] = 0.0
                    G[at + i + e] = own_t
                elif size <= most or sticks:
                    for j in range(n):
                        G[at + j] = W[at + j]
                else:
                    y1, z1 = y / size, z / size
                    d = y1 if e == 0 else z1
                    share = most / size
                    ky = share * ((1.0 if e == 0 else 0.0) - d * y1)
                    kz = share * ((1.0 if e == 1 else 0.0) - d * z1)
                    for j in range(n):
                        G[at + j] = own_t * (law * d / own * W[a * n + j]) + (
                            ky * W[i * n + j] + kz * W[(i + 1) * n + j])
                    G[at + a] -= own_t * law * d
                    G[at + i + e] += own_t
                    G[at + i] -= own_t * ky
                    G[at + i + 1] -= own_t * kz


@compiled
def gauss(G: np.ndarray, n: int, x: np.ndarray) -> bool:
    """Solve G x = b in b's place, rows swapped by their largest; false if G is singular."""
    for k in range(n):
        best, most = k, abs(G[k * n + k])
        for i in range(k + 1, n):
            if abs(G[i * n + k]) > most:
                best, most = i, abs(G[i * n + k])
        if not most > 1e-300:
            return False
        if best != k:
            for j in range(k, n):
                G[k * n + j], G[best * n + j] = G[best * n + j], G[k * n + j]
            x[k], x[best] = x[best], x[k]
        inverse = 1 / G[k * n + k]
        for i in range(k + 1, n):
            f = G[i * n + k] * inverse
            if f != 0.0:
                for j in range(k + 1, n):
                    G[i * n + j] -= f * G[k * n + j]
                x[i] -= f * x[k]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for j in range(i + 1, n):
            s -= G[i * n + j] * x[j]
        x[i] = s / G[i * n + i]
    return True


@compiled
def solve_active(G: np.ndarray, n: int, x: np.ndarray, places: np.ndarray) -> bool:
    """Solve G x = b, flat (n * n), in b's place; False if that fails. Rows of what is open have but
    their diagonal: they are solved for first, the others by gauss(). places (2n,): room.
    """
    m = 0
    for i in range(n):
        alone = True
        for j in range(n):
            if j != i and G[i * n + j] != 0.0:
                alone = False
                break
        if alone:
            x[i] /= G[i * n + i]
        else:
            places[m] = i
            m += 1
    k = 0
    for a in range(m):
        i = int(places[a])
        c = 0
        for j in range(n):
            if c < m and int(places[c]) == j:
                c += 1
            else:
                x[i] -= G[i * n + j] * x[j]
    for a in range(m):
        i = int(places[a])
        for c in range(m):
            G[k] = G[i * n + int(places[c])]
            k += 1
        places[n + a] = x[i]
    if not gauss(G, m, places[n:n + m]):
        return False
    for a in range(m):
        x[int(places[a])] = places[n + a]
    return True


@compiled
def change_sides(rows: np.ndarray, m: int, n: int, W: np.ndarray, p: np.ndarray, u: np.ndarray,
                 sides: np.ndarray, all_: bool) -> int:
    """Let each normal row that is on the wrong side, pressing (1) or open (0), change it, or only
    the last of them; how many are.
    """
    wrong, last = 0, -1
    for c in range(m):
        a = rows[c]
        if (p[a] - u[a] / W[a * n + a] > 0) != (sides[a] > 0):
            wrong, last = wrong + 1, a
            if all_:
                sides[a] = 1 - sides[a]
    if wrong and not all_:
        sides[last] = 1 - sides[last]
    return wrong


@compiled
def newton(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int, n: int,
           W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float, room: np.ndarray,
           G: np.ndarray) -> float:
    """Newton's method from p on; p becomes the best found, the largest residual, m/s, is given.

    Where it turns in circles, one row at a time changes sides until fewer stand wrong, which ends
    (block principal pivoting: Judice and Pires, Computers and Operations Research 21, 1994).
    """
    u, phi, way, keep, sides, places = room[0], room[1], room[2], room[3], room[8], room[7]
    worst = residual(kinds, rows, mu, roll, m, n, W, b, p, u, phi)
    best, least, patience = worst, m + 1, PATIENCE
    for i in range(n):
        keep[i], sides[i] = p[i], 0.0
    change_sides(rows, m, n, W, p, u, sides, True)
    for _ in range(NEWTON_STEPS):
        if worst <= tolerance:
            break
        newton_matrix(kinds, rows, mu, roll, m, n, W, p, u, sides, G)
        for i in range(n):
            way[i] = -phi[i]
        for c in range(m):
            a = rows[c]
            way[a] = -u[a] if sides[a] > 0 else -p[a] * W[a * n + a]
        if not solve_active(G, n, way, places):
            break
        total = 0.0
        for i in range(n):
            total += way[i]
        if not math.isfinite(total):
            break
        for i in range(n):
            p[i] += way[i]
        for c in range(m):
            if sides[rows[c]] == 0.0:
                p[rows[c]] = 0.0
        worst = residual(kinds, rows, mu, roll, m, n, W, b, p, u, phi)
        if worst < best:
            best = worst
            for i in range(n):
                keep[i] = p[i]
        wrong = change_sides(rows, m, n, W, p, u, sides, patience > 0)
        if wrong < least:
            least, patience = wrong, PATIENCE
        else:
            patience -= 1
    for i in range(n):
        p[i] = keep[i]
    return best


@compiled
def admissible(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
               p: np.ndarray) -> None:
    """Bring all impulses into their cones: no contact ever pulls."""
    for c in range(m):
        a = rows[c]
        p[a] = max(0.0, p[a])
        for k in range(1, kinds[c], 2):
            if k == 1 and mu[c] >= STICKS:
                continue
            most = p[a] * max(0.0, mu[c] if k == 1 else roll[c])
            p[a + k], p[a + k + 1] = on_disc(p[a + k], p[a + k + 1], most)


@compiled
def solve_cones(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                n: int, W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float,
                sweeps: int, room: np.ndarray, G: np.ndarray) -> tuple[float, int]:
    """Solve for p (n,), from where it stands; the largest residual left, m/s, and the sweeps.

    Each round that Newton's method ends without a solution makes do with ten times as much.
    """
    done, worst = 0, math.inf
    for _ in range(ROUNDS):
        tolerance *= 10
        for _ in range(min(sweeps, 100)):
            done += 1
            worst = sweep(kinds, rows, mu, roll, m, n, W, b, p)
            if worst <= tolerance / 10:
                return worst, done
        left = newton(kinds, rows, mu, roll, m, n, W, b, p, tolerance / 10, room, G)
        admissible(kinds, rows, mu, roll, m, p)
        if left <= tolerance:
            return left, done
        worst = min(worst, left)
        sweeps *= 4
    return worst, done


@compiled
def opens(W: np.ndarray, n: int, a: int, b: np.ndarray, p: np.ndarray) -> bool:
    """Whether a contact comes apart."""
    u = b[a]
    for j in range(n):
        u += W[a * n + j] * p[j]
    return u > OPENING


@compiled
def solve_impulses(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                   n: int, W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float,
                   sweeps: int, room: np.ndarray, G: np.ndarray) -> tuple[float, int]:
    """Solve for p (n,), from where it stands; the largest residual left, m/s, and the sweeps.

    Friction without limit makes a convex problem of it, which holds a contact sideways even as it
    opens; so what has come out as open is let go, and all is solved once more. What then closes
    after all is held: between the two there is no answer (Painleve).
    """
    left, done = solve_cones(kinds, rows, mu, roll, m, n, W, b, p, tolerance, sweeps, room, G)
    for turn in range(2):
        some = False
        for c in range(m):
            a = rows[c]
            if kinds[c] == LIMIT:
                continue
            if turn == 0 and mu[c] >= STICKS and p[a] <= 0.0 and (
                    p[a + 1] != 0.0 or p[a + 2] != 0.0) and opens(W, n, a, b, p):
                mu[c] = -1.0
                p[a] = p[a + 1] = p[a + 2] = 0.0
                some = True
            elif turn == 1 and mu[c] < 0 and p[a] > 0:
                mu[c] = STICKS
                some = True
        if not some:
            break
        left, more = solve_cones(kinds, rows, mu, roll, m, n, W, b, p, tolerance, sweeps, room, G)
        done += more
    return left, done


@compiled
def solve_normals(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                  n: int, W: np.ndarray, need: np.ndarray, p: np.ndarray, room: np.ndarray,
                  G: np.ndarray) -> None:
    """Least normal impulses p (n,) that give each contact its velocity need[0] (m,) or more, but
    for a compliance of need[2], as a share of its W.

    W, kinds and rows are lost: the normals' own W takes their place.
    """
    b, own = room[4], room[5]
    for c in range(m):
        for e in range(m):
            W[c * m + e] = W[rows[c] * n + rows[e]]
    for i in range(n):
        p[i] = 0.0
    for c in range(m):
        W[c * m + c] *= 1 + need[2, c]
        b[c], own[c], room[6, c] = -need[0, c], 0.0, rows[c]
        kinds[c], rows[c], mu[c], roll[c] = LIMIT, c, 0.0, 0.0
    solve_cones(kinds, rows, mu, roll, m, m, W, b, own, 1e-9, 4, room, G)
    for c in range(m):
        p[int(room[6, c])] = max(0.0, own[c])


@compiled
def weaken_by(p: np.ndarray, n: int, work: float, spent: float) -> None:
    """Scale impulses p (n,) whose energy is ``work`` + ``spent`` / 2, J, so that it is none; what
    is no number becomes none.
    """
    share = min(1.0, max(0.0, -2 * work / spent)) if spent > 0 else 0.0
    if not math.isfinite(share) or not math.isfinite(work):
        share = 0.0
    for i in range(n):
        p[i] = share * p[i] if share > 0 else 0.0
