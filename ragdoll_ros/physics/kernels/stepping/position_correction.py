"""Depths given back in position alone, as far as motion can pay and joints allow."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import BEYOND, BURIED, bone_velocity
from ..dynamics.bias_forces import update_velocities
from ..maths.quaternion import cross
from ..system import Workspace, System
from .momentum import internal_kinetic_energy

PAID = 0.005
"""Share of the kinetic energy that giving depths back may cost in a step."""


@compiled
def correction_energy(s: System, r: Workspace, shift: np.ndarray) -> float:
    """Energy of height, J, that a displacement (nv,) gives; axes, composites are those of now."""
    total, g = 0.0, s.gravity
    for j in range(len(shift)):
        if shift[j] != 0.0:
            a, c = r.kinematics.motion_subspaces[j], r.composite[s.dof_body[j]]
            x, y, z = cross(a[0], a[1], a[2], c[1], c[2], c[3])
            total -= shift[j] * (g[0] * (c[0] * a[3] + x) + g[1] * (c[0] * a[4] + y)
                                 + g[2] * (c[0] * a[5] + z))
    return total


@compiled
def limit_correction_energy(s: System, r: Workspace, m: int, shift: np.ndarray) -> None:
    """Let the motion pay for giving depths back, by a ``shift`` (nv,) that costs r.lift[0] J: where
    it would be more than a part of its energy, they are given back by less. What is deep in the
    ground or beyond a limit comes out whatever it costs: what the motion does not pay is booked.
    """
    deep = False
    for i in range(m):
        c = r.contacts[i]
        deep |= c.b < 0 and c.gap < -(BEYOND if c.kind == 1 else BURIED)
    paid = PAID * max(0.0, internal_kinetic_energy(s, r))
    if r.lift[0] <= paid:
        return
    if deep:
        r.stats[0].work_position_correction += r.lift[0] - paid
    else:
        share = paid / r.lift[0]
        for j in range(len(shift)):
            shift[j] *= share
        r.lift[0] *= share


@compiled
def note_correction(s: System, r: Workspace, q: np.ndarray, shift: np.ndarray) -> None:
    """Enter by how much a ``shift`` (nv,) moves and turns each bone, m and rad, into r.own[:, 2:4];
    work is posed about there.
    """
    some = False
    for j in range(len(shift)):
        some |= shift[j] != 0.0
    if some:
        update_velocities(s.tree, q, shift, r.kinematics)
    for i in range(len(s.tree)):
        r.own[i, 2] = r.own[i, 3] = 0.0
        if some:
            x, y, z, r.own[i, 3] = bone_velocity(r.kinematics, i)
            r.own[i, 2] = math.sqrt(x * x + y * y + z * z)


@compiled
def clip_to_joint_limits(s: System, q: np.ndarray, shift: np.ndarray) -> None:
    """Shorten a ``shift`` (nv,) of a doll that would take a joint past a limit not met yet."""
    share, doll = 1.0, -1
    for k in range(len(s.joint_limits)):
        bound = s.joint_limits[k]
        if s.body_doll[s.dof_body[bound.dof]] != doll:
            shorten(s, doll, share, shift)
            share, doll = 1.0, s.body_doll[s.dof_body[bound.dof]]
        way = shift[bound.dof]
        room = q[bound.q_index] - bound.lower if way < 0 else bound.upper - q[bound.q_index]
        if room > 0 and abs(way) > room:
            share = min(share, room / abs(way))
    shorten(s, doll, share, shift)


@compiled
def shorten(s: System, doll: int, share: float, shift: np.ndarray) -> None:
    """Scale what of a ``shift`` (nv,) is a doll's."""
    if share < 1:
        for j in range(len(shift)):
            if s.body_doll[s.dof_body[j]] == doll:
                shift[j] *= share
