"""PerDoll: what is computed for a doll or its placement, kept while it is in a scene whose dolls
change.
"""
from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

Value = TypeVar('Value')


class PerDoll(Generic[Value]):
    """``make(doll)`` for each doll that is asked for, once. Dolls are told apart by identity, not
    equality: 0.0 and -0.0 are equal, but differ as text and in bits.
    """

    def __init__(self, make: Callable[[Any], Value]) -> None:
        self._make = make
        self._kept: dict[int, tuple[object, Value]] = {}

    def __getitem__(self, doll: object) -> Value:
        """What was made for this doll, or is made now."""
        kept = self._kept.get(id(doll))
        if kept is None:
            kept = self._kept[id(doll)] = doll, self._make(doll)
        return kept[1]

    def keep(self, dolls: Iterable[object]) -> None:
        """Forget all other dolls."""
        present = {id(doll) for doll in dolls}
        self._kept = {key: kept for key, kept in self._kept.items() if key in present}
