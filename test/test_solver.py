"""Impulses against Signorini's and Coulomb's laws: of one contact by itself, of many that stick."""
from __future__ import annotations

import collections

import numpy as np
import pytest

pytest.importorskip('numba')

from kept_code import kept

from ragdoll_ros.physics.kernels.impulses.active_set import solve_active_set
from ragdoll_ros.physics.kernels.impulses.newton import newton
from ragdoll_ros.physics.kernels.impulses.one_contact import solve_one_contact
from ragdoll_ros.physics.kernels.impulses.solver import ROUNDS, solve_cones
from ragdoll_ros.physics.kernels.maths.gaussian_elimination import gaussian_elimination
from ragdoll_ros.physics.kernels.system import NO_SLIP
from ragdoll_ros.physics.kernels.workspace import MEMBER, UNKNOWN

Island = collections.namedtuple('Island', 'members W G velocity active places is_normal')
"""What of an island the active set method reads and writes."""


@kept
def _one_contact(ease, c, last, mu):
    return solve_one_contact(ease, 3, 0, (c[0], c[1], c[2]), (last[0], last[1], last[2]), mu)


@kept
def _solve(island, b, p, tolerance):
    return solve_active_set(island, len(island.members), len(b), b, p, tolerance)


def _active_set(kinds, rows, mu, ease, b, p, tolerance):
    n, members = len(b), np.zeros(len(kinds), MEMBER)
    members['kind'], members['row'], members['friction'] = kinds, rows, mu
    island = Island(members, ease, np.zeros(n * n), np.zeros(n), np.zeros(n),
                    np.zeros(n + 1, np.int64), np.zeros(n, np.int64))
    return _solve(island, b, p, tolerance)


def breach(ease, c, p, mu):
    """By how much, in velocities, an impulse p (3,) breaks the laws; ``ease`` is W (3, 3)."""
    u, cone = ease @ p + c, mu * p[0]
    size, speed = np.linalg.norm(p[1:]), np.linalg.norm(u[1:])
    if p[0] == 0:
        return max(-u[0], np.abs(p).max() * ease.trace())
    slides = 0.0 if size < cone * (1 - 1e-9) else size
    against = np.linalg.norm(u[1:] * slides + p[1:] * speed) / size if slides else speed
    return max(abs(u[0]), against, (size - cone) * ease.trace())


@pytest.mark.parametrize('seed', range(4))
def test_a_contact_by_itself_keeps_the_laws(seed):
    """Whatever its bodies, its friction (.01 to 100: beyond Painleve's) and the last impulse."""
    draw = np.random.default_rng(seed)
    for _ in range(1000):
        ways = draw.normal(size=(3, draw.integers(3, 6))) * np.exp(draw.normal(size=(3, 1)))
        ease, mu = ways @ ways.T, 10 ** draw.uniform(-2, 2)
        c = draw.normal(size=3) * np.exp(2 * draw.normal(size=3))
        last = np.abs(draw.normal(size=3)) * draw.integers(0, 2)
        p = np.array(_one_contact(ease.ravel(), c, last, mu))
        # Rounding of the sums, times what a quotient of nearly dependent ways loses.
        sums = (np.abs(ease) @ np.abs(p) + np.abs(c)).max()
        assert breach(ease, c, p, mu) <= 1e-9 * sums, (ease, c, p, mu, last)


def test_what_slides_and_closes_under_much_friction_is_stopped():
    """An edge of a doll at friction 10: normal and friction by turns went in circles here."""
    ease = np.array([[0.504, 0.213, 0.0], [0.213, 0.3, 0.0], [0.0, 0.0, 0.5]])
    c = np.array([-0.79, -1.78, -0.02])
    p = np.array(_one_contact(ease.ravel(), c, np.zeros(3), 10.0))
    assert p[0] > 0.1
    assert breach(ease, c, p, 10.0) <= 1e-12


@pytest.mark.parametrize('seed', range(4))
def test_many_that_stick_keep_the_laws(seed):
    """Faces, limits and what is let go, far more rows than ways to move, from any start."""
    draw = np.random.default_rng(seed)
    for _ in range(50):
        kinds = draw.choice([1, 3], size=draw.integers(2, 25))
        rows = np.cumsum(kinds) - kinds
        n = int(kinds.sum())
        mu = np.where(draw.random(len(kinds)) < 0.2, 0.0, 1e5)
        ways = draw.normal(size=(n, draw.integers(3, 12))) * np.exp(draw.normal(size=(n, 1)))
        W = ways @ ways.T
        W[np.diag_indices(n)] *= 1 + 1e-8
        b, p = ways @ draw.normal(size=ways.shape[1]), np.abs(draw.normal(size=n))
        assert _active_set(kinds, rows, mu, W.ravel(), b, p, 1e-9)
        u = W @ p + b
        # Rounding of the sums.
        small = 1e-9 + 1e-12 * (np.abs(W) @ np.abs(p)).max()
        along = np.setdiff1d(np.arange(n), rows)
        sticks = np.repeat(mu, kinds)[along] > 0
        assert p[rows].min() >= 0 and u[rows].min() >= -small
        assert np.abs(u[rows] * (p[rows] > 0)).max() <= small
        assert np.abs(u[along[sticks]]).max(initial=0.0) <= small
        assert not p[along[~sticks]].any()


@kept
def _eliminate(matrix, x):
    return gaussian_elimination(matrix, len(x), x)


