"""A doll's skin: its surface and the weights of its bones."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

SKIN_COLOR = (0.8, 0.75, 0.69, 1.0)
"""Colour of a skin without materials."""


@dataclass(frozen=True)
class Texture:
    """An encoded image of MIME type ``kind`` and its glTF sampler."""

    image: bytes
    kind: str
    sampler: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Appearance:
    """Normals, texture coordinates and materials of a skin of v vertices and t triangles.

    ``normals`` (v, 3) are unit vectors in the bind pose, zero where the file has none; ``uvs``
    (v, 2) are glTF's. ``materials`` are glTF's (2.0, 5.19), with indices into ``textures``;
    ``material_indices`` (t,) are the triangles', -1: none.
    """

    normals: np.ndarray
    uvs: np.ndarray
    material_indices: np.ndarray
    materials: tuple[dict, ...] = ()
    textures: tuple[Texture, ...] = ()


@dataclass(frozen=True)
class Skin:
    """A doll's skin in its bind pose, doll's frame.

    ``bones`` (b,) are the doll's bones that have riders, ``weights`` (v, b) their skin weights.
    ``positions`` (b, 3) m and ``orientations`` (b, 4) are the bones' poses that the skin is bound
    in: the doll's bind pose, unless a limb was moved with its skin. Without ``appearance`` all of
    it has the ``color`` red, green, blue, opacity.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray
    appearance: Appearance | None = None
    color: tuple[float, float, float, float] = SKIN_COLOR
