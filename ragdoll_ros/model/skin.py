"""A doll's skin: what of it is seen, and which bones it follows."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

SKIN_COLOR = (0.8, 0.75, 0.69, 1.0)
"""Of a skin that brings none."""


@dataclass(frozen=True)
class Texture:
    """An image as its file has it, of a MIME ``kind``, and glTF's sampler for it."""

    image: bytes
    kind: str
    sampler: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Appearance:
    """What a skin's surface looks like; v vertices and t triangles are the skin's.

    ``normals`` (v, 3) are unit vectors of the bind pose, zero where the file has none; ``uvs``
    (v, 2) as in glTF. ``materials`` are glTF's (2.0, 5.19), whose textures are indices of
    ``textures``; ``material_indices`` (t,) are the triangles', -1: none.
    """

    normals: np.ndarray
    uvs: np.ndarray
    material_indices: np.ndarray
    materials: tuple[dict, ...] = ()
    textures: tuple[Texture, ...] = ()


@dataclass(frozen=True)
class Skin:
    """A doll's skin in its bind pose, doll's frame.

    ``bones`` (b,) are the doll's bones that carry riders, ``weights`` (v, b) theirs. ``positions``
    (b, 3) m and ``orientations`` (b, 4) are where these bones were when the skin was bound to
    them: in the doll's bind pose, unless a limb has been moved with its skin since. Without
    ``appearance`` it is of one ``color``: red, green, blue, opacity.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray
    appearance: Appearance | None = None
    color: tuple[float, float, float, float] = SKIN_COLOR
