"""Impulses of a small island of contacts and limits, by Signorini's and Coulomb's laws exactly.

Unknown are the impulses p of m contacts, n rows: 1 (a limit), 3 (a contact: normal, two tangents)
or 5 (also two of rolling). The velocities after are u = W p + b, with W flat (n * n), b those
without impulses. The complementarity problem:
u_n >= 0, p_n >= 0, u_n p_n = 0; |p_t| <= mu p_n, and where u_t is not zero p_t = -mu p_n u_t/|u_t|.

Where friction is zero or unlimited, the active set method solves it. Else Gauss-Seidel sweeps come
near, and where they stall, as with mass ratios of 1:1000, Newton's method finishes.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT
from ..system import NO_SLIP
from ..workspace import Island
from .active_set import is_convex, solve_active_set
from .gauss_seidel import gauss_seidel_sweep
from .newton import newton
from .one_contact import project_to_disc

ROUNDS, LOOSER = 6, 3
"""Rounds of sweeps, twice as many each time, and of Newton's method, against more of the proximal
share; the first LOOSER rounds that fail are followed by ten times the tolerance, up to UNSOLVED."""

RESTITUTION_ROUNDS, UNSOLVABLE = 1, 1e-2
"""Rounds for what meets within a step with restitution, and the residual, m/s, that they leave
where there is no solution: jammed bodies cannot separate on all sides. Restitution is left out
there."""

SWEEPS = 2
"""Gauss-Seidel sweeps before the first Newton step: three and eight cost more than they save."""

PROXIMAL, STIFFER = 1e-4, 3
"""Share of W's diagonal that resists the first round's Newton steps: enough for impulses that the
compliance, 1e-8 of W, decides, and less than what decides the motion of bodies; and its growth from
round to round. With 1e-5, as with 1e-3, more steps are taken."""

UNSOLVED = 1e-5
"""m/s: islands with a larger residual are counted, and their impulses kept from adding energy."""

OPENING = 1e-4
"""m/s: contacts of unlimited friction that open faster are released."""


@compiled
def clamp_to_cones(members: np.ndarray, m: int, p: np.ndarray) -> None:
    """Clamp the normal impulses in p to at least zero, then friction and rolling impulses to discs
    whose radius is the normal impulse times their coefficient. Unlimited friction (NO_SLIP) is not
    changed.
    """
    for c in range(m):
        member = members[c]
        a = member.row
        p[a] = max(0.0, p[a])
        for k in range(1, member.kind, 2):
            if k == 1 and member.friction >= NO_SLIP:
                continue
            law = member.friction if k == 1 else member.rolling_friction
            p[a + k], p[a + k + 1] = project_to_disc(p[a + k], p[a + k + 1], p[a] * max(0.0, law))


@compiled
def solve_cones(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray, tolerance: float,
                rounds: int) -> tuple[float, int]:
    """Solve for p (n,) in place, starting from p, in at most ``rounds`` rounds; those that fail
    relax the ``tolerance``, m/s, see LOOSER. Returns the residual left, m/s, and the number of
    sweeps. The residual is the last velocity change if sweeps converged, and the tolerance if the
    active set method did.
    """
    done, left, proximal, sweeps = 0, math.inf, PROXIMAL, SWEEPS
    convex = is_convex(island.members, m)
    if convex:
        sweeps = 1
    for turn in range(rounds):
        for _ in range(sweeps):
            done += 1
            worst = gauss_seidel_sweep(island.members, m, n, island.W, b, p, island.velocity)
            if worst <= tolerance:
                return worst, done
        if convex and solve_active_set(island, m, n, b, p, tolerance):
            return tolerance, done
        left = newton(island, m, n, b, p, tolerance, proximal)
        clamp_to_cones(island.members, m, p)
        if turn < LOOSER:
            tolerance = max(tolerance, min(10 * tolerance, UNSOLVED))
        if left <= tolerance:
            return left, done
        sweeps, proximal = 2 * sweeps, STIFFER * proximal
    return left, done


@compiled
def is_opening(W: np.ndarray, n: int, a: int, b: np.ndarray, p: np.ndarray) -> bool:
    """Whether the contact with normal row a opens faster than OPENING."""
    u = b[a]
    for j in range(n):
        u += W[a * n + j] * p[j]
    return u > OPENING


@compiled
def solve_impulses(island: Island, m: int, n: int, b: np.ndarray, p: np.ndarray, tolerance: float,
                   rounds: int) -> tuple[float, int]:
    """Solve for p (n,); arguments and return values as solve_cones().

    Unlimited friction makes the problem convex, but holds a contact sideways even as it opens. So
    opening contacts of unlimited friction are released, by a friction of -1 in their members, and
    all is solved again. Released contacts that then press get unlimited friction again, and all is
    solved a last time: between the two there is no solution (Painleve's paradox).
    """
    left, done = solve_cones(island, m, n, b, p, tolerance, rounds)
    for turn in range(2):
        some = False
        for c in range(m):
            member = island.members[c]
            a = member.row
            if member.kind == LIMIT:
                continue
            if turn == 0 and member.friction >= NO_SLIP and p[a] <= 0.0 and (
                    p[a + 1] != 0.0 or p[a + 2] != 0.0) and is_opening(island.W, n, a, b, p):
                member.friction = -1.0
                p[a] = p[a + 1] = p[a + 2] = 0.0
                some = True
            elif turn == 1 and member.friction < 0 and p[a] > 0:
                member.friction = NO_SLIP
                some = True
        if not some:
            break
        left, more = solve_cones(island, m, n, b, p, tolerance, rounds)
        done += more
    return left, done


@compiled
def solve_position_correction(island: Island, m: int, n: int) -> None:
    """Write to island.correction (n,) the normal impulses of position correction, kg m or kg m^2.
    They move the gap of each contact by the ``correction`` of its member, m or rad, or more, by
    complementarity; its ``correction_compliance`` is added to W as a share of the diagonal.

    W and the members are overwritten: only the normal rows remain.
    """
    W, b, own, normal_row = island.W, island.normal_rhs, island.normal_impulses, island.normal_row
    for c in range(m):
        normal_row[c] = island.members[c].row
    for c in range(m):
        for e in range(m):
            W[c * m + e] = W[normal_row[c] * n + normal_row[e]]
    for i in range(n):
        island.correction[i] = 0.0
    for c in range(m):
        member = island.members[c]
        W[c * m + c] *= 1 + member.correction_compliance
        b[c], own[c] = -member.correction, 0.0
        member.kind, member.row, member.friction, member.rolling_friction = LIMIT, c, 0.0, 0.0
    solve_cones(island, m, m, b, own, 1e-9, ROUNDS)
    for c in range(m):
        island.correction[normal_row[c]] = max(0.0, own[c])


@compiled
def scale_to_no_work(p: np.ndarray, n: int, work: float, spent: float) -> None:
    """Scale impulses p (n,) down so that their energy, J, work + spent / 2 is not positive; never
    up. work = p u, spent = p W p. Impulses that are not finite become zero.
    """
    share = min(1.0, max(0.0, -2 * work / spent)) if spent > 0 else 0.0
    if not math.isfinite(share) or not math.isfinite(work):
        share = 0.0
    for i in range(n):
        p[i] = share * p[i] if share > 0 else 0.0


@compiled
def energy_bound_share(a: float, b: float, c: float) -> float:
    """Return the largest x from 0 to 1 with a x^2 + b x + c <= 0, J, for a >= 0; 1 if a = 0. A
    positive c counts as 0.
    """
    c = min(0.0, c)
    root = math.sqrt(max(0.0, b * b - 4 * a * c))
    share = (-2 * c / (b + root) if b > 0 else (root - b) / (2 * a)) if a > 0 else 1.0
    return min(1.0, max(0.0, share))
