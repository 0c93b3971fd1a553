"""The instant of an impact: Newton's law of restitution and Coulomb's of friction."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts
from ..contact.gaps import place_geoms
from ..dynamics.forward_dynamics import forward_kinematics
from ..dynamics.mass_matrix import composite_rigid_body, factor_ltl, root_motion_subspaces, rotate_inertias
from ..impulses.solve_contacts import solve_contacts
from ..system import Workspace, System

TOLERANCE = 1e-10
"""m/s to which contacts are solved."""


@compiled
def impact(s: System, r: Workspace, q: np.ndarray, v: np.ndarray, bounces: bool) -> int:
    """Change v by the impulses of all that touches at q by r.gaps; how many contacts there are.

    Not ``bounces``: nothing is thrown back.
    """
    forward_kinematics(s.tree, q, v, r.kinematics)
    place_geoms(s.tree, s.body_root, s.geoms, r.kinematics, q, r.geom_positions, r.geom_rotations)
    m = find_contacts(s, q, r, r.gaps, 1e-6)
    if m == 0:
        return 0
    root_motion_subspaces(s.tree, q, r.kinematics.motion_subspaces)
    rotate_inertias(s.tree, r.kinematics, r.own)
    composite_rigid_body(s.tree, s.dof_parent, s.dof_body, r.kinematics, r.own, r.composite, r.H)
    factor_ltl(r.H, s.dof_parent)
    for i in range(m):
        for e in range(5):
            r.contacts[i].impulse[e] = 0.0
        if not bounces:
            r.contacts[i].restitution = 0.0
    change, shift = r.vectors[0], r.vectors[1]
    solve_contacts(s, r, q, v, v, m, 0.0, TOLERANCE, change, shift)
    for j in range(len(v)):
        v[j] += change[j]
    r.stats[0].impacts += 1
    return m
