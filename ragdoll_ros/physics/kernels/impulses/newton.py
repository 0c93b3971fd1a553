"""Semi-smooth Newton method on all rows of an island at once; symbols as in solver.py.

The function is Alart and Curnier's (CMAME 92, 1991). Impulses that several contacts of one face
bear together are nearly undetermined, and a full step along them leaves every friction cone. So
each step is one of the proximal point method (Rockafellar, SIAM Journal on Control and Optimization
14, 1976): a share ``proximal`` of the diagonal of W resists the change of an impulse, which does
not move the solution.

A step is solved for what is unknown in it alone: nothing of a contact that is open, three rows of
one that sticks, two of one that slips, whose friction along the slip follows from the normal
impulse.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.gaussian_elimination import gaussian_elimination
from ..system import NO_SLIP
from ..workspace import Island
from .gauss_seidel import add_velocity_change, velocities
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
def list_unknowns(island: Island, m: int, n: int, p: np.ndarray) -> int:
    """Write the unknowns of a Newton step from p to island.unknowns, and the part of the step that
    is known before to island.direction. Returns the number of unknowns. After alart_curnier().

    Open contacts lose their impulses, except tangential ones of unlimited friction. Of friction
    that slips, the part along the slip follows from the normal impulse; the part across it is
    unknown.
    """
    W, u, direction, unknowns, count = island.W, island.velocity, island.direction, (
        island.unknowns), 0
    for c in range(m):
        member = island.members[c]
        a = member.row
        push, normal = p[a] - u[a] / W[a * n + a], count
        for i in range(a, a + member.kind):
            direction[i] = 0.0
        if push > 0:
            count = add_unknown(unknowns, count, a)
        else:
            direction[a] = -p[a]
        for k in range(1, member.kind, 2):
            i = a + k
            law = member.friction if k == 1 else member.rolling_friction
            sticks = k == 1 and law >= NO_SLIP
            if not sticks and (push <= 0 or law <= 0):
                direction[i], direction[i + 1] = -p[i], -p[i + 1]
                continue
            own = max(W[i * n + i], W[(i + 1) * n + i + 1])
            y, z = p[i] - u[i] / own, p[i + 1] - u[i + 1] / own
            size = math.sqrt(y * y + z * z)
            if sticks or size <= law * push:
                count = add_unknown(unknowns, add_unknown(unknowns, count, i), i + 1)
            else:
                add_slip(island, unknowns[normal], k, (y / size, z / size), law,
                         law * u[a] / W[a * n + a], own)
                count = add_unknown(unknowns, count, i)
                across = unknowns[count - 1]
                across.width, across.direction[0], across.direction[1] = 2, -z / size, y / size
                across.share = law * push / size
                across.slack = own * (1 - across.share)
    return count


@compiled
def add_slip(island: Island, normal: np.record, k: int, d: tuple[float, float], law: float,
             offset: float, own: float) -> None:
    """Make friction along a slip depend on the unknown ``normal``: its direction gets the entries
    ``law`` times d at k and k + 1, its width becomes k + 2. Write the part of the friction step
    that does not depend on it to island.direction, rows normal.row + k and the next. k: 1 for
    friction, 3 for rolling; d: unit vector of the friction impulse; ``law``: coefficient;
    ``offset``: law u_n / W_nn, N s; ``own``: diagonal entry of W by which island.residual is scaled
    in these rows.
    """
    i, residual = normal.row + k, island.residual
    normal.width, normal.direction[k], normal.direction[k + 1] = k + 2, law * d[0], law * d[1]
    known = offset - (residual[i] * d[0] + residual[i + 1] * d[1]) / own
    island.direction[i], island.direction[i + 1] = known * d[0], known * d[1]


@compiled
def add_unknown(unknowns: np.ndarray, count: int, row: int) -> int:
    """Write unknown number ``count``, the impulse of a row by itself. Returns the next number."""
    new = unknowns[count]
    new.row, new.width, new.share, new.slack = row, 1, 1.0, 0.0
    new.direction[0] = 1.0
    for e in range(1, 5):
        new.direction[e] = 0.0
    return count + 1


@compiled
def linearize(island: Island, count: int, n: int, proximal: float) -> None:
    """Write the matrix of ``count`` unknowns of a Newton step to island.G, flat, with the share
    ``proximal`` of W's diagonal added to W, and the right-hand side to island.active.
    """
    W, G, rhs, known, row = island.W, island.G, island.active, island.step_start, island.combined
    residual = island.residual
    for i in range(n):
        known[i] = 0.0
    for j in range(n):
        add_velocity_change(W, n, j, island.direction[j], known)
    for k in range(count):
        own = island.unknowns[k]
        i = own.row
        first = W[i * n:i * n + n]
        if own.width == 2:
            x, y = own.direction[0], own.direction[1]
            rhs[k] = -x * residual[i] - y * residual[i + 1]
            x, y = own.share * x, own.share * y
            second = W[(i + 1) * n:(i + 1) * n + n]
            for j in range(n):
                row[j] = x * first[j] + y * second[j]
            rhs[k] -= x * known[i] + y * known[i + 1]
        else:
            for j in range(n):
                row[j] = first[j]
            rhs[k] = -residual[i] - known[i]
        for c in range(count):
            other = island.unknowns[c]
            j = other.row
            total = other.direction[0] * row[j]
            for e in range(1, other.width):
                total += other.direction[e] * row[j + e]
            G[k * count + c] = total
        G[k * count + k] += own.slack + proximal * own.share * first[i]


@compiled
def add_unknowns(island: Island, count: int) -> None:
    """Add the ``count`` unknowns found, island.active, to island.direction, the step."""
    for k in range(count):
        own = island.unknowns[k]
        for e in range(own.width):
            island.direction[own.row + e] += own.direction[e] * island.active[k]


@compiled
def newton(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray, tolerance: float,
           proximal: float) -> float:
    """Take full Newton steps from p, at most MAX_STEPS, until the residual is at most
    ``tolerance``, m/s, or the steps cycle (PATIENCE). ``proximal``: share of W's diagonal that
    resists the change of an impulse. p becomes the best iterate. Returns its residual, m/s.
    """
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
        count = list_unknowns(island, m, n, p)
        linearize(island, count, n, proximal)
        if not gaussian_elimination(island.G, count, island.active):
            break
        add_unknowns(island, count)
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
