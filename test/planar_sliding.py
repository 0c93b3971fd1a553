"""A body that slides and spins on level ground: Coulomb's law at thousands of points of its face.

Independent of the engine: midpoints of a fine grid, Runge-Kutta's method of order 4, steps that
shorten as the body stops. The pressure is affine, as equilibrium demands of it: its resultant is
the weight, and its moment is that of friction about the center of mass, and of the change of
angular momentum.
"""
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

G = 9.8


@dataclass(frozen=True)
class Sliding:
    """A body of 1 kg on a face, or on a line (``rolls``) along which it lies as a roller."""

    points: np.ndarray
    """(k, 2) m, from the center of the face, in the body's frame; each stands for an equal area."""
    height: float
    """m: of the center of mass."""
    inertia: float
    """kg m^2: about the vertical."""
    axial: float = 0.0
    """kg m^2: about x, the axis of a roller."""
    rolls: bool = False

    @cached_property
    def weights(self):
        """(3, k): what takes means over the points of something, and of its products with x, y."""
        return np.stack([np.ones(len(self.points)), *self.points.T]) / len(self.points)

    @cached_property
    def spread(self):
        """(2, 2) 1/m^2: from the center of pressure to the slopes of the pressure."""
        return np.linalg.pinv(self.weights[1:] @ self.points)


def disc(radius, thickness, rings=40):
    rho = np.sqrt((np.arange(rings) + 0.5) / rings)[:, None] * radius
    theta = (np.arange(3 * rings) + 0.5) * 2 * math.pi / (3 * rings)
    points = np.stack([rho * np.cos(theta), rho * np.sin(theta)], axis=-1).reshape(-1, 2)
    return Sliding(points, thickness / 2, radius ** 2 / 2)


def box(size, cells=70):
    places = (np.arange(cells) + 0.5) / cells - 0.5
    x, y = np.meshgrid(size[0] * places, size[1] * places)
    return Sliding(np.stack([x.ravel(), y.ravel()], axis=-1), size[2] / 2,
                   (size[0] ** 2 + size[1] ** 2) / 12)


def capsule(radius, length, cells=200):
    """On its side, by Steiner's law from its cylinder and its half balls."""
    x = length * ((np.arange(cells) + 0.5) / cells - 0.5)
    ball = 4 / 3 * radius / (length + 4 / 3 * radius)
    rod = 1 - ball
    across = rod * (radius ** 2 / 4 + length ** 2 / 12) + ball * (
        2 / 5 * radius ** 2 + length ** 2 / 4 + 3 / 8 * radius * length)
    return Sliding(np.stack([x, 0 * x], axis=-1), radius, across,
                   rod * radius ** 2 / 2 + ball * 2 / 5 * radius ** 2, rolls=True)


def accelerations(body, friction, state):
    """Rates of x, y, angle, velocity (2,), spin, and spin about the axis of a roller.

    With a pressure 1 + a x + b y force and torque are affine in (a, b): their sums over the points
    are taken once, and (a, b) is iterated.
    """
    angle, velocity, spin, roll = state[2], state[3:5], state[5], state[6]
    cosine, sine = math.cos(angle), math.sin(angle)
    frame = np.array(((cosine, sine), (-sine, cosine)))
    x, y = body.points.T
    along, aside = frame @ velocity
    slips = np.stack([along - spin * y, aside + spin * x])
    if body.rolls:
        slips[1] += body.height * roll
    directions = slips / np.maximum(np.sqrt((slips ** 2).sum(axis=0)), 1e-12)
    across = x * directions[1] - y * directions[0]
    # Mean direction and mean of the lever, for a pressure of 1, of x and of y.
    uniform, tilted = directions @ body.weights[0], directions @ body.weights[1:].T
    tilt = np.zeros(2)
    for _ in range(6):
        force = -friction * G * (uniform + tilted @ tilt)
        center = -body.height * force / G
        if body.rolls:
            center = np.array((center[0] - body.axial * roll * spin / G, 0.0))
        tilt = body.spread @ center
    assert (1 + body.points @ tilt).min() > 0
    torque = -friction * G * (across @ body.weights.T @ (1.0, *tilt))
    rolling = body.height * force[1] / body.axial if body.rolls else 0.0
    return np.concatenate([velocity, [spin], frame.T @ force, [torque / body.inertia, rolling]])


def slide(body, friction, speed, heading, spin, duration, steps=250):
    """Times and states (k, 7) from the origin until rest or for ``duration`` s."""
    size = np.sqrt((body.points ** 2).sum(axis=1).mean())
    state = np.array((0.0, 0.0, 0.0, speed * math.cos(heading), speed * math.sin(heading), spin,
                      0.0))
    time, times, states = 0.0, [0.0], [state]
    while time < duration - 1e-12:
        left = np.hypot(*state[3:5]) + size * abs(state[5])
        if left < 1e-4 * (speed + size * abs(spin)):
            break
        h = min(duration / steps, 0.1 * left / (friction * G), duration - time)
        a = accelerations(body, friction, state)
        b = accelerations(body, friction, state + h / 2 * a)
        c = accelerations(body, friction, state + h / 2 * b)
        d = accelerations(body, friction, state + h * c)
        state = state + h / 6 * (a + 2 * b + 2 * c + d)
        time += h
        times.append(time)
        states.append(state)
    return np.array(times), np.array(states)
