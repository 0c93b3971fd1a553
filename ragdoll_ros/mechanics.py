"""Energy, momentum and angular momentum of the dolls of a scene, from their bones' states.

Plain sums over rigid bodies, independent of any engine. World frame, SI.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import rotation
from .scene import Scene
from .state import State


@dataclass(frozen=True)
class Motion:
    """Where each of d dolls is as a whole, and how it moves."""

    energy: np.ndarray
    """(d,) J: kinetic energy plus that of height, zero where the world's origin is."""
    kinetic: np.ndarray
    """(d,) J."""
    centre: np.ndarray
    """(d, 3) m: centre of mass."""
    momentum: np.ndarray
    """(d, 3) N s."""
    spin: np.ndarray
    """(d, 3) N m s: angular momentum about the doll's own centre of mass."""
    locked_inertia: np.ndarray
    """(d, 3, 3) kg m^2 about the centre of mass, of the doll as if its joints were locked."""


class Mechanics:
    """Masses and inertias of all n bones of a scene, and the sums over each of its d dolls."""

    def __init__(self, scene: Scene) -> None:
        bones = scene.bones
        self.masses = np.array([bone.mass for bone in bones])
        self.inertias = np.array([bone.inertia for bone in bones])
        self.gravity = np.array(scene.gravity)
        counts = [len(placement.doll.bones) for placement in scene.dolls]
        self.starts = np.cumsum([0, *counts[:-1]])
        self.doll_of = np.repeat(np.arange(len(counts)), counts)
        self.doll_masses = np.add.reduceat(self.masses, self.starts)

    def kinetic(self, state: State) -> np.ndarray:
        """Kinetic energy of each bone, (n,) J."""
        body = np.matmul(state.angular[:, None, :], rotation.matrix(state.orientations))[:, 0]
        return 0.5 * (self.masses * np.einsum('ij,ij->i', state.linear, state.linear)
                      + np.einsum('ij,ij,ij->i', self.inertias, body, body))

    def potential(self, state: State) -> np.ndarray:
        """Energy of height of each bone, (n,) J; zero at the world's origin."""
        return -self.masses * (state.positions @ self.gravity)

    def energy(self, state: State) -> np.ndarray:
        """Kinetic energy plus that of height of each doll, (d,) J."""
        return np.add.reduceat(self.kinetic(state) + self.potential(state), self.starts)

    def motion(self, state: State) -> Motion:
        """All sums at once."""
        turn = rotation.matrix(state.orientations)
        body = np.matmul(state.angular[:, None, :], turn)[:, 0]
        impulses = self.masses[:, None] * state.linear
        moments = self.inertias * body
        kinetic = 0.5 * (np.einsum('ij,ij->i', impulses, state.linear)
                         + np.einsum('ij,ij->i', moments, body))
        weights = self.masses[:, None] * state.positions
        sums = np.add.reduceat(np.column_stack([kinetic, weights, impulses]), self.starts)
        centre = sums[:, 1:4] / self.doll_masses[:, None]
        arms = state.positions - centre[self.doll_of]
        own = np.matmul(turn, moments[:, :, None])[:, :, 0]
        spin = np.add.reduceat(own + cross(arms, impulses), self.starts)
        turned = np.matmul(turn * self.inertias[:, None, :], turn.transpose(0, 2, 1))
        steiner = np.einsum('i,ij,ik->ijk', self.masses, arms, arms)
        steiner = np.trace(steiner, axis1=1, axis2=2)[:, None, None] * np.eye(3) - steiner
        potential = -sums[:, 1:4] @ self.gravity
        return Motion(sums[:, 0] + potential, sums[:, 0], centre, sums[:, 4:7], spin,
                      np.add.reduceat(turned + steiner, self.starts))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (..., 3); numpy's own costs five times as much on few rows."""
    out = np.empty(np.broadcast_shapes(np.shape(a), np.shape(b)))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
