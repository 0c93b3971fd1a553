"""Which bones of a doll stand for the parts that real falls are told of."""
from __future__ import annotations

BONES = {'pelvis': ('pelvis', 'lower_trunk', 'trunk', 'torso'), 'head': ('head',),
         'hand': ('hand', 'forearm')}
"""Ends of the names of bones that stand for a part, the best first."""


def bones_of(part: str, names: list[str]) -> list[int]:
    """Indices of the bones that stand for a part; none where no name tells."""
    for word in BONES[part]:
        found = [index for index, name in enumerate(names) if name.endswith(word)]
        if found:
            return found
    return []
