"""A doll's skin: what of it is seen, and which bones it follows."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SKIN_COLOR = (0.8, 0.75, 0.69, 1.0)
"""Of a skin that brings none."""


@dataclass(frozen=True)
class Skin:
    """A doll's skin in its bind pose, doll's frame.

    ``bones`` (b,) are the doll's bones that carry riders, ``weights`` (v, b) theirs. ``positions``
    (b, 3) m and ``orientations`` (b, 4) are where these bones were when the skin was bound to
    them: in the doll's bind pose, unless a limb has been moved with its skin since. ``color`` is
    red, green, blue, opacity.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray
    color: tuple[float, float, float, float] = SKIN_COLOR
