"""Vectors and quaternions as tuples: values as in numpy and scipy, bits as written out."""
from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip('numba')
from kept_code import kept

from ragdoll_ros.physics.kernels.maths import vectors

RNG = np.random.default_rng(0)
A, B = (tuple(row) for row in RNG.normal(size=(2, 3)))
P, Q = (tuple(row / np.linalg.norm(row)) for row in RNG.normal(size=(2, 4)))
MATRIX = Rotation.from_quat(Q).as_matrix()


def called(function, *arguments):
    """The value of a function that only compiled code can call."""
    def call(arguments):
        return function(*arguments)
    call.__qualname__ = f'call_{function.__name__}'
    return kept(call)(arguments)


@pytest.mark.parametrize('name, arguments, expected', [
    ('vec', (np.array(A),), A),
    ('quat', (np.array(Q),), Q),
    ('column', (MATRIX, 1), MATRIX[:, 1]),
    ('add', (A, B), np.add(A, B)),
    ('sub', (A, B), np.subtract(A, B)),
    ('neg', (A,), np.negative(A)),
    ('scale', (.7, A), np.multiply(.7, A)),
    ('divide', (A, .7), np.divide(A, .7)),
    ('add_scaled', (A, .7, B), np.add(A, np.multiply(.7, B))),
    ('quat_conj', (Q,), np.multiply(Q, (-1, -1, -1, 1))),
])
def test_elementwise_operations_have_numpys_bits(name, arguments, expected):
    assert np.array_equal(called(getattr(vectors, name), *arguments), expected)


@pytest.mark.parametrize('name, arguments, expected', [
    ('dot', (A, B), np.dot(A, B)),
    ('cross', (A, B), np.cross(A, B)),
    ('norm', (A,), np.linalg.norm(A)),
    ('to_world', (MATRIX, A), MATRIX @ A),
    ('to_local', (MATRIX, A), MATRIX.T @ A),
    ('quat_mul', (P, Q), (Rotation.from_quat(P) * Rotation.from_quat(Q)).as_quat()),
    ('quat_rotate', (Q, A), MATRIX @ A),
    ('quat_rotate_inverse', (Q, A), MATRIX.T @ A),
])
def test_products_are_those_of_numpy_and_scipy(name, arguments, expected):
    value = np.array(called(getattr(vectors, name), *arguments))
    if name == 'quat_mul' and value @ expected < 0:
        value = -value
    assert value == pytest.approx(np.array(expected), abs=1e-15)


def test_put_stores_three_entries():
    row = np.zeros(4)
    called(vectors.put, row, A)
    assert np.array_equal(row, [*A, 0])


def test_the_matrix_of_a_quaternion():
    out = np.zeros((3, 3))
    called(vectors.quat_to_matrix, Q, out)
    assert out == pytest.approx(MATRIX, abs=1e-15)


@pytest.mark.parametrize(('function', 'arguments'), [
    (vectors.cross, (A, B)), (vectors.quat_mul, (P, Q)), (vectors.quat_rotate, (Q, A))])
def test_compiled_operations_round_each_result_as_python_does(function, arguments):
    assert called(function, *arguments) == function.py_func(*arguments)
