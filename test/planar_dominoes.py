"""Dominoes in a plane for the event-driven reference: boxes, their lower corners on the ground, and
the upper front corner of each on the back of the next.

x forward, z up, phi about y from upright, so that a domino that falls forward has phi > 0. Has the
interface of PlanarRods that ragdoll_ros/accuracy/references/event_driven.py integrates; shares no
code with an engine.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ragdoll_ros.accuracy.references.contact_modes import constrained_motion

DIFFERENCE = 1e-6
"""s: over which the contacts' rows are differentiated; the error is about 1e-10 m/s^2."""


def _turned(phi, x, z):
    """A point (x, z) of a body at angle phi, in the world's axes, from the body's centre."""
    return np.array((np.cos(phi) * x + np.sin(phi) * z, -np.sin(phi) * x + np.cos(phi) * z))


@dataclass(frozen=True)
class PlanarDominoes:
    """``count`` boxes, ``thick`` by ``high`` m, of 1 kg, ``pitch`` m from each other."""

    count: int
    thick: float = 0.04
    high: float = 0.3
    pitch: float = 0.1
    friction: float = 0.5
    restitution: float = 0.5
    gravity: float = 9.8
    restitution_speed: float = 1e-3

    @property
    def feet(self):
        """Contacts: (box, side) on the ground, (box, 0) between a box and the next.

        The first box falls about its front corner; its back one never comes down again.
        """
        return ((0, 1), *((k, side) for k in range(1, self.count) for side in (-1, 1)),
                *((k, 0) for k in range(self.count - 1)))

    def start(self, rate):
        """All upright, the first turning at ``rate`` rad/s about its lower front corner."""
        q, v = np.zeros((self.count, 3)), np.zeros((self.count, 3))
        q[:, 0], q[:, 1] = self.pitch * np.arange(self.count), self.high / 2
        v[0] = rate * self.high / 2, rate * self.thick / 2, rate
        return np.concatenate([q.ravel(), v.ravel()])

    def angles(self, rows):
        """Angles (t, n) rad, of coordinates and velocities (t, 6 n)."""
        return rows[:, 2:3 * self.count:3]

    def speeds(self, y):
        """Generalised velocities (3 n,)."""
        return y[3 * self.count:]

    def gaps(self, y):
        """Distances (k,) m of all contacts."""
        q, found = y[:3 * self.count].reshape(-1, 3), []
        for one, side in self.feet:
            if side:
                found.append(q[one, 1] + _turned(
                    q[one, 2], side * self.thick / 2, -self.high / 2)[1])
            else:
                corner, back = self._touching(q, one)
                found.append(-(corner - back) @ _turned(q[one + 1, 2], 1, 0))
        return np.array(found)

    def dynamics(self, _):
        """Mass matrix and generalised force."""
        inertia = (self.thick ** 2 + self.high ** 2) / 12
        force = np.tile((0.0, -self.gravity, 0.0), self.count)
        return np.diag(np.tile((1.0, 1.0, inertia), self.count)), force

    def contact(self, y):
        """Jacobian (k, 2, 3 n) of the contacts' normals and tangents, and their drift (k, 2)."""
        size = 3 * self.count
        q, v = y[:size], y[size:]
        ahead, behind = (self._jacobian(q + sign * DIFFERENCE * v) for sign in (1, -1))
        return self._jacobian(q), (ahead - behind) @ v / (2 * DIFFERENCE)

    def forces(self, y, modes):
        """Accelerations (3 n,) with fixed modes, and forces (k, 2) N of all contacts."""
        return constrained_motion(*self.dynamics(y), *self.contact(y), modes, self.friction)

    def _touching(self, q, one):
        """Upper front corner of a box, and the middle of the back of the next, (2,) m each."""
        corner = q[one, :2] + _turned(q[one, 2], self.thick / 2, self.high / 2)
        return corner, q[one + 1, :2] + _turned(q[one + 1, 2], -self.thick / 2, 0)

    def _jacobian(self, q):
        q = q.reshape(-1, 3)
        rows = np.zeros((len(self.feet), 2, 3 * self.count))
        for row, (one, side) in zip(rows, self.feet, strict=True):
            if side:
                self._add(row, q, one, q[one, :2] + _turned(
                    q[one, 2], side * self.thick / 2, -self.high / 2), np.eye(2)[::-1], 1)
                continue
            corner, _ = self._touching(q, one)
            axes = np.array((-_turned(q[one + 1, 2], 1, 0), _turned(q[one + 1, 2], 0, 1)))
            self._add(row, q, one, corner, axes, 1)
            self._add(row, q, one + 1, corner, axes, -1)
        return rows

    @staticmethod
    def _add(row, q, body, point, axes, sign):
        """Add the velocity along ``axes`` (2, 2) of a body's point to a contact's rows."""
        x, z = point - q[body, :2]
        row[:, 3 * body:3 * body + 2] += sign * axes
        row[:, 3 * body + 2] += sign * axes @ np.array((z, -x))
