"""Anderson acceleration of Gauss-Seidel sweeps.

A sweep maps impulses p to g; at the solution f = g - p, with rows weighted by the root of W's
diagonal, is zero. With the differences dF and dG of f and g between the last sweeps, the next one
begins at g - dG x, where x minimizes |f - dF x| (Anderson, Journal of the ACM 12, 1965; Walker and
Ni, SIAM Journal on Numerical Analysis 49, 2011).
"""
from __future__ import annotations

import collections
import math

import numpy as np

from ..compiling.decorators import compiled
from .cholesky import solve

MEMORY = 3
"""Differences that are kept. In heaps 5 and 8 need as many sweeps."""

REGULARIZATION = 1e-8
"""Share of the diagonal of dF^T dF that is added to it."""

Anderson = collections.namedtuple(
    'Anderson', 'start swept z_swept f f_steps steps z_steps normal rhs')
"""Impulses (n,) at the ``start`` of a sweep, and as ``swept``, with their ``z_swept`` (nv,); f
(n,); differences between sweeps: ``f_steps``, ``steps`` (MEMORY, n), ``z_steps`` (MEMORY,
nv); scratch."""


def make_anderson(rows: int, nv: int) -> Anderson:
    """Allocate the memory for so many rows and degrees of freedom."""
    return Anderson(
        start=np.zeros(rows), swept=np.zeros(rows), z_swept=np.zeros(nv), f=np.zeros(rows),
        f_steps=np.zeros((MEMORY, rows)), steps=np.zeros((MEMORY, rows)),
        z_steps=np.zeros((MEMORY, nv)), normal=np.zeros((MEMORY, MEMORY)), rhs=np.zeros(MEMORY))


@compiled
def accelerate(memory: Anderson, weights: np.ndarray, n: int, turn: int, p: np.ndarray,
               z: np.ndarray) -> None:
    """Replace the impulses p (n,) and z = Y^T p after sweep number ``turn`` by those at which the
    next sweep begins. memory.start must hold p before the sweep; turn 0 forgets earlier sweeps.
    ``weights`` (n,): roots of W's diagonal.
    """
    f, swept, z_swept = memory.f, memory.swept, memory.z_swept
    slot, count = turn % MEMORY, min(turn, MEMORY)
    f_step, step, z_step = memory.f_steps[slot], memory.steps[slot], memory.z_steps[slot]
    for i in range(n):
        now = weights[i] * (p[i] - memory.start[i])
        f_step[i], step[i] = now - f[i], p[i] - swept[i]
        f[i], swept[i] = now, p[i]
    for j in range(len(z)):
        z_step[j] = z[j] - z_swept[j]
        z_swept[j] = z[j]
    if count == 0:
        return
    A, x = memory.normal[:count, :count], memory.rhs[:count]
    first = turn - count + 1
    for a in range(count):
        own = memory.f_steps[(first + a) % MEMORY]
        for b in range(a + 1):
            A[a, b] = dot_rows(own, memory.f_steps[(first + b) % MEMORY], n)
        A[a, a] = (1 + REGULARIZATION) * A[a, a] + 1e-300
        x[a] = dot_rows(own, f, n)
    solve(A, x)
    if not math.isfinite(x.sum()):
        return
    for a in range(count):
        own, z_own, share = (memory.steps[(first + a) % MEMORY],
                             memory.z_steps[(first + a) % MEMORY], x[a])
        for i in range(n):
            p[i] -= share * own[i]
        for j in range(len(z)):
            z[j] -= share * z_own[j]


@compiled
def dot_rows(a: np.ndarray, b: np.ndarray, n: int) -> float:
    """The scalar product of the first n entries of a and b."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total
