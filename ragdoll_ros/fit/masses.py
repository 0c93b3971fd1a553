"""Masses: from the volumes of the bodies, or from the proportions of a human body."""
from __future__ import annotations

WATER = 1000.0
"""kg/m^3; animals are within 10 % of it."""

SEGMENTS = {'head': 6.94, 'neck': 1.0, 'trunk': 43.46, 'upper_arm': 2.71, 'forearm': 1.62,
            'hand': 0.61, 'thigh': 14.16, 'shin': 4.33, 'foot': 1.37}
"""Percent of a man's mass, each limb of one side (de Leva 1996, table 4)."""

PART_OF = {'spine': 'trunk', 'hips': 'trunk', 'clavicle': 'trunk', 'finger': 'hand', 'toe': 'foot',
           None: 'trunk', 'soft': 'head'}


def by_volume(volumes: list[float], total: float) -> list[float]:
    """Give each body its share of ``total`` kg by its volume."""
    whole = sum(volumes)
    return [total * volume / whole for volume in volumes]


def by_proportions(volumes: list[float], roles: list[str | None], sides: list[int],
                   total: float) -> list[float]:
    """Share ``total`` kg as in a human body; within a segment by volume.

    Segments that the doll lacks leave the others in proportion; what is no part of a human
    body weighs as much as its volume of the trunk does.
    """
    segments = [(PART_OF.get(role, role), side) for role, side in zip(roles, sides, strict=True)]
    held: dict[tuple, float] = {}
    for segment, volume in zip(segments, volumes, strict=True):
        held[segment] = held.get(segment, 0) + volume
    trunk = sum(volume for (name, _), volume in held.items() if name == 'trunk') or sum(volumes)
    shares = []
    for (name, side), volume in zip(segments, volumes, strict=True):
        if name == 'trunk':
            shares.append(SEGMENTS['trunk'] * volume / trunk)
        elif name in SEGMENTS:
            shares.append(SEGMENTS[name] * volume / held[(name, side)])
        else:
            shares.append(SEGMENTS['trunk'] * volume / trunk)
    return by_volume(shares, total)
