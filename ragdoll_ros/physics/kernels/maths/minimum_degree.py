"""Order of elimination of a sparse symmetric matrix: minimum degree.

The next node is always the one that is connected to the fewest others, by entries of the matrix or
by the elimination so far (Tinney and Walker, Proceedings of the IEEE 55, 1967; George and Liu, SIAM
Review 31, 1989); of equal ones, the first. Nodes are blocks of rows and weigh as many.
"""
from __future__ import annotations

import collections

import numpy as np

from ..compiling.decorators import compiled

MOST_NODES = 2048
"""Nodes for which there is room at most."""

MinimumDegree = collections.namedtuple('MinimumDegree', 'graph weight degree near order')
"""``graph`` (n, n): whether nodes are connected, symmetric; ``weight`` (n,) of each; its
``degree``, the weight of all nodes that it is connected to, -1 once it is eliminated; ``near``: a
list of some nodes; their ``order``."""


def make_minimum_degree(nodes: int) -> MinimumDegree:
    """Allocate room for ``nodes`` nodes, at most MOST_NODES."""
    room = min(nodes, MOST_NODES)
    return MinimumDegree(np.zeros((room, room), np.uint8),
                         *(np.zeros(room, np.int64) for _ in range(4)))


@compiled
def find_order(nodes: MinimumDegree, n: int) -> None:
    """Write the order in which n nodes are eliminated to nodes.order; nodes.graph fills up."""
    graph, weight, degree, near = nodes.graph, nodes.weight, nodes.degree, nodes.near
    for i in range(n):
        degree[i] = 0
        for j in range(n):
            if graph[i, j] and j != i:
                degree[i] += weight[j]
    for k in range(n):
        best = -1
        for i in range(n):
            if degree[i] >= 0 and (best < 0 or degree[i] < degree[best]):
                best = i
        nodes.order[k], degree[best], count = best, -1, 0
        for j in range(n):
            if graph[best, j] and degree[j] >= 0:
                near[count] = j
                count += 1
        for a in range(count):
            i = near[a]
            degree[i] -= weight[best]
            for b in range(a):
                j = near[b]
                if not graph[i, j]:
                    graph[i, j] = graph[j, i] = 1
                    degree[i] += weight[j]
                    degree[j] += weight[i]
