"""Impacts, and motions about a sticking edge: closed forms, or one equation of one variable.

Shares no code with the engines. Planar motions: x forward, z up, angles about y, positive forwards.
"""
import math
from collections.abc import Sequence

import numpy as np

from .integration import MAX_STEP, TOLERANCE

STILL = 1e-9
"""rad/s: a rocking block with a slower impact is at rest."""


def edge_angle(half_width: float, half_height: float, start: float, gravity: float,
               times: np.ndarray, rocks: bool = True) -> np.ndarray:
    """Angles (t,) rad of a box on one lower edge, released at the angle ``start`` > 0.

    About the edge I a'' = m g x, with x = h sin a - b cos a the horizontal offset of the centre,
    I = 4/3 m (b^2 + h^2), b and h half the width and height, m. If it ``rocks``, the angular
    momentum about the striking edge is conserved: the rate is multiplied by 1 - 2 m b^2 / I
    (Housner, Bull. Seism. Soc. Am. 53, 1963).
    """
    about_edge = 4 / 3 * (half_width ** 2 + half_height ** 2)
    kept = 1 - 2 * half_width ** 2 / about_edge
    angles = np.zeros(len(times))
    begin, side, state = float(times[0]), 1.0, np.array([start, 0.0])
    while begin < times[-1]:
        solved = _until_flat(half_width, half_height, gravity / about_edge, begin,
                             float(times[-1]), state)
        inside = (times >= begin) & (times <= solved.t[-1])
        angles[inside] = side * solved.sol(times[inside])[0]
        rate = kept * solved.y[1, -1]
        if not rocks or not len(solved.t_events[0]) or abs(rate) < STILL:
            break
        begin, side, state = solved.t[-1], -side, np.array([0.0, -rate])
    return angles


def _until_flat(half_width: float, half_height: float, pull: float, begin: float, end: float,
                state: np.ndarray) -> object:
    """Solution from ``begin`` to ``end`` s, or to where the box falls flat; mirrored to a > 0."""
    from scipy.integrate import solve_ivp

    def derivative(_: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], pull * (half_height * math.sin(y[0]) - half_width * math.cos(y[0]))

    def flat(_: float, y: np.ndarray) -> float:
        return y[0]
    flat.terminal, flat.direction = True, -1
    return solve_ivp(derivative, (begin, end), state, 'DOP853', dense_output=True, events=flat,
                     rtol=TOLERANCE, atol=TOLERANCE, max_step=MAX_STEP)


def edge_centre(half_width: float, half_height: float, angles: np.ndarray) -> np.ndarray:
    """Centres (t, 3) m of the same box, which stands centred at the origin at angle 0."""
    side = np.where(angles < 0, -1.0, 1.0) * half_width
    sin, cos = np.sin(angles), np.cos(angles)
    return np.stack([side - side * cos + half_height * sin, np.zeros(len(angles)),
                     side * sin + half_height * cos], axis=1)


def peaks(angles: np.ndarray) -> np.ndarray:
    """Peaks of |angle| at uniform samples, by parabolas through the three highest samples."""
    size = np.abs(angles)
    tops = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    before, here, after = size[tops - 1], size[tops], size[tops + 1]
    return here + (after - before) ** 2 / (8 * (2 * here - before - after))


def planar_impulse(arm: tuple[float, float], mass: float, inertia: float,
                   velocity: tuple[float, float], restitution: float,
                   friction: float) -> tuple[float, float]:
    """Impulse (x, z) N s that the ground gives a body at a point, ``arm`` (x, z) m from its centre.

    Newton's law: the normal velocity becomes -e times itself; Coulomb's: the point sticks where
    the impulse is within the cone, else the impulse is on the cone's edge, against the sliding
    velocity after the impact (Moreau 1988), which may be reversed.
    ``velocity`` (x, z) m/s is the point's before the impact, ``inertia`` kg m^2 about y.
    """
    x, z = arm
    xx, xz, zz = 1 / mass + z * z / inertia, -x * z / inertia, 1 / mass + x * x / inertia
    away = -(1 + restitution) * velocity[1]
    sticking = np.linalg.solve(((xx, xz), (xz, zz)), (-velocity[0], away))
    if abs(sticking[0]) <= friction * sticking[1]:
        return float(sticking[0]), float(sticking[1])
    for slope in (-friction, friction):
        normal = away / (zz + slope * xz)
        if (velocity[0] + (xx * slope + xz) * normal) * slope <= 0:
            return slope * normal, normal
    raise ArithmeticError(f'no impulse fits friction {friction} at {arm}')


def balls_in_a_row(radius: float, masses: Sequence[float], starts: Sequence[float],
                   speeds: Sequence[float], restitution: float, times: np.ndarray) -> np.ndarray:
    """Positions (t, n) m of balls on a line with successive impacts, from left to right.

    An impact conserves momentum and multiplies the relative velocity by -e.
    """
    x, v = np.array(starts, float), np.array(speeds, float)
    places, now = np.empty((len(times), len(x))), 0.0
    while True:
        room, closing = np.diff(x) - 2 * radius, v[:-1] - v[1:]
        waits = np.where(closing > 1e-12, room / np.maximum(closing, 1e-12), math.inf)
        pair, until = int(np.argmin(waits)), now + float(waits.min())
        inside = (times >= now) & (times <= until)
        places[inside] = x + v * (times[inside] - now)[:, None]
        if until >= times[-1]:
            return places
        x, now = x + v * (until - now), until
        a, b = masses[pair], masses[pair + 1]
        impulse = (1 + restitution) * closing[pair] * a * b / (a + b)
        v[pair] -= impulse / a
        v[pair + 1] += impulse / b


def spin_down(radius: float, friction: float, gravity: float, rate: float,
              times: np.ndarray) -> np.ndarray:
    """Angles (t,) rad of a disc that spins on its face until friction stops it.

    With uniform pressure the torque is 2/3 mu m g r, the moment of inertia m r^2 / 2, so w' = -4/3
    mu g / r.
    """
    slowing = 4 / 3 * friction * gravity / radius
    t = np.minimum(times, rate / slowing)
    return rate * t - slowing * t * t / 2