@pytest.mark.parametrize('n', [1, 2, 3, 5, 6, 8, 12, 40])
def test_elimination_solves_what_needs_pivots(n):
    """Zero pivots in the order given; rounding of n sums, times the condition."""
    draw = np.random.default_rng(n)
    for _ in range(20):
        matrix = draw.normal(size=(n, n))
        if n > 1:
            np.fill_diagonal(matrix, 0.0)
            matrix[0, 0] = 0.0
        b = draw.normal(size=n)
        x = b.copy()
        assert _eliminate(matrix.ravel().copy(), x)
        error = np.linalg.norm(matrix @ x - b) / np.linalg.norm(b)
        assert error < 1e-15 * n * np.linalg.cond(matrix)


@pytest.mark.parametrize('n', [1, 2, 3, 6])
@pytest.mark.parametrize('row', [0, -1])
def test_elimination_says_that_a_matrix_is_singular(n, row):
    matrix = np.eye(n)
    matrix[row] = 0.0
    assert not _eliminate(matrix.ravel(), np.ones(n))


Cones = collections.namedtuple('Cones', (
    *Island._fields, 'residual', 'direction', 'best', 'step_start', 'newton_steps', 'unknowns',
    'combined'))
"""What Newton's method reads and writes besides."""


@kept
def _cones(island, b, p, tolerance, rounds):
    return solve_cones(island, len(island.members), len(b), b, p, tolerance, rounds)[0]


@kept
def _newton(island, b, p, tolerance, proximal):
    return newton(island, len(island.members), len(b), b, p, tolerance, proximal)


def mixed(draw, count):
    """Members of so many limits, contacts with friction, without, with all of it, and rolling."""
    members = np.zeros(count, MEMBER)
    members['kind'] = draw.choice([1, 3, 3, 3, 5], count)
    members['row'] = np.cumsum(members['kind']) - members['kind']
    members['friction'] = draw.choice([0.0, 0.3, 0.7, 1.0, NO_SLIP], count)
    members['rolling_friction'] = draw.choice([0.0, 0.02], count)
    return members


def cones(members, ease):
    n = len(ease)
    return Cones(members, ease.ravel(), np.zeros(n * n), np.zeros(n), np.zeros(2 * n + 2),
                 np.zeros(n + 1, np.int64), np.zeros(n, np.int64), np.zeros(n), np.zeros(n),
                 np.zeros(n), np.zeros(n), np.zeros(1, np.int64), np.zeros(n, UNKNOWN),
                 np.zeros(n))


def largest_breach(members, ease, b, p):
    """By how much, m/s, impulses break the laws of any member: each of its discs is like the
    friction of a contact with that normal impulse.
    """
    worst, u = 0.0, ease @ p + b
    for member in members:
        a = member['row']
        worst = max(worst, -u[a], -p[a] * ease[a, a], min(abs(u[a]), abs(p[a]) * ease[a, a]))
        for k in range(1, member['kind'], 2):
            i = a + k
            law = member['friction'] if k == 1 else member['rolling_friction']
            if k == 1 and law >= NO_SLIP:
                worst = max(worst, np.abs(u[i:i + 2]).max())
                continue
            size, speed = np.linalg.norm(p[i:i + 2]), np.linalg.norm(u[i:i + 2])
            own, most = max(ease[i, i], ease[i + 1, i + 1]), law * p[a]
            worst = max(worst, (size - most) * own)
            if size < most - 1e-9:
                worst = max(worst, speed)
            elif speed > 0:
                worst = max(worst, own * np.linalg.norm(p[i:i + 2] + most * u[i:i + 2] / speed)
                            if speed > 1e-7 else 0.0)
    return worst


@pytest.mark.parametrize('count', [1, 2, 3, 5, 6, 8, 12])
def test_what_slips_sticks_rolls_and_opens_together_keeps_the_laws(count):
    """Solved, whatever the kinds: 40 islands of bodies with more freedom than rows, so that there
    is a solution. Its direction is known as well as a slip of 1e-7 m/s allows.
    """
    draw = np.random.default_rng(count)
    for _ in range(40):
        members = mixed(draw, count)
        n = int(members['kind'].sum())
        rows = draw.normal(size=(n, n + 6))
        ease, b, p = rows @ rows.T / n, draw.normal(size=n), np.zeros(n)
        assert _cones(cones(members, ease), b, p, 1e-9, ROUNDS) <= 1e-9
        assert largest_breach(members, ease, b, p) < 1e-6


def test_newton_ends_in_quadratic_steps():
    """From 1e-3 beside a solution two steps reach rounding: 1e-3, 1e-6, 1e-12 of the impulses."""
    draw, taken = np.random.default_rng(7), []
    for _ in range(40):
        members = mixed(draw, 8)
        n = int(members['kind'].sum())
        rows = draw.normal(size=(n, n + 6))
        ease, b, p = rows @ rows.T / n, draw.normal(size=n), np.zeros(n)
        island = cones(members, ease)
        _cones(island, b, p, 1e-11, ROUNDS)
        p *= 1 + 1e-3 * draw.normal(size=n)
        island.newton_steps[0] = 0
        assert _newton(island, b, p, 1e-9, 0.0) <= 1e-9
        taken.append(int(island.newton_steps[0]))
    assert np.median(taken) <= 2 and max(taken) <= 6
