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
