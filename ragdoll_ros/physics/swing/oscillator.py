"""Exact solution of the damped oscillator for any stiffness, damping and step."""
from dataclasses import dataclass

import numpy as np

_TERMS = 24
"""Terms of the series; for arguments up to 1 the remainder is below 1e-24."""


@dataclass(frozen=True)
class Flow:
    """Coefficients of the solution of z'' = -w z - c z' + f, f linear in time, over a step h.

    z(h)  = (1 - w n1) z + m z' + n1 f(0) + n3 (f(h) - f(0)) z'(h) = -w m z + (1 - w n1 - c m) z' +
    m f(0) + n1/h (f(h) - f(0)) Shapes as the input's. For w = c = 0: m = h, n1 = h^2/2, n3 = h^2/6.
    """

    m: np.ndarray
    """Response of z to a unit z', s."""
    n1: np.ndarray
    """Response of z to a unit force, s^2."""
    n3: np.ndarray
    """Response of z to a force that grows from 0 to 1, s^2."""


def flow(w: np.ndarray, c: np.ndarray, h: float) -> Flow:
    """The exact flow for stiffness ``w`` (1/s^2), damping ``c`` (1/s) and step ``h`` (s).

    With a, b the roots of s^2 + c s + w times h, the three are divided differences of the
    exponential function: m = h exp[a, b], n1 = h^2 exp[0, a, b], n3 = h^2 exp[0, 0, a, b]
    (Higham, Functions of Matrices, 2008, section 10.7; the phi functions of Hochbruck and
    Ostermann, Exponential integrators, Acta Numerica 19, 2010). Small roots take the Taylor
    series, which is real; large ones the recurrence that divides by the larger root. Relative
    error about 1e-14 for all w >= 0, c >= 0.
    """
    product, total = w * h * h, c * h
    size = np.maximum(np.sqrt(product), total)
    m, n1, n3 = _series(np.where(size < 1, product, 0), np.where(size < 1, total, 0))
    large = size >= 1
    if np.any(large):
        for out, value in zip((m, n1, n3), _recurrence(product[large], total[large]), strict=True):
            out[large] = value
    return Flow(m * h, n1 * h * h, n3 * h * h)


def _series(product: np.ndarray, total: np.ndarray) -> tuple[np.ndarray, ...]:
    """Sum h_k/(k+1)!, h_k/(k+2)!, h_k/(k+3)!; h_k the complete symmetric polynomials of a, b."""
    before, term = np.zeros_like(product), np.ones_like(product)
    sums = [np.zeros_like(product) for _ in range(3)]
    factorial = 1.0
    for k in range(_TERMS):
        factorial *= k + 1
        sums[0] += term / factorial
        sums[1] += term / (factorial * (k + 2))
        sums[2] += term / (factorial * (k + 2) * (k + 3))
        before, term = term, -total * term - product * before
    return tuple(sums)


def _recurrence(product: np.ndarray, total: np.ndarray) -> tuple[np.ndarray, ...]:
    half = total / 2
    root = np.sqrt((half - np.sqrt(product)) * (half + np.sqrt(product)) + 0j)
    b = -half - root
    a = np.where(root.imag != 0, -half + root, -product / (half + root))
    m = np.exp(a) * _phi1(b - a)
    n1 = (m - _phi1(a)) / b
    n3 = (n1 - _phi2(a)) / b
    return m.real, n1.real, n3.real


def _phi1(x: np.ndarray) -> np.ndarray:
    """(e^x - 1)/x."""
    safe = np.where(x == 0, 1, x)
    return np.where(x == 0, 1, np.expm1(safe) / safe)


def _phi2(x: np.ndarray) -> np.ndarray:
    """(e^x - 1 - x)/x^2."""
    near = np.abs(x) < 0.5
    small, safe = np.where(near, x, 0), np.where(near, 1, x)
    series = np.full_like(x, 0.5)
    term = np.full_like(x, 0.5)
    for k in range(3, 20):
        term = term * small / k
        series = series + term
    return np.where(near, series, (np.expm1(safe) - safe) / (safe * safe))
