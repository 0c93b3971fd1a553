"""Newton's method on all rows of an island at once, semi-smooth.

The function is that of Alart and Curnier (CMAME 92, 1991).
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..system import STICKS
from .one_contact import on_disc
from .sweep import velocities

NEWTON_STEPS = 40
"""At the most; from the sweeps' end some three are. All are taken in full: on the way the residual
may grow, as contacts change sides. The best is kept."""

PATIENCE = 3
"""Steps in which all rows change sides that are on the wrong one, though no fewer come to be."""


@compiled
def residual(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
             n: int, W: np.ndarray, b: np.ndarray, p: np.ndarray, u: np.ndarray,
             phi: np.ndarray) -> float:
    """Alart and Curnier's function, in velocities: zero where p is the solution; its largest."""
    worst = 0.0
    velocities(W, b, p, n, u)
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
