"""One level of links, all at once: how they swing through one step.

The equation of a link of unit direction d, with the world's axes throughout:

    d'' = -|d'|^2 d + P [ w arc(d, n) - c (d' - spin x d) + (share g - r'')/reach ]

P projects on the plane across d; n is the rest direction and spin the angular velocity of the
frame it is fixed in; r the link's root; arc as in sphere.py; w = k/J, c the damping. A link
whose chain goes on carries the masses beyond it as if they hung straight on: with s_j their
distances along the straight chain, J = sum m_j s_j^2 and reach = J / sum m_j s_j. For a chain
of one mass that is m l^2 and l, and exact.

The integrator is exponential, of order 2 (Hochbruck and Ostermann, Exponential integrators,
Acta Numerica 19, 2010, section 2, there in a linear space; here in the tangent plane at d,
taken back to the sphere by the great circle):

1. In the tangent plane at d the equation is that of the damped oscillator about a target that
   moves with the frame, under a force linear in time: solved exactly (oscillator.py).
2. Go along that tangent, take the rate along (sphere.py).
3. What the true force at the end differs from the model's acts on the rate as a force that
   grows from nothing over the step.

What follows from it:
- A swing that moves in one plane in a still frame, without gravity, is the linear oscillator:
  exact to rounding for every step, stiffness and damping.
- Without spring and damping it is kick, rotate, kick: Stoermer and Verlet's, on the sphere.
- Two points of the sphere are never further apart than their images in a tangent plane, so 1
  and 2 never add energy in a still frame; what 3 adds is at most of order 1/(h w) of it.
- The root's motion through the step is the cubic through the places and velocities at its ends:
  the root's change of velocity is met exactly, jerk included.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .oscillator import flow
from .sphere import along, arc, cross, dot


@dataclass(frozen=True)
class Seat:
    """What n links are rooted on at one instant; world frame."""

    point: np.ndarray
    """(3, n) m, the links' roots."""
    velocity: np.ndarray
    """(3, n) m/s."""
    axes: np.ndarray
    """(3, 3, n): [j] is the j-th axis of the frame that the rest directions are fixed in."""
    spin: np.ndarray
    """(3, n) rad/s, angular velocity of that frame."""

    def outward(self, v: np.ndarray) -> np.ndarray:
        """Vectors (3, n) of the frame, in the world."""
        return self.axes[0] * v[0] + self.axes[1] * v[1] + self.axes[2] * v[2]

    def inward(self, v: np.ndarray) -> np.ndarray:
        """Vectors (3, n) of the world, in the frame."""
        return np.einsum('jin,in->jn', self.axes, v)


@dataclass(frozen=True)
class Links:
    """n links at one instant; world frame."""

    seat: Seat
    direction: np.ndarray
    """(3, n) unit vectors from root to mass."""
    rate: np.ndarray
    """(3, n) 1/s, the direction's rate of change."""
    pull: np.ndarray
    """(3, n) rad, the arc to the rest direction."""
    drift: np.ndarray
    """(3, n) 1/s, the rate a direction fixed in the frame would have."""

    @classmethod
    def at(cls, seat: Seat, rest: np.ndarray, direction: np.ndarray,
           rate: np.ndarray | None = None) -> Links:
        """Give links that point so; without a rate they are at rest in their frame."""
        drift = cross(seat.spin, direction)
        return cls(seat, direction, drift if rate is None else rate,
                   arc(direction, seat.outward(rest)), drift)


@dataclass(frozen=True)
class Level:
    """What does not change about n links that are equally far from their bones."""

    rest: np.ndarray
    """(3, n) unit rest directions in the axes of the seats."""
    length: np.ndarray
    """(n,) m."""
    reach: np.ndarray
    """(n,) m, the length of the simple pendulum with the same period."""
    inertia: np.ndarray
    """(n,) kg m^2, J."""
    stiffness: np.ndarray
    """(n,) 1/s^2, w = k/J."""
    damping: np.ndarray
    """(n,) 1/s, c."""
    gravity: np.ndarray
    """(3, n) m/s^2, the share that acts."""

    def swing(self, now: Links, seat: Seat, step: Step) -> Links:
        """Give the links ``step`` later, when their seats are at ``seat``."""
        d, u, pull, drift = now.direction, now.rate, now.pull, now.drift
        first, last = accelerations(now.seat, seat, step.h)
        first, last = (self.gravity - first) / self.reach, (self.gravity - last) / self.reach
        turned = arc(d, seat.outward(now.seat.inward(d)))
        x = _across(d, step.x_pull * pull + step.x_rate * u + step.x_turned * turned
                    + step.x_drift * drift + step.x_first * first + step.x_last * last)
        v = _across(d, step.v_pull * pull + step.v_rate * u + step.v_turned * turned
                    + step.v_drift * drift + step.v_first * first + step.v_x * x)
        d, v = along(d, x, v)
        then = Links.at(seat, self.rest, d)
        v += step.end_pull * then.pull + step.end_drift * then.drift
        v += step.end_force * _across(d, last)
        return Links(seat, d, v, then.pull, then.drift)

    def tips(self, links: Links) -> Seat:
        """Give the masses' own motion and frames: the seats of the next level.

        The frame turns with the rod by the smallest turn from the rest direction n to d; its
        angular velocity relative to the seat is (n + d) x d' / (1 + n . d).
        """
        seat, d = links.seat, links.direction
        n = seat.outward(self.rest)
        middle = n + d
        scale = 1 / np.maximum(1 + dot(n, d), 1e-3)
        axes = (seat.axes + 2 * self.rest[:, None] * d
                - (np.einsum('jin,in->jn', seat.axes, middle) * scale)[:, None] * middle)
        spin = seat.spin + cross(middle, links.rate - links.drift) * scale
        return Seat(seat.point + self.length * d, seat.velocity + self.length * links.rate,
                    axes, spin)


class Step:
    """The factors of one step of ``h`` s for one level, each (n,): see Level.swing.

    Those of x and v are the oscillator's (oscillator.Flow) about the target pull + y(t), where
    y is the parabola with y(0) = 0, y'(0) = drift, y(h) = turned.
    """

    def __init__(self, level: Level, h: float) -> None:
        w, c = level.stiffness, level.damping
        part = flow(w, c, h)
        m, n1, n3 = part.m, part.n1, part.n3
        keep = 1 - w * n1 - c * m
        self.h = h
        self.x_pull, self.x_rate = w * n1, m
        self.x_turned, self.x_drift = 1 - 2 * n1 / h ** 2, 2 * n1 / h - m
        self.x_first, self.x_last = n1 - n3, n3
        self.end_force = n1 / h
        self.end_pull, self.end_drift = w * n1 / h, c * n1 / h
        self.v_pull, self.v_rate = w * m - self.end_pull, keep
        self.v_turned = 2 / h - 2 * m / h ** 2 - self.end_pull - 2 * self.end_drift / h
        self.v_drift = 2 * m / h - 1 - keep + self.end_drift
        self.v_first, self.v_x = m - self.end_force, self.end_pull


def accelerations(before: Seat, after: Seat, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Root accelerations (3, n) m/s^2 at both ends of the cubic that joins two seats."""
    mean = (after.point - before.point) * (6 / h)
    v0, v1 = before.velocity, after.velocity
    return (mean - 4 * v0 - 2 * v1) / h, (4 * v1 + 2 * v0 - mean) / h


def _across(d: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Parts of v across the directions d."""
    return v - dot(d, v) * d
