"""Banded systems of linear equations, by Gaussian elimination with partial pivoting."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled


@compiled
def solve_banded(band: np.ndarray, n: int, width: int, x: np.ndarray) -> bool:
    """Solve A x = b in place, A (n, n) with at most ``width`` entries on either side of the
    diagonal. Row i of ``band``, flat, has 3 width + 1 entries, those of columns i - width to
    i + 2 width of A; the last ``width``, for row exchanges, are zero. Returns whether A is regular.
    """
    stride = 3 * width + 1
    for k in range(n):
        bottom = min(n - 1, k + width)
        best, most = k, 0.0
        for i in range(k, bottom + 1):
            size = abs(band[i * stride + k - i + width])
            if size > most:
                best, most = i, size
        if not 1e-300 < most < math.inf:
            return False
        columns = min(n - k, 2 * width + 1)
        at = k * stride + width
        pivot = band[at:at + columns]
        if best != k:
            other = best * stride + k - best + width
            for j in range(columns):
                band[at + j], band[other + j] = band[other + j], band[at + j]
            x[k], x[best] = x[best], x[k]
        inverse = 1 / pivot[0]
        for i in range(k + 1, bottom + 1):
            at = i * stride + k - i + width
            row = band[at:at + columns]
            f = row[0] * inverse
            if f != 0.0:
                for j in range(1, columns):
                    row[j] -= f * pivot[j]
                x[i] -= f * x[k]
    for i in range(n - 1, -1, -1):
        at, total = i * stride + width, x[i]
        for j in range(1, min(n - i, 2 * width + 1)):
            total -= band[at + j] * x[i + j]
        x[i] = total / band[at]
    return True
