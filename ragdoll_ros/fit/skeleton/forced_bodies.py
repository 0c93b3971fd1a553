"""Bones that the user names as bodies of their own (``--keep``)."""
import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from ...files.doll import plain_name
from ...model import errors
from ..reading.character import Character
from .groups import MIN_CLUSTER_VERTICES, vertices_by_bone


def find_forced_bodies(character: Character, patterns: Sequence[str],
                       min_weight: float | None = None) -> frozenset[int]:
    """Bones with skin whose name equals or matches a pattern: ``*``, ``?``, ``[abc]``.

    ``min_weight`` as in vertices_by_bone. Raises UnknownBone for a pattern without a match,
    WrongForm where no match has skin.
    """
    if not patterns:
        return frozenset()
    clusters = vertices_by_bone(character, min_weight)
    forced: set[int] = set()
    for pattern in patterns:
        named = _matching(character.bone_names, plain_name(pattern, pattern))
        found = [bone for bone in named if len(clusters[bone]) >= MIN_CLUSTER_VERTICES]
        if not named:
            raise errors.UnknownBone('keep', pattern, _suggestions(character.bone_names, pattern))
        if not found:
            raise errors.WrongForm('keep', pattern,
                                   f'a bone that moves {MIN_CLUSTER_VERTICES} vertices or more')
        forced |= set(found)
    return frozenset(forced)


def _matching(names: tuple[str, ...], pattern: str) -> list[int]:
    """Index of the bone of exactly that name, else of all bones whose names match the pattern."""
    if pattern in names:
        return [names.index(pattern)]
    return [int(bone) for bone in np.flatnonzero([fnmatchcase(name, pattern) for name in names])]


def _suggestions(names: tuple[str, ...], pattern: str) -> str:
    """What is expected: the names most similar to the pattern."""
    lower = {name.lower(): name for name in names}
    like = difflib.get_close_matches(pattern.lower().strip('*'), lower, 5, 0.5)
    if not like:
        return errors.one_of(names, pattern)
    return f'one of {len(names)} names, such as {", ".join(lower[name] for name in like)}'
