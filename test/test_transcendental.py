"""Sines, arcs, exponentials and the like against the C library's and against many digits."""
import math

import pytest

from ragdoll_ros.model.rotation import sine_and_cosine

pytest.importorskip('numba')
from kept_code import kept

from ragdoll_ros.physics.kernels.maths import transcendental

ANGLES = [0.0, -0.0, 1e-300, 1e-9, 0.3, math.pi / 4, 0.8, math.pi / 2, 2.0, math.pi, 4.0, 5.0,
          2 * math.pi, 100.0, 1e4, 1e6]


@kept(error_model='numpy')
def _sine_and_cosine(x):
    return transcendental.sine_and_cosine(x)


@kept(error_model='numpy')
def _asinh(x):
    return transcendental.asinh(x)


@kept(error_model='numpy')
def _arc(sin, cos):
    return transcendental.arc(sin, cos)


@kept(error_model='numpy')
def _exp_minus(x):
    return transcendental.exp_minus(x)


@pytest.mark.parametrize('angle', [*ANGLES, *(-angle for angle in ANGLES)])
def test_sine_and_cosine_are_those_of_the_c_library(angle):
    right = math.sin(angle), math.cos(angle)
    # 1.5 units of the last bit
    assert _sine_and_cosine(angle) == pytest.approx(right, rel=0, abs=3e-16)
    for found, wanted in zip(sine_and_cosine(angle), right, strict=True):
        assert abs(found - wanted) <= math.ulp(wanted) if abs(wanted) > 1e-9 else 1e-16


def test_sine_and_cosine_far_from_0_and_without_bound():
    s, c = _sine_and_cosine(1e9)
    assert (s, c) == pytest.approx((math.sin(1e9), math.cos(1e9)), abs=1e-6)  # 1e9 rounds
    assert s * s + c * c == pytest.approx(1, abs=1e-6)
    for angle in (math.inf, math.nan):
        assert all(map(math.isnan, _sine_and_cosine(angle)))


def test_half_a_bit_decides():
    """sin(pi + 1e-16) as many digits have it: what the C library takes for exact is not needed."""
    assert sine_and_cosine(math.pi) == (1.2246467991473532e-16, -1.0)
    assert sine_and_cosine(0.0) == (0.0, 1.0)


@pytest.mark.parametrize('x', [0.0, 1e-300, 1e-5, 0.049, 0.051, 0.5, 1.0, 30.0, 1e8])
def test_inverse_hyperbolic_sine(x):
    for signed in (x, -x):
        assert _asinh(signed) == pytest.approx(math.asinh(signed), rel=2e-15)  # some roundings
    assert math.isnan(_asinh(math.nan))


@pytest.mark.parametrize('angle', [0.0, 1e-300, 1e-17, 1e-9, 0.01, 0.0624, 0.0626, 0.5, 1.0,
                                   math.pi / 2, 1.6, 3.0, 3.14, math.pi])
def test_an_arc_is_that_of_the_c_library(angle):
    sin, cos = abs(math.sin(angle)), math.cos(angle)
    for size in (1e-100, 1.0, 3e50):
        assert _arc(size * sin, size * cos) == pytest.approx(math.atan2(sin, cos), rel=4e-16)
    for bad in ((math.nan, 1.0), (1.0, math.nan), (0.0, 0.0)):
        assert math.isnan(_arc(*bad))


@pytest.mark.parametrize('x', [0.0, -1e-300, -1e-17, -1e-5, -0.3, -0.34, -0.35, -1.0, -30.0, -700.0,
                               -800.0, -math.inf])
def test_the_exponential_of_what_decays(x):
    assert _exp_minus(x) == pytest.approx((math.exp(x), math.expm1(x)), rel=4e-16, abs=0)
