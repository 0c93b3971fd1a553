"""Semi-smooth Newton method on all rows of an island at once; symbols as in solver.py.

The function is Alart and Curnier's (CMAME 92, 1991). Impulses that several contacts of one face
bear together are nearly undetermined, and a full step along them leaves every friction cone. So
each step is one of the proximal point method (Rockafellar, SIAM Journal on Control and Optimization
14, 1976): a share ``proximal`` of the diagonal of W resists the change of an impulse, which does
not move the solution.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..system import NO_SLIP
from ..workspace import Island
from .gauss_seidel import velocities
from .one_contact import project_to_disc

MAX_STEPS = 40
"""After the sweeps some three are needed. All are taken in full: the residual may grow on the way,
as contacts change between sticking and sliding. The best is kept."""

PATIENCE = 8
"""Steps that do not halve the residual, after which the method cycles."""


@compiled
def alart_curnier(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray) -> float:
    """Write u = W p + b to island.velocity, and Alart and Curnier's function, scaled to velocities
    and zero at the solution, to island.residual. Returns its largest entry.
    """
    W, u, phi, worst = island.W, island.velocity, island.residual, 0.0
    velocities(W, b, p, n, u)
    for c in range(m):
        member = island.members[c]
        a = member.row
        own = W[a * n + a]
        push = max(0.0, p[a] - u[a] / own)
        phi[a] = (p[a] - push) * own
        worst = max(worst, abs(phi[a]))
        for k in range(1, member.kind, 2):
            i = a + k
            own = max(W[i * n + i], W[(i + 1) * n + i + 1])
            if k == 1 and member.friction >= NO_SLIP:
                phi[i], phi[i + 1] = u[i], u[i + 1]
            else:
                law = member.friction if k == 1 else member.rolling_friction
                most = push * max(0.0, law)
                y, z = project_to_disc(p[i] - u[i] / own, p[i + 1] - u[i + 1] / own, most)
                phi[i], phi[i + 1] = (p[i] - y) * own, (p[i + 1] - z) * own
            worst = max(worst, abs(phi[i]), abs(phi[i + 1]))
    return worst


@compiled
def linearize(island: Island, m: int, n: int, p: np.ndarray, proximal: float) -> None:
    """Write the Jacobian of alart_curnier() at p, with the share ``proximal`` of W's diagonal added
    to W, to island.G, flat (n * n), and the right-hand side of a step to island.direction.
    """
    W, G, u, direction = island.W, island.G, island.velocity, island.direction
    for i in range(n):
        direction[i] = -island.residual[i]
    for c in range(m):
        member = island.members[c]
        a = member.row
        own = W[a * n + a]
        push = p[a] - u[a] / own
        active = push > 0
        write_velocity_row(W, G, n, a, active, proximal)
        if not active:
            direction[a] = -p[a]
        for k in range(1, member.kind, 2):
            i = a + k
            own_t = max(W[i * n + i], W[(i + 1) * n + i + 1])
            law = max(0.0, member.friction if k == 1 else member.rolling_friction)
            y, z = p[i] - u[i] / own_t, p[i + 1] - u[i + 1] / own_t
            size, most = math.sqrt(y * y + z * z), law * max(0.0, push)
            sticks = k == 1 and law >= NO_SLIP
            if sticks or not active or size <= most:
                for e in range(i, i + 2):
                    write_velocity_row(W, G, n, e, active or sticks, proximal)
                    if not active and not sticks:
                        direction[e] = -p[e]
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
                G[at + a] += proximal * normal * own - own_t * law * d
                G[at + i + e] += own_t
                G[at + i] += (proximal * W[i * n + i] - own_t) * ky
                G[at + i + 1] += (proximal * W[(i + 1) * n + i + 1] - own_t) * kz


@compiled
def write_velocity_row(W: np.ndarray, G: np.ndarray, n: int, i: int, active: bool,
                       proximal: float) -> None:
    """Write row i of the Jacobian G: W's, its diagonal times 1 + ``proximal``, so that the step
    zeroes the row's velocity; the identity's if not ``active``, so that it zeroes its impulse.
    """
    at = i * n
    for j in range(n):
        G[at + j] = W[at + j] if active else 0.0
    G[at + i] = (1 + proximal) * W[at + i] if active else 1.0


@compiled
def gaussian_elimination(G: np.ndarray, n: int, x: np.ndarray) -> bool:
    """Solve G x = b in place with partial pivoting. Returns whether G is regular."""
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
def solve_reduced(G: np.ndarray, n: int, x: np.ndarray, places: np.ndarray,
                  reduced: np.ndarray) -> bool:
    """Solve G x = b, flat (n * n), in place; returns whether G is regular. Rows of open contacts
    have only their diagonal: they are eliminated first. places, reduced (n,): scratch.
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
        i = places[a]
        c = 0
        for j in range(n):
            if c < m and places[c] == j:
                c += 1
            else:
                x[i] -= G[i * n + j] * x[j]
    for a in range(m):
        i = places[a]
        for c in range(m):
            G[k] = G[i * n + places[c]]
            k += 1
        reduced[a] = x[i]
    if not gaussian_elimination(G, m, reduced):
        return False
    for a in range(m):
        x[places[a]] = reduced[a]
    return True


@compiled
def newton(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray, tolerance: float,
           proximal: float) -> float:
    """Take Newton steps from p, which becomes the best found. Returns its residual, m/s."""
    direction, keep = island.direction, island.best
    best, late = math.inf, 0
    for turn in range(MAX_STEPS + 1):
        worst = alart_curnier(island, m, n, b, p)
        late = 0 if worst < best / 2 else late + 1
        if worst < best:
            best = worst
            for i in range(n):
                keep[i] = p[i]
        if best <= tolerance or late > PATIENCE or turn == MAX_STEPS:
            break
        island.newton_steps[0] += 1
        linearize(island, m, n, p, proximal)
        if not solve_reduced(island.G, n, direction, island.places, island.active):
            break
        total = 0.0
        for i in range(n):
            total += direction[i]
        if not math.isfinite(total):
            break
        for i in range(n):
            p[i] += direction[i]
    if best < math.inf:
        for i in range(n):
            p[i] = keep[i]
    return best
