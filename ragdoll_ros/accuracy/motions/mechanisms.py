"""Pendulums: small, large and damped.

A doll's root is free, so the pivot is a root of 1e12 kg and 100 m radius. Gravity is off; instead a
constant push of the bob's weight acts on its centre, so that the pivot moves by only 2e-11 m.
"""
from __future__ import annotations

import math

import numpy as np

from ...model.push import Push
from ...model.ragdoll import Bone, Joint, Ragdoll
from ...model.scene import Placement
from ...model.shapes import Box, Sphere
from ..cases.trial import Trial, posed
from ..references.closed_forms import pendulum_angle
from ..references.integration import integrate
from ..trajectory import Trajectory
from .motion import ReferenceMotion, airborne_scene, orientations_about

PIVOT = 1e12
"""kg"""

LENGTH, MASS, GRAVITY = 0.5, 1.0, 9.8
"""m from the hinge to the bob's centre, kg, m/s^2"""

ROD = Box((0.05, 0.05, 0.4))
MOMENT = ROD.inertia(MASS)[1] + MASS * LENGTH ** 2
"""kg m^2 about the hinge"""

OMEGA = math.sqrt(MASS * GRAVITY * LENGTH / MOMENT)
"""rad/s of small oscillations"""


def mechanism_motions() -> list[ReferenceMotion]:
    """All pendulums."""
    return [swing('pendulum_small', 'Pendulum, 5°, 2 s', math.radians(5)),
            swing('pendulum_large', 'Pendulum, 120°, 2 s', math.radians(120)),
            damped('damped_under', 'under-damped (ζ = 0.2)', 0.2),
            damped('damped_critical', 'critically damped (ζ = 1)', 1.0),
            damped('damped_over', 'over-damped (ζ = 3)', 3.0)]


def swing(name: str, title: str, amplitude: float) -> ReferenceMotion:
    """A pendulum released at ``amplitude`` rad."""
    def angle(times: np.ndarray) -> np.ndarray:
        return pendulum_angle(amplitude, OMEGA, times)
    return _pendulum(name, title, 'elliptic functions', amplitude, 0.0, angle)


def damped(name: str, title: str, ratio: float) -> ReferenceMotion:
    """A pendulum with a damped hinge released at 30 degrees, with a damping ratio."""
    def angle(times: np.ndarray) -> np.ndarray:
        def rate(t: float, y: np.ndarray) -> tuple[float, float]:
            return y[1], -OMEGA ** 2 * math.sin(y[0]) - 2 * ratio * OMEGA * y[1]
        return integrate(rate, (math.radians(30), 0.0), times)[:, 0]
    return _pendulum(name, f'Damped hinge, {title}, 2 s', 'its equation, DOP853 at 1e-12',
                     math.radians(30), 2 * ratio * OMEGA * MOMENT, angle)


def _pendulum(name: str, title: str, reference: str, amplitude: float, damping: float,
              angle: object) -> ReferenceMotion:
    bones = (Bone('pivot', Sphere(100.0), PIVOT, (0.0, 0.0, 0.0)),
             Bone('bob', ROD, MASS, (0.0, 0.0, -LENGTH)))
    hinge = Joint('pivot', 'bob', 'hinge', (0.0, 0.0, 0.0), ((0.0, 1.0, 0.0),), damping=damping)
    doll = Ragdoll(name, bones, (hinge,))
    weight = Push('bob', (0.0, 0.0, -MASS * GRAVITY), start=0.0, duration=2.0)
    trial = Trial(airborne_scene(doll, (0.0, 0.0, 0.0)), 2.0,
                  posed(Placement(doll), {'bob': amplitude}), (weight,))

    def truth(times: np.ndarray) -> Trajectory:
        phi = angle(times)
        bob = LENGTH * np.stack([-np.sin(phi), 0 * phi, -np.cos(phi)], axis=-1)
        positions = np.stack([0 * bob, bob], axis=1)
        return Trajectory.of_poses(times, positions, orientations_about(
            (0.0, 1.0, 0.0), np.stack([0 * phi, phi], axis=1)))
    return ReferenceMotion(name, title, reference, trial, truth, 'angle_worst_rad', in_flight=False)
