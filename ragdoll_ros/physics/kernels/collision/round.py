"""Contacts of spheres and capsules with any shape: a ball that slides along a segment.

The signed distance of a point from a convex shape is a convex function of the point; so along a
capsule's axis it has one least value. Each contact is that of one ball of the axis, with a normal
and a gap of its own. Only when the axis itself is within a box or cylinder, which may be deep, is
the way out that of the whole axis.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from .axes import widest_axis
from .shapes import BOX, CAPSULE, CYLINDER, SPHERE, distance, into, out_of

STEEP = 0.7
"""Of a normal along a cylinder's axis from which on its cap, not its side, is what is lain on."""

SLANT = 0.5
"""Of a normal along a box's axis up to which the box's width there bounds what can lie on it."""

TIE = 1e-10
"""m: an end of the axis that is this near to being the deepest is the deepest."""

APART = 0.1
"""Two contacts of one capsule are at least this part of its radius apart."""


@compiled
def nearest_ball(kind: int, size: np.ndarray, px: float, py: float, pz: float, ux: float, uy: float,
                 uz: float, half: float) -> float:
    """Where on the axis p + t u, |t| <= half, of the shape's frame its distance is least."""
    if half <= 0:
        return 0.0
    if kind >= BOX:
        return _least(kind, size, px, py, pz, ux, uy, uz, half)
    # Ericson 5.1.9 for two segments given by their middles
    along, across, other = px * ux + py * uy + pz * uz, ux * ux + uy * uy, 0.0
    if kind == CAPSULE:
        t = (uz * pz - along) / across if across > 1e-16 else 0.0
        t = min(max(t, -half), half)
        other = min(max(pz + t * uz, -size[1]), size[1])
    return min(max(uz * other - along, -half), half)


@compiled
def _least(kind: int, size: np.ndarray, px: float, py: float, pz: float, ux: float, uy: float,
           uz: float, half: float) -> float:
    """Where the distance's slope, which only grows along the axis, goes through 0.

    By the Illinois method and bisection in turn: the slope jumps deep within a shape.
    """
    a, b = -half, half
    low = _slope(kind, size, px, py, pz, ux, uy, uz, a)
    if low >= 0:
        return a
    high = _slope(kind, size, px, py, pz, ux, uy, uz, b)
    if high <= 0:
        return b
    t, side = a, 0
    for k in range(100):
        t = (a + b) / 2 if k % 3 == 2 else a + (b - a) * low / (low - high)
        slope = _slope(kind, size, px, py, pz, ux, uy, uz, t)
        if abs(slope) < 1e-13 or b - a < 1e-13 * half:
            break
        if slope < 0:
            a, low = t, slope
            if side < 0:
                high /= 2
            side = -1
        else:
            b, high = t, slope
            if side > 0:
                low /= 2
            side = 1
    return t


@compiled
def _slope(kind: int, size: np.ndarray, px: float, py: float, pz: float, ux: float, uy: float,
           uz: float, t: float) -> float:
    _, x, y, z = distance(kind, size, px + t * ux, py + t * uy, pz + t * uz, ux, uy)
    return x * ux + y * uy + z * uz


@compiled
def _slab(lo: float, hi: float, p: float, u: float, width: float) -> tuple[float, float]:
    """What is left of [lo, hi] where |p + t u| <= width; nothing if the second is the less."""
    if abs(u) < 1e-12:
        return (lo, hi) if abs(p) <= width else (1.0, 0.0)
    a, b = (-width - p) / u, (width - p) / u
    return max(lo, min(a, b)), min(hi, max(a, b))


@compiled
def _shadow(kind: int, size: np.ndarray, px: float, py: float, pz: float, ux: float, uy: float,
            uz: float, half: float, nx: float, ny: float, nz: float) -> tuple[float, float]:
    """The part of an axis that lies over the face or line of the shape whose normal is n."""
    lo, hi = -half, half
    if kind == BOX:
        if abs(nx) < SLANT:
            lo, hi = _slab(lo, hi, px, ux, size[0])
        if abs(ny) < SLANT:
            lo, hi = _slab(lo, hi, py, uy, size[1])
        if abs(nz) < SLANT:
            lo, hi = _slab(lo, hi, pz, uz, size[2])
    elif kind == CYLINDER and abs(nz) > STEEP:
        across = ux * ux + uy * uy
        middle = -(px * ux + py * uy) / max(across, 1e-12)
        x, y = px + middle * ux, py + middle * uy
        chord = (size[0] * size[0] - x * x - y * y) / max(across, 1e-12)
        if chord < 0:
            return 1.0, 0.0
        chord = math.sqrt(chord)
        lo, hi = max(lo, middle - chord), min(hi, middle + chord)
    elif kind != SPHERE:
        lo, hi = _slab(lo, hi, pz, uz, size[1])
    return lo, hi


