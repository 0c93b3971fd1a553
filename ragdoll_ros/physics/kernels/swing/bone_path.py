"""The path of a bone between two states: cubic in position and in rotation vector.

Positions are interpolated with the linear velocities, orientations by a rotation vector whose rates
at both ends are the angular velocities (cubic Hermite). The error is of fourth order in the time
between the states; velocities are those of the path. Whole turns between two states are chosen by
the angular velocities.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.transcendental import arc, sine_and_cosine
from ..maths.vectors import (Quat, Vec3, add, add_scaled, cross, divide, dot, norm, put, quat_conj,
                             quat_mul, scale, sub, vec)


@compiled
def set_bones(time: float, knots: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
    """Write the states (b, 13) at ``time`` s of bones with states ``rows`` (k, b, 13) at ``knots``
    (k,) s; constant before the first and after the last.
    """
    after = np.searchsorted(knots, time)
    if after == len(knots) or knots[after] == time or after == 0:
        known = min(after, len(knots) - 1)
        for bone in range(len(out)):
            for k in range(13):
                out[bone, k] = rows[known, bone, k]
        return
    span = knots[after] - knots[after - 1]
    part = (time - knots[after - 1]) / span
    for bone in range(len(out)):
        interpolate_state(rows[after - 1, bone], rows[after, bone], span, part, out[bone])


@compiled
def interpolate_state(start: np.ndarray, end: np.ndarray, span: float, part: float,
            out: np.ndarray) -> None:
    """Write to ``out`` (13,) the state at fraction ``part`` (0 to 1) of the path of ``span`` s
    between two states (13,): position, orientation, linear and angular velocity.
    """
    position, linear = hermite(vec(start), vec(end), vec(start[7:]), vec(end[7:]), span, part)
    spin = vec(start[10:])
    turn = turn_between(start, end, span)
    vector, rate = hermite((0.0, 0.0, 0.0), turn, spin, rate_of_vector(turn, vec(end[10:])), span,
                           part)
    orientation = quat_mul(from_rotation_vector(vector), orientation_of(start))
    put(out, position)
    out[3], out[4], out[5], out[6] = orientation
    put(out[7:], linear)
    put(out[10:], rate_of_turn(vector, rate))


@compiled
def orientation_of(state: np.ndarray) -> Quat:
    """Orientation of a state (13,)."""
    return state[3], state[4], state[5], state[6]


@compiled
def hermite(a: Vec3, b: Vec3, a_rate: Vec3, b_rate: Vec3, span: float,
            part: float) -> tuple[Vec3, Vec3]:
    """Cubic Hermite interpolation of a and b with these rates, and its rate."""
    s, r = part, 1 - part
    change = divide(sub(b, a), span)
    value = add(scale(r * r, a_rate), sub(scale(s * (3 - 2 * s), change), scale(s * r, b_rate)))
    rate = add(scale(r * (1 - 3 * s), a_rate),
               add(scale(6 * s * r, change), scale(s * (3 * s - 2), b_rate)))
    return add_scaled(a, span * s, value), rate


@compiled
def turn_between(start: np.ndarray, end: np.ndarray, span: float) -> Vec3:
    """Rotation vector, rad, world axes, from one state's orientation to the other's, ``span`` s
    later. The mean angular velocity determines the whole turns.
    """
    q = quat_mul(orientation_of(end), quat_conj(orientation_of(start)))
    if q[3] < 0:
        q = -q[0], -q[1], -q[2], -q[3]
    sin = norm((q[0], q[1], q[2]))
    angle = 2 * arc(sin, q[3])
    # For small turns the vector part is half the turn.
    vector = scale(angle / sin if sin > 1e-150 else 2.0, (q[0], q[1], q[2]))
    mean = scale(span / 2, add(vec(start[10:]), vec(end[10:])))
    if dot(mean, mean) <= 1:
        return vector
    axis = divide(vector, angle) if angle > 1e-12 else divide(mean, norm(mean))
    revolutions = math.floor((dot(mean, axis) - angle) / (2 * math.pi) + 0.5)
    return scale(angle + 2 * math.pi * revolutions, axis)


@compiled
def from_rotation_vector(v: Vec3) -> Quat:
    """Unit quaternion of a rotation vector, rad."""
    half = norm(v) / 2
    sin, cos = sine_and_cosine(half)
    share = sin / (2 * half) if half > 1e-150 else 0.5
    return share * v[0], share * v[1], share * v[2], cos


@compiled
def rate_of_turn(vector: Vec3, rate: Vec3) -> Vec3:
    """Angular velocity of a rotation vector with this rate: the left Jacobian of SO(3).

    Barfoot, State Estimation for Robotics, 2017, eq. 7.77.
    """
    angle = norm(vector)
    if angle < 1e-3:
        start, second = 0.5 - angle * angle / 24, 1 / 6 - angle * angle / 120
    else:
        sin = sine_and_cosine(angle)[0]
        half = sine_and_cosine(angle / 2)[0]
        start = 2 * (half / angle) * (half / angle)
        second = (angle - sin) / (angle * angle * angle)
    once = cross(vector, rate)
    return add_scaled(add_scaled(rate, start, once), second, cross(vector, once))


@compiled
def rate_of_vector(vector: Vec3, angular: Vec3) -> Vec3:
    """Rate, rad/s, of a rotation ``vector``, rad, whose rotation has this ``angular`` velocity: the
    inverse left Jacobian, eq. 7.76 of the source above.

    Beyond 1.5 pi, near its singularity, the angular velocity itself.
    """
    angle = norm(vector)
    if angle >= 1.5 * math.pi:
        return angular
    factor = 1 / 12
    if angle > 1e-3:
        sin, cos = sine_and_cosine(angle / 2)
        factor = (1 - angle / 2 * cos / sin) / (angle * angle)
    once = cross(vector, angular)
    return add_scaled(add_scaled(angular, -0.5, once), factor, cross(vector, once))
