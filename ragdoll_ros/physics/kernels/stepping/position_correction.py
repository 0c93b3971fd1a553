"""Position correction: bounds on the energy and the joint motion of the displacement that removes
penetrations. Its target: solve_contacts.set_correction(); solved by
solver.solve_position_correction() and large_island.solve_large(); applied in
contact_step.finish_step().
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
from .momentum import internal_kinetic_energy, is_borne

PAID_SHARE = 0.005
"""Share of the internal kinetic energy that position correction may add in a step."""


@compiled
def correction_energy(s: System, ws: Workspace, kin: Kinematics, correction: np.ndarray) -> float:
    """Energy, J, that a displacement ``correction`` (nv,) adds in gravity, to first order; springs
    are not counted. ``kin`` has all motion subspaces; dynamics.composite_inertias are those of its
    pose.
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
    """Scale a displacement ``correction`` (nv,), and its scalars.correction_energy, so that this
    stays below the share PAID_SHARE of the internal kinetic energy.

    If one of m contacts is deep, and is a joint limit or a contact with the world or a kinematic
    body, the displacement stays whole: the excess, J, is added to stats.work_position_correction.
    """
    is_deep, scalars = False, ws.step.scalars[0]
    for i in range(m):
        c = ws.contacts.found[i]
        is_deep |= is_borne(s, c) and c.gap < -(
            BEYOND_LIMIT if c.kind == LIMIT else DEEP_PENETRATION)
    paid = PAID_SHARE * max(0.0, internal_kinetic_energy(s, ws))
    if scalars.correction_energy <= paid:
        return
    if is_deep:
        ws.stats[0].work_position_correction += scalars.correction_energy - paid
    else:
        share = paid / scalars.correction_energy
        for j in range(len(correction)):
            correction[j] *= share
        scalars.correction_energy *= share


@compiled
def write_correction_motion(s: System, kin: Kinematics, q: np.ndarray, correction: np.ndarray,
                            motion: np.ndarray) -> None:
    """Write how far a displacement ``correction`` (nv,) moves each body, for the update of gaps:
    the distance that its center of mass moves, m, to motion[i].correction, and its angle of
    rotation, rad, to motion[i].correction_angle. ``kin``: of q; its velocities are overwritten.
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
        wanted = correction[limit.dof]
        room = q[limit.q] - limit.lower if wanted < 0 else limit.upper - q[limit.q]
        if room > 0 and abs(wanted) > room:
            share = min(share, room / abs(wanted))
    scale_doll(s, doll, share, correction)


@compiled
def scale_doll(s: System, doll: int, share: float, correction: np.ndarray) -> None:
    """Scale the part of a displacement (nv,) that is one doll's by ``share``, if below 1."""
    if share < 1:
        for j in range(len(correction)):
            if s.body_doll[s.dof_body[j]] == doll:
                correction[j] *= share
