"""Swings at several frame rates against closed forms: a spring, a pendulum and a throw.

For comparison VRM spring bones (VRMC_springBone-1.0: a Verlet step with drag, stiffness and gravity
each times the frame's length), whose period depends on the frame rate.
"""
from __future__ import annotations

import functools
import math
from collections.abc import Callable
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone
from ...model.shapes import Sphere
from ...model.state import State
from ...model.swing import Link, Swing
from ...model.swing_mount import SwingMount
from ..references.closed_forms import pendulum_angle
from ..results.runner import Job, Row, RunOptions

if TYPE_CHECKING:
    from ...physics.swing.swings import Swings

NAME = 'swing'
RATES = (15, 30, 60, 120, 240)
DURATION = 3.0
GRAVITY = 9.8
LENGTH, MASS, STIFFNESS, DAMPING = 0.3, 0.5, 8.0, 0.1
START = math.radians(60)
STILL = State(np.zeros((1, 3)), np.array([rotation.IDENTITY]), *np.zeros((2, 1, 3)))


def jobs(options: RunOptions) -> list[Job]:
    """One job."""
    return [Job(NAME, 'swings', functools.partial(measure), 2.0)]


def measure() -> list[Row]:
    """Largest error over 3 s and CPU time of a frame for each kind, and the period of VRM's spring,
    at each frame rate.
    """
    rows = []
    for rate in RATES:
        times = np.arange(1, round(DURATION * rate) + 1) / rate
        row: Row = {'rate': rate}
        for name, angle in (('spring', _spring), ('pendulum', _pendulum), ('fall', _fall)):
            before = process_time()
            row[f'{name}_error'] = angle(times)
            row[f'{name}_frame_s'] = (process_time() - before) / len(times)
        row['recipe_period_s'] = vrm_period(rate)
        rows.append(row)
    return rows


def _swings(link: Link, mode: str, gravity: float, **fields: object) -> Swings:
    # Imported here, because it compiles.
    from ...physics.swing.swings import Swings
    swing = Swing('swing', 'bone', (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (link,), mode=mode, **fields)
    mount = SwingMount.on(swing, Bone('bone', Sphere(0.1), 1.0, (0.0, 0.0, 0.0)), 0)
    return Swings([mount], (0.0, 0.0, -gravity), lambda time: STILL)


def _spring(times: np.ndarray) -> float:
    """Largest angle error, rad, of a damped spring released at 60 degrees, no gravity."""
    swings = _swings(Link(LENGTH, MASS, STIFFNESS, DAMPING), 'spring', 0.0)
    swings.begin(0.0, [[math.cos(START), math.sin(START), 0.0]], [[0.0, 0.0, 0.0]])
    omega = math.sqrt(STIFFNESS / MASS) / LENGTH
    fast = omega * math.sqrt(1 - DAMPING ** 2)
    truth = START * np.exp(-DAMPING * omega * times) * (
        np.cos(fast * times) + DAMPING * omega / fast * np.sin(fast * times))
    return _worst(swings, times, truth, lambda x: math.atan2(x[1], x[0]))


def _pendulum(times: np.ndarray) -> float:
    """Largest angle error, rad, of a pendulum released horizontally."""
    swings = _swings(Link(LENGTH, MASS), 'pendulum', GRAVITY)
    swings.begin(0.0)
    truth = pendulum_angle(math.pi / 2, math.sqrt(GRAVITY / LENGTH), times)
    return _worst(swings, times, truth, lambda x: math.atan2(x[0], -x[2]))


def _fall(times: np.ndarray) -> float:
    """Largest height error, m, of a mass thrown up at 2 m/s under 2 m/s^2."""
    swings = _swings(Link(LENGTH, MASS), 'free', 2.0, velocity=(0.0, 0.0, 2.0))
    swings.begin(0.0)
    return _worst(swings, times, 2 * times - times ** 2, lambda x: x[2])


def _worst(swings: Swings, times: np.ndarray, truth: np.ndarray,
           read: Callable[[np.ndarray], float]) -> float:
    found = [read(swings.evaluate(time).positions[0]) for time in times]
    return float(np.abs(np.array(found) - truth).max())


def vrm_period(rate: float, stiffness: float = 1.0, drag: float = 0.02) -> float:
    """Period, s, of a VRM spring bone released at 60 degrees without gravity, from its zeros."""
    dt, rest = 1 / rate, np.array([1.0, 0.0])
    now = before = LENGTH * np.array([math.cos(START), math.sin(START)])
    angles = [START]
    for _ in range(round(20 * rate)):
        then = now + (now - before) * (1 - drag) + dt * stiffness * rest
        before, now = now, LENGTH * rotation.normalized(then)
        angles.append(math.atan2(now[1], now[0]))
    angles = np.array(angles)
    at = np.flatnonzero(angles[:-1] * angles[1:] < 0)[:9]
    zeros = at + angles[at] / (angles[at] - angles[at + 1])
    return float(2 * np.diff(zeros).mean() * dt)
