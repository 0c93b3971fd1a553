"""Cholesky factorization of small symmetric matrices."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled


@compiled
def solve(a: np.ndarray, b: np.ndarray) -> None:
    """Solve a x = b in place, b becomes x, by Cholesky; a (n, n) > 0 is overwritten."""
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
    """Replace row i of a symmetric matrix, flat in U, n a row, by that of its factor, U^T U, up to
    column ``count``, from the rows above it. Returns whether its pivot is positive. Loops over
    columns, and takes four rows at once, for vector instructions.
    """
    own, width, k = U[i * n + i:i * n + count], count - i, 0
    while k + 4 <= i:
        at = k * n + i
        a, b = U[at:at + width], U[at + n:at + n + width]
        c, d = U[at + 2 * n:at + 2 * n + width], U[at + 3 * n:at + 3 * n + width]
        x, y, z, w = a[0], b[0], c[0], d[0]
        if x != 0.0 or y != 0.0 or z != 0.0 or w != 0.0:
            for j in range(width):
                own[j] = own[j] - x * a[j] - y * b[j] - z * c[j] - w * d[j]
        k += 4
    while k < i:
        a = U[k * n + i:k * n + count]
        x = a[0]
        if x != 0.0:
            for j in range(width):
                own[j] -= x * a[j]
        k += 1
    if not own[0] > 0:
        return False
    scale = 1 / math.sqrt(own[0])
    for j in range(width):
        own[j] *= scale
    return True


@compiled
def substitute(U: np.ndarray, n: int, count: int, z: np.ndarray) -> None:
    """Solve U^T U x = z in place: z (count,) becomes x. U: flat, n a row."""
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
