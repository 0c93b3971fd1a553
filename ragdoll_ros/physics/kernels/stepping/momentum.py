"""Conservation of momentum in a step, of each doll that does not touch the ground, to rounding.

A centered step in generalized coordinates conserves the momentum at its middle pose, that at its
end only to third order. The difference is added as a rigid motion of the whole doll.
With the impulses J of everything that acts from outside at points x, over h s:
P' = P + m g h + J, C' = C + h (P + P') / (2 m), L' = L + (x - (C + C') / 2) x J about the center of
mass C. So the sums over dolls that touch each other are conserved as well.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT, ROLLING
from ..dynamics.body import MOVED
from ..dynamics.kinematics import (Kinematics, inertia_times, root_orientation, root_position,
                                   rotate_inertias, velocity_at)
from ..dynamics.passive import passive_torque
from ..maths.cholesky import solve
from ..maths.vectors import (Vec3, add, add_scaled, cross, divide, dot, put, quat_rotate_inverse,
                             scale, sub, vec)
from ..system import System
from ..workspace import Workspace

REMOVABLE = 0.01
"""Share of the internal kinetic energy that may be removed from it without being counted."""


@compiled
def sum_dolls(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, out: np.ndarray) -> None:
    """Write the sums over each doll (DOLL_SUMS) to ``out`` (d,). ``kin``: of q and the velocities;
    its inertias are updated. The energies of a doll that is MOVED count as zero, as its motion is
    prescribed. Overwrites dynamics.matrix.
    """
    rotate_inertias(s.tree, kin, ws.step.dynamics.matrix)
    for d in range(len(out)):
        doll = out[d]
        doll.kinetic = 0.0
        for k in range(3):
            doll.center[k] = doll.momentum[k] = doll.angular_momentum[k] = 0.0
            for j in range(3):
                doll.inertia[j, k] = 0.0
    for i in range(len(s.tree)):
        d, mass = s.body_doll[i], s.tree[i].mass
        at = add(root_position(q, s.tree[s.body_root[i]].q_start), vec(kin.positions[i]))
        for k in range(3):
            out[d].center[k] += mass * at[k] / s.doll_masses[d]
    for i in range(len(s.tree)):
        root = root_position(q, s.tree[s.body_root[i]].q_start)
        add_body(out[s.body_doll[i]], s.tree[i].mass, kin, i, root)
    for d in range(len(out)):
        doll = out[d]
        doll.energy = doll.kinetic - s.doll_masses[d] * dot(vec(doll.center), vec(s.gravity))
    for i in range(len(s.tree)):
        body = s.tree[i]
        if body.kinematic == MOVED:
            out[s.body_doll[i]].energy = out[s.body_doll[i]].kinetic = 0.0
        for k in range(body.dof_count if body.has_passive and not body.kinematic else 0):
            out[s.body_doll[i]].energy += passive_torque(body, k, q[body.q_start + k])[2]


@compiled
def add_body(doll: np.record, mass: float, kin: Kinematics, i: int, root: Vec3) -> None:
    """Add body i, whose root is at ``root``, m, to the sums of a doll whose center is known."""
    x, y, z = sub(add(root, vec(kin.positions[i])), vec(doll.center))
    w, I = vec(kin.spatial_velocities[i]), kin.inertias[i]
    u, spin = velocity_at(kin, i, vec(kin.positions[i])), inertia_times(I, w)
    doll.kinetic += (mass * dot(u, u) + spin[0] * w[0] + spin[1] * w[1] + spin[2] * w[2]) / 2
    momentum = scale(mass, u)
    put(doll.momentum, add(vec(doll.momentum), momentum))
    put(doll.angular_momentum,
        add(vec(doll.angular_momentum), add(cross((x, y, z), momentum), spin)))
    own = doll.inertia
    own[0, 0] += I[0] + mass * (y * y + z * z)
    own[1, 1] += I[3] + mass * (x * x + z * z)
    own[2, 2] += I[5] + mass * (x * x + y * y)
    own[0, 1] += I[1] - mass * x * y
    own[0, 2] += I[2] - mass * x * z
    own[1, 2] += I[4] - mass * y * z
    own[1, 0], own[2, 0], own[2, 1] = own[0, 1], own[0, 2], own[1, 2]


@compiled
def total_energy(dolls: np.ndarray) -> tuple[float, float]:
    """Total and kinetic energy, J, of all dolls (d,)."""
    energy = kinetic = 0.0
    for d in range(len(dolls)):
        energy += dolls[d].energy
        kinetic += dolls[d].kinetic
    return energy, kinetic


@compiled
def add_impulse(external: np.record, factor: float, at: Vec3, impulse: Vec3) -> None:
    """Add ``factor`` times an ``impulse``, N s, at the point ``at``, m, world, to external.impulse,
    and its moment about the world's origin to external.moment. Also takes a force, N, with a time,
    s, as the factor.
    """
    moment = cross(at, impulse)
    put(external.impulse, add_scaled(vec(external.impulse), factor, impulse))
    put(external.moment, add_scaled(vec(external.moment), factor, moment))


@compiled
def is_borne(s: System, c: np.record) -> bool:
    """Whether one side of a contact does not yield: the WORLD or a kinematic body. True for joint
    limits, whose body_b is the WORLD.
    """
    return c.body_b < 0 or s.tree[c.body_a].kinematic != 0 or s.tree[c.body_b].kinematic != 0


@compiled
def add_contact_impulses(s: System, ws: Workspace, m: int) -> None:
    """Add the impulses of m contacts between two dolls to step.external, with moments about the
    world's origin. Set its flags: on_ground for dolls with an impulse from the WORLD or a kinematic
    body, touches_other for dolls that have a contact with another. Contacts with a kinematic body
    set on_ground alone. Joint limits and contacts within a doll are skipped.
    """
    external = ws.step.external
    for n in range(m):
        c = ws.contacts.found[n]
        if c.kind == LIMIT:
            continue
        p, one = c.impulse, s.body_doll[c.body_a]
        if is_borne(s, c):
            if p[0] != 0.0 or p[1] != 0.0 or p[2] != 0.0:  # friction without limit needs no normal
                external[one].on_ground = 1
                if c.body_b >= 0:
                    external[s.body_doll[c.body_b]].on_ground = 1
            continue
        other = s.body_doll[c.body_b]
        if one == other:
            continue
        external[one].touches_other = external[other].touches_other = 1
        t, w = vec(c.tangents[0]), vec(c.tangents[1])
        for doll, sign in ((one, 1.0), (other, -1.0)):
            add_impulse(external[doll], sign, vec(c.point), scale(p[0], vec(c.normal)))
            add_impulse(external[doll], sign, vec(c.friction_point),
                        add(scale(p[1], t), scale(p[2], w)))
            if c.kind == ROLLING:
                moment = external[doll].moment
                put(moment, add_scaled(vec(moment), sign, add(scale(p[3], t), scale(p[4], w))))


@compiled
def count_contact_impulses(s: System, ws: Workspace, m: int, impulses: np.ndarray) -> None:
    """Add the impulses of m contacts to ``impulses`` (n, 3) N s, by bone, world frame: with plus
    sign for body_a, minus for body_b. Joint limits are skipped.
    """
    for n in range(m):
        c = ws.contacts.found[n]
        if c.kind == LIMIT:
            continue
        p, t, w = c.impulse, vec(c.tangents[0]), vec(c.tangents[1])
        impulse = add(scale(p[0], vec(c.normal)), add(scale(p[1], t), scale(p[2], w)))
        bone = impulses[s.tree[c.body_a].bone]
        put(bone, add(vec(bone), impulse))
        if c.body_b >= 0:
            bone = impulses[s.tree[c.body_b].bone]
            put(bone, sub(vec(bone), impulse))


@compiled
def conserve_momentum(s: System, ws: Workspace, h: float, q: np.ndarray, v: np.ndarray) -> None:
    """Change the coordinates q and velocities v of roots at the end of a step of h s, so that each
    doll that is not on the ground has the momenta and center of mass that follow from its external
    impulses. The sums at q are step.sums_after.

    Displacements by position correction between touching dolls are kept. In an island in the air
    they must not move the common center of mass: its displacement is subtracted from that of each
    doll. What is left of a doll's displacement adds angular momentum about the common center, by
    the doll's velocity relative to that center; the doll's spin compensates it.
    """
    step, label = ws.step, ws.island.label
    sum_islands(s, ws, h)
    for i in range(len(s.tree)):
        body, d = s.tree[i], s.body_doll[i]
        if body.parent >= 0 or step.external[d].on_ground:
            continue
        old, new, external, mass = (step.sums_before[d], step.sums_after[d], step.external[d],
                                    s.doll_masses[d])
        impulse, momentum, center = vec(external.impulse), vec(old.momentum), vec(new.center)
        due = due_momentum(s, ws, d, h)
        travel, twice = scale(h, add(momentum, due)), 2 * mass
        place = add(vec(old.center), divide(travel, twice))
        mean = add(vec(old.center), place)
        mean = mean[0] / 2, mean[1] / 2, mean[2] / 2
        displacement, turning = sub(place, center), (0.0, 0.0, 0.0)
        if external.touches_other:
            displacement = sub(place, vec(external.center))
            group = step.islands[label[d]]
            if not group.on_ground:
                displacement = add_scaled(displacement, -1 / group.mass, vec(group.moved))
                turning = cross(sub(add(center, displacement), place),
                                add_scaled(due, -mass / group.mass, vec(group.momentum)))
        spin = sub(sub(sub(add(vec(old.angular_momentum), vec(external.moment)),
                           cross(mean, impulse)), turning), vec(new.angular_momentum))
        spin = locked_angular_velocity(ws, new, spin)
        gained = divide(sub(due, vec(new.momentum)), mass)
        at, dof = body.q_start, body.v_start
        change = add(gained, cross(spin, sub(root_position(q, at), center)))
        turn = quat_rotate_inverse(root_orientation(q, at), spin)
        for k in range(3):
            v[dof + k] += change[k]
            v[dof + 3 + k] += turn[k]
            q[at + k] += displacement[k]


@compiled
def due_momentum(s: System, ws: Workspace, d: int, h: float) -> Vec3:
    """Momentum, N s, that doll d has after h s by its external impulses and weight."""
    return add_scaled(add(vec(ws.step.sums_before[d].momentum), vec(ws.step.external[d].impulse)),
                      s.doll_masses[d] * h, vec(s.gravity))


@compiled
def sum_islands(s: System, ws: Workspace, h: float) -> None:
    """Write step.islands: sums over those dolls of each island that touch other dolls, of mass, of
    momentum after h s and of mass times displacement by position correction, and whether the ground
    bears one of these dolls.
    """
    islands, label = ws.step.islands, ws.island.label
    for d in range(len(islands)):
        group = islands[d]
        group.mass, group.on_ground = 0.0, 0
        for k in range(3):
            group.momentum[k] = group.moved[k] = 0.0
    for d in range(len(islands)):
        external = ws.step.external[d]
        if external.touches_other:
            group, mass = islands[label[d]], s.doll_masses[d]
            moved = sub(vec(ws.step.sums_after[d].center), vec(external.center))
            group.mass += mass
            group.on_ground |= external.on_ground
            put(group.momentum, add(vec(group.momentum), due_momentum(s, ws, d, h)))
            put(group.moved, add_scaled(vec(group.moved), mass, moved))


@compiled
def internal_kinetic_energy(s: System, ws: Workspace) -> float:
    """Kinetic energy, J, of the motion that remove_energy() may scale, by step.sums_after: that of
    all dolls, without the rigid motion of those that are not on the ground.
    """
    after, inner = ws.step.sums_after, 0.0
    for d in range(len(after)):
        inner += after[d].kinetic
        if not ws.step.external[d].on_ground:
            spin = locked_angular_velocity(ws, after[d], vec(after[d].angular_momentum))
            inner -= rigid_energy(after[d], s.doll_masses[d], spin)
    return inner


@compiled
def remove_energy(s: System, ws: Workspace, gained: float, q: np.ndarray, v: np.ndarray) -> float:
    """Remove the spurious energy ``gained``, J, from the motion v at q, where the sums are
    step.sums_after, as far as there is any. Returns how much was removed, J.

    v becomes w + share (v - w). Of dolls on the ground w is zero, of others their rigid motion, so
    that their momenta stay. What is at rest relative to w stays so, and what slides or separates
    goes on in the same direction.
    """
    inner = internal_kinetic_energy(s, ws)
    share = math.sqrt(max(0.0, 1 - gained / inner)) if inner > 0 else 1.0
    for i in range(len(s.tree)):
        body, d = s.tree[i], s.body_doll[i]
        at, dof = body.q_start, body.v_start
        if body.kinematic:
            continue
        if body.parent >= 0 or ws.step.external[d].on_ground:
            for k in range(body.dof_count if body.parent >= 0 else 6):
                v[dof + k] *= share
            continue
        new = ws.step.sums_after[d]
        spin = locked_angular_velocity(ws, new, vec(new.angular_momentum))
        move = add(divide(vec(new.momentum), s.doll_masses[d]),
                   cross(spin, sub(root_position(q, at), vec(new.center))))
        turn = quat_rotate_inverse(root_orientation(q, at), spin)
        for k in range(3):
            v[dof + k] = move[k] + share * (v[dof + k] - move[k])
            v[dof + 3 + k] = turn[k] + share * (v[dof + 3 + k] - turn[k])
    return max(0.0, min(gained, inner))


@compiled
def locked_angular_velocity(ws: Workspace, doll: np.record, angular_momentum: Vec3) -> Vec3:
    """Angular velocity, rad/s, world axes, that a doll (its DOLL_SUMS) with all joints locked has
    with this angular momentum about its center of mass. Overwrites step.spin and
    step.dynamics.matrix.
    """
    matrix, spin = ws.step.dynamics.matrix, ws.step.spin
    for j in range(3):
        for k in range(3):
            matrix[j, k] = doll.inertia[j, k]
    put(spin, angular_momentum)
    solve(matrix, spin)
    return vec(spin)


@compiled
def rigid_energy(doll: np.record, mass: float, spin: Vec3) -> float:
    """Kinetic energy, J, of a doll's rigid motion with angular velocity ``spin``, rad/s."""
    p, l = doll.momentum, doll.angular_momentum
    return ((p[0] ** 2 + p[1] ** 2 + p[2] ** 2) / mass + spin[0] * l[0] + spin[1] * l[1]
            + spin[2] * l[2]) / 2
