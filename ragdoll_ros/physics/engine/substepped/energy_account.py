"""EnergyAccount: initial energy, work of loads and allowed energy of each doll."""
from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np


@dataclass
class EnergyAccount:
    """Energy balance of d dolls since the start, J."""

    start: np.ndarray
    """(d,) initial energy."""
    allowed: np.ndarray
    """(d,) lowest energy so far plus the work since."""
    put_in: np.ndarray
    """(d,) sum of the absolute values of all work."""
    pushes: float = 0.0
    """Work of pushes."""
    grabs: float = 0.0
    """Work of hands."""
    taken: float = 0.0
    """Spurious energy that the projection removed."""

    @classmethod
    def opened(cls, energy: np.ndarray) -> EnergyAccount:
        """Open the account of dolls with an initial ``energy`` (d,) J."""
        return cls(energy.copy(), energy.copy(), np.zeros_like(energy))

    def add_work(self, doll: int, work: float, by_hand: bool) -> None:
        """Add the work, J, of a push or of a hand."""
        self.allowed[doll] += work
        self.put_in[doll] += abs(work)
        if by_hand:
            self.grabs += work
        else:
            self.pushes += work

    def lower(self, energy: np.ndarray) -> None:
        """Lower the allowed energy to ``energy`` (d,) J where that is less."""
        np.minimum(self.allowed, energy, out=self.allowed)

    def copy(self) -> EnergyAccount:
        """Copy the account and its arrays."""
        return dataclasses.replace(self, start=self.start.copy(), allowed=self.allowed.copy(),
                                   put_in=self.put_in.copy())

    def excess(self, energy: np.ndarray) -> float:
        """Energy, J, above the initial energy plus all work, for a current ``energy`` (d,) J."""
        return float((energy - self.start).sum()) - self.pushes - self.grabs

    def measures(self, energy: np.ndarray) -> dict[str, float]:
        """Measures for a current ``energy`` (d,) J; keys end in units."""
        return {'energy_excess_J': self.excess(energy), 'energy_projected_J': self.taken,
                'work_of_pushes_J': self.pushes, 'work_of_grabs_J': self.grabs}