@compiled
def round_separation(kind_a: int, size_a: np.ndarray, pa: np.ndarray, ra: np.ndarray, kind_b: int,
                     size_b: np.ndarray, pb: np.ndarray, rb: np.ndarray) -> float:
    """Signed distance, m, of a sphere or capsule a from any shape b."""
    px, py, pz = into(rb, pa[0] - pb[0], pa[1] - pb[1], pa[2] - pb[2])
    ux, uy, uz = into(rb, ra[0, 2], ra[1, 2], ra[2, 2])
    t = nearest_ball(kind_b, size_b, px, py, pz, ux, uy, uz, size_a[1])
    gap, _, _, _ = distance(kind_b, size_b, px + t * ux, py + t * uy, pz + t * uz, ux, uy)
    if gap < 0 and kind_b >= BOX and size_a[1] > 0:
        gap, _, _, _ = widest_axis(kind_a, size_a, ra, kind_b, size_b, rb, pa[0] - pb[0],
                                   pa[1] - pb[1], pa[2] - pb[2], math.inf)
    return gap - size_a[0]


@compiled
def round_contacts(kind_a: int, size_a: np.ndarray, pa: np.ndarray, ra: np.ndarray, kind_b: int,
                   size_b: np.ndarray, pb: np.ndarray, rb: np.ndarray, margin: float, sign: float,
                   out: np.ndarray) -> int:
    """Contacts of a sphere or capsule a with any shape b; ``sign`` -1 turns the normals round.

    At the nearest ball, and where the axis enters and leaves the space over what it touches.
    """
    px, py, pz = into(rb, pa[0] - pb[0], pa[1] - pb[1], pa[2] - pb[2])
    ux, uy, uz = into(rb, ra[0, 2], ra[1, 2], ra[2, 2])
    radius, half = size_a[0], size_a[1]
    best = nearest_ball(kind_b, size_b, px, py, pz, ux, uy, uz, half)
    gap, nx, ny, nz = distance(
        kind_b, size_b, px + best * ux, py + best * uy, pz + best * uz, ux, uy)
    if gap - radius > margin:
        return 0
    name, count = 2.0, 0
    if gap < 0 and kind_b >= BOX and half > 0:
        gap, nx, ny, nz = widest_axis(kind_a, size_a, ra, kind_b, size_b, rb, pa[0] - pb[0],
                                      pa[1] - pb[1], pa[2] - pb[2], math.inf)
        nx, ny, nz = into(rb, nx, ny, nz)
    elif half > 0:
        lo, hi = _shadow(kind_b, size_b, px, py, pz, ux, uy, uz, half, nx, ny, nz)
        if hi - lo > APART * radius:
            for k in range(2):
                t = lo if k == 0 else hi
                other, x, y, z = distance(
                    kind_b, size_b, px + t * ux, py + t * uy, pz + t * uz, ux, uy)
                if other <= gap + TIE:
                    name = -1.0
                elif abs(t - best) < APART * radius:
                    name = float(k)
                    continue
                if other - radius <= margin:
                    _write(out[count], px + t * ux, py + t * uy, pz + t * uz, x, y, z, radius,
                           other, float(k), sign, pb, rb)
                    count += 1
    if name >= 0:
        _write(out[count], px + best * ux, py + best * uy, pz + best * uz, nx, ny, nz, radius, gap,
               name, sign, pb, rb)
        count += 1
    return count


@compiled
def _write(row: np.ndarray, x: float, y: float, z: float, nx: float, ny: float, nz: float,
           radius: float, distance: float, name: float, sign: float, p: np.ndarray,
           r: np.ndarray) -> None:
    """The contact of a ball at x, y, z of b's frame, whose centre is this far from the surface."""
    back = (distance + radius) / 2
    x, y, z = out_of(r, x - back * nx, y - back * ny, z - back * nz)
    nx, ny, nz = out_of(r, nx, ny, nz)
    row[0], row[1], row[2] = p[0] + x, p[1] + y, p[2] + z
    row[3], row[4], row[5] = sign * nx, sign * ny, sign * nz
    row[6], row[7] = distance - radius, name
