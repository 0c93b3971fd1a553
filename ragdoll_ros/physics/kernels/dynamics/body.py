"""The kinematic tree as compiled code sees it: one record for each body, parents first."""
from __future__ import annotations

import numpy as np

BODY = np.dtype([
    ('bone', np.int64), ('parent', np.int64), ('has_quaternion', np.int64),
    ('dof_count', np.int64), ('q_start', np.int64), ('v_start', np.int64), ('mass', float),
    ('inertia', float, 3), ('inertial_orientation', float, 4), ('parent_to_joint', float, 3),
    ('joint_to_com', float, 3), ('joint_axes', float, (3, 3)), ('joint_damping', float),
    ('kinematic', np.int64), ('has_passive', np.int64), ('passive_torques', float, (3, 2)),
    ('passive_angles', float, (3, 2)), ('passive_rates', float, (3, 2))],
    align=True)
"""A body and the joint to its parent.

bone: index in the scene. parent: record of the parent, -1 for a root. has_quaternion: 1 if q holds
a quaternion (roots, and ball joints without limits). dof_count: degrees of freedom of the joint,
0 for a root, which has six. q_start, v_start: where its coordinates begin in q and v. mass, kg;
inertia: principal moments about the center of mass, kg m^2; inertial_orientation: principal axes
relative to the doll's axes (x, y, z, w). parent_to_joint, joint_to_com: from the parent's center of
mass to the joint and on to the body's own, m; joint_axes: rows; all three along the doll's axes in
the bind pose. joint_damping: N m s/rad. kinematic: MOVED, FIXED, or 0 for what forces move."""

MOVED, FIXED = 1, 2
"""Kinds of kinematic bodies, which have infinite inertia (as in Box2D). All bodies of a doll are
MOVED at constant velocities; FIXED is a root alone, which stays where it is while forces move the
bodies that hang on it."""

WORLD = -1
"""In place of the index of a body: what never moves, the ground and static geoms."""
