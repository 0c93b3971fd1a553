"""DollTotals: energy, momentum and inertia of each doll, summed over its bones."""
from __future__ import annotations

import numpy as np


class DollTotals:
    """Energy, centre of mass, momenta and inertia of each of d dolls, world frame."""

    def __init__(self, energy: np.ndarray, kinetic: np.ndarray, centre: np.ndarray,
                 momentum: np.ndarray, angular_momentum: np.ndarray, inertia: np.ndarray) -> None:
        self.rows = np.concatenate([energy[:, None], kinetic[:, None], centre, momentum,
                                    angular_momentum, inertia.reshape(-1, 9)], axis=1)
        """(d, 20): all quantities side by side."""

    @classmethod
    def of(cls, rows: np.ndarray) -> DollTotals:
        """Wrap rows (d, 20) without a copy."""
        totals = cls.__new__(cls)
        totals.rows = rows
        return totals

    @property
    def energy(self) -> np.ndarray:
        """Kinetic plus potential energy, (d,) J; potential energy is zero at the world's origin."""
        return self.rows[:, 0]

    @property
    def kinetic(self) -> np.ndarray:
        """Kinetic energy, (d,) J."""
        return self.rows[:, 1]

    @property
    def centre(self) -> np.ndarray:
        """Centre of mass, (d, 3) m."""
        return self.rows[:, 2:5]

    @property
    def momentum(self) -> np.ndarray:
        """Linear momentum, (d, 3) N s."""
        return self.rows[:, 5:8]

    @property
    def angular_momentum(self) -> np.ndarray:
        """Angular momentum about the doll's centre of mass, (d, 3) N m s."""
        return self.rows[:, 8:11]

    @property
    def inertia(self) -> np.ndarray:
        """Locked inertia about the centre of mass, joints fixed in the pose, (d, 3, 3) kg m^2."""
        return self.rows[:, 11:20].reshape(-1, 3, 3)
