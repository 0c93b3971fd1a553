"""Small symmetric systems of equations."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled


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


@compiled
def factor_row(U: np.ndarray, n: int, i: int, count: int) -> bool:
    """Make row i of a symmetric matrix, flat, n a row, that of its factor U^T U, up to column
    ``count``, from those above it; whether it has one. A processor does several columns at once.
    """
    own = U[i * n:i * n + count]
    for k in range(i):
        above, share = U[k * n:k * n + count], U[k * n + i]
        if share != 0.0:
            for j in range(i, count):
                own[j] -= share * above[j]
    if not own[i] > 0:
        return False
    scale = 1 / math.sqrt(own[i])
    for j in range(i, count):
        own[j] *= scale
    return True


@compiled
def substitute(U: np.ndarray, n: int, count: int, z: np.ndarray) -> None:
    """Put the x of U^T U x = z in z's place, (count,)."""
    for k in range(count):
        own = U[k * n:k * n + count]
        z[k] /= own[k]
        for j in range(k + 1, count):
            z[j] -= z[k] * own[j]
    for k in range(count - 1, -1, -1):
        s = z[k]
        for j in range(k + 1, count):
            s -= U[k * n + j] * z[j]
        z[k] = s / U[k * n + k]
