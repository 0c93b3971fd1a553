"""The sparse factor and Anderson's acceleration, against dense linear algebra."""
import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: there is no rigid engine')

from kept_code import kept

from ragdoll_ros.physics.kernels.maths.anderson import accelerate, make_anderson
from ragdoll_ros.physics.kernels.maths.minimum_degree import find_order, make_minimum_degree
from ragdoll_ros.physics.kernels.maths.sparse_lu import (
    clear_row,
    eliminate_row,
    find_pattern,
    make_sparse_lu,
    substitute_back,
)


@kept
def solve_sparse(lu, a, b, m):
    """Solve a x = b in place, where m cliques have entries; returns the work, or -1."""
    n = len(b)
    work = find_pattern(lu, n, m)
    if work < 0:
        return work
    for i in range(n):
        clear_row(lu, i)
        for k in range(m):
            for x in range(lu.sizes[k]):
                if lu.sets[k, x] == i:
                    for y in range(lu.sizes[k]):
                        lu.row[lu.sets[k, y]] = a[i, lu.sets[k, y]]
        lu.row[i] = a[i, i]
        if not eliminate_row(lu, i, b):
            return -2
    substitute_back(lu, n, b)
    return work


def cliques(rng, n, count, size):
    """Sets of indices near each other, and the matrix pattern that is their union."""
    sets = [np.sort(rng.choice(np.arange(low, min(n, low + 3 * size)), size, replace=False))
            for low in rng.integers(0, n - size, count)]
    pattern = np.eye(n, dtype=bool)
    for own in sets:
        pattern[np.ix_(own, own)] = True
    return sets, pattern


def loaded(sets, n):
    lu = make_sparse_lu(n, len(sets), max(map(len, sets)))
    for k, own in enumerate(sets):
        lu.sizes[k], lu.sets[k, :len(own)] = len(own), own
    return lu


@pytest.mark.parametrize('n', [6, 40, 300, 700])
def test_a_sparse_system_that_is_not_symmetric_is_solved_as_a_dense_one(n):
    rng = np.random.default_rng(n)
    sets, pattern = cliques(rng, n, n // 2, min(5, n // 2))
    A = np.where(pattern, rng.normal(size=(n, n)), 0.0) + 12.0 * np.eye(n)
    b = rng.normal(size=n)
    x, lu = b.copy(), loaded(sets, n)
    work = solve_sparse(lu, A, x, len(sets))
    assert x == pytest.approx(np.linalg.solve(A, b), abs=1e-12)
    assert 0 < work < n ** 3 / 3
    if n >= 300:
        assert work < n ** 3 / 100, 'it is sparse'


def test_the_pattern_has_all_entries_that_arise_and_no_others():
    """Against elimination of a dense matrix of ones and zeros."""
    rng = np.random.default_rng(1)
    n = 60
    sets, pattern = cliques(rng, n, 25, 4)
    lu = loaded(sets, n)
    solve_sparse(lu, np.where(pattern, 0.01, 0.0) + np.eye(n), np.ones(n), len(sets))
    for k in range(n):
        below = np.flatnonzero(pattern[k + 1:, k]) + k + 1
        assert sorted(lu.columns[lu.start[k]:lu.start[k + 1]]) == below.tolist()
        pattern[np.ix_(below, below)] = True


def test_a_matrix_that_would_fill_up_is_refused():
    n = 600
    assert solve_sparse(loaded([np.arange(n)], n), np.eye(n), np.ones(n), 1) == -1


def test_a_matrix_without_a_pivot_is_refused():
    A = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert solve_sparse(loaded([np.arange(2)], 2), A, np.ones(2), 1) == -2


@kept
def find(nodes, n):
    find_order(nodes, n)


def test_the_order_of_elimination_is_that_of_minimum_degree():
    """Against the definition: sets of neighbours, by weight, the first of equal ones."""
    rng = np.random.default_rng(3)
    n = 40
    graph = np.triu(rng.random((n, n)) < 0.08, 1)
    graph |= graph.T
    weights = rng.integers(1, 7, n)
    near = {i: set(np.flatnonzero(graph[i])) for i in range(n)}
    nodes = make_minimum_degree(n)
    nodes.graph[:], nodes.weight[:] = graph, weights
    find(nodes, n)
    for k in nodes.order:
        least = min(sum(weights[j] for j in own) for own in near.values())
        assert k == min(i for i, own in near.items() if sum(weights[j] for j in own) == least)
        own = near.pop(k)
        for i in own:
            near[i] = (near[i] | own) - {i, k}
    assert not near


@kept
def iterate(slope, c, p, memory, weights, turns, accelerated):
    """Map p to slope p + c so many times; z = 2 p."""
    n = len(p)
    z = 2 * p
    for turn in range(turns):
        memory.start[:] = p
        p[:] = slope @ p + c
        z[:] = 2 * p
        if accelerated:
            accelerate(memory, weights, n, turn, p, z)
    return z


def test_anderson_acceleration_finds_the_fixed_point_of_a_slow_iteration():
    """Three slow modes, as many as there is memory: eleven turns in place of thousands."""
    rng = np.random.default_rng(2)
    n = 30
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    M = Q @ np.diag([0.99, 0.97, -0.9] + [0.0] * (n - 3)) @ Q.T
    c = rng.normal(size=n)
    exact = np.linalg.solve(np.eye(n) - M, c)
    p = np.zeros(n)
    z = iterate(M, c, p, make_anderson(n, n), np.ones(n), 11, True)
    assert p == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())
    assert z == pytest.approx(2 * p, abs=1e-9 * np.abs(exact).max()), 'z goes along'
    plain = np.zeros(n)
    iterate(M, c, plain, make_anderson(n, n), np.ones(n), 11, False)
    assert np.abs(plain - exact).max() > 1e-2 * np.abs(exact).max()
