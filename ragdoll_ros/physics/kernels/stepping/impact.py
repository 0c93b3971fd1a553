"""The instant of an impact: Newton's law of restitution and Coulomb's of friction."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find import find_contacts
from ..contact.gaps import place_geoms
from ..dynamics.forward import pose
from ..dynamics.mass import crba, factor, root_axes, turn_inertias
from ..impulses.response import respond
from ..system import Room, System

TOLERANCE = 1e-10
"""m/s to which contacts are solved."""


@compiled
def impact(s: System, r: Room, q: np.ndarray, v: np.ndarray, bounces: bool) -> int:
    """Change v by the impulses of all that touches at q by r.gaps; how many contacts there are.

    Not ``bounces``: nothing is thrown back.
    """
    pose(s.tree, q, v, r.work)
    place_geoms(s.tree, s.root_of, s.geoms, r.work, q, r.at, r.turn)
    m = find_contacts(s, q, r, r.gaps, 1e-6)
    if m == 0:
        return 0
    root_axes(s.tree, q, r.work.axes)
    turn_inertias(s.tree, r.work, r.own)
    crba(s.tree, s.up, s.bone_of, r.work, r.own, r.composite, r.H)
    factor(r.H, s.up)
    for i in range(m):
        for e in range(5):
            r.contacts[i].impulse[e] = 0.0
        if not bounces:
            r.contacts[i].restitution = 0.0
    change, shift = r.vectors[0], r.vectors[1]
    respond(s, r, q, v, v, m, 0.0, TOLERANCE, change, shift)
    for j in range(len(v)):
        v[j] += change[j]
    r.tally[0].impacts += 1
    return m
