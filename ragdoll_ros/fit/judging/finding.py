"""Result of a check of a doll."""
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A sentence for the user, and its severity."""

    sentence: str
    wrong: bool = False
    """Whether no correct doll has this finding; otherwise some have."""

    @property
    def word(self) -> str:
        """Severity: 'wrong' or 'doubtful'."""
        return 'wrong' if self.wrong else 'doubtful'
