"""That a step keeps momentum: of each doll that does not touch the ground, to rounding.

A centred step in generalised coordinates keeps the momentum at its middle pose, that at its end but
to third order. What it has missed is given back as a motion of the whole doll as one rigid body.
With the impulses J of all that acts from outside at points x, over h s:
P' = P + m g h + J, C' = C + h (P + P') / (2 m), L' = L + (x - (C + C') / 2) x J about the centre of
mass C. So the sums over dolls that touch each other are kept as well.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..dynamics.mass_matrix import rotate_inertias
from ..maths.cholesky import solve
from ..maths.quaternion import cross, turned
from ..system import Workspace, System

SMALL = 0.01
"""Share of a motion's energy that may be taken out of it without a word."""


@compiled
def sum_dolls(s: System, q: np.ndarray, r: Workspace, out: np.ndarray) -> None:
    """Sums (d,) over each doll; work is posed at q."""
    rotate_inertias(s.tree, r.kinematics, r.own)
    for d in range(len(out)):
        doll = out[d]
        doll.kinetic = 0.0
        for k in range(3):
            doll.centre[k] = doll.momentum[k] = doll.angular_momentum[k] = 0.0
            for j in range(3):
                doll.inertia[j, k] = 0.0
    for i in range(len(s.tree)):
        d, m, c, root = s.body_doll[i], s.tree[i].mass, r.kinematics.positions[i], s.tree[s.body_root[i]].q_start
        for k in range(3):
            out[d].centre[k] += m * (q[root + k] + c[k]) / s.doll_masses[d]
    for i in range(len(s.tree)):
        add_body(out[s.body_doll[i]], s.tree[i].mass, r.kinematics.positions[i], r.kinematics.spatial_velocities[i], r.own[i],
                 q, s.tree[s.body_root[i]].q_start)
    for d in range(len(out)):
        doll, g = out[d], s.gravity
        doll.energy = doll.kinetic - s.doll_masses[d] * (
            doll.centre[0] * g[0] + doll.centre[1] * g[1] + doll.centre[2] * g[2])


@compiled
def add_body(doll: np.record, m: float, c: np.ndarray, move: np.ndarray, I: np.ndarray,
             q: np.ndarray, root: int) -> None:
    """Add a bone of mass m, kg, ``c`` (3,) m from its doll's root, which stands in q at ``root``,
    with the spatial velocity ``move`` and the inertia I (6,) about its own centre.
    """
    x, y, z = (q[root] + c[0] - doll.centre[0], q[root + 1] + c[1] - doll.centre[1],
               q[root + 2] + c[2] - doll.centre[2])
    wx, wy, wz = move[0], move[1], move[2]
    vx, vy, vz = cross(wx, wy, wz, c[0], c[1], c[2])
    vx, vy, vz = move[3] + vx, move[4] + vy, move[5] + vz
    lx = I[0] * wx + I[1] * wy + I[2] * wz
    ly = I[1] * wx + I[3] * wy + I[4] * wz
    lz = I[2] * wx + I[4] * wy + I[5] * wz
    doll.kinetic += (m * (vx * vx + vy * vy + vz * vz) + lx * wx + ly * wy + lz * wz) / 2
    doll.momentum[0] += m * vx
    doll.momentum[1] += m * vy
    doll.momentum[2] += m * vz
    vx, vy, vz = cross(x, y, z, m * vx, m * vy, m * vz)
    doll.angular_momentum[0] += vx + lx
    doll.angular_momentum[1] += vy + ly
    doll.angular_momentum[2] += vz + lz
    own = doll.inertia
    own[0, 0] += I[0] + m * (y * y + z * z)
    own[1, 1] += I[3] + m * (x * x + z * z)
    own[2, 2] += I[5] + m * (x * x + y * y)
    own[0, 1] += I[1] - m * x * y
    own[0, 2] += I[2] - m * x * z
    own[1, 2] += I[4] - m * y * z
    own[1, 0], own[2, 0], own[2, 1] = own[0, 1], own[0, 2], own[1, 2]


