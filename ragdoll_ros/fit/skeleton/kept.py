"""Bones that the user wants as bodies of their own, by their names."""
from __future__ import annotations

import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from ...model import errors
from ..reading.character import Character
from ..roles.names import plain_name
from .groups import FEWEST, vertices_by_bone


def find_kept(character: Character, patterns: Sequence[str],
              share: float | None = None) -> frozenset[int]:
    """Bones with skin whose names are, or match, one of the patterns: ``*``, ``?``, ``[abc]``.

    UnknownBone for a pattern that no bone has, WrongForm where those that do have no skin.
    ``share`` as in vertices_by_bone.
    """
    if not patterns:
        return frozenset()
    clusters = vertices_by_bone(character, share)
    kept: set[int] = set()
    for pattern in patterns:
        named = _matching(character.bone_names, plain_name(pattern, pattern))
        found = [bone for bone in named if len(clusters[bone]) >= FEWEST]
        if not named:
            raise errors.UnknownBone('keep', pattern, _nearest(character.bone_names, pattern))
        if not found:
            raise errors.WrongForm('keep', pattern, f'a bone that moves {FEWEST} vertices or more')
        kept |= set(found)
    return frozenset(kept)


def _matching(names: tuple[str, ...], pattern: str) -> list[int]:
    """Bones of that very name, or else those that it matches."""
    if pattern in names:
        return [names.index(pattern)]
    return [int(bone) for bone in np.flatnonzero([fnmatchcase(name, pattern) for name in names])]


def _nearest(names: tuple[str, ...], pattern: str) -> str:
    """What is expected: the names most like the pattern."""
    lower = {name.lower(): name for name in names}
    like = difflib.get_close_matches(pattern.lower().strip('*'), lower, 5, 0.5)
    if not like:
        return errors.one_of(names, pattern)
    return f'one of {len(names)} names, such as {", ".join(lower[name] for name in like)}'
