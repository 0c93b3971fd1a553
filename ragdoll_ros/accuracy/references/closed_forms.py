"""Motions in closed form."""
from __future__ import annotations

import math

import numpy as np


def fall(start: np.ndarray, velocity: np.ndarray, gravity: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Positions (t, 3) m of a body in free flight: x0 + v0 t + g t^2 / 2."""
    t = np.asarray(t, float)[:, None]
    return start + velocity * t + np.asarray(gravity) * t * t / 2


def pendulum_angle(amplitude: float, omega: float, t: np.ndarray) -> np.ndarray:
    """Angle, rad, of a pendulum released at ``amplitude``; omega^2 = m g L / I.

    sin(phi/2) = k cd(omega t | k^2) with k = sin(amplitude/2) (Abramowitz, Stegun 16.1).
    """
    from scipy.special import ellipj
    k = math.sin(amplitude / 2)
    _, cn, dn, _ = ellipj(omega * np.asarray(t, float), k * k)
    return 2 * np.arcsin(k * cn / dn)


def bounce_apex(height: float, restitution: float, bounces: int) -> float:
    """Apex height, m, after some bounces: each leaves e^2 of the energy."""
    return height * restitution ** (2 * bounces)


def bounce_times(height: float, restitution: float, gravity: float, bounces: int) -> list[float]:
    """Times, s, of the first impacts of a ball released at ``height``."""
    times = [math.sqrt(2 * height / gravity)]
    for n in range(1, bounces):
        apex = bounce_apex(height, restitution, n)
        times.append(times[-1] + 2 * math.sqrt(2 * apex / gravity))
    return times


def incline_slide(slope: float, friction: float, gravity: float, t: np.ndarray) -> np.ndarray:
    """Distance, m, that a block slides down from rest by Coulomb's law; 0 if it sticks."""
    pull = gravity * (math.sin(slope) - friction * math.cos(slope))
    return max(0.0, pull) * np.asarray(t, float) ** 2 / 2


def ball_slide_then_roll(speed: float, friction: float, gravity: float, t: np.ndarray,
                         rim: float = 0.0) -> np.ndarray:
    """Distance, m, of a solid ball on the ground with initial speed and ``rim`` = r w, m/s.

    It slides with -mu g until 2 (v0 - r w0) / (7 mu g), then rolls at constant speed.
    """
    t = np.asarray(t, float)
    grip = 2 * (speed - rim) / (7 * friction * gravity)
    slid = np.minimum(t, grip)
    rolled = np.maximum(t - grip, 0.0)
    rolling = (5 * speed + 2 * rim) / 7
    return speed * slid - friction * gravity * slid ** 2 / 2 + rolling * rolled


def ball_slide_then_roll_angle(speed: float, friction: float, gravity: float, radius: float,
                               t: np.ndarray, rim: float = 0.0) -> np.ndarray:
    """Rotation, rad, of the same ball: accelerated by 5/2 mu g / r until it rolls, then v / r."""
    t = np.asarray(t, float)
    grip = 2 * (speed - rim) / (7 * friction * gravity)
    slid, rolled = np.minimum(t, grip), np.maximum(t - grip, 0.0)
    rolling = (5 * speed + 2 * rim) / 7
    return (rim * slid + 5 / 4 * friction * gravity * slid ** 2 + rolling * rolled) / radius
