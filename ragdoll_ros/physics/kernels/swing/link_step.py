"""One step of a link.

The integrator is exponential, of order 2 (Hochbruck and Ostermann, Exponential integrators,
Acta Numerica 19, 2010, section 2, for linear spaces; here in the tangent plane at d, with the
exponential map of the sphere):

1. In the tangent plane at d, solve exactly the damped oscillator about a target that moves with
   the frame, under a force linear in time (maths/oscillator.py).
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

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.oscillator import oscillator_response
from ..maths.vectors import (Vec3, add, add_scaled, cross, dot, norm, put, quat_to_matrix, scale,
                             sub, vec)
from .bone_path import orientation_of
from .links import Frame
from .sphere import exp_map, log_map, transported

LARGEST_FORCED_PHASE = 0.5
"""rad: phase of a pendulum under its root's acceleration above which a step is divided."""

ROUNDING = 1e-12
"""Relative rounding error of an energy."""

SMALLEST_ARC = 1e-10
"""rad: nearer to the opposite of its rest direction, a link has no smallest rotation to it."""

LEAST = 1e-300
"""1/s^2: avoids 0/0."""


@compiled
def set_response(link: np.ndarray, h: float, r: np.ndarray) -> None:
    """Write the coefficients of a link's motion over a step of ``h`` s to ``r`` (RESPONSE)."""
    w, c = link.stiffness, link.damping
    m, n1, n3 = oscillator_response(w, c, h)
    keep, damping_share = 1 - w * n1 - c * m, c * n1 / h
    r.h = h
    r.x_rest, r.x_rate = w * n1, m
    r.x_frame, r.x_drift = 1 - 2 * n1 / (h * h), 2 * n1 / h - m
    r.x_start, r.x_end = n1 - n3, n3
    r.v_rest, r.v_rate = w * m, keep
    r.v_frame = (2 - 2 * m / h - 2 * damping_share) / h
    r.v_drift = 2 * m / h - 1 - keep + damping_share
    r.v_start = m - n1 / h
    r.end_rest, r.end_drift, r.end_force = w * n1 / h, damping_share, n1 / h
    r.root_move, r.root_speed = 6 / (h * h * link.reach), 2 / (h * link.reach)
    r.largest_square = (LARGEST_FORCED_PHASE / h) ** 4


@compiled
def outward(frame: Frame, v: Vec3) -> Vec3:
    """Rotate a vector from a frame to the world."""
    return add(scale(v[0], frame.x), add(scale(v[1], frame.y), scale(v[2], frame.z)))


@compiled
def root_frame(link: np.ndarray, bone: np.ndarray, matrix: np.ndarray) -> Frame:
    """Frame at the root of a chain's first link; ``bone`` (13,): the bone's state. Scratch:
    ``matrix`` (3, 3).
    """
    quat_to_matrix(orientation_of(bone), matrix)
    x, y, z = ((matrix[0, 0], matrix[1, 0], matrix[2, 0]),
               (matrix[0, 1], matrix[1, 1], matrix[2, 1]),
               (matrix[0, 2], matrix[1, 2], matrix[2, 2]))
    spin = vec(bone[10:])
    root = vec(link.root)
    arm = add(scale(root[0], x), add(scale(root[1], y), scale(root[2], z)))
    return Frame(add(vec(bone), arm), add(vec(bone[7:]), cross(spin, arm)), x, y, z, spin)


@compiled
def limited(v: Vec3, most: float) -> Vec3:
    """A vector, or one of its direction and length ``most`` if it is longer."""
    size = norm(v)
    return scale(most / size, v) if size > most else v


@compiled
def tip_frame(link: np.ndarray, state: np.ndarray, most: float) -> Frame:
    """Frame at a link's mass: that of the next link's root, its spin at most ``most`` rad/s.

    The frame at the link's root is rotated by the smallest rotation from the rest direction n to d:
    a reflection along n and one along n + d. The relative angular velocity is
    (n + d) x d' / (1 + n . d).
    """
    axes, d, rate, rest = state.axes, vec(state.direction), vec(state.rate), vec(link.rest)
    x, y, z = vec(axes[0]), vec(axes[1]), vec(axes[2])
    n = add(scale(rest[0], x), add(scale(rest[1], y), scale(rest[2], z)))
    middle = add(n, d)
    size = norm(middle)
    if size < SMALLEST_ARC:  # any half turn
        middle = cross(n, x) if abs(rest[0]) < 0.6 else cross(n, y)
        size = norm(middle)
    m = scale(1 / size, middle)
    n_mirrored = add_scaled(n, -2 * dot(n, m), m)
    spin = add_scaled(vec(state.spin), 2 / size, cross(m, sub(rate, vec(state.drift))))
    return Frame(
        add_scaled(vec(state.point), link.length, d),
        add_scaled(vec(state.velocity), link.length, rate),
        add_scaled(add_scaled(x, -2 * dot(x, m), m), -2 * rest[0], n_mirrored),
        add_scaled(add_scaled(y, -2 * dot(y, m), m), -2 * rest[1], n_mirrored),
        add_scaled(add_scaled(z, -2 * dot(z, m), m), -2 * rest[2], n_mirrored),
        limited(spin, most))


