"""The damped oscillator against the exponential of its matrix."""
import itertools
import math

import numpy as np
import pytest
from scipy.linalg import expm

pytest.importorskip('numba')
from kept_code import kept

from ragdoll_ros.physics.kernels.maths import oscillator

STEP = 0.01


@kept(error_model='numpy')
def _response(w, c, h):
    return oscillator.oscillator_response(w, c, h)


@pytest.fixture(scope='module')
def response():
    """The kernels' function as Python calls it."""
    return _response


@pytest.mark.parametrize(('phase', 'ratio'), list(itertools.product(
    [0.0, 1e-6, 0.3, 0.999, 1.001, 3.0, 40.0], [0.0, 0.1, 0.5, 1.0, 1.001, 3.0, 30.0])))
def test_responses_are_those_of_the_matrix_exponential(response, phase, ratio):
    """A force of 1 and one that grows from 0 to 1 are further states of a linear system."""
    w, c = (phase / STEP) ** 2, 2 * ratio * phase / STEP
    system = np.zeros((4, 4))
    system[0, 1], system[1] = 1, (-w, -c, 1, 0)
    system[2, 3] = 1 / STEP
    whole = expm(system * STEP)
    m, n1, n3 = response(w, c, STEP)
    assert m / STEP == pytest.approx(whole[0, 1] / STEP, abs=1e-11)
    assert n1 / STEP ** 2 == pytest.approx(whole[0, 2] / STEP ** 2, abs=1e-11)
    assert n3 / STEP ** 2 == pytest.approx(whole[0, 3] / STEP ** 2, abs=1e-11)


@pytest.mark.parametrize('ratio', [0.0, 1e-3, 1.0, 1e4])
@pytest.mark.parametrize('phase', [1e3, 1e6, 1e12, 1e20])
def test_the_stiffest_follow_their_force(response, phase, ratio):
    """The mean of z is what the spring gives, and what is left of a turn within its bounds."""
    w, c = (phase / STEP) ** 2, 2 * ratio * phase / STEP
    m, n1, n3 = response(w, c, STEP)
    assert all(map(math.isfinite, (m, n1, n3)))
    assert abs(m) <= 1.01 / (phase / STEP) and -1e-12 <= w * n1 <= 2 + 1e-12
    assert 0 <= n3 <= 1.01 * STEP ** 2 / 6
