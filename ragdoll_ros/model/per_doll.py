"""PerDoll: results computed for dolls or placements, kept while these are in a scene whose dolls
change.
"""
from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

Value = TypeVar('Value')


class PerDoll(Generic[Value]):
    """Results of ``make(doll)``, computed once for each doll that is asked for. Dolls are told
    apart by identity, not equality: 0.0 and -0.0 are equal, but differ as text and in bits.
    """

    def __init__(self, make: Callable[[Any], Value]) -> None:
        self._make = make
        self._kept: dict[int, tuple[object, Value]] = {}

    def __getitem__(self, doll: object) -> Value:
        """The result for this doll, computed at the first request."""
        kept = self._kept.get(id(doll))
        if kept is None:
            kept = self._kept[id(doll)] = doll, self._make(doll)
        return kept[1]

    def keep(self, dolls: Iterable[object]) -> None:
        """Discard the results of all dolls but these."""
        present = {id(doll) for doll in dolls}
        self._kept = {key: kept for key, kept in self._kept.items() if key in present}
