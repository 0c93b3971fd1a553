"""Masses that no person has."""
from __future__ import annotations

from collections.abc import Sequence

from ...model.ragdoll import Ragdoll
from ..roles.person import SEGMENTS, segment
from .finding import Finding

LIGHTEST, HEAVIEST = 10.0, 45.0
"""kg/m^2, mass over height squared: of infants and the ill, and of the very heavy."""

FACTOR, WRONG_FACTOR = 2.2, 6.0
"""A segment's share is doubtful, or wrong, by this factor off a man's. Children's heads are 2."""


def find_masses(doll: Ragdoll, roles: Sequence[str | None], height: float) -> list[Finding]:
    """What of a person's masses no person has; ``height`` is the doll's, m."""
    index = doll.mass / height ** 2
    found = []
    if not LIGHTEST < index < HEAVIEST:
        found.append(Finding(f'a person of {height:.3g} m that weighs {doll.mass:.3g} kg: '
                             f'{index:.0f} kg/m^2, where people have {LIGHTEST:.0f} to '
                             f'{HEAVIEST:.0f} (--mass)', not LIGHTEST / 4 < index < HEAVIEST * 4))
    masses: dict[tuple[str, int], float] = {}
    for bone, role in zip(doll.bones, roles, strict=True):
        part = segment(role, bone.name)
        masses[part] = masses.get(part, 0.0) + bone.mass
    for (part, side), mass in masses.items():
        share, usual = 100 * mass / doll.mass, SEGMENTS[part]
        off = max(share / usual, usual / share)
        # A hand or a foot may be a stump, or part of what is above it.
        if off > FACTOR * (2 if part in ('hand', 'foot') else 1):
            name = {1: 'left ', -1: 'right ', 0: ''}[side] + part.replace('_', ' ')
            found.append(Finding(f"the {name} has {share:.2g} % of the mass, where a person's has "
                                 f'{usual:g} % (--masses proportions)', off > WRONG_FACTOR))
    return found
