"""Fields of a form and their values."""
from __future__ import annotations

from dataclasses import dataclass

FieldValue = str | float | tuple[float, ...]
FormValues = dict[str, FieldValue]
"""Values by the keys of their fields."""


@dataclass(frozen=True)
class Field:
    """One line of a form: key, label with unit, kind of widget, and hint."""

    key: str
    label: str
    widget: str
    hint: str
