"""Masses of bodies from skin volume, from anthropometric proportions, or from both."""
from __future__ import annotations

import numpy as np

from ...model import errors
from ..reading.character import Character
from ..roles.person import SEGMENTS, is_person, segment
from ..skeleton.groups import BodyGroup, mirrored_group
from .skin_volume import skin_volumes

WATER_DENSITY = 1000.0
"""kg/m^3; the density of animals is within 10 % of it."""

MIN_FILL, MAX_FILL = 0.2, 1.5
"""Plausible ratio of skin volume to shape volume; outside it the skin is open, flat or layered."""


def share_mass(total: float | None, sharing: str, character: Character, groups: list[BodyGroup],
               shapes: list[float], notes: list[str]) -> list[float]:
    """Mass of each group's body, kg; ``shapes`` are the volumes of the bodies' shapes, m^3.

    ``total`` is the mass of the doll, kg; None: the skin's volume times the density of water.
    ``sharing`` is 'volume' (of the skin), 'proportions' (of a person) or 'best': by volume, but
    for a person the geometric mean of both, because skin weights change beside the joints, not at
    them. A note reports an unusable skin volume. Raises NotPositive, NotFinite for a bad total.
    """
    volumes = _skin_volumes(character, groups, np.array(shapes), notes)
    if total is None:
        total = WATER_DENSITY * float(volumes.sum())
    errors.check_positive('mass', total)
    roles = [group.role for group in groups]
    person = is_person(roles, character.positions[[group.bone for group in groups]])
    shares = volumes
    if sharing == 'proportions' or (sharing == 'best' and person):
        shares = _anthropometric_shares(groups, volumes)
    if sharing == 'best' and person:
        shares = np.sqrt(shares / shares.sum() * volumes / volumes.sum())
    return [float(f'{total * share / shares.sum():.9g}') for share in shares]


def _skin_volumes(character: Character, groups: list[BodyGroup], shapes: np.ndarray,
                  notes: list[str]) -> np.ndarray:
    """Skin volume of each group, m^3, averaged over left and right."""
    carriers = np.full(len(character.vertices), -1)
    for index, group in enumerate(groups):
        carriers[group.vertices[group.vertices < len(carriers)]] = index
    volumes = skin_volumes(character, carriers, len(groups))
    pairs = [mirrored_group(character, groups, index) for index in range(len(groups))]
    volumes = (volumes + volumes[pairs]) / 2
    if not MIN_FILL * shapes.sum() < volumes.sum() < MAX_FILL * shapes.sum():
        notes.append(f'the skin encloses {1000 * volumes.sum():.3g} l and the bodies '
                     f'{1000 * shapes.sum():.3g} l: the skin is open or layered, so masses follow '
                     'the volumes of the bodies (set the total with --mass)')
        return shapes
    bounded = np.clip(volumes, MIN_FILL * shapes, MAX_FILL * shapes)
    changed = [group.name for group, here in zip(groups, bounded != volumes, strict=True) if here]
    if changed:
        notes.append(f'the skin of {", ".join(changed)} is flat, open or layered: the volumes of '
                     'the bodies limit the masses')
    return bounded


def _anthropometric_shares(groups: list[BodyGroup], volumes: np.ndarray) -> np.ndarray:
    """Percent of a man's mass for each group; within a segment in proportion to volume.

    Segments that the doll lacks leave the ratios of the others unchanged.
    """
    segments = [segment(group.role, group.name) for group in groups]
    held: dict[tuple[str, int], float] = {}
    for part, volume in zip(segments, volumes, strict=True):
        held[part] = held.get(part, 0.0) + volume
    return np.array([SEGMENTS[part[0]] * volume / held[part]
                     for part, volume in zip(segments, volumes, strict=True)])
