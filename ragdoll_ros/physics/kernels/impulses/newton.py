"""Newton's method on all rows of an island at once, semi-smooth.

The function is that of Alart and Curnier (CMAME 92, 1991). What several contacts of one face bear
together is nearly free, and a full step along it leaves every cone. So each step is one of the
proximal point method (Rockafellar, SIAM Journal on Control and Optimization 14, 1976): a change of
an impulse is resisted by a share of its own W, which does not move the solution.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..system import NO_SLIP
from .one_contact import project_to_disc
from .gauss_seidel import velocities

NEWTON_STEPS = 40
"""At the most; from the sweeps' end some three are. All are taken in full: on the way the residual
may grow, as contacts change sides. The best is kept."""

PATIENCE = 8
"""Steps that do not halve the residual, after which it goes in circles."""


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
            if k == 1 and mu[c] >= NO_SLIP:
                phi[i], phi[i + 1] = u[i], u[i + 1]
            else:
                most = push * max(0.0, mu[c] if k == 1 else roll[c])
                y, z = project_to_disc(p[i] - u[i] / own, p[i + 1] - u[i + 1] / own, most)
                phi[i], phi[i + 1] = (p[i] - y) * own, (p[i + 1] - z) * own
            worst = max(worst, abs(phi[i]), abs(phi[i + 1]))
    return worst


@compiled
def linearize(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int, n: int,
              W: np.ndarray, p: np.ndarray, u: np.ndarray, phi: np.ndarray, resist: float,
              G: np.ndarray, way: np.ndarray) -> None:
    """Jacobian of residual(), flat (n * n), with the share ``resist`` of W's diagonal added to W,
    and the right-hand side ``way`` (n,) of the equations of a step.
    """
    for i in range(n):
        way[i] = -phi[i]
    for c in range(m):
        a = rows[c]
        own = W[a * n + a]
        push = p[a] - u[a] / own
        active = push > 0
        write_velocity_row(W, G, n, a, active, resist)
        if not active:
            way[a] = -p[a]
        for k in range(1, kinds[c], 2):
            i = a + k
            own_t = max(W[i * n + i], W[(i + 1) * n + i + 1])
            law = max(0.0, mu[c] if k == 1 else roll[c])
            y, z = p[i] - u[i] / own_t, p[i + 1] - u[i + 1] / own_t
            size, most = math.sqrt(y * y + z * z), law * max(0.0, push)
            sticks = k == 1 and law >= NO_SLIP
            if sticks or not active or size <= most:
                for e in range(i, i + 2):
                    write_velocity_row(W, G, n, e, active or sticks, resist)
                    if not active and not sticks:
                        way[e] = -p[e]
                continue
            y1, z1, share = y / size, z / size, most / size
            for e in range(2):
                at, d = (i + e) * n, y1 if e == 0 else z1
                ky = share * ((1.0 if e == 0 else 0.0) - d * y1)
                kz = share * ((1.0 if e == 1 else 0.0) - d * z1)
                normal = own_t * law * d / own
                for j in range(n):
                    G[at + j] = normal * W[a * n + j] + (
                        ky * W[i * n + j] + kz * W[(i + 1) * n + j])
                G[at + a] += resist * normal * own - own_t * law * d
                G[at + i + e] += own_t
                G[at + i] += (resist * W[i * n + i] - own_t) * ky
                G[at + i + 1] += (resist * W[(i + 1) * n + i + 1] - own_t) * kz


@compiled
def write_velocity_row(W: np.ndarray, G: np.ndarray, n: int, i: int, active: bool, resist: float) -> None:
    """Let the step bring row i's velocity to nothing, or, if it is not ``active``, its impulse."""
    at = i * n
    for j in range(n):
        G[at + j] = W[at + j] if active else 0.0
    G[at + i] = (1 + resist) * W[at + i] if active else 1.0


@compiled
def gaussian_elimination(G: np.ndarray, n: int, x: np.ndarray) -> bool:
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
        inverse, pivot = 1 / G[k * n + k], G[k * n + k + 1:k * n + n]
        for i in range(k + 1, n):
            f, row = G[i * n + k] * inverse, G[i * n + k + 1:i * n + n]
            if f != 0.0:
                for j in range(n - k - 1):
                    row[j] -= f * pivot[j]
                x[i] -= f * x[k]
    for i in range(n - 1, -1, -1):
        s = x[i]
        for j in range(i + 1, n):
            s -= G[i * n + j] * x[j]
        x[i] = s / G[i * n + i]
    return True


@compiled
def solve_reduced(G: np.ndarray, n: int, x: np.ndarray, places: np.ndarray) -> bool:
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
    if not gaussian_elimination(G, m, places[n:n + m]):
        return False
    for a in range(m):
        x[int(places[a])] = places[n + a]
    return True


@compiled
def newton(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int, n: int,
           W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float, resist: float,
           room: np.ndarray, G: np.ndarray) -> float:
    """Newton's method from p on, against ``resist``; p becomes the best found, the largest
    residual, m/s, is given.
    """
    u, phi, way, keep, places = room[0], room[1], room[2], room[3], room[7]
    best, late = math.inf, 0
    for turn in range(NEWTON_STEPS + 1):
        worst = residual(kinds, rows, mu, roll, m, n, W, b, p, u, phi)
        late = 0 if worst < best / 2 else late + 1
        if worst < best:
            best = worst
            for i in range(n):
                keep[i] = p[i]
        if best <= tolerance or late > PATIENCE or turn == NEWTON_STEPS:
            break
        linearize(kinds, rows, mu, roll, m, n, W, p, u, phi, resist, G, way)
        if not solve_reduced(G, n, way, places):
            break
        total = 0.0
        for i in range(n):
            total += way[i]
        if not math.isfinite(total):
            break
        for i in range(n):
            p[i] += way[i]
    if best < math.inf:
        for i in range(n):
            p[i] = keep[i]
    return best
