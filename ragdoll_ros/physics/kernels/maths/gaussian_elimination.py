"""Gaussian elimination of small dense matrices.

Two columns are eliminated at once: each entry is read and written half as often, and loops over a
row do twice as much.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled

SINGULAR = 1e-300
"""A pivot that is not larger is taken as zero."""


@compiled
def gaussian_elimination(G: np.ndarray, n: int, x: np.ndarray) -> bool:
    """Solve G x = b with partial pivoting: x (n,) holds b before and the solution after; G, flat
    (n * n), is overwritten. Returns whether G is regular.
    """
    k = 0
    while k + 1 < n:
        at = k * n
        best = largest_pivot(G, n, k, k)
        if not abs(G[best * n + k]) > SINGULAR:
            return False
        swap_rows(G, n, x, k, best)
        inverse, beside = 1 / G[at + k], G[at + k + 1]
        for i in range(k + 1, n):
            G[i * n + k] *= inverse
            G[i * n + k + 1] -= G[i * n + k] * beside
        best = largest_pivot(G, n, k + 1, k + 1)
        if not abs(G[best * n + k + 1]) > SINGULAR:
            return False
        swap_rows(G, n, x, k + 1, best)
        first, second = G[at + k + 2:at + n], G[at + n + k + 2:at + 2 * n]
        width, f = n - k - 2, G[at + n + k]
        for j in range(width):
            second[j] -= f * first[j]
        x[k + 1] -= f * x[k]
        G[at + k], G[at + n + k + 1] = inverse, 1 / G[at + n + k + 1]
        for i in range(k + 2, n):
            f, g = G[i * n + k], G[i * n + k + 1] * G[at + n + k + 1]
            own = G[i * n + k + 2:i * n + n]
            for j in range(width):
                own[j] = own[j] - f * first[j] - g * second[j]
            x[i] = x[i] - f * x[k] - g * x[k + 1]
        k += 2
    if k < n:
        if not abs(G[n * n - 1]) > SINGULAR:
            return False
        G[n * n - 1] = 1 / G[n * n - 1]
    for i in range(n - 1, -1, -1):
        x[i] *= G[i * n + i]
        for j in range(i):
            x[j] -= G[j * n + i] * x[i]
    return True


@compiled
def largest_pivot(G: np.ndarray, n: int, column: int, start: int) -> int:
    """Row, from ``start`` on, with the largest entry of a column."""
    best, most = start, abs(G[start * n + column])
    for i in range(start + 1, n):
        if abs(G[i * n + column]) > most:
            best, most = i, abs(G[i * n + column])
    return best


@compiled
def swap_rows(G: np.ndarray, n: int, x: np.ndarray, i: int, k: int) -> None:
    """Exchange rows i and k of G and x."""
    if i != k:
        for j in range(n):
            G[i * n + j], G[k * n + j] = G[k * n + j], G[i * n + j]
        x[i], x[k] = x[k], x[i]
