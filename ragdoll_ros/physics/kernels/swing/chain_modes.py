"""Lowest frequencies of hanging chains, by inverse iteration with Rayleigh's quotient.

Small angles phi of n links from a line along which gravity acts: M phi'' = -K phi, with
M_ij = l_i l_j sum of the masses from max(i, j) on, and K tridiagonal of springs between links and
of the weight that each link bears.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled, entry, type_like

ITERATIONS = 4
"""Inverse iterations. They begin with a straight chain; one leaves an error of 3e-4, each further
one a thousandth, for equal links."""


@compiled
def apply_inertia(lengths: np.ndarray, masses: np.ndarray, first: int, x: np.ndarray,
                  out: np.ndarray) -> None:
    """Write M x of the links from ``first`` on to ``out``."""
    n = len(lengths)
    place = 0.0
    for i in range(first, n):
        place += lengths[i] * x[i]
        out[i] = masses[i] * place
    total = 0.0
    for i in range(n - 1, first - 1, -1):
        total += out[i]
        out[i] = lengths[i] * total


@compiled
def solve_stiffness(springs: np.ndarray, weights: np.ndarray, first: int, f: np.ndarray,
                    x: np.ndarray, pivots: np.ndarray) -> bool:
    """Solve K x = f of the links from ``first`` on, from the tip to the root; whether K has an
    inverse. Scratch: ``pivots`` (n,).
    """
    n = len(springs)
    for i in range(n - 1, first - 1, -1):
        # What is beyond link i acts on it through its spring, in series with all beyond that.
        pivots[i], x[i] = springs[i] + weights[i], f[i]
        if i < n - 1:
            pivots[i] += springs[i + 1] * (1 - springs[i + 1] / pivots[i + 1])
            x[i] += springs[i + 1] * x[i + 1] / pivots[i + 1]
        if not pivots[i] > 0:
            return False
    for i in range(first, n):
        x[i] = (x[i] + (springs[i] * x[i - 1] if i > first else 0.0)) / pivots[i]
    return True


@entry(*[type_like(np.zeros(0))] * 5)
def lowest_squares(lengths: np.ndarray, masses: np.ndarray, springs: np.ndarray,
                   weights: np.ndarray, out: np.ndarray) -> None:
    """Write to ``out`` (n,) the square, 1/s^2, of the lowest frequency of each link with all beyond
    it, its root at rest; 0 where the stiffness matrix has no inverse.

    ``lengths`` m, ``masses`` kg at the ends, ``springs`` N m/rad at the roots, and ``weights`` N
    m/rad that gravity adds: each link's length times the weight of the masses from its own on.
    """
    n = len(lengths)
    x, f, inertia, pivots = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for first in range(n):
        x[:] = 1.0
        apply_inertia(lengths, masses, first, x, f)
        out[first] = 0.0
        for _ in range(ITERATIONS):
            if not solve_stiffness(springs, weights, first, f, x, pivots):
                break
            apply_inertia(lengths, masses, first, x, inertia)
            energy, motion = 0.0, 0.0
            for i in range(first, n):
                energy += x[i] * f[i]
                motion += x[i] * inertia[i]
            out[first] = energy / motion
            for i in range(first, n):
                f[i] = inertia[i] * out[first]