@compiled
def total_energy(dolls: np.ndarray) -> tuple[float, float]:
    """Energy of all dolls, J, and the kinetic part of it."""
    energy = kinetic = 0.0
    for d in range(len(dolls)):
        energy += dolls[d].energy
        kinetic += dolls[d].kinetic
    return energy, kinetic


@compiled
def give(given: np.record, sign: float, x: float, y: float, z: float, jx: float, jy: float,
         jz: float) -> None:
    """Enter an impulse, N s, at a point of the world, m."""
    given.impulse[0] += sign * jx
    given.impulse[1] += sign * jy
    given.impulse[2] += sign * jz
    a, b, c = cross(x, y, z, jx, jy, jz)
    given.moment[0] += sign * a
    given.moment[1] += sign * b
    given.moment[2] += sign * c


@compiled
def add_contact_impulses(s: System, r: Workspace, m: int, given: np.ndarray) -> None:
    """Enter the impulses of m contacts, and who bears whom."""
    for n in range(m):
        c = r.contacts[n]
        if c.kind == 1:
            continue
        one = s.body_doll[c.a]
        other = s.body_doll[c.b] if c.b >= 0 else -1
        if other < 0:
            p = c.impulse  # what sticks may be held sideways alone
            if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:
                given[one].on_ground = 1
            continue
        if one == other:
            continue
        given[one].touches_other = given[other].touches_other = 1
        p, t, w = c.impulse, c.tangents[0], c.tangents[1]
        for doll, sign in ((one, 1.0), (other, -1.0)):
            give(given[doll], sign, c.point[0], c.point[1], c.point[2], p[0] * c.normal[0],
                 p[0] * c.normal[1], p[0] * c.normal[2])
            give(given[doll], sign, c.friction_point[0], c.friction_point[1], c.friction_point[2], p[1] * t[0] + p[2] * w[0],
                 p[1] * t[1] + p[2] * w[1], p[1] * t[2] + p[2] * w[2])
            if c.kind == 5:
                for k in range(3):
                    given[doll].moment[k] += sign * (p[3] * t[k] + p[4] * w[k])


@compiled
def conserve_momentum(s: System, r: Workspace, h: float, q: np.ndarray, v: np.ndarray) -> None:
    """Change q and v at the end of a step of h s, before which the sums were r.before, so that each
    doll which the ground does not bear has the momentum and the place that are due; r.after are
    the sums at q and v. Giving depths back may have moved dolls apart that touch each other: their
    spins make up for what that changes of their angular momentum about the world's origin.
    """
    gained, mean, turn, moved = r.table[12], r.table[13], r.table[14], r.table[15]
    for i in range(len(s.tree)):
        bone, d = s.tree[i], s.body_doll[i]
        if bone.parent >= 0 or r.external[d].on_ground:
            continue
        old, new, given, m = r.sums_before[d], r.sums_after[d], r.external[d], s.doll_masses[d]
        at, rate = bone.q_start, bone.v_start
        for k in range(3):
            due = old.momentum[k] + given.impulse[k] + m * s.gravity[k] * h
            place = old.centre[k] + h * (old.momentum[k] + due) / (2 * m)
            mean[k] = (old.centre[k] + place) / 2
            mean[3 + k] = place - (given.centre[k] if given.touches_other else new.centre[k])
            gained[k] = (due - new.momentum[k]) / m
            moved[k] = new.centre[k] + mean[3 + k] - place
            turn[k] = due
        x, y, z = cross(mean[0], mean[1], mean[2], given.impulse[0], given.impulse[1],
                        given.impulse[2])
        dx, dy, dz = cross(moved[0], moved[1], moved[2], turn[0], turn[1], turn[2])
        turn[0] = old.angular_momentum[0] + given.moment[0] - x - dx - new.angular_momentum[0]
        turn[1] = old.angular_momentum[1] + given.moment[1] - y - dy - new.angular_momentum[1]
        turn[2] = old.angular_momentum[2] + given.moment[2] - z - dz - new.angular_momentum[2]
        locked_angular_velocity(new, r.kinematics.matrix, turn)
        x, y, z = cross(turn[0], turn[1], turn[2], q[at] - new.centre[0], q[at + 1] - new.centre[1],
                        q[at + 2] - new.centre[2])
        v[rate] += gained[0] + x
        v[rate + 1] += gained[1] + y
        v[rate + 2] += gained[2] + z
        x, y, z = turned(q[at + 3], q[at + 4], q[at + 5], -q[at + 6], turn[0], turn[1], turn[2])
        v[rate + 3] += x
        v[rate + 4] += y
        v[rate + 5] += z
        for k in range(3):
            q[at + k] += mean[3 + k]


