"""Whether a skeleton is a person's, and whether its masses are.

Shares of mass: a man's, de Leva 1996 (J Biomech 29:1223), table 4. His head has the neck.
"""
from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ..model.ragdoll import Ragdoll
from .finding import Finding
from .names import side_of

SEGMENTS = {'head': 6.94, 'trunk': 43.46, 'upper_arm': 2.71, 'forearm': 1.62, 'hand': 0.61,
            'thigh': 14.16, 'shin': 4.33, 'foot': 1.37}
"""Percent of the whole, each limb of one side."""

SEGMENT_OF = {**{name: name for name in SEGMENTS}, 'neck': 'head', 'soft': 'head', 'spine': 'trunk',
              'hips': 'trunk', 'clavicle': 'trunk', 'finger': 'hand', 'toe': 'foot'}
"""The segment that a bone of a role is part of; what has no role is part of the trunk."""

LIMBS = ('upper_arm', 'forearm', 'thigh', 'shin')
"""Roles of which a person has two each."""

LEAN = 0.7
"""A head is this far from above the hips at the most, of how much higher it is: not a dog's."""

LIGHTEST, HEAVIEST = 10.0, 45.0
"""kg/m^2, mass over height squared: of infants and the ill, and of the very heavy."""

FACTOR, WRONG_FACTOR = 2.2, 6.0
"""A segment's share is doubtful, or wrong, by this factor off a man's. Children's heads are 2."""


def is_person(roles: Sequence[str | None], positions: np.ndarray) -> bool:
    """Whether bones of these roles at (n, 3) m, x forward and z up, are an upright person's."""
    count = Counter(roles)
    if any(count[role] < 2 for role in LIMBS) or not count['head'] + count['neck']:
        return False

    def middle(*wanted: str) -> np.ndarray:
        return np.mean([at for role, at in zip(roles, positions, strict=True) if role in wanted],
                       axis=0)

    rise = middle('head', 'neck') - middle('thigh')
    return bool(rise[2] > 0 and np.linalg.norm(rise[:2]) < LEAN * rise[2]
                and middle('shin')[2] < middle('thigh')[2])


def segment(role: str | None, name: str) -> tuple[str, int]:
    """Segment that a bone is part of, and its side: 1 left, -1 right, 0 in the middle."""
    part = SEGMENT_OF.get(role, 'trunk')
    return part, 0 if part in ('trunk', 'head') else side_of(name)


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
