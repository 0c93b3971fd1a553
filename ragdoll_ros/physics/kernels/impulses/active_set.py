"""All rows of an island at once, where the problem is convex: friction none, or without limit.

Then impulses minimise p W p / 2 + b p, where normal ones are no less than zero. The active set
method (Nocedal and Wright, Numerical Optimization, 16.5; Lawson and Hanson's of non-negative least
squares) goes downhill at every turn, so it ends, however alike the rows of one face are.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.cholesky import factor_row, substitute
from ..system import NO_SLIP
from .gauss_seidel import LIMIT, ROLLING, velocities

TURNS = 4
"""Changes of the active set, for each contact, after which there is taken to be no end."""


@compiled
def is_convex(kinds: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int) -> bool:
    """Whether no friction of m contacts has a bound that its normal impulse sets."""
    for c in range(m):
        if kinds[c] != LIMIT and (0.0 < mu[c] < NO_SLIP or (kinds[c] == ROLLING and roll[c] > 0)):
            return False
    return True


@compiled
def solve_active_set(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, m: int, n: int,
                     W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float,
                     room: np.ndarray, U: np.ndarray) -> bool:
    """Solve a convex island for p (n,), from where it stands; whether that came to its end.

    ``tolerance``: m/s at which what does not press may approach. U, flat (n * n): Cholesky's factor
    of W at the active rows, which are ``places``.
    """
    z, u, normal, places = room[0], room[1], room[2], room[7]
    count = initial_active_set(kinds, rows, mu, m, p, places, normal)
    if not factor_rows(W, n, places, 0, count, U):
        return False
    for _ in range(TURNS * m + 8):
        for k in range(count):
            z[k] = -b[int(places[k])]
        substitute(U, n, count, z)
        share, drop = 1.0, -1
        for k in range(count):
            i = int(places[k])
            if normal[i] > 0 and z[k] < 0 and p[i] <= share * (p[i] - z[k]):
                share, drop = p[i] / (p[i] - z[k]), k
        for k in range(count):
            i = int(places[k])
            p[i] += share * (z[k] - p[i])
        if drop >= 0:
            p[int(places[drop])] = 0.0
            count -= 1
            remove_column(U, n, places, drop, count)
            if not factor_rows(W, n, places, drop, count, U):
                return False
            continue
        enter = most_approaching(rows, m, n, W, b, p, u, tolerance)
        if enter < 0:
            return True
        places[count] = enter
        append_column(W, U, n, places, count)
        count += 1
        if not factor_rows(W, n, places, count - 1, count, U):
            return False
    return False


@compiled
def initial_active_set(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, m: int, p: np.ndarray,
               places: np.ndarray, normal: np.ndarray) -> int:
    """Begin with the rows that stick and the normals that press; how many they are. ``normal`` (n,)
    becomes which rows push only.
    """
    count = 0
    for c in range(m):
        a = rows[c]
        normal[a] = 1.0
        for i in range(a + 1, a + kinds[c]):
            normal[i] = 0.0
            if i < a + 3 and mu[c] >= NO_SLIP:
                places[count] = i
                count += 1
            else:
                p[i] = 0.0
    for c in range(m):
        a = rows[c]
        if p[a] > 0:
            places[count] = a
            count += 1
        else:
            p[a] = 0.0
    return count


@compiled
def factor_rows(W: np.ndarray, n: int, places: np.ndarray, start: int, count: int,
                U: np.ndarray) -> bool:
    """Cholesky's factor, U^T U = W at ``places``, from row ``start`` on; whether there is one."""
    for i in range(start, count):
        at = int(places[i]) * n
        for j in range(i, count):
            U[i * n + j] = W[at + int(places[j])]
        if not factor_row(U, n, i, count):
            return False
    return True


@compiled
def append_column(W: np.ndarray, U: np.ndarray, n: int, places: np.ndarray, last: int) -> None:
    """Put the column of the row that came last, ``last``, into the factor's rows above it."""
    at = int(places[last]) * n
    for k in range(last):
        s = W[at + int(places[k])]
        for i in range(k):
            s -= U[i * n + k] * U[i * n + last]
        U[k * n + last] = s / U[k * n + k]


@compiled
def remove_column(U: np.ndarray, n: int, places: np.ndarray, drop: int, count: int) -> None:
    """Take a row from ``places`` and its column from the factor's rows above it."""
    for j in range(drop, count):
        places[j] = places[j + 1]
    for k in range(drop):
        for j in range(drop, count):
            U[k * n + j] = U[k * n + j + 1]


@compiled
def most_approaching(rows: np.ndarray, m: int, n: int, W: np.ndarray, b: np.ndarray,
                     p: np.ndarray, u: np.ndarray, tolerance: float) -> int:
    """The row of the contact without impulse that approaches fastest, -1 if none does."""
    velocities(W, b, p, n, u)
    worst, found = -tolerance, -1
    for c in range(m):
        a = rows[c]
        if p[a] <= 0.0 and u[a] < worst:
            worst, found = u[a], a
    return found
