"""Whether a skeleton is a person's, and body segments with their shares of the mass.

The shares are those of a man in model/anthropometry.py; the head includes the neck.
"""
from collections import Counter
from collections.abc import Sequence

import numpy as np

from ...files.bone_names.names import side_of
from ...model.anthropometry import MEN, TRUNK

SEGMENTS = {'head': MEN.segments['head'].mass,
            'trunk': sum(MEN.segments[part].mass for part in TRUNK),
            **{name: part.mass for name, part in MEN.segments.items()
               if name not in ('head', *TRUNK)}}
"""Percent of the total mass; limbs are of one side."""

SEGMENT_OF = {**{name: name for name in SEGMENTS}, 'neck': 'head', 'soft': 'head', 'spine': 'trunk',
              'hips': 'trunk', 'clavicle': 'trunk', 'finger': 'hand', 'toe': 'foot'}
"""Segment of each role; bones without a role belong to the trunk."""

PAIRED_ROLES = ('upper_arm', 'forearm', 'thigh', 'shin')
"""Roles that a person has twice."""

MAX_LEAN = 0.7
"""Largest horizontal over vertical offset of the head from the hips; quadrupeds exceed it."""


MAX_HEAD_SHARE = 0.25
"""Largest share of the volume in head and neck of a person, an infant's; a chibi's is larger."""


def is_person(roles: Sequence[str | None], positions: np.ndarray) -> bool:
    """Whether bones of these roles at (n, 3) m, x forward, z up, form an upright person."""
    count = Counter(roles)
    if any(count[role] < 2 for role in PAIRED_ROLES) or not count['head'] + count['neck']:
        return False

    def middle(*wanted: str) -> np.ndarray:
        return np.mean([at for role, at in zip(roles, positions, strict=True) if role in wanted],
                       axis=0)

    rise = middle('head', 'neck') - middle('thigh')
    return bool(rise[2] > 0 and np.linalg.norm(rise[:2]) < MAX_LEAN * rise[2]
                and middle('shin')[2] < middle('thigh')[2])


def has_persons_proportions(roles: Sequence[str | None], names: Sequence[str],
                            volumes: Sequence[float]) -> bool:
    """Whether head and neck have no larger share of a person's volume than MAX_HEAD_SHARE. Chibi
    figures, and monsters that are mostly head, exceed it.
    """
    head = sum(volume for role, name, volume in zip(roles, names, volumes, strict=True)
               if segment(role, name)[0] == 'head')
    return head <= MAX_HEAD_SHARE * sum(volumes)


def segment(role: str | None, name: str) -> tuple[str, int]:
    """Segment of a bone, and its side: 1 left, -1 right, 0 in the middle."""
    part = SEGMENT_OF.get(role, 'trunk')
    return part, 0 if part in ('trunk', 'head') else side_of(name)
