"""Masses of bodies: by their volumes, or by the proportions of a human body."""
from __future__ import annotations

from ..model import errors
from .groups import Group
from .names import side_of

WATER = 1000.0
"""kg/m^3; animals are within 10 % of it."""

SEGMENTS = {'head': 6.94, 'neck': 1.0, 'trunk': 43.46, 'upper_arm': 2.71, 'forearm': 1.62,
            'hand': 0.61, 'thigh': 14.16, 'shin': 4.33, 'foot': 1.37}
"""Percent of a man's mass, each limb of one side (de Leva 1996, table 4)."""

PART_OF = {'spine': 'trunk', 'hips': 'trunk', 'clavicle': 'trunk', 'finger': 'hand', 'toe': 'foot',
           None: 'trunk', 'soft': 'head'}


def share_mass(total: float | None, sharing: str, groups: list[Group], volumes: list[float],
               skin: float) -> list[float]:
    """Mass of each group's body, kg, from the bodies' volumes, m^3.

    ``total`` is the whole doll's, kg; None takes as much water as there is in the skin's volume
    ``skin``, m^3. ``sharing`` is 'volume' or 'proportions' (a human body's). NotPositive,
    NotFinite: a total that cannot be.
    """
    if total is None:
        # Bodies overlap; a closed skin knows better how much of the character there is.
        plausible = 0.3 * sum(volumes) < skin < 1.2 * sum(volumes)
        total = WATER * (skin if plausible else sum(volumes))
    errors.check_positive('mass', total)
    shares = _proportions(groups, volumes) if sharing == 'proportions' else volumes
    whole = sum(shares)
    return [float(f'{total * share / whole:.9g}') for share in shares]


def _proportions(groups: list[Group], volumes: list[float]) -> list[float]:
    """Percent of a human's mass; within a segment by volume.

    Segments that the doll lacks leave the others in proportion; what is no part of a human
    body weighs as much as its volume of the trunk does.
    """
    segments = [(PART_OF.get(group.role, group.role), side_of(group.name)) for group in groups]
    held: dict[tuple, float] = {}
    for segment, volume in zip(segments, volumes, strict=True):
        held[segment] = held.get(segment, 0) + volume
    trunk = sum(volume for (name, _), volume in held.items() if name == 'trunk') or sum(volumes)
    return [SEGMENTS[segment[0]] * volume / held[segment]
            if segment[0] in SEGMENTS and segment[0] != 'trunk'
            else SEGMENTS['trunk'] * volume / trunk
            for segment, volume in zip(segments, volumes, strict=True)]
