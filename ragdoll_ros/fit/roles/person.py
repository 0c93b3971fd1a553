"""Whether a skeleton is a person's, and the segments that a person has.

Shares of mass: a man's, by model/anthropometry.py. His head has the neck.
"""
from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ...model.anthropometry import MEN, TRUNK
from .names import side_of

SEGMENTS = {'head': MEN.segments['head'].mass,
            'trunk': sum(MEN.segments[part].mass for part in TRUNK),
            **{name: part.mass for name, part in MEN.segments.items()
               if name not in ('head', *TRUNK)}}
"""Percent of the whole, each limb of one side."""

SEGMENT_OF = {**{name: name for name in SEGMENTS}, 'neck': 'head', 'soft': 'head', 'spine': 'trunk',
              'hips': 'trunk', 'clavicle': 'trunk', 'finger': 'hand', 'toe': 'foot'}
"""The segment that a bone of a role is part of; what has no role is part of the trunk."""

LIMBS = ('upper_arm', 'forearm', 'thigh', 'shin')
"""Roles of which a person has two each."""

LEAN = 0.7
"""A head is this far from above the hips at the most, of how much higher it is: not a dog's."""


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
