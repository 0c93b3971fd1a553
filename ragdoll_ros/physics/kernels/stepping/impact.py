"""An impact: Newton's law of restitution and Coulomb's law of friction at an instant."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts
from ..contact.gaps import TOUCHING
from ..dynamics.kinematics import (forward_kinematics, place_geoms, root_motion_subspaces,
                                   rotate_inertias)
from ..dynamics.mass_matrix import factor_ltl, mass_matrix
from ..impulses.solve_contacts import solve_contacts
from ..system import System
from ..workspace import Workspace

TOLERANCE = 1e-10
"""m/s: tolerance of the contact solve."""


@compiled
def impact(s: System, ws: Workspace, q: np.ndarray, v: np.ndarray, bounces: bool) -> int:
    """Add to v the change by the impulses of everything that touches at q by ws.gaps. Returns the
    number of contacts. ``bounces``: whether there is restitution.
    """
    kin, dyn, contacts = ws.step.start, ws.step.dynamics, ws.contacts.found
    forward_kinematics(s.tree, q, v, kin)
    place_geoms(s.tree, s.body_root, s.geoms, q, kin)
    m = find_contacts(s, ws, kin, q, ws.gaps, TOUCHING)
    if m == 0:
        return 0
    root_motion_subspaces(s.tree, q, kin)
    rotate_inertias(s.tree, kin, dyn.matrix)
    mass_matrix(s.tree, s.dof_parent, s.dof_body, kin, dyn)
    factor_ltl(dyn.H, s.dof_parent)
    for i in range(m):
        for e in range(5):
            contacts[i].impulse[e] = 0.0
        if not bounces:
            contacts[i].restitution = 0.0
    solve_contacts(s, ws, kin, q, v, v, m, 0.0, TOLERANCE)
    for j in range(len(v)):
        v[j] += ws.step.v_change[j]
    ws.stats[0].impacts += 1
    return m
