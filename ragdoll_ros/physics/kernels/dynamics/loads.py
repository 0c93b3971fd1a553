"""What acts on bodies beside gravity and contacts: wrenches and springs, as records."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import Vec3, quat_rotate, vec
from .kinematics import Kinematics, inertial_frame

LOAD = np.dtype([('bone', np.int64), ('local', np.int64), ('force', float, 3),
                 ('torque', float, 3), ('point', float, 3)], align=True)
"""A wrench on a bone of the cluster: force, N, at ``point``, m, along the bone's axes from its
center of mass, and torque, N m; along the bone's axes if ``local``, else along the world's."""

GRAB, LINEAR_DRIVE, ANGULAR_DRIVE, JOINT_SPRING = 0, 1, 2, 3
"""Kinds of springs: a grab pulls a point of a body towards a target; a drive damps a body's linear
or angular velocity towards a target velocity; a joint spring holds one axis of a joint."""

SPRING = np.dtype([
    ('kind', np.int64), ('body', np.int64), ('axis', np.int64), ('saturated', np.int64),
    ('point', float, 3), ('target', float, 3), ('target_velocity', float, 3),
    ('target_angle', float), ('time_left', float), ('stiffness', float), ('damping', float),
    ('max_force', float), ('saturated_force', float, 3), ('mobility', float)], align=True)
"""A spring on a body of the tree. ``point``: along the body's axes from its center of mass, m.
``target``, m, moves with ``target_velocity``, m/s (of an angular drive rad/s), for ``time_left`` s.
``axis``, ``target_angle``, rad: of a joint spring, whose angle moves with the first entry of
``target_velocity``, rad/s. stiffness N/m or N m/rad, damping N s/m or
N m s/rad, max_force N or N m. ``saturated``: 1 if it exerts the constant ``saturated_force`` (its
first entry for a joint spring) in this step. ``mobility``: the largest inverse inertia that it can
act on, 1/kg or 1/(kg m^2)."""


@compiled
def load_in_world(body: np.record, kin: Kinematics, i: int,
                  load: np.record) -> tuple[Vec3, Vec3]:
    """Force, N, and torque, N m, of a load on body i, along the world's axes; the torque without
    the moment of the force.
    """
    force, torque = vec(load.force), vec(load.torque)
    if load.local == 0:
        return force, torque
    frame = inertial_frame(body, kin, i)
    return quat_rotate(frame, force), quat_rotate(frame, torque)
