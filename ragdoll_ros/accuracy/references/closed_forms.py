"""Motions in closed form, or with forces in closed form."""
import math

import numpy as np

from .integration import MAX_STEP, TOLERANCE

STOPPED = 1e-9
"""m/s: sum of sliding speed and r w below which the disc is at rest."""


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

    It slides at the acceleration -mu g until t = 2 (v0 - r w0) / (7 mu g), then rolls at constant
    speed.
    """
    t = np.asarray(t, float)
    grip = 2 * (speed - rim) / (7 * friction * gravity)
    slid = np.minimum(t, grip)
    rolled = np.maximum(t - grip, 0.0)
    rolling = (5 * speed + 2 * rim) / 7
    return speed * slid - friction * gravity * slid ** 2 / 2 + rolling * rolled


def ball_slide_then_roll_angle(speed: float, friction: float, gravity: float, radius: float,
                               t: np.ndarray, rim: float = 0.0) -> np.ndarray:
    """Rotation, rad, of the same ball: angular acceleration 5/2 mu g / r until it rolls, then rate
    v / r.
    """
    t = np.asarray(t, float)
    grip = 2 * (speed - rim) / (7 * friction * gravity)
    slid, rolled = np.minimum(t, grip), np.maximum(t - grip, 0.0)
    rolling = (5 * speed + 2 * rim) / 7
    return (rim * slid + 5 / 4 * friction * gravity * slid ** 2 + rolling * rolled) / radius


def friction_factors(ratio: float) -> tuple[float, float]:
    """Friction of a thin disc that slides and spins on its face, with uniform pressure.

    Coulomb's law; force over mu m g, and torque over mu m g r, at a = v / (r w) = ``ratio``. The
    mean of |v + w x p| over the face is r w W(a). W is the mean distance, in radii, of the face's
    points from one at a radii from its centre:

        W = 4/(9 pi) [(7 + a^2) E - 4 (1 - a^2) K](a^2),                       a <= 1
        W = 4/(9 pi) [a (7 + a^2) E - (a^2 - 1) (a^2 + 3) / a K](1/a^2),       a >= 1

    so friction dissipates the power mu m g (f v + t r w), f = dW/da and t = W - a f.
    """
    from scipy.special import ellipe, ellipk
    a = min(max(ratio, 1e-9), 1e6)
    k = min(a, 1 / a) ** 2
    e, f = ellipe(k), ellipk(k) if k < 1 else 0.0
    if a <= 1:
        mean = 4 / (9 * math.pi) * ((7 + a * a) * e - 4 * (1 - a * a) * f)
        force = 4 / (3 * math.pi * a) * ((1 + a * a) * e - (1 - a * a) * f)
    else:
        mean = 4 / (9 * math.pi) * (a * (7 + a * a) * e - (a * a - 1) * (a * a + 3) / a * f)
        force = 4 / (3 * math.pi) * ((1 + a * a) * e - (a * a - 1) * f)
    return force, mean - a * force


def slide_and_spin(radius: float, friction: float, gravity: float, speed: float, rate: float,
                   times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (t,) m and rotation (t,) rad of the disc, from ``speed`` m/s and ``rate`` rad/s > 0.

    Sliding and spin stop at the same time, with a near 0.653 (Farkas, Bartels, Unger, Wolf, Phys.
    Rev. Lett. 90, 2003).
    """
    from scipy.integrate import solve_ivp

    def derivative(_: float, y: np.ndarray) -> tuple[float, ...]:
        rim = radius * y[3]
        force, torque = friction_factors(y[2] / max(rim, 1e-300))
        return y[2], y[3], -friction * gravity * force, -2 * friction * gravity * torque / radius

    def stopped(_: float, y: np.ndarray) -> float:
        return y[2] + radius * y[3] - STOPPED
    stopped.terminal = True
    solved = solve_ivp(derivative, (times[0], times[-1]), (0.0, 0.0, speed, rate), 'DOP853',
                       events=stopped, dense_output=True, rtol=TOLERANCE, atol=TOLERANCE,
                       max_step=MAX_STEP)
    slid, angle, *_ = solved.sol(np.minimum(times, solved.t[-1]))
    return slid, angle
