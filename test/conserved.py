"""Energy and momentum of a doll from their definitions: numpy alone, none of the package's sums.

World frame, SI. Of the package only a bone's mass and moments of inertia are taken, which
test_ragdoll.py holds to sums over random points.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass
class Conserved:
    """What one doll has at an instant."""

    mass: float
    centre: np.ndarray
    """(3,) m, of mass."""
    kinetic: float
    """J: sum of m v v / 2 + w I w / 2."""
    energy: float
    """J: that and - m g x."""
    momentum: np.ndarray
    """(3,) N s: sum of m v."""
    angular_momentum: np.ndarray
    """(3,) N m s about the doll's centre of mass: sum of (x - c) x m v + I w."""
    inertia: np.ndarray
    """(3, 3) kg m^2 about that centre: sum of I + m (r r 1 - r r^T), r = x - c (Steiner)."""


def conserved(scene, state, doll=0):
    """Sums over the bones of the scene's doll of that index."""
    first = sum(len(placement.doll.bones) for placement in scene.dolls[:doll])
    bones = scene.dolls[doll].doll.bones
    own = slice(first, first + len(bones))
    m, moments = np.array([bone.mass for bone in bones]), np.array([bone.inertia for bone in bones])
    x, v, w = state.positions[own], state.linear_velocities[own], state.angular_velocities[own]
    turns = matrices(state.orientations[own])
    inertias = turns @ (moments[:, :, None] * turns.transpose(0, 2, 1))
    spins = (inertias @ w[:, :, None])[:, :, 0]
    centre = m @ x / m.sum()
    arms = x - centre
    kinetic = (m @ (v * v).sum(axis=1) + (w * spins).sum()) / 2
    return Conserved(m.sum(), centre, kinetic, kinetic - m.sum() * np.dot(scene.gravity, centre),
                     m @ v, (np.cross(arms, m[:, None] * v) + spins).sum(axis=0),
                     inertias.sum(axis=0) + m @ (arms ** 2).sum(axis=1) * np.eye(3)
                     - arms.T @ (m[:, None] * arms))


def matrices(orientations):
    """Rotation matrices (n, 3, 3) of unit quaternions x, y, z, w (Shoemake 1985)."""
    x, y, z, w = orientations.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
                    ).transpose(2, 0, 1)
