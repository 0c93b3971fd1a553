"""The chains of a scene as compiled code sees them: one record for each link, roots first.

The equation of motion of a link of unit direction d, world frame:

    d'' = -|d'|^2 d + P [ w log_map(d, n) - c (d' - spin x d) + (share g - r'')/reach ]

P projects on the tangent plane at d; n is the rest direction, and spin the angular velocity of the
frame in which it is fixed; r is the link's root; log is the logarithm map of the sphere
(sphere.py); w = k/J, c the damping. See physics/swing/chains.py for J and reach.
"""
from __future__ import annotations

import collections

import numpy as np

LINK = np.dtype([
    ('bone', np.int64), ('parent', np.int64), ('root', float, 3), ('rest', float, 3),
    ('length', float), ('reach', float), ('stiffness', float), ('damping', float),
    ('gravity', float, 3), ('radius', float)], align=True)
"""Constants of a link. bone: its row among the bones that carry swings. parent: the link that it
hangs on, always the one before it, or -1 for the first of a chain. root: attachment of the first
link in its bone's frame, m. rest: unit rest direction in the frame at its root. length, m; reach:
length of the simple pendulum of the same period, m. stiffness w, 1/s^2; damping c, 1/s. gravity,
1/s^2: the scene's, times the swing's share, over reach. radius, m: of its mass, for colliders."""

COLLIDER = np.dtype([('bone', np.int64), ('start', float, 3), ('end', float, 3), ('radius', float)],
                    align=True)
"""A capsule on a bone: its row among the bones that carry swings or colliders, and the ends of its
axis in its frame, m; equal for a sphere. radius, m."""

LINK_STATE = np.dtype([
    ('point', float, 3), ('velocity', float, 3), ('axes', float, (3, 3)), ('spin', float, 3),
    ('direction', float, 3), ('rate', float, 3), ('to_rest', float, 3), ('drift', float, 3)],
    align=True)
"""State of a link at one time, world frame. Of the frame at its root: point, m, and its velocity,
m/s; axes: rows; spin: angular velocity, rad/s. direction: unit vector from root to mass; rate: its
derivative, 1/s. to_rest: log map of the rest direction at the direction, rad; drift: rate of a
direction that is fixed in the frame at the root, 1/s."""

RESPONSE = np.dtype([(name, float) for name in (
    'h', 'x_rest', 'x_rate', 'x_frame', 'x_drift', 'x_start', 'x_end', 'v_rest', 'v_rate',
    'v_frame', 'v_drift', 'v_start', 'end_rest', 'end_drift', 'end_force', 'root_move',
    'root_speed', 'largest_square')], align=True)
"""Coefficients of a link's step of ``h`` s: of its turn x, its rate v, and the correction at the
end. They are the damped oscillator's about the target to_rest + y(t), y the parabola with y(0) = 0,
y'(0) = drift, y(h) = the turn of a direction that is fixed in the frame. root_move, 1/(m s^2), and
root_speed, 1/(m s): of the inertial force of its root's motion. largest_square, 1/s^4: of a force
under which the step is not divided."""

Chains = collections.namedtuple(
    'Chains', 'links starts ends responses part_responses roots colliders firsts lasts before')
"""The m links of c chains. ``links`` (m,) LINK, in the scene's order; ``starts`` (c,) and ``ends``
(c,): first link of each chain, and the one after its last. ``responses`` (m,) to a step of the
grid. Scratch: ``part_responses`` (m,) to other steps; ``roots`` (b, 13) states of the bones that
carry swings or colliders. ``colliders`` COLLIDER, chain by chain, of each from ``firsts`` (c,) to
``lasts`` (c,), as starts and ends; scratch for them: ``before`` (m,) LINK_STATE."""

Around = collections.namedtuple('Around', 'colliders first until before after holds_all')
"""What is around a chain in a step: ``colliders`` COLLIDER, its own from ``first`` to ``until``;
states (b, 13) of the bones ``before`` and ``after`` the step; whether all colliders hold tips
outside (``holds_all``), or those that they touch."""

Frame = collections.namedtuple('Frame', 'point velocity x y z spin')
"""A frame, world: its origin, m, and velocity, m/s; its axes; its angular velocity, rad/s."""
