"""Contact of the mass at a link's tip with colliders: inelastic, without friction.

The tip at p = r + l d may not be nearer to the axis of a capsule (or the center of a sphere) than
the radius R. With q the axis' nearest point, D u = q - r and |u| = 1, it is inside while the angle
between d and u is below that of cos = (D^2 + l^2 - R^2)/(2 D l). Where no d is outside there is no
contact.

A tip that touches at the start of a step and would be inside at its end gets a constant force along
the normal at the start that lets it end on the surface, and the surface's speed along the normal
there: the method of Shake and Rattle (Hairer, Lubich and Wanner, Geometric Numerical Integration,
2006, VII.1.4), with one step's order. A tip that arrives loses its speed towards the surface, at an
instant that collide.py finds.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.transcendental import arc
from ..maths.vectors import (Vec3, add, add_scaled, cross, dot, norm, put, quat_rotate, scale, sub,
                             vec)
from .bone_path import orientation_of
from .link_step import set_frame, step_link, tangential
from .links import Around, Frame
from .sphere import exp_map

TOUCH = 2e-5
"""m: gap up to which a tip touches a collider."""

ACCURACY = 1e-7
"""m: of a tip that is held on a surface."""

SWEEPS = 12
"""Most corrections of the forces of all colliders that a tip touches."""

LEAST_LEVER = 0.01
"""Least ratio of the tip's speed along a normal to its speed: a rod along it cannot yield."""

LEAST_SHARE = 0.3
"""Least cosine between the normals at both ends of a step."""

FREE = 1e30
"""m: gap to a collider that no direction of a link avoids."""


@compiled
def copy_state(source: np.ndarray, target: np.ndarray) -> None:
    """Copy a link's state."""
    put(target.point, vec(source.point))
    put(target.velocity, vec(source.velocity))
    for k in range(3):
        put(target.axes[k], vec(source.axes[k]))
    put(target.spin, vec(source.spin))
    put(target.direction, vec(source.direction))
    put(target.rate, vec(source.rate))
    put(target.to_rest, vec(source.to_rest))
    put(target.drift, vec(source.drift))


@compiled
def tip_contact(link: np.ndarray, state: np.ndarray, collider: np.ndarray,
                bone: np.ndarray) -> tuple[float, Vec3, float, float, float]:
    """Contact of the mass at a link's tip with a collider on a ``bone``, whose state is (13,).

    Returns the gap, m; the unit tangent at the link's direction d along which d turns away from the
    collider; the angle, rad, by which d must turn along it to reach the surface, negative outside;
    the derivative of the gap by that angle, m/rad; and the rate of the gap, m/s. The gap is FREE,
    the tangent of any length and the rest zero, where no direction is clear of the collider.
    """
    d, root, length = vec(state.direction), vec(state.point), link.length
    tip = add_scaled(root, length, d)
    turn = orientation_of(bone)
    start = quat_rotate(turn, vec(collider.start))
    axis = sub(quat_rotate(turn, vec(collider.end)), start)
    square = dot(axis, axis)
    part = dot(sub(sub(tip, vec(bone)), start), axis) / square if square > 0 else 0.0
    arm = add_scaled(start, min(max(part, 0.0), 1.0), axis)
    nearest = add(vec(bone), arm)
    radius = collider.radius + link.radius
    away = sub(nearest, root)
    distance = norm(away)
    cos = (distance * distance + length * length - radius * radius) / (
        2 * distance * length + 1e-300)
    out = scale(-1 / (distance + 1e-300), tangential(d, away))
    sin = norm(out)
    apart = norm(sub(tip, nearest))
    if cos <= -1:
        return FREE, out, 0.0, 0.0, 0.0
    if sin > 1e-9:
        out = scale(1 / sin, out)
    else:  # the rod is on a line through the nearest point: any way out
        out = tangential(d, (1.0, 0.0, 0.0) if abs(d[0]) < 0.6 else (0.0, 1.0, 0.0))
        out = scale(1 / norm(out), out)
    wanted = arc(math.sqrt(max(1 - cos * cos, 0.0)), min(cos, 1.0))
    angle = wanted - arc(sin, dot(d, away) / (distance + 1e-300))
    lever = length * distance * sin / (apart + 1e-300)
    surface = add(vec(bone[7:]), cross(vec(bone[10:]), arm))
    moving = sub(add_scaled(vec(state.velocity), length, vec(state.rate)), surface)
    speed = dot(sub(tip, nearest), moving) / (apart + 1e-300)
    return apart - radius, out, angle, lever, speed


