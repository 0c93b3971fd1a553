"""Exact solution of the damped oscillator for any stiffness, damping and step."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled, entry, type_like
from .transcendental import exp_minus, sine_and_cosine

TERMS = 24
"""Terms of the series; for arguments up to 1 the remainder is below 1e-24."""

LARGEST_PHASE = 1e6
"""rad: beyond it a whole number of turns is taken off first."""


@compiled
def oscillator_response(w: float, c: float, h: float) -> tuple[float, float, float]:
    """Responses m, n1, n3 of z'' = -w z - c z' + f, f linear in time, over a step ``h`` (s).

    z(h)  = (1 - w n1) z + m z' + n1 f(0) + n3 (f(h) - f(0));
    z'(h) = -w m z + (1 - w n1 - c m) z' + m f(0) + n1/h (f(h) - f(0)).

    With a, b the roots of s^2 + c s + w times h, they are divided differences of the exponential
    function: m = h exp[a, b], n1 = h^2 exp[0, a, b], n3 = h^2 exp[0, 0, a, b] (Higham, Functions
    of Matrices, 2008, section 10.7; the phi functions of Hochbruck and Ostermann, Exponential
    integrators, Acta Numerica 19, 2010). Small roots take the Taylor series; real ones the
    recurrence that divides by the larger root; complex ones the closed form. Relative error about
    1e-14 for all w >= 0, c >= 0. For w = c = 0: h, h^2/2, h^2/6.
    """
    product, total = w * h * h, c * h
    half, size = total / 2, math.sqrt(product)
    if max(size, total) < 1:
        m, n1, n3 = _series(product, total)
    elif half >= size:
        b = -half - math.sqrt((half - size) * (half + size))
        a = product / b
        m = exp_minus(a)[0] * _phi1(b - a)
        n1 = (m - _phi1(a)) / b
        n3 = (n1 - _phi2(a)) / b
    else:
        turn = math.sqrt((size - half) * (size + half))
        sin, cos = sine_and_cosine(turn if turn < LARGEST_PHASE else turn % (2 * math.pi))
        decay = exp_minus(-half)[0]
        m = decay * (sin / turn if turn > 0 else 1.0)
        n1 = (1 - decay * cos - half * m) / product
        n3 = (1 - total * n1 - m) / product
    return m * h, n1 * h * h, n3 * h * h


@compiled
def _series(product: float, total: float) -> tuple[float, float, float]:
    """Return the sums over k of h_k/(k+1)!, h_k/(k+2)!, h_k/(k+3)!; h_k the complete symmetric
    polynomials of a, b, where a b = ``product`` and a + b = -``total``.
    """
    before, term = 0.0, 1.0
    m, n1, n3 = 0.0, 0.0, 0.0
    factorial = 1.0
    for k in range(TERMS):
        factorial *= k + 1
        m += term / factorial
        n1 += term / (factorial * (k + 2))
        n3 += term / (factorial * (k + 2) * (k + 3))
        before, term = term, -total * term - product * before
    return m, n1, n3


@compiled
def _phi1(x: float) -> float:
    """The phi function (e^x - 1)/x for x <= 0; 1 at x = 0."""
    return exp_minus(x)[1] / x if x < 0 else 1.0


@compiled
def _phi2(x: float) -> float:
    """(e^x - 1 - x)/x^2, x <= 0."""
    if x < -0.5:
        return (exp_minus(x)[1] - x) / (x * x)
    series = term = 0.5
    for k in range(3, 20):
        term = term * x / k
        series += term
    return series


@entry(*[type_like(0.0)] * 3, type_like(np.zeros((0, 0))), *[type_like(np.zeros(0))] * 2,
       *[type_like(np.zeros((0, 0)))] * 2)
def drive_oscillators(w: float, c: float, h: float, forces: np.ndarray, z: np.ndarray,
                      rate: np.ndarray, z_path: np.ndarray, rate_path: np.ndarray) -> None:
    """Advance oscillators z'' = -w z - c z' + f with equal w, 1/s^2, and c, 1/s, by t steps of
    ``h`` s in which their ``forces`` f (t, k) are constant. Updates ``z`` and ``rate``, z', (k,) in
    place and writes their values at the end of each step to the paths (t, k).
    """
    m, n1, _ = oscillator_response(w, c, h)
    for i in range(len(forces)):
        for j in range(len(z)):
            start, f = z[j], forces[i, j]
            z[j] = (1 - w * n1) * start + m * rate[j] + n1 * f
            rate[j] = (1 - w * n1 - c * m) * rate[j] + m * (f - w * start)
            z_path[i, j], rate_path[i, j] = z[j], rate[j]
