"""Active set method for all rows of an island at once, where the problem is convex: friction is
zero or unlimited.

Then impulses minimize p W p / 2 + b p with normal ones non-negative. The active set method (Nocedal
and Wright, Numerical Optimization, 16.5; Lawson and Hanson's non-negative least squares) goes
downhill at every turn, so it ends, however alike the rows of one face are.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT, ROLLING
from ..maths.cholesky import factor_row, substitute
from ..system import NO_SLIP
from ..workspace import Island
from .gauss_seidel import velocities

TURNS = 4
"""Changes of the active set, for each contact, after which the search is given up."""


@compiled
def is_convex(members: np.ndarray, m: int) -> bool:
    """Return whether all m contacts have either no friction or unlimited friction (NO_SLIP), and no
    rolling friction: then the problem is convex.
    """
    for k in range(m):
        member = members[k]
        if member.kind != LIMIT and (0.0 < member.friction < NO_SLIP or (
                member.kind == ROLLING and member.rolling_friction > 0)):
            return False
    return True


@compiled
def solve_active_set(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray,
                     tolerance: float) -> bool:
    """Solve a convex island of m contacts and n rows for p (n,) in place, starting from p. Returns
    whether a solution was found; if not, p is the last iterate.

    ``tolerance``: m/s at which a contact without impulse may approach. island.places lists the
    active rows, island.G holds the Cholesky factor of W at these rows.
    """
    W, U, z, places = island.W, island.G, island.active, island.places
    count = initial_active_set(island, m, p)
    if not factor_rows(W, n, places, 0, count, U):
        return False
    for _ in range(TURNS * m + 8):
        for k in range(count):
            z[k] = -b[places[k]]
        substitute(U, n, count, z)
        share, drop = 1.0, -1
        for k in range(count):
            i = places[k]
            if island.is_normal[i] and z[k] < 0 and p[i] <= share * (p[i] - z[k]):
                share, drop = p[i] / (p[i] - z[k]), k
        for k in range(count):
            i = places[k]
            p[i] += share * (z[k] - p[i])
        if drop >= 0:
            p[places[drop]] = 0.0
            count -= 1
            remove_column(U, n, places, drop, count)
            if not factor_rows(W, n, places, drop, count, U):
                return False
            continue
        enter = most_approaching(island, m, n, b, p, tolerance)
        if enter < 0:
            return True
        places[count] = enter
        append_column(W, U, n, places, count)
        count += 1
        if not factor_rows(W, n, places, count - 1, count, U):
            return False
    return False


@compiled
def initial_active_set(island: Island, m: int, p: np.ndarray) -> int:
    """Write the active rows to island.places: the tangents of all contacts with unlimited friction
    (NO_SLIP), then the normals with an impulse; to island.is_normal which rows are normals. Returns
    the number of active rows; p of all others is set to 0.
    """
    count, members, places = 0, island.members, island.places
    for k in range(m):
        a = members[k].row
        island.is_normal[a] = 1
        for i in range(a + 1, a + members[k].kind):
            island.is_normal[i] = 0
            if i < a + 3 and members[k].friction >= NO_SLIP:
                places[count] = i
                count += 1
            else:
                p[i] = 0.0
    for k in range(m):
        a = members[k].row
        if p[a] > 0:
            places[count] = a
            count += 1
        else:
            p[a] = 0.0
    return count


@compiled
def factor_rows(W: np.ndarray, n: int, places: np.ndarray, start: int, count: int,
                U: np.ndarray) -> bool:
    """Write rows ``start`` to ``count`` - 1 of the upper Cholesky factor U to U, with U^T U =
    W[places, places]; the rows before are given. W and U are flat, n elements a row. Returns
    whether the matrix is positive definite.
    """
    for i in range(start, count):
        at = places[i] * n
        for j in range(i, count):
            U[i * n + j] = W[at + places[j]]
        if not factor_row(U, n, i, count):
            return False
    return True


@compiled
def append_column(W: np.ndarray, U: np.ndarray, n: int, places: np.ndarray, end: int) -> None:
    """Write column ``end`` of the factor U, for row places[end] of W, above its diagonal: rows 0 to
    end - 1. factor_rows() computes the diagonal entry.
    """
    at = places[end] * n
    for k in range(end):
        s = W[at + places[k]]
        for i in range(k):
            s -= U[i * n + k] * U[i * n + end]
        U[k * n + end] = s / U[k * n + k]


@compiled
def remove_column(U: np.ndarray, n: int, places: np.ndarray, drop: int, count: int) -> None:
    """Remove entry ``drop`` from ``places`` and column ``drop`` from rows 0 to drop - 1 of U;
    ``count`` columns remain. The rows from ``drop`` on must be factored again.
    """
    for j in range(drop, count):
        places[j] = places[j + 1]
    for k in range(drop):
        for j in range(drop, count):
            U[k * n + j] = U[k * n + j + 1]


@compiled
def most_approaching(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray,
                     tolerance: float) -> int:
    """Normal row without impulse that approaches fastest, or -1; u to island.velocity."""
    u = island.velocity
    velocities(island.W, b, p, n, u)
    worst, found = -tolerance, -1
    for k in range(m):
        a = island.members[k].row
        if p[a] <= 0.0 and u[a] < worst:
            worst, found = u[a], a
    return found
