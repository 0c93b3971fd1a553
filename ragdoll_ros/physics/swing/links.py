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
- Two points of the sphere are never further apart than their images in a tangent plane
  (Toponogov), so 1 and 2 never add energy to a spring in a still frame. 3 could where w h^2 is
  large; its rate is held to the energy of 1, which exact motion has: still of order 2, and
  stable for every stiffness, damping and step.
- The root's motion through the step is the cubic through the places and velocities at its ends:
  the root's change of velocity is met exactly, jerk included.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .oscillator import flow
from .sphere import along, arc, cross, dot

_ROUNDING = 1e-12
"""Share of the energy that counts as rounding."""

_LEAST = 1e-300
"""1/s^2: keeps 0/0 away."""


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
        return np.einsum('jin,jn->in', self.axes, v)

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
        """Links that point so; without a rate they are at rest in their frame."""
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

    @cached_property
    def lightness(self) -> np.ndarray:
        """(3, n) 1/m, one over the reach."""
        return _rows(1 / self.reach)

    @cached_property
    def springy(self) -> bool:
        """Whether any link has a spring."""
        return bool(np.any(self.stiffness))

    def forces(self, before: Seat, after: Seat, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Gravity and the roots' inertia, (3, n) 1/s^2, at both ends of a step of ``h`` s.

        The roots go on the cubic that joins two seats in place and velocity.
        """
        double = 2 / h
        cubic = (after.point - before.point) * (6 / h ** 2)
        cubic -= (before.velocity + after.velocity) * double
        return ((self.gravity - cubic + before.velocity * double) * self.lightness,
                (self.gravity + cubic - after.velocity * double) * self.lightness)

    def swing(self, now: Links, seat: Seat, step: Step,
              forces: tuple[np.ndarray, np.ndarray]) -> Links:
        """The links one ``step`` later, when their seats are at ``seat``."""
        d, rate, pull, drift = now.direction, now.rate, now.pull, now.drift
        first, last = forces
        turned = arc(d, seat.outward(now.seat.inward(d)))
        x = _across(d, step.x_pull * pull + step.x_rate * rate + step.x_turned * turned
                    + step.x_drift * drift + step.x_first * first + step.x_last * last)
        left = pull + turned - x
        v = _across(d, step.v_pull * pull + step.v_rate * rate + step.v_turned * turned
                    + step.v_drift * drift + step.v_first * first - step.end_pull * left)
        d, v, moved = along(d, x, v, left)
        then = Links.at(seat, self.rest, d)
        v += step.end_pull * then.pull + step.end_drift * then.drift
        if self.springy:
            v = self._bounded(v, moved, then, step)
        v += step.end_force * _across(d, last)
        return Links(seat, d, v, then.pull, then.drift)

    def _bounded(self, v: np.ndarray, left: np.ndarray, then: Links, step: Step) -> np.ndarray:
        """Hold the rates to the energy they had before the springs' correction.

        That is |v|^2 + w |arc|^2, relative to the frame. ``left`` is the arc that the model
        leaves. Where the frame turns about the link by phi in the step, the true arc leads the
        model's by phi and the true rate lags by phi; the sum of the two energies stays the same
        to third order in the step if the model's arc is turned by -phi here. Without that the
        bound would take away what is no gain, and the method be of order 1.
        """
        relative = v - then.drift
        left = _twisted(left, then.direction, dot(then.seat.spin, then.direction) * (-step.h / 2))
        before = relative - step.end_pull * (then.pull - left)
        whole = dot(before, before) + self.stiffness * dot(left, left)
        most = whole * (1 + _ROUNDING) - self.stiffness * dot(then.pull, then.pull)
        share = np.maximum(most, 0) / (dot(relative, relative) + _LEAST)
        return then.drift + np.minimum(np.sqrt(share), 1) * relative

    def tips(self, links: Links) -> Seat:
        """The masses' own motion and frames: the seats of the next level.

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
    """The factors of one step of ``h`` s for one level, each (3, n): see Level.swing.

    Those of x and v are the oscillator's (oscillator.Flow) about the target pull + y(t), where
    y is the parabola with y(0) = 0, y'(0) = drift, y(h) = turned. v lacks what the correction
    at the end brings.
    """

    def __init__(self, level: Level, h: float) -> None:
        w, c = level.stiffness, level.damping
        part = flow(w, c, h)
        m, n1, n3 = part.m, part.n1, part.n3
        keep = 1 - w * n1 - c * m
        lag = c * n1 / h
        self.h = h
        self.x_pull, self.x_rate = _rows(w * n1), _rows(m)
        self.x_turned, self.x_drift = _rows(1 - 2 * n1 / h ** 2), _rows(2 * n1 / h - m)
        self.x_first, self.x_last = _rows(n1 - n3), _rows(n3)
        self.v_pull, self.v_rate = _rows(w * m), _rows(keep)
        self.v_turned = _rows((2 - 2 * m / h - 2 * lag) / h)
        self.v_drift = _rows(2 * m / h - 1 - keep + lag)
        self.v_first = _rows(m - n1 / h)
        self.end_pull, self.end_drift, self.end_force = (
            _rows(w * n1 / h), _rows(lag), _rows(n1 / h))


def _rows(factor: np.ndarray) -> np.ndarray:
    """Repeat (n,) to (3, n): to multiply two such is twice as fast as to broadcast."""
    return np.repeat(factor[None], 3, axis=0)


def _across(d: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Parts of v across the directions d."""
    return v - dot(d, v) * d


def _twisted(v: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Tangents v turned about d by twice ``half`` rad, to third order; their length stays."""
    scale = 1 / (1 + half * half)
    return ((1 - half * half) * scale) * v + (2 * half * scale) * cross(d, v)
