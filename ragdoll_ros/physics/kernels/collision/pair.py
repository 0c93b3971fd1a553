"""Where two shapes touch, or nearly so, and how far they are apart.

Four kinds: see shapes.py for their sizes. Spheres and capsules are balls along an axis
(round.py); boxes and cylinders have axes that separate them (axes.py) and
patches on which they lie (flat.py).
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from .axes import widest_axis
from .clip import MOST
from .flat import flat_contacts
from .round import round_contacts, round_separation
from .shapes import BOX, CAPSULE, CYLINDER, SPHERE, bound

__all__ = ['BOX', 'CAPSULE', 'CYLINDER', 'MOST', 'POINT', 'SPHERE', 'collide', 'separation']

POINT = 8
"""Columns of a contact: point, normal from b to a, gap, name."""


@compiled
def collide(kind_a: int, size_a: np.ndarray, pa: np.ndarray, ra: np.ndarray, kind_b: int,
            size_b: np.ndarray, pb: np.ndarray, rb: np.ndarray, margin: float,
            out: np.ndarray) -> int:
    """How many points of two bodies are at most ``margin`` m apart; one row of ``out`` (8, 8) each.

    A row is the point midway between the surfaces (world, m), the unit normal from b to a, the gap
    along it (m; negative: overlap), and a name that points of the same features keep. ``size`` (3,)
    and kinds as in shapes.py; ``p`` (3,) centres, m; ``r`` (3, 3) rotations to the world.
    """
    x, y, z = pa[0] - pb[0], pa[1] - pb[1], pa[2] - pb[2]
    reach = bound(kind_a, size_a) + bound(kind_b, size_b) + margin
    if x * x + y * y + z * z > reach * reach:
        return 0
    sign = 1.0
    if kind_b <= CAPSULE < kind_a:
        kind_a, size_a, pa, ra, kind_b, size_b, pb, rb = (
            kind_b, size_b, pb, rb, kind_a, size_a, pa, ra)
        sign = -1.0
    if kind_a <= CAPSULE:
        return round_contacts(kind_a, size_a, pa, ra, kind_b, size_b, pb, rb, margin, sign, out)
    return flat_contacts(kind_a, size_a, pa, ra, kind_b, size_b, pb, rb, margin, out)


@compiled
def separation(kind_a: int, size_a: np.ndarray, pa: np.ndarray, ra: np.ndarray, kind_b: int,
               size_b: np.ndarray, pb: np.ndarray, rb: np.ndarray, enough: float) -> float:
    """Signed distance of two bodies, m: positive just when they are disjoint. Of what is farther
    apart than ``enough`` a bound below it that is too will do.

    It is continuous, and while they touch its rate is the relative velocity along the normal. With
    a sphere or capsule, or a cylinder, it is the distance while they are apart; of two boxes the
    largest along an axis of theirs. Overlapped: the least penetration.
    """
    if kind_b <= CAPSULE < kind_a:
        kind_a, size_a, pa, ra, kind_b, size_b, pb, rb = (
            kind_b, size_b, pb, rb, kind_a, size_a, pa, ra)
    if kind_a <= CAPSULE:
        return round_separation(kind_a, size_a, pa, ra, kind_b, size_b, pb, rb)
    s, _, _, _ = widest_axis(kind_a, size_a, ra, kind_b, size_b, rb, pa[0] - pb[0], pa[1] - pb[1],
                             pa[2] - pb[2], enough)
    return s
