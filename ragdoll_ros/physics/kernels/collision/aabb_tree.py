"""A tree of bounding boxes: which bones may touch which static geoms within a time.

The boxes are sorted along a Morton curve (Morton 1966), which keeps neighbors together, and paired
level by level. The tree is built once: what it holds never moves.
"""
from __future__ import annotations

import collections

import numpy as np

from ..compiling.decorators import compiled, entry, type_like
from ..maths.vectors import Vec3, norm, vec
from .sweep_and_prune import IMPACT_SPEEDUP, MARGIN

MORTON_BITS = 10
"""Bits of the position along each axis that decide a box's place on the curve."""

STACK = 64
"""Nodes that wait to be visited: at most one for each level of a tree."""

AabbTree = collections.namedtuple('AabbTree', 'lower upper order stack')
"""Of m boxes. ``lower``, ``upper`` (2 k, 3) m: corners of the nodes' boxes, k a power of 2. Node 1
is the root, 2 i and 2 i + 1 are the children of i; nodes from k on are the boxes in ``order`` (m,);
what is beyond these is empty. ``stack``: scratch."""


def make_aabb_tree(lower: np.ndarray, upper: np.ndarray) -> AabbTree:
    """Build the AABB tree of boxes with the corners ``lower`` and ``upper`` (m, 3), in m: a
    complete binary tree with its leaves along a Morton curve.
    """
    order = _along_curve((lower + upper) / 2)
    leaves = 1 << max(0, len(order) - 1).bit_length()
    low, high = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    low[leaves:leaves + len(order)] = lower[order]
    high[leaves:leaves + len(order)] = upper[order]
    level = leaves
    while level > 1:
        half = level // 2
        low[half:level] = low[level:2 * level].reshape(half, 2, 3).min(axis=1)
        high[half:level] = high[level:2 * level].reshape(half, 2, 3).max(axis=1)
        level = half
    return AabbTree(low, high, order, np.zeros(STACK, np.int64))


def _along_curve(centers: np.ndarray) -> np.ndarray:
    """Indices (m,) of points (m, 3) in the order of a Morton curve."""
    size = np.ptp(centers, axis=0)
    cells = (centers - centers.min(axis=0)) / np.where(size > 0, size, 1.0)
    cells = (cells * ((1 << MORTON_BITS) - 1)).astype(np.int64)
    code = np.zeros(len(centers), np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code, kind='stable')


@compiled
def is_near(tree: AabbTree, node: int, center: Vec3, radius: float) -> bool:
    """Whether a sphere touches the box of a node."""
    squared = 0.0
    for e in range(3):
        beyond = max(tree.lower[node, e] - center[e], center[e] - tree.upper[node, e], 0.0)
        squared += beyond * beyond
    return squared <= radius * radius


TREE = type_like(make_aabb_tree(np.zeros((1, 3)), np.zeros((1, 3))))
STATES, REACH, MASK, KEYS = (type_like(each) for each in (
    np.zeros((0, 13)), np.zeros(0), np.zeros(0, bool), np.zeros(0, np.int64)))


@entry(TREE, STATES, REACH, MASK, type_like(0.0), KEYS)
def find_near(tree: AabbTree, states: np.ndarray, reach: np.ndarray, moving: np.ndarray,
              ahead: float, keys: np.ndarray) -> int:
    """Find the boxes of ``tree`` that each bone of the mask ``moving`` (n,) may touch within
    ``ahead`` s: by its bounding sphere of radius ``reach`` (n,), m, widened by MARGIN and by its
    motion at IMPACT_SPEEDUP times its speed. Writes bone * m + box, of m boxes, to ``keys`` (k,).
    Returns the number found; if it exceeds k, the others are not written. ``states`` (n, 13): of
    all bones.
    """
    count, boxes, leaves = 0, len(tree.order), len(tree.lower) // 2
    for i in range(len(states)):
        if not moving[i]:
            continue
        center = vec(states[i])
        radius = reach[i] + MARGIN + IMPACT_SPEEDUP * ahead * (
            norm(vec(states[i, 7:])) + reach[i] * norm(vec(states[i, 10:])))
        waiting = 1
        tree.stack[0] = 1
        while waiting:
            waiting -= 1
            node = tree.stack[waiting]
            if not is_near(tree, node, center, radius):
                continue
            if node < leaves:
                tree.stack[waiting], tree.stack[waiting + 1] = 2 * node, 2 * node + 1
                waiting += 2
            else:
                if count < len(keys):
                    keys[count] = i * boxes + tree.order[node - leaves]
                count += 1
    return count
