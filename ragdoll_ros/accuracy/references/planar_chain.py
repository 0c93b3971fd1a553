"""A chain of equal rods in a plane, from Lagrange's equations in absolute angles.

With x the place of the first rod's centre and phi_i the angle of rod i to the x axis, centre i lies
at x + sum_k a_ik L u_k, u_k = (cos phi_k, sin phi_k), a_ik = 1/2 at both ends of the row and 1
between. Then T = m/2 sum |x_i'|^2 + I/2 sum phi_i'^2 gives, with J_i the Jacobian of centre i,

    M(phi) [x'', phi''] = sum_i m J_i' (g + sum_k a_ik L u_k phi_k'^2),

integrated by DOP853 at 1e-12. Shares no code with the engines.
"""
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .integration import integrate


@dataclass(frozen=True)
class PlanarChain:
    """``links`` rods of ``length`` m, ``mass`` kg and ``inertia`` kg m^2 about the centre."""

    links: int
    length: float
    mass: float
    inertia: float

    def motion(self, angles: Sequence[float], rates: Sequence[float], times: Sequence[float],
               gravity: Sequence[float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
        """Centres (t, links, 2) m and angles (t, links) rad.

        The first rod's centre starts at the origin, moving so that the chain's centre of mass
        is at rest. ``angles`` and ``rates`` are absolute, rad and rad/s.
        """
        angles, rates = np.array(angles, float), np.array(rates, float)
        start = np.concatenate([[0.0, 0.0], angles, self._at_rest(angles, rates), rates])
        load = np.array(gravity, float)
        rows = integrate(lambda t, y: self._derivative(y, load), start, times)
        x, phi = rows[:, :2], rows[:, 2:2 + self.links]
        arms = self._arms()
        rods = self.length * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        return x[:, None, :] + np.einsum('ik,tkd->tid', arms, rods), phi

    def _arms(self) -> np.ndarray:
        """Coefficients a_ik: offset of centre i from the first centre along rod k, in lengths."""
        arms = np.tril(np.ones((self.links, self.links)), -1)
        arms[1:, 0] = 0.5
        return arms + np.diag([0.0] + [0.5] * (self.links - 1))

    def _at_rest(self, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        normals = self.length * np.stack([-np.sin(angles), np.cos(angles)])
        return -(normals * rates) @ self._arms().T.sum(axis=1) / self.links

    def _derivative(self, y: np.ndarray, gravity: np.ndarray) -> np.ndarray:
        n = self.links
        phi, rates = y[2:2 + n], y[4 + n:]
        arms = self._arms()
        along = self.length * np.stack([np.cos(phi), np.sin(phi)])
        across = self.length * np.stack([-np.sin(phi), np.cos(phi)])
        # jacobian of all centres: (2, n, 2 + n)
        jac = np.zeros((2, n, 2 + n))
        jac[0, :, 0] = jac[1, :, 1] = 1.0
        jac[:, :, 2:] = arms[None] * across[:, None, :]
        drift = -np.einsum('ik,dk,k->di', arms, along, rates ** 2)
        mass = self.mass * np.einsum('dij,dik->jk', jac, jac)
        mass[2:, 2:] += self.inertia * np.eye(n)
        load = self.mass * np.einsum('dij,di->j', jac, gravity[:, None] - drift)
        return np.concatenate([y[2 + n:], np.linalg.solve(mass, load)])
