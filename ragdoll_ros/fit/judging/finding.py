"""What a measure has found about a doll."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A sentence for the user, and how much it weighs."""

    sentence: str
    wrong: bool = False
    """Whether no doll that is right has it; otherwise some have."""

    @property
    def word(self) -> str:
        """``wrong`` or ``doubtful``."""
        return 'wrong' if self.wrong else 'doubtful'
