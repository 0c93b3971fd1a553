"""Newton's method on a large island, in the space of its degrees of freedom.

The function is that of newton.py, with a proximal share too. Of each contact, linearized, it is
A dp + B du = -phi with du = Y dz + D dp: z = Y^T p, and D the compliance and the proximal share of
W's diagonal. So dp = -C^-1 (phi + B Y dz) with C = A + B D, a matrix of each contact by itself, and

    (I + sum of Y^T C^-1 B Y) dz = -Y^T C^-1 phi.

That matrix has entries between the degrees of freedom of one contact alone. They are eliminated
body by body in the order of minimum degree, so that few more entries arise: from the leaves of each
tree to its root, and in a stack from both its ends.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.minimum_degree import find_order
from ..maths.sparse_lu import clear_row, eliminate_row, find_pattern, substitute_back
from ..system import NO_SLIP, System
from ..workspace import Island, Workspace
from .one_contact import project_to_disc

SPARSE_STEPS, SPARSE_PATIENCE = 12, 4
"""Newton steps at most, and those that do not halve the residual. It may grow on the way, as
contacts change between sticking and sliding; the best is kept."""

HALVED_SHARES, GROWTH = 4, 100.0
"""Shares of a step that are tried, each half of the one before, until the sum of squares is below
the largest of the last three (Grippo, Lampariello and Lucidi 1986), or in the first two steps below
GROWTH times that of the start. Without, steps cycle in heaps; were each to reduce it, they would
stall among redundant contacts."""

MOST_PROXIMAL, LEAST_PROXIMAL = 1e-2, 1e-6
"""Share of W's diagonal that resists the steps: at first, and a tenth after each that halves the
residual, as what is left is what the impulses of several bodies decide together. Of 88 islands of
a heap, a hundredth of the velocities is reached in 14 steps by 80 from 1e-2, 75 from 1e-1 and 62
from 1e-3, where the first steps lead far away."""


@compiled
def find_sparsity(s: System, ws: Workspace, m: int) -> tuple[int, int]:
    """Order the degrees of freedom of an island and find the pattern of the matrix, in island.lu.
    Returns how many there are, and the work of an elimination, -1 if there is no room.
    """
    island, lu, place = ws.island, ws.island.lu, ws.island.dof_place
    count = connect_bodies(s, ws, m)
    if count < 0:
        return 0, -1
    find_order(island.elimination, count)
    dofs = 0
    for k in range(count):
        node = island.elimination.order[k]
        first = s.tree[island.bodies[node]].v_start
        for j in range(first + island.elimination.weight[node] - 1, first - 1, -1):
            place[j], dofs = dofs, dofs + 1
    for k in range(m):
        i = island.members[k].contact
        lu.sizes[k] = ws.contacts.found[i].dof_count
        for x in range(lu.sizes[k]):
            lu.sets[k, x] = place[island.support[i, x]]
    list_occurrences(island, dofs, m)
    return dofs, find_pattern(lu, dofs, m)


@compiled
def connect_bodies(s: System, ws: Workspace, m: int) -> int:
    """Write the bodies that m contacts move to island.bodies, as nodes of island.elimination, and
    connect those that one contact moves. Returns how many there are, or -1 if there is no room.
    """
    island, nodes, number = ws.island, ws.island.elimination, ws.island.body_number
    for i in range(len(number)):
        number[i] = -1
    count = 0
    for k in range(m):
        i = island.members[k].contact
        for x in range(ws.contacts.found[i].dof_count):
            body = s.dof_body[island.support[i, x]]
            if number[body] < 0:
                if count == len(nodes.order):
                    return -1
                number[body], island.bodies[count], nodes.weight[count] = count, body, 0
                count += 1
    for a in range(count):
        for b in range(count):
            nodes.graph[a, b] = 0
    for k in range(m):
        i, near, before = island.members[k].contact, 0, -1
        for x in range(ws.contacts.found[i].dof_count):
            node = number[s.dof_body[island.support[i, x]]]
            if node == before:
                continue
            before = node
            for a in range(near):
                nodes.graph[node, nodes.near[a]] = nodes.graph[nodes.near[a], node] = 1
            nodes.near[near], near = node, near + 1
    for node in range(count):
        body = s.tree[island.bodies[node]]
        nodes.weight[node] = body.dof_count if body.parent >= 0 else 6
    return count


@compiled
def list_occurrences(island: Island, dofs: int, m: int) -> None:
    """List, for each degree of freedom in order of elimination, the members whose support contains
    it and its place there: island.occurrences and occurrence_start.
    """
    begin, listed, sets = island.occurrence_start, island.occurrences, island.lu.sets
    for i in range(dofs + 1):
        begin[i] = 0
    for k in range(m):
        for x in range(island.lu.sizes[k]):
            begin[sets[k, x] + 1] += 1
    for i in range(dofs):
        begin[i + 1] += begin[i]
    for k in range(m):
        for x in range(island.lu.sizes[k]):
            i = sets[k, x]
            listed[begin[i]].member, listed[begin[i]].place = k, x
            begin[i] += 1
    for i in range(dofs, 0, -1):
        begin[i] = begin[i - 1]
    begin[0] = 0


@compiled
def write_velocities(ws: Workspace, m: int, b: np.ndarray, p: np.ndarray) -> None:
    """Write z = Y^T p to island.z and the row velocities W p + b to island.velocity; W includes the
    compliance of the members.
    """
    island = ws.island
    Y, z, u = island.Y, island.z, island.velocity
    for j in range(len(z)):
        z[j] = 0.0
    for k in range(m):
        member = island.members[k]
        support = island.support[member.contact]
        for row in range(member.row, member.row + member.kind):
            if p[row] != 0.0:
                for x in range(ws.contacts.found[member.contact].dof_count):
                    z[support[x]] += Y[row, x] * p[row]
    for k in range(m):
        member = island.members[k]
        support, soft = island.support[member.contact], member.compliance
        for e in range(member.kind):
            row = member.row + e
            total = b[row] + p[row] * island.blocks[k, e, e] * soft / (1 + soft)
            for x in range(ws.contacts.found[member.contact].dof_count):
                total += Y[row, x] * z[support[x]]
            u[row] = total


@compiled
def linearize_contact(island: Island, k: int, p: np.ndarray) -> float:
    """Linearize member k at p and island.velocity: write phi, scaled to velocities, to
    island.phi[k], and A and B of A dp + B du = -phi to island.A[k] and island.B[k]. Returns the
    largest absolute entry of phi, m/s.
    """
    member, block, u = island.members[k], island.blocks[k], island.velocity
    A, B, phi, a = island.A[k], island.B[k], island.phi[k], member.row
    for e in range(member.kind):
        for g in range(member.kind):
            A[e, g] = B[e, g] = 0.0
    own, worst = block[0, 0], 0.0
    push = p[a] - u[a] / own
    active = push > 0
    phi[0] = u[a] if active else own * p[a]
    A[0, 0], B[0, 0] = (0.0, 1.0) if active else (own, 0.0)
    worst = abs(phi[0])
    for e in range(1, member.kind, 2):
        law = member.friction if e == 1 else member.rolling_friction
        sticks = e == 1 and law >= NO_SLIP
        own_t = max(block[e, e], block[e + 1, e + 1])
        most = max(0.0, law) * max(0.0, push)
        y, z = p[a + e] - u[a + e] / own_t, p[a + e + 1] - u[a + e + 1] / own_t
        size = math.sqrt(y * y + z * z)
        if sticks or (active and size <= most):
            phi[e], phi[e + 1] = u[a + e], u[a + e + 1]
            B[e, e] = B[e + 1, e + 1] = 1.0
        elif not active:
            phi[e], phi[e + 1] = own_t * p[a + e], own_t * p[a + e + 1]
            A[e, e] = A[e + 1, e + 1] = own_t
        else:
            y, z, share = y / size, z / size, most / size
            phi[e], phi[e + 1] = own_t * (p[a + e] - most * y), own_t * (p[a + e + 1] - most * z)
            A[e, 0], A[e + 1, 0] = -own_t * law * y, -own_t * law * z
            B[e, 0], B[e + 1, 0] = own_t * law * y / own, own_t * law * z / own
            B[e, e], B[e + 1, e + 1] = share * (1 - y * y), share * (1 - z * z)
            B[e, e + 1] = B[e + 1, e] = -share * y * z
            for f in range(2):
                for g in range(2):
                    A[e + f, e + g] = own_t * ((1.0 if f == g else 0.0) - B[e + f, e + g])
        worst = max(worst, abs(phi[e]), abs(phi[e + 1]))
    return worst


@compiled
def eliminate_contact(island: Island, k: int, proximal: float) -> None:
    """Form C = A + B D of member k in island.A[k], and replace B by C^-1 B and phi by C^-1 phi. D
    is diagonal: the member's compliance, and the share ``proximal`` of W's diagonal. Elimination
    overwrites C. No pivoting: right of its diagonal, C has entries only between the two rows of
    friction, or of rolling, that slides.
    """
    A, B, phi, kind = island.A[k], island.B[k], island.phi[k], island.members[k].kind
    soft = island.members[k].compliance
    for g in range(kind):
        softness = island.blocks[k, g, g] * (soft / (1 + soft) + proximal)
        for e in range(kind):
            A[e, g] += B[e, g] * softness
    for e in range(kind):
        for i in range(e + 1, kind):
            f = A[i, e] / A[e, e]
            if f != 0.0:
                for g in range(kind):
                    A[i, g] -= f * A[e, g]
                    B[i, g] -= f * B[e, g]
                phi[i] -= f * phi[e]
    for e in range(kind - 1, -1, -1):
        for i in range(e + 1, kind):
            if A[e, i] != 0.0:
                for g in range(kind):
                    B[e, g] -= A[e, i] * B[i, g]
                phi[e] -= A[e, i] * phi[i]
        for g in range(kind):
            B[e, g] /= A[e, e]
        phi[e] /= A[e, e]


@compiled
def multiply_rows(island: Island, k: int) -> None:
    """Write B Y of member k to its rows of island.BY, after eliminate_contact(), when B is C^-1 B.
    Write to island.coupled which of these rows are not zero; those of open contacts are zero.
    """
    member, B, Y, BY = island.members[k], island.B[k], island.Y, island.BY
    for e in range(member.kind):
        row = member.row + e
        island.coupled[row] = 0
        for x in range(island.lu.sizes[k]):
            BY[row, x] = 0.0
        for g in range(member.kind):
            share, other = B[e, g], member.row + g
            if share != 0.0:
                island.coupled[row] = 1
                for x in range(island.lu.sizes[k]):
                    BY[row, x] += share * Y[other, x]


@compiled
def solve_for_dz(island: Island, dofs: int) -> bool:
    """Assemble I + sum of Y^T C^-1 B Y, after multiply_rows() of all members, and solve for the
    step dz = Y^T dp. Writes dz to island.z_direction, in order of elimination. Returns whether the
    matrix is regular.
    """
    lu, Y, dz = island.lu, island.Y, island.z_direction
    for i in range(dofs):
        clear_row(lu, i)
        lu.row[i], dz[i] = 1.0, 0.0
        for at in range(island.occurrence_start[i], island.occurrence_start[i + 1]):
            k, x = island.occurrences[at].member, island.occurrences[at].place
            member, phi = island.members[k], island.phi[k]
            for e in range(member.kind):
                dz[i] -= Y[member.row + e, x] * phi[e]
            add_contact_row(island, k, x)
        if not eliminate_row(lu, i, dz):
            return False
    substitute_back(lu, dofs, dz)
    return True


@compiled
def add_contact_row(island: Island, k: int, x: int) -> None:
    """Add Y^T C^-1 B Y of member k to lu.row, the matrix row of the degree of freedom at place x of
    its support.
    """
    member, Y, BY, place, row = island.members[k], island.Y, island.BY, island.lu.sets, (
        island.lu.row)
    a, coupled, alone = member.row, island.coupled, 0
    if member.kind >= 3:  # three at once: an indirect address costs as much as their sum
        alone = 3
        if coupled[a] or coupled[a + 1] or coupled[a + 2]:
            f, g, h = Y[a, x], Y[a + 1, x], Y[a + 2, x]
            for y in range(island.lu.sizes[k]):
                row[place[k, y]] += f * BY[a, y] + g * BY[a + 1, y] + h * BY[a + 2, y]
    for e in range(alone, member.kind):
        if coupled[a + e]:
            f = Y[a + e, x]
            for y in range(island.lu.sizes[k]):
                row[place[k, y]] += f * BY[a + e, y]


@compiled
def find_direction(island: Island, m: int) -> None:
    """Write dp = -C^-1 (phi + B Y dz) to island.direction. island.phi and island.B already contain
    the factor C^-1, by eliminate_contact(); dz: island.z_direction, in the order of elimination.
    """
    for k in range(m):
        member, B, phi = island.members[k], island.B[k], island.phi[k]
        slide = island.local
        for g in range(member.kind):
            slide[g] = 0.0
            for x in range(island.lu.sizes[k]):
                slide[g] += island.Y[member.row + g, x] * island.z_direction[island.lu.sets[k, x]]
        for e in range(member.kind):
            change = phi[e]
            for g in range(member.kind):
                change += B[e, g] * slide[g]
            island.direction[member.row + e] = -change


@compiled
def linearize(ws: Workspace, m: int, b: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """Linearize m contacts at p. Returns the largest entry of phi, m/s, and the sum of squares."""
    write_velocities(ws, m, b, p)
    worst = total = 0.0
    for k in range(m):
        worst = max(worst, linearize_contact(ws.island, k, p))
        for e in range(ws.island.members[k].kind):
            total += ws.island.phi[k, e] * ws.island.phi[k, e]
    return worst, total


@compiled
def take_step(ws: Workspace, m: int, n: int, b: np.ndarray, p: np.ndarray,
              most: float) -> tuple[float, float]:
    """Move p along island.direction by the first of the shares 1, 1/2, 1/4 ..., HALVED_SHARES in
    number, that leaves phi's sum of squares below ``most``, or by the last. Returns the largest
    entry of phi, m/s, and its sum of squares there, see linearize().
    """
    start, direction, share = ws.island.step_start, ws.island.direction, 1.0
    worst = total = 0.0
    for i in range(n):
        start[i] = p[i]
    for _ in range(HALVED_SHARES):
        for i in range(n):
            p[i] = start[i] + share * direction[i]
        worst, total = linearize(ws, m, b, p)
        if total < most:
            break
        share /= 2
    return worst, total


@compiled
def sparse_newton(ws: Workspace, m: int, n: int, b: np.ndarray, p: np.ndarray, tolerance: float,
                  dofs: int) -> float:
    """Solve a large island of m contacts and n rows for its impulses p (n,), N s: at most
    SPARSE_STEPS Newton steps from the given p, until the residual is at most ``tolerance``, m/s, or
    stalls (SPARSE_PATIENCE). p becomes the best iterate, clamped to its cones.

    b (n,): velocities of the rows without impulses, m/s. ``dofs``: number of degrees of freedom,
    from find_sparsity(). Writes Y^T p to island.z. Returns the residual of the best iterate before
    clamping, m/s.
    """
    island, keep = ws.island, ws.island.best
    best, late, proximal, before = math.inf, 0, MOST_PROXIMAL, math.inf
    worst, total = linearize(ws, m, b, p)
    older = old = GROWTH * total
    for turn in range(SPARSE_STEPS + 1):
        late = 0 if worst < best / 2 else late + 1
        proximal = max(LEAST_PROXIMAL, proximal / 10) if worst < before / 2 else MOST_PROXIMAL
        before = worst
        if worst < best:
            best = worst
            for i in range(n):
                keep[i] = p[i]
        if best <= tolerance or late > SPARSE_PATIENCE or turn == SPARSE_STEPS:
            break
        island.newton_steps[0] += 1
        for k in range(m):
            eliminate_contact(island, k, proximal)
            multiply_rows(island, k)
        if not solve_for_dz(island, dofs):
            break
        find_direction(island, m)
        most, older, old = max(total, old, older), old, total
        worst, total = take_step(ws, m, n, b, p, most)
    for i in range(n):
        p[i] = keep[i]
    for k in range(m):
        clamp_member(island, k, p)
    write_velocities(ws, m, b, p)
    return best


@compiled
def clamp_member(island: Island, k: int, p: np.ndarray) -> None:
    """Clamp the impulses of member k as clamp_to_cones() does: the normal one to at least zero,
    then friction and rolling to their discs.
    """
    member = island.members[k]
    a = member.row
    p[a] = max(0.0, p[a])
    for e in range(1, member.kind, 2):
        if e > 1 or member.friction < NO_SLIP:
            law = member.friction if e == 1 else member.rolling_friction
            p[a + e], p[a + e + 1] = project_to_disc(p[a + e], p[a + e + 1], p[a] * max(0.0, law))
