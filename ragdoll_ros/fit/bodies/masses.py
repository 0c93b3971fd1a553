"""Masses of bodies: by the volume of their skin, by a person's proportions, or half way between."""
from __future__ import annotations

import numpy as np

from ...model import errors
from ..reading.character import Character
from ..roles.person import SEGMENTS, is_person, segment
from ..skeleton.groups import Group, partner
from .skin_volume import skin_volumes

WATER = 1000.0
"""kg/m^3; animals are within 10 % of it."""

LEAST, MOST = 0.2, 1.5
"""The skin of a body holds this share of its shape's volume; else it is open, flat or in layers."""


def share_mass(total: float | None, sharing: str, character: Character, groups: list[Group],
               shapes: list[float], notes: list[str]) -> list[float]:
    """Mass of each group's body, kg; ``shapes`` are the volumes of the bodies' shapes, m^3.

    ``total`` is the whole doll's, kg; None takes as much water as the skin holds. ``sharing`` is
    'volume' (the skin's), 'proportions' (a person's) or 'best': by volume, but of a person by the
    geometric mean of both, as a skin says where limbs change hands and not where joints are. A
    note says where the skin tells no volume. NotPositive, NotFinite: a total that cannot be.
    """
    volumes = _volumes(character, groups, np.array(shapes), notes)
    if total is None:
        total = WATER * float(volumes.sum())
    errors.check_positive('mass', total)
    roles = [group.role for group in groups]
    person = is_person(roles, character.positions[[group.bone for group in groups]])
    shares = volumes
    if sharing == 'proportions' or (sharing == 'best' and person):
        shares = _proportions(groups, volumes)
    if sharing == 'best' and person:
        shares = np.sqrt(shares / shares.sum() * volumes / volumes.sum())
    return [float(f'{total * share / shares.sum():.9g}') for share in shares]


def _volumes(character: Character, groups: list[Group], shapes: np.ndarray,
             notes: list[str]) -> np.ndarray:
    """Volume of the skin of each group, m^3, the same on both sides of the character."""
    carriers = np.full(len(character.vertices), -1)
    for index, group in enumerate(groups):
        carriers[group.vertices[group.vertices < len(carriers)]] = index
    volumes = skin_volumes(character, carriers, len(groups))
    pairs = [partner(character, groups, index) for index in range(len(groups))]
    volumes = (volumes + volumes[pairs]) / 2
    if not LEAST * shapes.sum() < volumes.sum() < MOST * shapes.sum():
        notes.append(f'the skin holds {1000 * volumes.sum():.3g} l and the bodies '
                     f'{1000 * shapes.sum():.3g} l: it is open, or several; masses follow the '
                     'bodies (--mass says otherwise)')
        return shapes
    bounded = np.clip(volumes, LEAST * shapes, MOST * shapes)
    changed = [group.name for group, here in zip(groups, bounded != volumes, strict=True) if here]
    if changed:
        notes.append(f'the skin of {", ".join(changed)} is flat, open or in layers: what their '
                     'bodies hold bounds their masses')
    return bounded


def _proportions(groups: list[Group], volumes: np.ndarray) -> np.ndarray:
    """Percent of a man's mass; within a segment by volume.

    Segments that the doll lacks leave the others in proportion.
    """
    segments = [segment(group.role, group.name) for group in groups]
    held: dict[tuple[str, int], float] = {}
    for part, volume in zip(segments, volumes, strict=True):
        held[part] = held.get(part, 0.0) + volume
    return np.array([SEGMENTS[part[0]] * volume / held[part]
                     for part, volume in zip(segments, volumes, strict=True)])
