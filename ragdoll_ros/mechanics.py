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
    turns: np.ndarray
    """(n, 3, 3): rotation matrix of each bone."""


@dataclass(frozen=True)
class Shift:
    """A displacement of d dolls and a motion of each as one rigid body, to be added."""

    way: np.ndarray
    """(d, 3) m."""
    linear: np.ndarray
    """(d, 3) m/s, of the centres of mass."""
    spin: np.ndarray
    """(d, 3) rad/s about the centres of mass."""
    centre: np.ndarray
    """(d, 3) m: the centres of mass before."""
    inertia: np.ndarray
    """(d, 3, 3) kg m^2: the locked inertia about it; zero where there is no spin to add."""


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
        self._members = (self.doll_of == np.arange(len(counts))[:, None]).astype(float)
        self._weights = self._members * self.masses
        self.doll_masses = self._weights.sum(axis=1)

    def kinetic(self, state: State) -> np.ndarray:
        """Kinetic energy of each bone, (n,) J."""
        body = np.matmul(state.angular[:, None, :], rotation.matrix(state.orientations))[:, 0]
        return 0.5 * (self.masses * np.einsum('ij,ij->i', state.linear, state.linear)
                      + np.einsum('ij,ij,ij->i', self.inertias, body, body))

    def energy(self, state: State) -> np.ndarray:
        """Kinetic energy plus that of height of each doll, (d,) J."""
        height = self._weights @ (state.positions @ self.gravity)
        return self._members @ self.kinetic(state) - height

    def motion(self, state: State) -> Motion:
        """All sums at once."""
        turn = rotation.matrix(state.orientations)
        body = np.matmul(state.angular[:, None, :], turn)[:, 0]
        impulses = self.masses[:, None] * state.linear
        moments = self.inertias * body
        kinetic = self._members @ (0.5 * (np.einsum('ij,ij->i', impulses, state.linear)
                                          + np.einsum('ij,ij->i', moments, body)))
        weighted = self._weights @ state.positions
        centre = weighted / self.doll_masses[:, None]
        arms = state.positions - centre[self.doll_of]
        own = np.matmul(turn, moments[:, :, None])[:, :, 0]
        return Motion(kinetic - weighted @ self.gravity, kinetic, centre,
                      self._members @ impulses, self._members @ (own + cross(arms, impulses)),
                      turn)

    def shifted(self, state: State, shift: Shift) -> State:
        """Give the state after each doll is moved on and set in motion as one rigid body."""
        doll = self.doll_of
        arms = state.positions - shift.centre[doll]
        return State(state.positions + shift.way[doll], state.orientations,
                     state.linear + shift.linear[doll] + cross(shift.spin[doll], arms),
                     state.angular + shift.spin[doll])

    def shifted_motion(self, motion: Motion, shift: Shift) -> Motion:
        """Give the sums after such a shift: a rigid motion adds P v + M v v / 2 to the kinetic
        energy, and L w + w I w / 2 about the centre of mass.
        """
        masses = self.doll_masses[:, None]
        gained = np.matmul(shift.inertia, shift.spin[:, :, None])[:, :, 0]
        kinetic = motion.kinetic + (
            (motion.momentum + masses * shift.linear / 2) * shift.linear
            + (motion.spin + gained / 2) * shift.spin).sum(axis=1)
        centre = motion.centre + shift.way
        return Motion(kinetic - self.doll_masses * (centre @ self.gravity), kinetic, centre,
                      motion.momentum + masses * shift.linear, motion.spin + gained,
                      motion.turns)

    def locked_inertia(self, state: State, motion: Motion, doll: int) -> np.ndarray:
        """Inertia (3, 3) kg m^2 about its centre of mass of a doll as if its joints were locked.

        Steiner's theorem: the sum of R I R^T + m (r r 1 - r r^T) over its bones.
        """
        own = slice(self.starts[doll], self.starts[doll] + int(self._members[doll].sum()))
        turn = motion.turns[own]
        turned = np.matmul(turn * self.inertias[own, None, :], turn.transpose(0, 2, 1))
        arms = state.positions[own] - motion.centre[doll]
        outer = arms.T @ (self.masses[own, None] * arms)
        return turned.sum(axis=0) + np.trace(outer) * np.eye(3) - outer


def damping_rate(scene: Scene) -> float:
    """Fastest rate, 1/s, at which the joints' damping c ends a motion: a bound on c / I.

    I is the inertia in which two bones turn against each other about the joint's axis, at the
    least that of both about their own centres of mass: 1/I = 1/Ia + 1/Ib.
    """
    fastest = 0.0
    for placement in scene.dolls:
        doll = placement.doll
        turns = {bone.name: rotation.matrix(bone.orientation) for bone in doll.bones}
        inertias = {bone.name: np.array(bone.inertia) for bone in doll.bones}
        for joint in doll.joints:
            axes = np.eye(3) if joint.kind == 'ball' else joint.axes
            for axis in axes if joint.damping else ():
                ease = sum(1 / (inertias[name] @ (np.array(axis) @ turns[name]) ** 2)
                           for name in (joint.parent, joint.child))
                fastest = max(fastest, joint.damping * float(ease))
    return fastest


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (..., 3); numpy's own costs five times as much on few rows."""
    out = np.empty(np.broadcast_shapes(np.shape(a), np.shape(b)))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
