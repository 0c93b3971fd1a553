"""Integration of one level of links, vectorized, over one step.

The equation of motion of a link of unit direction d, world frame:

    d'' = -|d'|^2 d + P [ w log_map(d, n) - c (d' - spin x d) + (share g - r'')/reach ]

P projects on the tangent plane at d; n is the rest direction, and spin the angular velocity of the
frame in which it is fixed; r is the link's root; log is the logarithm map of the sphere
(sphere.py); w = k/J, c the damping. A link carries the masses beyond it as if the chain were
straight: with s_j their distances from the root, J = sum m_j s_j^2 and reach = J / sum m_j s_j.
For a chain of one mass these are m l^2 and l, and exact.

The integrator is exponential, of order 2 (Hochbruck and Ostermann, Exponential integrators,
Acta Numerica 19, 2010, section 2, for linear spaces; here in the tangent plane at d, with the
exponential map of the sphere):

1. In the tangent plane at d, solve exactly the damped oscillator about a target that moves with
   the frame, under a force linear in time (oscillator.py).
2. Map the result to the sphere and transport the rate in parallel (sphere.py).
3. Add to the rate the difference between true and model force at the end, as a force that grows
   linearly from zero over the step.

Properties:
- Planar motion in a frame at rest, without gravity, is the linear oscillator: exact to rounding for
  every step, stiffness and damping.
- Without spring and damping it is the Stoermer-Verlet method on the sphere.
- Distances on the sphere are at most those of the images in a tangent plane (Toponogov), so that
  1 and 2 never add energy to a spring in a frame at rest. 3 may, for large w h^2; its rate is
  limited to the energy after 1. The method is still of order 2, and stable for every stiffness,
  damping and step.
- The root follows the cubic through positions and velocities at both ends of the step, so that its
  change of velocity enters exactly.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .oscillator import flow
from .sphere import cross, dot, exp_map, log_map

_ROUNDING = 1e-12
"""Relative rounding error of an energy."""

_LEAST = 1e-300
"""1/s^2: avoids 0/0."""


@dataclass(frozen=True)
class BaseFrames:
    """Frames at the roots of n links at one time; world frame."""

    point: np.ndarray
    """(3, n) m, origins."""
    velocity: np.ndarray
    """(3, n) m/s."""
    axes: np.ndarray
    """(3, 3, n): [j] is the j-th axis; rest directions are fixed in these frames."""
    spin: np.ndarray
    """(3, n) rad/s, angular velocities."""

    def outward(self, v: np.ndarray) -> np.ndarray:
        """Rotate vectors (3, n) from the frames to the world frame."""
        return np.einsum('jin,jn->in', self.axes, v)

    def inward(self, v: np.ndarray) -> np.ndarray:
        """Rotate vectors (3, n) from the world frame to the frames."""
        return np.einsum('jin,in->jn', self.axes, v)


@dataclass(frozen=True)
class Links:
    """State of n links at one time; world frame."""

    base: BaseFrames
    direction: np.ndarray
    """(3, n) unit vectors from root to mass."""
    rate: np.ndarray
    """(3, n) 1/s, the direction's rate of change."""
    pull: np.ndarray
    """(3, n) rad, log map of the rest direction at the direction."""
    drift: np.ndarray
    """(3, n) 1/s, rate of a direction fixed in the base frame."""

    @classmethod
    def at(cls, base: BaseFrames, rest: np.ndarray, direction: np.ndarray,
           rate: np.ndarray | None = None) -> Links:
        """Links with these directions and rates; None: at rest in the base frame."""
        drift = cross(base.spin, direction)
        return cls(base, direction, drift if rate is None else rate,
                   log_map(direction, base.outward(rest)), drift)


