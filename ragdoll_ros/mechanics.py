"""Energy, momentum and angular momentum of the dolls of a scene, from their bones' states.

Plain sums over rigid bodies, independent of any engine. World frame, SI.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
    inertia: np.ndarray
    """(d, 3, 3) kg m^2 about that centre, as if the doll's joints were locked in its pose."""

    @classmethod
    def of(cls, sums: np.ndarray) -> Motion:
        """From rows (d, 20) of all these."""
        motion = cls(sums[:, 0], sums[:, 1], sums[:, 2:5], sums[:, 5:8], sums[:, 8:11],
                     sums[:, 11:20].reshape(-1, 3, 3))
        motion.__dict__['sums'] = sums
        return motion

    @cached_property
    def sums(self) -> np.ndarray:
        """(d, 20): all these side by side."""
        return np.concatenate([self.energy[:, None], self.kinetic[:, None], self.centre,
                               self.momentum, self.spin, self.inertia.reshape(-1, 9)], axis=1)


@dataclass(frozen=True)
class Shift:
    """A displacement of d dolls and a motion of each as one rigid body, to be added.

    What is a single body may be turned before.
    """

    way: np.ndarray
    """(d, 3) m."""
    linear: np.ndarray
    """(d, 3) m/s, of the centres of mass."""
    spin: np.ndarray
    """(d, 3) rad/s about the centres of mass."""
    turn: np.ndarray | None = None
    """(d, 4) quaternions, no turn for dolls of several bones; None: no turn at all."""


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
        self._of_points = _sums_of_points()

    def energy(self, state: State) -> np.ndarray:
        """Kinetic energy plus that of height of each doll, (d,) J."""
        return self.motion(state).energy

    def motion(self, state: State) -> Motion:
        """All sums at once: of each bone as a point at its centre of mass, plus its own turning."""
        count, turns = len(self.masses), state.turns
        inertias = np.matmul(turns * self.inertias[:, None, :], turns.transpose(0, 2, 1))
        spins = np.matmul(inertias, state.angular[:, :, None])[:, :, 0]
        energies = (spins * state.angular).sum(axis=1, keepdims=True) / 2
        own = np.concatenate([energies, spins, inertias.reshape(count, 9)], axis=1)
        centre = self._weights @ state.positions / self.doll_masses[:, None]
        point = np.concatenate([state.positions - centre[self.doll_of], state.linear], axis=1)
        squares = (point[:, :, None] * point[:, None, :]).reshape(count, 36)
        sums = self._members @ own + self._weights @ squares @ self._of_points
        kinetic = sums[:, 0]
        return Motion(kinetic - self.doll_masses * (centre @ self.gravity), kinetic, centre,
                      self._weights @ state.linear, sums[:, 1:4], sums[:, 4:].reshape(-1, 3, 3))

    def shifted(self, state: State, motion: Motion, shift: Shift) -> State:
        """Give the state after each doll is moved on and set in motion as one rigid body."""
        orientations, angular = state.orientations, state.angular
        if shift.turn is not None:
            turns = shift.turn[self.doll_of]
            orientations = rotation.multiply(turns, orientations)
            angular = rotation.rotate(turns, angular)
        rows = (shift.way, shift.linear, shift.spin, motion.centre,
                (shift.spin @ _CROSS).reshape(-1, 3, 3))
        if len(shift.way) > 1:
            rows = tuple(row[self.doll_of] for row in rows)
        way, linear, spin, centre, turning = rows
        turned = np.matmul((state.positions - centre)[:, None, :], turning)[:, 0]
        return State(state.positions + way, orientations, state.linear + linear + turned,
                     angular + spin)


_CROSS = np.array([[0, 0, 0, 0, 0, 1, 0, -1, 0], [0, 0, -1, 0, 0, 0, 1, 0, 0],
                   [0, 1, 0, -1, 0, 0, 0, 0, 0]], float)
"""(3, 9) takes w to the matrix M with r M = w x r for rows r."""


def _sums_of_points() -> np.ndarray:
    """Matrix (36, 13) that takes all products z_i z_j of z = (r, v), position and velocity of a
    unit mass, to its kinetic energy v v / 2 (1), angular momentum r x v (3), and its inertia
    r r 1 - r r^T (9, Steiner's theorem).
    """
    table = np.zeros((6, 6, 13))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        table[3 + i, 3 + i, 0] = 0.5
        table[j, 3 + k, 1 + i], table[k, 3 + j, 1 + i] = 1, -1
        for other in (j, k):
            table[other, other, 4 + 4 * i] = 1
            table[i, other, 4 + 3 * i + other] = -1
    return table.reshape(36, 13)


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


def point_motion(state: State, bone: int, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) m and velocity (3,) m/s of a point of a bone, given along its axes."""
    if not point.any():
        return state.positions[bone], state.linear[bone]
    arm = state.turns[bone] @ point
    return (state.positions[bone] + arm,
            state.linear[bone] + cross(state.angular[bone], arm))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (..., 3); numpy's own costs five times as much on few rows."""
    out = np.empty(np.broadcast_shapes(np.shape(a), np.shape(b)))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