@compiled
def internal_kinetic_energy(s: System, r: Workspace) -> float:
    """Kinetic energy, J, of v - w in take_out, by the sums r.after."""
    spin, inner = r.table[14], 0.0
    for d in range(len(r.sums_after)):
        inner += r.sums_after[d].kinetic
        if not r.external[d].on_ground:
            for k in range(3):
                spin[k] = r.sums_after[d].angular_momentum[k]
            locked_angular_velocity(r.sums_after[d], r.kinematics.matrix, spin)
            inner -= rigid_energy(r.sums_after[d], s.doll_masses[d], spin)
    return inner


@compiled
def remove_energy(s: System, r: Workspace, gained: float, q: np.ndarray, v: np.ndarray) -> None:
    """Take energy, J, that came from nothing out of the motion v at q, the sums there being
    r.after, as far as there is any.

    v becomes w + s (v - w). Of dolls that the ground bears w is zero, of others their motion as
    one rigid body: their momenta stay. What is at rest against w stays so, and what slides or comes
    apart does so in the same direction.
    """
    matrix, spin, inner = r.kinematics.matrix, r.table[14], internal_kinetic_energy(s, r)
    share = math.sqrt(max(0.0, 1 - gained / inner)) if inner > 0 else 1.0
    for i in range(len(s.tree)):
        bone, new = s.tree[i], r.sums_after[s.body_doll[i]]
        at, rate = bone.q_start, bone.v_start
        if bone.parent >= 0 or r.external[s.body_doll[i]].on_ground:
            for k in range(bone.dof_count if bone.parent >= 0 else 6):
                v[rate + k] *= share
            continue
        for k in range(3):
            spin[k] = new.angular_momentum[k]
        locked_angular_velocity(new, matrix, spin)
        x, y, z = cross(spin[0], spin[1], spin[2], q[at] - new.centre[0], q[at + 1] - new.centre[1],
                        q[at + 2] - new.centre[2])
        mass = s.doll_masses[s.body_doll[i]]
        x, y, z = new.momentum[0] / mass + x, new.momentum[1] / mass + y, new.momentum[2] / mass + z
        v[rate] = x + share * (v[rate] - x)
        v[rate + 1] = y + share * (v[rate + 1] - y)
        v[rate + 2] = z + share * (v[rate + 2] - z)
        x, y, z = turned(q[at + 3], q[at + 4], q[at + 5], -q[at + 6], spin[0], spin[1], spin[2])
        v[rate + 3] = x + share * (v[rate + 3] - x)
        v[rate + 4] = y + share * (v[rate + 4] - y)
        v[rate + 5] = z + share * (v[rate + 5] - z)


@compiled
def locked_angular_velocity(doll: np.record, matrix: np.ndarray, spin: np.ndarray) -> None:
    """Put in an angular momentum's place the angular velocity (3,) rad/s of a doll that has it as
    one rigid body.
    """
    for j in range(3):
        for k in range(3):
            matrix[j, k] = doll.inertia[j, k]
    solve(matrix, spin[:3])


@compiled
def rigid_energy(doll: np.record, mass: float, spin: np.ndarray) -> float:
    """Kinetic energy, J, of that body."""
    p, l = doll.momentum, doll.angular_momentum
    return ((p[0] ** 2 + p[1] ** 2 + p[2] ** 2) / mass + spin[0] * l[0] + spin[1] * l[1]
            + spin[2] * l[2]) / 2