@dataclass(frozen=True)
class Level:
    """Constants of the n links with the same number of links between them and their bones."""

    rest: np.ndarray
    """(3, n) unit rest directions in the base frames."""
    length: np.ndarray
    """(n,) m."""
    reach: np.ndarray
    """(n,) m, length of the simple pendulum of the same period."""
    inertia: np.ndarray
    """(n,) kg m^2, J."""
    stiffness: np.ndarray
    """(n,) 1/s^2, w = k/J."""
    damping: np.ndarray
    """(n,) 1/s, c."""
    gravity: np.ndarray
    """(3, n) m/s^2, scaled by the swing's share of gravity."""

    @cached_property
    def inverse_reach(self) -> np.ndarray:
        """(3, n) 1/m."""
        return _rows(1 / self.reach)

    @cached_property
    def has_springs(self) -> bool:
        """Whether any link has a spring."""
        return bool(np.any(self.stiffness))

    def forces(self, before: BaseFrames, after: BaseFrames,
               h: float) -> tuple[np.ndarray, np.ndarray]:
        """Gravity and inertial force of the root, (3, n) 1/s^2, at both ends of a step of ``h`` s.

        The root follows the cubic through both positions and velocities.
        """
        double = 2 / h
        cubic = (after.point - before.point) * (6 / h ** 2)
        cubic -= (before.velocity + after.velocity) * double
        return ((self.gravity - cubic + before.velocity * double) * self.inverse_reach,
                (self.gravity + cubic - after.velocity * double) * self.inverse_reach)

    def swing(self, now: Links, base: BaseFrames, step: Step,
              forces: tuple[np.ndarray, np.ndarray]) -> Links:
        """Integrate links over one step; ``base`` are the frames at its end."""
        d, rate, pull, drift = now.direction, now.rate, now.pull, now.drift
        first, last = forces
        turned = log_map(d, base.outward(now.base.inward(d)))
        x = _tangential(d, step.x_pull * pull + step.x_rate * rate + step.x_turned * turned
                    + step.x_drift * drift + step.x_first * first + step.x_last * last)
        left = pull + turned - x
        v = _tangential(d, step.v_pull * pull + step.v_rate * rate + step.v_turned * turned
                    + step.v_drift * drift + step.v_first * first - step.end_pull * left)
        d, v, moved = exp_map(d, x, v, left)
        then = Links.at(base, self.rest, d)
        v += step.end_pull * then.pull + step.end_drift * then.drift
        if self.has_springs:
            v = self._bounded(v, moved, then, step)
        v += step.end_force * _tangential(d, last)
        return Links(base, d, v, then.pull, then.drift)

    def _bounded(self, v: np.ndarray, left: np.ndarray, then: Links, step: Step) -> np.ndarray:
        """Limit the rates to the energy before the correction of the spring force.

        Energy is |v|^2 + w |log|^2, relative to the frame; ``left`` is the log map that the model
        gives. If the frame turns about the link by phi in the step, the true log map leads the
        model's by phi, and the true rate lags by phi. Rotating the model's by -phi keeps the sum of
        both energies to third order in the step; without it the limit would reduce the order to 1.
        """
        relative = v - then.drift
        left = _rotated(left, then.direction, dot(then.base.spin, then.direction) * (-step.h / 2))
        before = relative - step.end_pull * (then.pull - left)
        whole = dot(before, before) + self.stiffness * dot(left, left)
        most = whole * (1 + _ROUNDING) - self.stiffness * dot(then.pull, then.pull)
        share = np.maximum(most, 0) / (dot(relative, relative) + _LEAST)
        return then.drift + np.minimum(np.sqrt(share), 1) * relative

    def tips(self, links: Links) -> BaseFrames:
        """Frames at the masses: the bases of the next level.

        The base frame is rotated by the smallest rotation from the rest direction n to d; the
        relative angular velocity is (n + d) x d' / (1 + n . d).
        """
        base, d = links.base, links.direction
        n = base.outward(self.rest)
        middle = n + d
        scale = 1 / np.maximum(1 + dot(n, d), 1e-3)
        axes = (base.axes + 2 * self.rest[:, None] * d
                - (np.einsum('jin,in->jn', base.axes, middle) * scale)[:, None] * middle)
        spin = base.spin + cross(middle, links.rate - links.drift) * scale
        return BaseFrames(base.point + self.length * d, base.velocity + self.length * links.rate,
                    axes, spin)


class Step:
    """Coefficients (3, n) of Level.swing for a step of ``h`` s.

    Those of x and v are the oscillator's (oscillator.Flow) about the target pull + y(t), y the
    parabola with y(0) = 0, y'(0) = drift, y(h) = turned; v excludes the correction at the end.
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
    """Repeat (n,) to (3, n): the product of two such arrays is twice as fast as broadcasting."""
    return np.repeat(factor[None], 3, axis=0)


def _tangential(d: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Components of v orthogonal to the directions d."""
    return v - dot(d, v) * d


def _rotated(v: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Rotate tangents v about d by 2 * ``half`` rad, to third order; keeps their length."""
    scale = 1 / (1 + half * half)
    return ((1 - half * half) * scale) * v + (2 * half * scale) * cross(d, v)
