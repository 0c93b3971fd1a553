"""Records of the chains of a scene, for the kernels that integrate them."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model.swing_mount import SwingMount
from ..kernels.compiling.decorators import rows_of
from ..kernels.swing.links import COLLIDER, LINK
from ..kernels.swing.loaded import chain_modes


def make_links(mounted: Sequence[SwingMount], gravity: np.ndarray) -> np.ndarray:
    """Records LINK (m,) of all links of mounted swings, none of them free, in their order."""
    links = rows_of(LINK, sum(len(mount.swing.links) for mount in mounted))
    last = 0
    for mount in mounted:
        swing, first, last = mount.swing, last, last + len(mount.swing.links)
        own = links[first:last]
        lengths, masses, springs, ratios = np.array([
            (link.length, link.mass, link.stiffness, link.damping) for link in swing.links]).T
        weight = abs(swing.gravity) * np.linalg.norm(gravity)
        if swing.independent:
            inertia, lever = masses * lengths ** 2, masses * lengths
        else:
            inertia, lever = carried(lengths, masses, springs, weight)
        own['bone'], own['root'], own['rest'] = mount.bone, mount.root, mount.directions
        own['parent'] = np.arange(first - 1, last - 1)
        own['parent'][0] = -1
        own['radius'] = [link.radius for link in swing.links]
        own['length'], own['reach'], own['stiffness'] = lengths, inertia / lever, springs / inertia
        own['damping'] = 2 * ratios * np.sqrt((springs + weight * lever) / inertia)
        own['gravity'] = np.outer(lever / inertia, swing.gravity * gravity)
    return links


def make_colliders(mounted: Sequence[SwingMount]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Records COLLIDER of all colliders of mounted swings, and the first of each swing and the one
    after its last, (c,).
    """
    found = [collider for mount in mounted for collider in mount.colliders]
    rows = rows_of(COLLIDER, len(found))
    for row, collider in zip(rows, found, strict=True):
        row['bone'], row['radius'] = collider.bone, collider.radius
        row['start'], row['end'] = collider.axis
    ends = np.cumsum([len(mount.colliders) for mount in mounted], dtype=np.int64)
    return rows, np.append(0, ends)[:-1].astype(np.int64), ends


def carried(lengths: np.ndarray, masses: np.ndarray, springs: np.ndarray,
            weight: float) -> tuple[np.ndarray, np.ndarray]:
    """Inertia J (n,) kg m^2 and first moment (n,) kg m about the root of each link of a chain, with
    all that it carries; ``weight``: of 1 kg, N.

    The first moment is that of the straight chain. With J, the link swings at the lowest frequency
    of the true chain that it forms with all links beyond, hanging from a root at rest. Where that
    frequency is zero, J is the straight chain's moment of inertia.
    """
    inertia, lever = np.zeros((2, len(lengths)))
    for index in range(len(lengths)):
        distances = np.cumsum(lengths[index:])
        inertia[index] = masses[index:] @ distances ** 2
        lever[index] = masses[index:] @ distances
    squares = np.zeros(len(lengths))
    chain_modes.lowest_squares(
        *map(np.ascontiguousarray, (lengths, masses, springs)),
        weight * lengths * np.cumsum(masses[::-1])[::-1], squares)
    moving = squares > 0
    inertia[moving] = (springs + weight * lever)[moving] / squares[moving]
    return inertia, lever