@compiled
def set_frame(link: np.ndarray, state: np.ndarray, frame: Frame, d: Vec3) -> None:
    """Write the ``frame`` at a link's root and its unit direction d to ``state`` (LINK_STATE), and
    what follows from these: to_rest, the log map from d to the rest direction, rad, and drift, the
    rate of d if it were fixed in the frame, 1/s. The rate is not changed.
    """
    put(state.point, frame.point)
    put(state.velocity, frame.velocity)
    put(state.axes[0], frame.x)
    put(state.axes[1], frame.y)
    put(state.axes[2], frame.z)
    put(state.spin, frame.spin)
    put(state.direction, d)
    put(state.to_rest, log_map(d, outward(frame, vec(link.rest))))
    put(state.drift, cross(frame.spin, d))


@compiled
def root_forces(link: np.ndarray, r: np.ndarray, state: np.ndarray,
                frame: Frame) -> tuple[Vec3, Vec3]:
    """Gravity and inertial force of the root, 1/s^2, at both ends of a step.

    The root follows the cubic through both positions and velocities.
    """
    before, after, gravity = vec(state.velocity), frame.velocity, vec(link.gravity)
    cubic = sub(scale(r.root_move, sub(frame.point, vec(state.point))),
                scale(r.root_speed, add(before, after)))
    return (add_scaled(sub(gravity, cubic), r.root_speed, before),
            add_scaled(add(gravity, cubic), -r.root_speed, after))


@compiled
def step_link(link: np.ndarray, r: np.ndarray, state: np.ndarray, frame: Frame,
              forces: tuple[Vec3, Vec3]) -> None:
    """Advance ``state`` (LINK_STATE) by one step, in place.

    ``r`` (RESPONSE): coefficients of the link's motion over a step of this length; ``frame``: at
    its root at the end of the step; ``forces``: at its start and end, 1/s^2, see root_forces().
    """
    start, end = forces
    d, rate = vec(state.direction), vec(state.rate)
    to_rest, drift = vec(state.to_rest), vec(state.drift)
    axes = state.axes
    local = dot(vec(axes[0]), d), dot(vec(axes[1]), d), dot(vec(axes[2]), d)
    frame_turn = log_map(d, outward(frame, local))
    x = tangential(d, add(
        add(add_scaled(scale(r.x_rest, to_rest), r.x_rate, rate),
            add_scaled(scale(r.x_frame, frame_turn), r.x_drift, drift)),
        add_scaled(scale(r.x_start, start), r.x_end, end)))
    left = sub(add(to_rest, frame_turn), x)
    v = tangential(d, add(
        add(add_scaled(scale(r.v_rest, to_rest), r.v_rate, rate),
            add_scaled(scale(r.v_frame, frame_turn), r.v_drift, drift)),
        add_scaled(scale(r.v_start, start), -r.end_rest, left)))
    d, chord = exp_map(d, x)
    v, left = transported(v, x, chord), transported(left, x, chord)
    set_frame(link, state, frame, d)
    v = add(v, add_scaled(scale(r.end_rest, vec(state.to_rest)), r.end_drift, vec(state.drift)))
    if link.stiffness > 0:
        v = limit_rate(link, r, state, v, left)
    put(state.rate, add_scaled(v, r.end_force, tangential(d, end)))


@compiled
def limit_rate(link: np.ndarray, r: np.ndarray, state: np.ndarray, v: Vec3, left: Vec3) -> Vec3:
    """Return the rate v, after the correction of the spring force, with its part relative to the
    frame scaled down where kinetic and spring energy are more than before that correction.

    Energy is |v|^2 + w |log|^2, relative to the frame; ``left`` is the log map that the model
    gives. If the frame turns about the link by phi in the step, the true log map leads the model's
    by phi, and the true rate lags by phi. Rotating ``left`` by -phi keeps the sum of both energies
    to third order in the step; without it the limit would reduce the order to 1.
    """
    w, d = link.stiffness, vec(state.direction)
    to_rest, drift = vec(state.to_rest), vec(state.drift)
    relative = sub(v, drift)
    left = rotated(left, d, dot(vec(state.spin), d) * (-r.h / 2))
    before = add_scaled(relative, -r.end_rest, sub(to_rest, left))
    whole = dot(before, before) + w * dot(left, left)
    most = max(whole * (1 + ROUNDING) - w * dot(to_rest, to_rest), 0.0)
    share = most / (dot(relative, relative) + LEAST)
    return add_scaled(drift, min(math.sqrt(share), 1.0), relative)


@compiled
def tangential(d: Vec3, v: Vec3) -> Vec3:
    """Component of v orthogonal to the direction d."""
    return add_scaled(v, -dot(d, v), d)


@compiled
def rotated(v: Vec3, d: Vec3, half: float) -> Vec3:
    """Rotate a tangent v about d by 2 ``half`` rad, to third order; keeps its length."""
    share = 1 / (1 + half * half)
    return add_scaled(scale((1 - half * half) * share, v), 2 * half * share, cross(d, v))
