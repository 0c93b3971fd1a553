"""Warm start: a step's solve begins with the impulses of the step before."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find_contacts import find_id
from ..contact.gaps import MET
from ..contact_kind import LIMIT
from ..impulses.solve_contacts import SEPARATING
from ..maths.vectors import norm, vec
from ..system import System
from ..workspace import Workspace
from .impact import closes_fast

JAMMED = 10.0
"""Factor on all momenta and weights above which impulses are those of a jam."""


@compiled
def jam_threshold(s: System, ws: Workspace, h: float) -> float:
    """Sum of impulses, N s, that only jammed contacts exceed in h s: JAMMED times the sum over
    dolls of sqrt(2 m E) + m g h, E their kinetic energy.
    """
    momentum, weight = 0.0, norm(vec(s.gravity))
    for d in range(len(ws.step.sums_before)):
        mass = s.doll_masses[d]
        momentum += math.sqrt(2 * ws.step.sums_before[d].kinetic * mass) + mass * weight * h
    return JAMMED * momentum


@compiled
def warm_start(s: System, ws: Workspace, m: int, known: np.ndarray, h: float) -> None:
    """Set the initial impulses of m found contacts, matched by id: those of contacts.tried, the
    last trial of this step; else those of ``known``, the last step, scaled by the ratio of step
    lengths; else 0. Contacts that are in contacts.start are persistent, and get their gap and
    velocities there by take_start(), which removes the friction, and its impulses, of those that
    separate. Where impacts are not sought, a contact that closes fast is not persistent if it is
    not in ``known`` or had a gap above MET there.

    Impulses of jammed contacts are undetermined and would grow from step to step: if the sum of the
    scaled normal impulses exceeds jam_threshold(), all begin at zero.
    """
    stats, pressed = ws.stats[0], 0.0
    tried_count = ws.step.scalars[0].tried_count
    share = h / stats.last_dt if stats.last_dt > 0 else 0.0
    for j in range(stats.contact_count):
        pressed += abs(known[j].impulse[0])
    if share * pressed > jam_threshold(s, ws, h):
        share, tried_count = 0.0, 0
    start_count = ws.step.scalars[0].start_contact_count
    j = k = t = 0
    for i in range(m):
        c = ws.contacts.found[i]
        for e in range(5):
            c.impulse[e] = 0.0
        j = find_id(known, stats.contact_count, c.id, j)
        is_new = not ws.step.scalars[0].seeks_impacts
        if j < stats.contact_count:
            is_new &= known[j].gap > MET
            for e in range(5):
                c.impulse[e] = share * known[j].impulse[e]
        t = find_id(ws.contacts.tried, tried_count, c.id, t)
        if t < tried_count:
            for e in range(5):
                c.impulse[e] = ws.contacts.tried[t].impulse[e]
        k = find_id(ws.contacts.start, start_count, c.id, k)
        c.persistent = 1 if k < start_count and not (
            is_new and closes_fast(ws.contacts.start[k])) else 0
        if c.persistent:
            take_start(c, ws.contacts.start[k])


@compiled
def take_start(c: np.record, start: np.record) -> None:
    """Copy gap and velocities of a persistent contact at the step's start to ``c``; if it separates
    there, remove its friction.
    """
    c.gap, c.spin = start.gap, start.spin
    for e in range(5):
        c.start_velocity[e] = start.start_velocity[e]
    if c.kind != LIMIT and start.start_velocity[0] > SEPARATING:
        c.friction = c.rolling_friction = 0.0
        for e in range(1, 5):
            c.impulse[e] = 0.0
