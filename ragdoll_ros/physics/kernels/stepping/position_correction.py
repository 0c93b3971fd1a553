"""Position correction: penetrations are removed by a displacement, without velocity.

It raises the potential energy. The motion pays for that, so it goes no further than a share of the
kinetic energy allows; nor does it take a joint past a limit.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import BEYOND_LIMIT, DEEP_PENETRATION
from ..contact_kind import LIMIT
from ..dynamics.kinematics import Kinematics, body_velocity, linear, update_velocities
from ..maths.vectors import add, cross, dot, norm, scale, vec
from ..system import System
from ..workspace import Workspace
from .momentum import internal_kinetic_energy

PAID_SHARE = 0.005
"""Share of the internal kinetic energy that position correction may cost in a step."""


@compiled
def correction_energy(s: System, ws: Workspace, kin: Kinematics, correction: np.ndarray) -> float:
    """Potential energy, J, that a displacement ``correction`` (nv,) adds; composite inertias and
    motion subspaces are those of ``kin``.
    """
    total, g = 0.0, vec(s.gravity)
    for j in range(len(correction)):
        if correction[j] != 0.0:
            axis, subtree = (kin.motion_subspaces[j],
                             ws.step.dynamics.composite_inertias[s.dof_body[j]])
            total -= correction[j] * dot(g, add(scale(subtree.mass, linear(axis)),
                                                cross(vec(axis), vec(subtree.moment))))
    return total


@compiled
def limit_correction_energy(s: System, ws: Workspace, m: int, correction: np.ndarray) -> None:
    """Scale a displacement ``correction`` (nv,) so that the potential energy it adds stays below a
    share of the internal kinetic energy. Deep penetrations into the ground or past a limit are
    corrected whatever the energy; what the motion does not pay is booked.
    """
    deep, scalars = False, ws.step.scalars[0]
    for i in range(m):
        c = ws.contacts.found[i]
        deep |= c.body_b < 0 and c.gap < -(BEYOND_LIMIT if c.kind == LIMIT else DEEP_PENETRATION)
    paid = PAID_SHARE * max(0.0, internal_kinetic_energy(s, ws))
    if scalars.correction_energy <= paid:
        return
    if deep:
        ws.stats[0].work_position_correction += scalars.correction_energy - paid
    else:
        share = paid / scalars.correction_energy
        for j in range(len(correction)):
            correction[j] *= share
        scalars.correction_energy *= share


@compiled
def enter_correction_bounds(s: System, kin: Kinematics, q: np.ndarray, correction: np.ndarray,
                            motion: np.ndarray) -> None:
    """Enter by how much a displacement ``correction`` (nv,) moves, m, and turns, rad, each body
    into ``motion``. ``kin`` is that of q; its velocities are overwritten.
    """
    some = False
    for j in range(len(correction)):
        some |= correction[j] != 0.0
    if some:
        update_velocities(s.tree, q, correction, kin)
    for i in range(len(s.tree)):
        motion[i].correction = motion[i].correction_angle = 0.0
        if some:
            moved, motion[i].correction_angle = body_velocity(kin, i)
            motion[i].correction = norm(moved)


@compiled
def clip_to_joint_limits(s: System, q: np.ndarray, correction: np.ndarray) -> None:
    """Scale the displacement ``correction`` (nv,) of each doll so that it takes no joint past a
    limit that it has not reached.
    """
    share, doll = 1.0, -1
    for k in range(len(s.joint_limits)):
        limit = s.joint_limits[k]
        if s.body_doll[s.dof_body[limit.dof]] != doll:
            scale_doll(s, doll, share, correction)
            share, doll = 1.0, s.body_doll[s.dof_body[limit.dof]]
        way = correction[limit.dof]
        room = q[limit.q] - limit.lower if way < 0 else limit.upper - q[limit.q]
        if room > 0 and abs(way) > room:
            share = min(share, room / abs(way))
    scale_doll(s, doll, share, correction)


@compiled
def scale_doll(s: System, doll: int, share: float, correction: np.ndarray) -> None:
    """Scale the part of a displacement (nv,) that is one doll's."""
    if share < 1:
        for j in range(len(correction)):
            if s.body_doll[s.dof_body[j]] == doll:
                correction[j] *= share
