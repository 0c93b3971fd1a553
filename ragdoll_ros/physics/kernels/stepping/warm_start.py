"""Impulses for a step to begin with: those of the step before."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..impulses.solve_contacts import PARTING
from ..system import Workspace, System

JAMMED = 10.0
"""Times all momenta and weights that impulses may be before they are those of a jam."""


@compiled
def jam_threshold(s: System, r: Workspace, h: float) -> float:
    """Sum of impulses, N s, that only what jams exceeds in h s."""
    momentum, g = 0.0, s.gravity
    weight = math.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2)
    for d in range(len(r.sums_before)):
        mass = s.doll_masses[d]
        momentum += math.sqrt(2 * r.sums_before[d].kinetic * mass) + mass * weight * h
    return JAMMED * momentum


@compiled
def warm_start(s: System, r: Workspace, m: int, known: np.ndarray, h: float) -> None:
    """Begin with the impulses of the step before, of the contacts that there were.

    Where contacts jam, what they press against each other is decided by nothing, and would grow
    from step to step: from where it is beyond all measure, they begin with none.
    """
    tally, pressed = r.stats[0], 0.0
    scale = h / tally.last_dt if tally.last_dt > 0 else 0.0
    for j in range(tally.contact_count):
        pressed += abs(known[j].impulse[0])
    if scale * pressed > jam_threshold(s, r, h):
        scale = 0.0
    j = k = 0
    for i in range(m):
        c = r.contacts[i]
        for e in range(5):
            c.impulse[e] = 0.0
        j = find_key(known, tally.contact_count, c.id, j)
        if j < tally.contact_count:
            for e in range(5):
                c.impulse[e] = scale * known[j].impulse[e]
        k = find_key(r.start_contacts, r.count[0], c.id, k)
        c.persistent = 1 if k < r.count[0] else 0
        if c.persistent:
            old = r.start_contacts[k]
            c.gap = old.gap
            for e in range(5):
                c.start_velocity[e] = old.start_velocity[e]
            if c.kind > 1 and old.start_velocity[0] > PARTING:
                c.friction = c.rolling_friction = 0.0
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
        if contacts[j].id == key:
            return j
    return count
