"""Impulses for a step to begin with: those of the step before."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..impulses.response import PARTING
from ..system import Room, System

JAMMED = 10.0
"""Times all momenta and weights that impulses may be before they are those of a jam."""


@compiled
def jammed(s: System, r: Room, h: float) -> float:
    """Sum of impulses, N s, that only what jams exceeds in h s."""
    momentum, g = 0.0, s.gravity
    weight = math.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2)
    for d in range(len(r.before)):
        mass = s.doll_masses[d]
        momentum += math.sqrt(2 * r.before[d].kinetic * mass) + mass * weight * h
    return JAMMED * momentum


@compiled
def warm_start(s: System, r: Room, m: int, known: np.ndarray, h: float) -> None:
    """Begin with the impulses of the step before, of the contacts that there were.

    Where contacts jam, what they press against each other is decided by nothing, and would grow
    from step to step: from where it is beyond all measure, they begin with none.
    """
    tally, pressed = r.tally[0], 0.0
    scale = h / tally.lasted if tally.lasted > 0 else 0.0
    for j in range(tally.contacts):
        pressed += abs(known[j].impulse[0])
    if scale * pressed > jammed(s, r, h):
        scale = 0.0
    j = k = 0
    for i in range(m):
        c = r.contacts[i]
        for e in range(5):
            c.impulse[e] = 0.0
        j = find_key(known, tally.contacts, c.key, j)
        if j < tally.contacts:
            for e in range(5):
                c.impulse[e] = scale * known[j].impulse[e]
        k = find_key(r.begun, r.count[0], c.key, k)
        c.begun = 1 if k < r.count[0] else 0
        if c.begun:
            old = r.begun[k]
            c.gap = old.gap
            for e in range(5):
                c.start[e] = old.start[e]
            if c.kind > 1 and old.start[0] > PARTING:
                c.friction = c.rolling = 0.0
                for e in range(1, 5):
                    c.impulse[e] = 0.0


@compiled
def find_key(contacts: np.ndarray, count: int, key: int, near: int) -> int:
    """Where among so many contacts that with the key stands, sought from ``near`` on, as most stand
    in the same order; ``count``: nowhere.
    """
    for n in range(count):
        j = near + n
        if j >= count:
            j -= count
        if contacts[j].key == key:
            return j
    return count
