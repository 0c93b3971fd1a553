"""Impulses against Signorini's and Coulomb's laws: of one contact by itself, of many that stick."""
from __future__ import annotations

import collections

import numpy as np
import pytest

pytest.importorskip('numba')

from kept_code import kept

from ragdoll_ros.physics.kernels.impulses.active_set import solve_active_set
from ragdoll_ros.physics.kernels.impulses.one_contact import solve_one_contact
from ragdoll_ros.physics.kernels.workspace import MEMBER

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
