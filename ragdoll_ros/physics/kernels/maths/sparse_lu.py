"""LU factorization of sparse matrices whose pattern is symmetric, without row exchanges.

The pattern is a union of cliques: sets of indices all of whose pairs have an entry. The symbolic
part finds where the factor U has entries, along the elimination tree, whose parent of a row is its
first column behind the diagonal (Liu, SIAM Journal on Matrix Analysis and Applications 11, 1990).
The numeric part goes row by row and applies L to the right-hand side at once, so that L is not
stored (Davis, Direct Methods for Sparse Linear Systems, 2006).
"""
from __future__ import annotations

import collections
import math

import numpy as np

from ..compiling.decorators import compiled

ROOM = 256
"""Entries in a row of U for which there is room on average; as many as there are columns in small
matrices."""

SparseLU = collections.namedtuple(
    'SparseLU', 'sets sizes start columns values inverse above_start above mark row set_head '
    'set_next child sibling')
"""A sparse factor. ``sets`` (m, k), of which ``sizes`` (m,) count: the cliques. Row i of U has
``columns``, ascending, and ``values`` from start[i] to start[i + 1], and the reciprocal of its
pivot in ``inverse``; the rows ``above`` that have an entry in column i are those from
above_start[i] to above_start[i + 1], in order. ``row`` (n,): the row that is eliminated. The others
are lists: cliques by their first index, children by their parent in the elimination tree."""


def make_sparse_lu(n: int, sets: int, size: int) -> SparseLU:
    """Allocate an LU factor of n rows, of up to ``sets`` cliques of up to ``size`` indices each,
    with room for n min(n, ROOM) entries of U.
    """
    room = n * min(n, ROOM)

    def indices(count: int) -> np.ndarray:
        return np.zeros(count, np.int64)

    return SparseLU(
        sets=np.zeros((sets, size), np.int64), sizes=indices(sets), start=indices(n + 1),
        columns=indices(room), values=np.zeros(room), inverse=np.zeros(n),
        above_start=indices(n + 1), above=indices(room), mark=indices(n), row=np.zeros(n),
        set_head=indices(n), set_next=indices(sets), child=indices(n), sibling=indices(n))


@compiled
def find_pattern(lu: SparseLU, n: int, m: int) -> int:
    """Find the pattern of U (n, n) for m cliques. Returns how many entries the elimination of all
    rows changes, or -1 if there is no room.
    """
    start, columns, mark = lu.start, lu.columns, lu.mark
    for i in range(n):
        mark[i] = lu.set_head[i] = lu.child[i] = -1
    for k in range(m):
        first = n
        for x in range(lu.sizes[k]):
            first = min(first, lu.sets[k, x])
        if first < n:
            lu.set_next[k], lu.set_head[first] = lu.set_head[first], k
    total = work = 0
    for i in range(n):
        if total + n - i > len(columns):
            return -1
        start[i], mark[i], parent = total, i, n
        k = lu.set_head[i]
        while k >= 0:
            for x in range(lu.sizes[k]):
                j = lu.sets[k, x]
                if mark[j] != i:
                    mark[j], columns[total], total = i, j, total + 1
                    parent = min(parent, j)
            k = lu.set_next[k]
        k = lu.child[i]
        while k >= 0:
            for e in range(start[k], start[k + 1]):
                j = columns[e]
                if mark[j] != i:
                    mark[j], columns[total], total = i, j, total + 1
                    parent = min(parent, j)
            k = lu.sibling[k]
        start[i + 1] = total
        sort_columns(columns, start[i], total)
        work += (total - start[i]) ** 2
        if parent < n:
            lu.sibling[i], lu.child[parent] = lu.child[parent], i
    transpose_pattern(lu, n)
    return work


@compiled
def sort_columns(columns: np.ndarray, begin: int, end: int) -> None:
    """Sort the entries from ``begin`` to ``end`` in place."""
    for e in range(begin + 1, end):
        own, k = columns[e], e
        while k > begin and columns[k - 1] > own:
            columns[k], k = columns[k - 1], k - 1
        columns[k] = own


@compiled
def transpose_pattern(lu: SparseLU, n: int) -> None:
    """Write the rows of U that have an entry in each column to lu.above."""
    begin, at = lu.above_start, lu.mark
    for i in range(n):
        at[i] = 0
    for e in range(lu.start[n]):
        at[lu.columns[e]] += 1
    begin[0] = 0
    for i in range(n):
        begin[i + 1] = begin[i] + at[i]
        at[i] = begin[i]
    for k in range(n):
        for e in range(lu.start[k], lu.start[k + 1]):
            i = lu.columns[e]
            lu.above[at[i]] = k
            at[i] += 1


@compiled
def clear_row(lu: SparseLU, i: int) -> None:
    """Zero the entries of lu.row that row i of L + U has."""
    for e in range(lu.above_start[i], lu.above_start[i + 1]):
        lu.row[lu.above[e]] = 0.0
    for e in range(lu.start[i], lu.start[i + 1]):
        lu.row[lu.columns[e]] = 0.0
    lu.row[i] = 0.0


@compiled
def eliminate_row(lu: SparseLU, i: int, b: np.ndarray) -> bool:
    """Eliminate row i, of which lu.row has the entries of A, and its right-hand side b[i], by the
    rows before it. Returns whether its pivot is regular.
    """
    row, columns, values, start = lu.row, lu.columns, lu.values, lu.start
    e, end = lu.above_start[i], lu.above_start[i + 1]
    while e < end:
        k = lu.above[e]
        f, first, e = row[k] * lu.inverse[k], start[k], e + 1
        b[i] -= f * b[k]
        count = start[k + 1] - first
        if e < end and lu.above[e] == k + 1 and columns[first] == k + 1 and (
                start[k + 2] - start[k + 1] == count - 1):
            # Rows of one body have one pattern: two at once, as addresses are indirect.
            row[k + 1] -= f * values[first]
            h, next_first, e = row[k + 1] * lu.inverse[k + 1], start[k + 1], e + 1
            b[i] -= h * b[k + 1]
            for g in range(count - 1):
                row[columns[next_first + g]] -= (
                    f * values[first + 1 + g] + h * values[next_first + g])
        else:
            for g in range(first, first + count):
                row[columns[g]] -= f * values[g]
    if not 1e-300 < abs(row[i]) < math.inf:
        return False
    lu.inverse[i] = 1 / row[i]
    for g in range(lu.start[i], lu.start[i + 1]):
        values[g] = row[columns[g]]
    return True


@compiled
def substitute_back(lu: SparseLU, n: int, b: np.ndarray) -> None:
    """Solve U x = b in place."""
    for i in range(n - 1, -1, -1):
        total = b[i]
        for g in range(lu.start[i], lu.start[i + 1]):
            total -= lu.values[g] * b[lu.columns[g]]
        b[i] = total * lu.inverse[i]
