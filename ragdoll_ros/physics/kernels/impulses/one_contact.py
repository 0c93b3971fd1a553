"""The impulse of one contact by itself, exactly by Signorini's and Coulomb's laws."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import Vec3
from ..system import NO_SLIP

MAX_ITERATIONS = 50
"""Iterations for the drag of a sliding contact; some four are needed."""


@compiled
def solve_one_contact(W: np.ndarray, n: int, a: int, c: Vec3, guess: Vec3, mu: float) -> Vec3:
    """Return the impulse, N s, of one contact. Its rows of W (flat, n a row), normal and two
    tangents, begin at a; its velocity without the impulse is c, m/s; friction coefficient mu.
    ``guess``: an impulse to start from. With unlimited friction (NO_SLIP) a contact that opens
    still gets a tangential impulse.

    A sliding contact has u_n = 0 and u_t = -d p_t with a drag d > 0: for given d, the system is
    linear. The drag with |p_t| = mu p_n exists, as d = 0 gives a larger |p_t| (else the contact
    would stick) and infinite d gives none. It is found by Newton's method on mu p_n / |p_t|, nearly
    a line in d, between bounds.
    """
    at = a * n + a
    w00, w01, w02 = W[at], W[at + 1], W[at + 2]
    w11, w12, w22 = W[at + n + 1], W[at + n + 2], W[at + 2 * n + 2]
    c0, c1, c2 = c
    x, y, z = guess
    if mu <= 0.0:
        return max(0.0, -c0 / w00), 0.0, 0.0
    d0, d1, d2 = w11 * w22 - w12 * w12, w02 * w12 - w01 * w22, w01 * w12 - w02 * w11
    det = w00 * d0 + w01 * d1 + w02 * d2
    if det > 1e-12 * w00 * w11 * w22:
        e11, e12, e22 = w00 * w22 - w02 * w02, w01 * w02 - w00 * w12, w00 * w11 - w01 * w01
        sx = -(d0 * c0 + d1 * c1 + d2 * c2) / det
        sy = -(d1 * c0 + e11 * c1 + e12 * c2) / det
        sz = -(d2 * c0 + e12 * c1 + e22 * c2) / det
        if sx >= 0 and (mu >= NO_SLIP or sy * sy + sz * sz <= mu * mu * sx * sx):
            return sx, sy, sz
    if mu >= NO_SLIP:
        det = w11 * w22 - w12 * w12
        return 0.0, (w12 * c2 - w22 * c1) / det, (w12 * c1 - w11 * c2) / det
    if c0 >= 0:
        return 0.0, 0.0, 0.0
    drag = -((c1 + w01 * x + w11 * y + w12 * z) * y + (c2 + w02 * x + w12 * y + w22 * z) * z)
    if drag > 0:
        drag /= y * y + z * z
    else:  # no impulse to start from: friction against c on a free surface
        drag = max(0.0, math.sqrt(c1 * c1 + c2 * c2) / (-c0 * mu / w00) - (w11 + w22) / 2)
    least, most = 0.0, math.inf
    for _ in range(MAX_ITERATIONS):
        v11, v22 = w11 + drag, w22 + drag
        det = v11 * v22 - w12 * w12
        g1, g2 = (v22 * w01 - w12 * w02) / det, (v11 * w02 - w12 * w01) / det
        k1, k2 = (v22 * c1 - w12 * c2) / det, (v11 * c2 - w12 * c1) / det
        alone = w00 - w01 * g1 - w02 * g2
        x = (w01 * k1 + w02 * k2 - c0) / alone
        y, z = -k1 - g1 * x, -k2 - g2 * x
        size = math.sqrt(y * y + z * z)
        over = mu * x - size
        if abs(over) <= 1e-13 * size:
            break
        if over < 0:
            least = drag
        else:
            most = drag
        q1, q2 = (v22 * y - w12 * z) / det, (v11 * z - w12 * y) / det
        dx = (w01 * q1 + w02 * q2) / alone
        shrinks = (y * (q1 + g1 * dx) + z * (q2 + g2 * dx)) / size
        slope = mu * (dx * size + x * shrinks)
        drag -= over * size / slope if slope > 0 else math.inf
        if not least < drag < most:
            drag = (least + most) / 2 if most < math.inf else 2 * least + w11 + w22
    y, z = project_to_disc(y, z, mu * x)
    return x, y, z


@compiled
def project_to_disc(y: float, z: float, radius: float) -> tuple[float, float]:
    """The point nearest to (y, z) of the disc of this radius about the origin."""
    size = math.sqrt(y * y + z * z)
    if size > radius:
        share = radius / size
        return y * share, z * share
    return y, z
