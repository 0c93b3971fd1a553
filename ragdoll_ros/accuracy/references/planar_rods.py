"""Hinged rods above level ground in a plane: Lagrange's equations and contact kinematics.

x forward, z up; a rod at angle phi points along u = (sin phi, cos phi), so angles are those about
y. Every point is the root's centre plus a sum of rods, p = c + sum_k b_k u(phi_k), which gives

    M(phi) [c'', phi''] = sum_i m_i J_i' (g + sum_k b_ik u(phi_k) phi_k'^2) + J_c' f.

Rods end in balls that touch the ground at their lowest points. Shares no code with the engines;
event_driven.py integrates from event to event.
"""
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .contact_modes import constrained_motion


def directions(phi: np.ndarray) -> np.ndarray:
    """Axes u (..., 2) of rods at angles (...,) rad."""
    return np.stack([np.sin(phi), np.cos(phi)], axis=-1)


@dataclass(frozen=True)
class PlanarRods:
    """Rods of ``lengths`` m, ``masses`` kg, ``inertias`` kg m^2, ball ends of ``radii`` m.

    Rod i > 0 hangs by its upper end (+) from its parent, rod ``parents[i]``, at the parent's upper
    or lower end (``sides[i]``, 1 or -1). ``feet`` lists the ends (rod, 1 or -1) that may touch the
    ground.
    """

    lengths: tuple[float, ...]
    masses: tuple[float, ...]
    inertias: tuple[float, ...]
    radii: tuple[float, ...]
    parents: tuple[int, ...]
    sides: tuple[int, ...]
    feet: tuple[tuple[int, int], ...]
    gravity: float = 9.8
    friction: float = 0.0
    restitution: float = 0.0
    restitution_speed: float = 1e-3
    """m/s: slower impacts have no restitution."""

    def centres(self, rows: np.ndarray) -> np.ndarray:
        """Centres (t, n, 2) m of all rods, from coordinates and velocities (t, 2 (n + 2))."""
        phi = rows[:, 2:2 + len(self.lengths)]
        return rows[:, None, :2] + np.einsum('ik,tkd->tid', self._arms, directions(phi))

    def energy(self, rows: np.ndarray) -> np.ndarray:
        """Kinetic and potential energy (t,) J of coordinates and velocities (t, 2 (n + 2))."""
        half = rows.shape[1] // 2
        kinetic = [y[half:] @ self.dynamics(y)[0] @ y[half:] / 2 for y in rows]
        heights = self.centres(rows)[..., 1]
        return np.array(kinetic) + self.gravity * heights @ np.array(self.masses)

    def gaps(self, y: np.ndarray) -> np.ndarray:
        """Distances (k,) m of the feet from the ground."""
        n = len(self.lengths)
        ends = y[1] + directions(y[2:2 + n])[:, 1] @ self._feet_arms.T
        return ends - np.array([self.radii[rod] for rod, _ in self.feet])

    @cached_property
    def _arms(self) -> np.ndarray:
        """b_ik (n, n), m: offset of the centre of rod i along rod k."""
        n = len(self.lengths)
        arms = np.zeros((n, n))
        for rod in range(1, n):
            parent = self.parents[rod]
            arms[rod] = arms[parent]
            arms[rod, parent] += self.sides[rod] * self.lengths[parent] / 2
            arms[rod, rod] -= self.lengths[rod] / 2
        return arms

    @cached_property
    def _feet_arms(self) -> np.ndarray:
        """Offsets (k, n), m, of the k feet along each rod, from the root's centre."""
        arms = self._arms[[rod for rod, _ in self.feet]]
        for row, (rod, end) in zip(arms, self.feet, strict=True):
            row[rod] += end * self.lengths[rod] / 2
        return arms

    def _jacobian(self, phi: np.ndarray, arms: np.ndarray) -> np.ndarray:
        """Jacobian (k, 2, n + 2) of points with arms (k, n)."""
        across = np.stack([np.cos(phi), -np.sin(phi)])
        jacobian = np.zeros((len(arms), 2, len(phi) + 2))
        jacobian[:, :, :2] = np.eye(2)
        jacobian[:, :, 2:] = arms[:, None] * across
        return jacobian

    def dynamics(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix and generalised force of gravity and motion."""
        n = len(self.lengths)
        phi, rates = y[2:2 + n], y[4 + n:]
        arms, masses = self._arms, np.array(self.masses)
        jacobian = self._jacobian(phi, arms)
        mass = np.einsum('i,idj,idk->jk', masses, jacobian, jacobian)
        mass[2:, 2:] += np.diag(self.inertias)
        pull = (arms * rates ** 2) @ directions(phi) + np.array((0.0, -self.gravity))
        return mass, np.einsum('i,idj,id->j', masses, jacobian, pull)

    def contact(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian (k, 2, n + 2) of the feet's normals and tangents, and their drift (k, 2).

        The contact point of a ball is a radius r below its centre, which adds -r phi' to the
        tangential velocity.
        """
        n = len(self.lengths)
        phi, rates, arms = y[2:2 + n], y[4 + n:], self._feet_arms
        jacobian = self._jacobian(phi, arms)[:, ::-1]
        drift = -((arms * rates ** 2) @ directions(phi))[:, ::-1]
        for rows, (rod, _) in zip(jacobian, self.feet, strict=True):
            rows[1, 2 + rod] -= self.radii[rod]
        return jacobian, drift

    def speeds(self, y: np.ndarray) -> np.ndarray:
        """Generalised velocities (n + 2,)."""
        return y[len(self.lengths) + 2:]

    def forces(self, y: np.ndarray, modes: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n + 2,) with fixed modes, and forces (k, 2) N of all feet."""
        return constrained_motion(*self.dynamics(y), *self.contact(y), modes, self.friction)