@compiled
def stop_at(link: np.ndarray, state: np.ndarray, collider: np.ndarray, bone: np.ndarray,
            is_held: bool) -> None:
    """Remove a touching tip's speed into a collider, and if ``is_held``, also its speed out of it.
    A link that is almost along the normal keeps its rate.
    """
    gap, out, _, lever, speed = tip_contact(link, state, collider, bone)
    if gap < TOUCH and lever > LEAST_LEVER * link.length and (speed < 0 or is_held):
        put(state.rate, add_scaled(vec(state.rate), -speed / lever, out))


@compiled
def move_out(link: np.ndarray, state: np.ndarray, frame: Frame, around: Around) -> None:
    """Turn a link until its tip is outside of the colliders where they are after the step."""
    colliders, bones = around.colliders, around.after
    for _ in range(SWEEPS):
        is_inside = False
        for k in range(around.first, around.until):
            gap, out, angle, _, _ = tip_contact(link, state, colliders[k], bones[colliders[k].bone])
            if gap < -ACCURACY:
                is_inside = True
                d, _ = exp_map(vec(state.direction), scale(angle, out))
                put(state.rate, tangential(d, vec(state.rate)))
                set_frame(link, state, frame, d)
        if not is_inside:
            return


@compiled
def step_touching(link: np.ndarray, r: np.ndarray, before: np.ndarray, state: np.ndarray,
                  frame: Frame, forces: tuple[Vec3, Vec3], around: Around) -> float:
    """Integrate a link over one step; ``state`` equals ``before``. The tip is held outside of the
    colliders that it touches in ``before``, or of all if around.holds_all. Returns the least gap,
    m, after the step without these holding forces, to the other colliders and to those that the tip
    has left.
    """
    colliders, bones_before, bones = around.colliders, around.before, around.after
    step_link(link, r, state, frame, forces)
    least, is_inside = FREE, False
    for k in range(around.first, around.until):
        gap = tip_contact(link, state, colliders[k], bones[colliders[k].bone])[0]
        if gap < TOUCH:
            was = tip_contact(link, before, colliders[k], bones_before[colliders[k].bone])[0]
            if was <= TOUCH or around.holds_all:
                is_inside = is_inside or gap < -ACCURACY
                continue
        least = min(least, gap)
    if is_inside:
        hold(link, r, before, state, frame, forces, around)
    else:
        for k in range(around.first, around.until):
            stop_at(link, state, colliders[k], bones[colliders[k].bone], False)
    return least


@compiled
def hold(link: np.ndarray, r: np.ndarray, before: np.ndarray, state: np.ndarray, frame: Frame,
         forces: tuple[Vec3, Vec3], around: Around) -> None:
    """Repeat a step, with constant forces of the colliders that hold the tip, along their normals
    at the start, so that the tip ends on their surfaces; then stop it there. See
    step_touching().
    """
    colliders, bones_before, bones = around.colliders, around.before, around.after
    first, until = around.first, around.until
    held = np.zeros(until - first)
    push = (0.0, 0.0, 0.0)
    for _ in range(SWEEPS):
        is_done = True
        for k in range(first, until):
            collider = colliders[k]
            gap, out, angle, _, _ = tip_contact(link, state, collider, bones[collider.bone])
            if gap >= -ACCURACY and (held[k - first] == 0 or gap <= ACCURACY):
                continue
            was, normal, _, _, _ = tip_contact(link, before, collider, bones_before[collider.bone])
            if was > TOUCH and not around.holds_all:
                continue
            share = dot(normal, out)
            more = angle / ((r.x_start + r.x_end) * max(share, LEAST_SHARE))
            more = max(more, -held[k - first])
            if more == 0:
                continue
            is_done = False
            held[k - first] += more
            push = (0.0, 0.0, 0.0)
            for other in range(first, until):
                if held[other - first] > 0:
                    _, normal, _, _, _ = tip_contact(link, before, colliders[other],
                                                     bones_before[colliders[other].bone])
                    push = add_scaled(push, held[other - first], normal)
            copy_state(before, state)
            step_link(link, r, state, frame, (add(forces[0], push), add(forces[1], push)))
        if is_done:
            break
    # The second half of the force is along the normal at the end: what stops the tip there.
    put(state.rate, add_scaled(vec(state.rate), -r.end_force,
                               tangential(vec(state.direction), push)))
    move_out(link, state, frame, around)
    for _ in range(SWEEPS):
        for k in range(first, until):
            stop_at(link, state, colliders[k], bones[colliders[k].bone], held[k - first] > 0)
