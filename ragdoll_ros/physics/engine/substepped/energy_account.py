"""The account of energy: what each doll began with, what was put in, what it may have."""
from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np


@dataclass
class Account:
    """Of d dolls, J."""

    start: np.ndarray
    """(d,) energy at the start."""
    allowed: np.ndarray
    """(d,) the lowest energy so far, plus work since."""
    put_in: np.ndarray
    """(d,) sum of the sizes of all work."""
    pushes: float = 0.0
    """Work of pushes since the start."""
    grabs: float = 0.0
    """Work of hands since the start."""
    taken: float = 0.0
    """What was taken out because nothing had put it in."""

    @classmethod
    def opened(cls, energy: np.ndarray) -> Account:
        """The account of dolls that begin with an ``energy`` (d,) J."""
        return cls(energy.copy(), energy.copy(), np.zeros_like(energy))

    def add_work(self, doll: int, work: float, by_hand: bool) -> None:
        """Enter the work of a push or of a hand."""
        self.allowed[doll] += work
        self.put_in[doll] += abs(work)
        if by_hand:
            self.grabs += work
        else:
            self.pushes += work

    def lower(self, energy: np.ndarray) -> None:
        """What dolls have lost they have lost for good."""
        np.minimum(self.allowed, energy, out=self.allowed)

    def copy(self) -> Account:
        """As it is now."""
        return dataclasses.replace(self, start=self.start.copy(), allowed=self.allowed.copy(),
                                   put_in=self.put_in.copy())

    def excess(self, energy: np.ndarray) -> float:
        """What dolls that have an ``energy`` (d,) J have above their start and all work since."""
        return float((energy - self.start).sum()) - self.pushes - self.grabs

    def measures(self, energy: np.ndarray) -> dict[str, float]:
        """What it says where dolls have an ``energy`` (d,) J: names end in their units."""
        return {'energy_excess_J': self.excess(energy),
                'energy_projected_J': self.taken,
                'work_of_pushes_J': self.pushes, 'work_of_grabs_J': self.grabs}
