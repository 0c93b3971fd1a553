"""Kinematics of all bodies of a kinematic tree, from the roots to the leaves.

Spatial vectors have their angular part first. They are expressed along the world's axes about the
point where the doll's root is at that instant: no transform from body to body is needed, and no
digits are lost far from the origin. A joint of several axes is a chain of hinges without mass in
between. Velocities v of roots: linear along the world's axes, angular along the root's own.
"""
from __future__ import annotations

import collections
import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.transcendental import sine_and_cosine
from ..maths.vectors import (Quat, Vec3, add, cross, put, quat, quat_mul, quat_rotate,
                             quat_to_matrix, to_local, vec)
from .body import WORLD

Kinematics = collections.namedtuple(
    'Kinematics', 'orientations positions spatial_velocities motion_subspaces inertias '
    'geom_positions geom_rotations')
"""What follows from q and v, for n bodies, nv degrees of freedom and g geoms: orientations (n, 4)
relative to the bind pose; positions (n, 3) of centers of mass from the root, m; spatial_velocities
(n, 6); motion_subspaces (nv, 6) of the joints' axes; inertias (n, 6) about centers of mass along
the world's axes (xx, xy, xz, yy, yz, zz); geom_positions (g, 3) m and geom_rotations (g, 3, 3) in
the world. forward_kinematics() fills the first four, for joints; the others are filled where they
are needed, by rotate_inertias() and place_geoms()."""


def make_kinematics(bodies: int, dofs: int, geoms: int) -> Kinematics:
    """Allocate zeroed arrays for so many bodies, degrees of freedom and geoms."""
    return Kinematics(np.zeros((bodies, 4)), np.zeros((bodies, 3)), np.zeros((bodies, 6)),
                      np.zeros((dofs, 6)), np.zeros((bodies, 6)), np.zeros((geoms, 3)),
                      np.zeros((geoms, 3, 3)))


@compiled
def put_spatial(row: np.ndarray, angular: Vec3, linear: Vec3) -> None:
    """Write a spatial vector to ``row`` (6,)."""
    row[0], row[1], row[2] = angular
    row[3], row[4], row[5] = linear


@compiled
def linear(row: np.ndarray) -> Vec3:
    """Linear part of a spatial vector (6,); vec() gives the angular part."""
    return row[3], row[4], row[5]


@compiled
def root_orientation(q: np.ndarray, start: int) -> Quat:
    """Orientation (x, y, z, w) of a root whose coordinates begin at ``start`` in q."""
    return q[start + 3], q[start + 4], q[start + 5], q[start + 6]


@compiled
def root_position(q: np.ndarray, start: int) -> Vec3:
    """Position, m, of a root whose coordinates begin at ``start`` in q."""
    return q[start], q[start + 1], q[start + 2]


@compiled
def forward_kinematics(tree: np.ndarray, q: np.ndarray, v: np.ndarray, kin: Kinematics) -> None:
    """Write ``kin`` at q and v: orientations, positions, velocities, joints' motion subspaces."""
    orientations, positions = kin.orientations, kin.positions
    velocities, subspaces = kin.spatial_velocities, kin.motion_subspaces
    for i in range(len(tree)):
        body = tree[i]
        at, dof, parent = body.q_start, body.v_start, body.parent
        if parent < 0:
            turn, bind = root_orientation(q, at), body.inertial_orientation
            put_spatial(velocities[i], quat_rotate(turn, (v[dof + 3], v[dof + 4], v[dof + 5])),
                        (v[dof], v[dof + 1], v[dof + 2]))
            put(positions[i], (0.0, 0.0, 0.0))
            put_quat(orientations[i], quat_mul(turn, (-bind[0], -bind[1], -bind[2], bind[3])))
            continue
        turn = quat(orientations[parent])
        joint = add(vec(positions[parent]), quat_rotate(turn, vec(body.parent_to_joint)))
        for k in range(6):
            velocities[i, k] = velocities[parent, k]
        if body.has_quaternion:
            # frame * q * frame^-1: the joint's frame is not that of the doll
            x, y, z = to_local(body.joint_axes, (q[at], q[at + 1], q[at + 2]))
            turn = quat_mul(turn, (x, y, z, q[at + 3]))
        for k in range(body.dof_count):
            local = vec(body.joint_axes[k])
            axis = quat_rotate(turn, local)
            put_spatial(subspaces[dof], axis, cross(joint, axis))
            for j in range(6):
                velocities[i, j] += subspaces[dof, j] * v[dof]
            if not body.has_quaternion:
                sine, cosine = sine_and_cosine(q[at + k] / 2)
                x, y, z = local
                turn = quat_mul(turn, (x * sine, y * sine, z * sine, cosine))
            dof += 1
        put_quat(orientations[i], turn)
        put(positions[i], add(joint, quat_rotate(turn, vec(body.joint_to_com))))


@compiled
def put_quat(row: np.ndarray, q: Quat) -> None:
    """Write a quaternion to ``row`` (4,): x, y, z, w."""
    row[0], row[1], row[2], row[3] = q


@compiled
def update_velocities(tree: np.ndarray, q: np.ndarray, v: np.ndarray, kin: Kinematics) -> None:
    """Write the spatial velocities at v to ``kin``, whose other fields are those of q."""
    velocities = kin.spatial_velocities
    for i in range(len(tree)):
        body, own = tree[i], velocities[i]
        dof = body.v_start
        if body.parent < 0:
            put_spatial(own, quat_rotate(root_orientation(q, body.q_start),
                                         (v[dof + 3], v[dof + 4], v[dof + 5])),
                        (v[dof], v[dof + 1], v[dof + 2]))
        else:
            for j in range(6):
                own[j] = velocities[body.parent, j]
            for k in range(dof, dof + body.dof_count):
                axis, rate = kin.motion_subspaces[k], v[k]
                for j in range(6):
                    own[j] += axis[j] * rate


@compiled
def root_motion_subspaces(tree: np.ndarray, q: np.ndarray, kin: Kinematics) -> None:
    """Write the motion subspaces of the roots' six degrees of freedom at q to ``kin``."""
    for i in range(len(tree)):
        if tree[i].parent < 0:
            turn, dof = root_orientation(q, tree[i].q_start), tree[i].v_start
            for k in range(3):
                x, y, z = 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0
                put_spatial(kin.motion_subspaces[dof + k], (0.0, 0.0, 0.0), (x, y, z))
                put_spatial(kin.motion_subspaces[dof + 3 + k], quat_rotate(turn, (x, y, z)),
                            (0.0, 0.0, 0.0))


@compiled
def inertial_frame(body: np.record, kin: Kinematics, i: int) -> Quat:
    """Orientation (x, y, z, w) in the world of the principal axes of body i."""
    return quat_mul(quat(kin.orientations[i]), quat(body.inertial_orientation))


@compiled
def rotate_inertias(tree: np.ndarray, kin: Kinematics, matrix: np.ndarray) -> None:
    """Write kin.inertias; after forward_kinematics(). ``matrix`` (3, 3): scratch."""
    for i in range(len(tree)):
        body = tree[i]
        quat_to_matrix(inertial_frame(body, kin, i), matrix)
        a, b, c = vec(body.inertia)
        n = 0
        for j in range(3):
            for k in range(j, 3):
                kin.inertias[i, n] = (
                    matrix[j, 0] * a * matrix[k, 0] + matrix[j, 1] * b * matrix[k, 1]
                    + matrix[j, 2] * c * matrix[k, 2])
                n += 1


@compiled
def point_of_body(body: np.record, kin: Kinematics, i: int, point: np.ndarray) -> Vec3:
    """Position, m, from the root, world axes, of a point (3,) of body i that is given from its
    center of mass along its principal axes, m.
    """
    return add(vec(kin.positions[i]), quat_rotate(inertial_frame(body, kin, i), vec(point)))


@compiled
def velocity_at(kin: Kinematics, i: int, arm: Vec3) -> Vec3:
    """Velocity, m/s, of the point of body i that is ``arm`` m from the root."""
    own = kin.spatial_velocities[i]
    return add(linear(own), cross(vec(own), arm))


@compiled
def body_velocity(kin: Kinematics, i: int) -> tuple[Vec3, float]:
    """Velocity, m/s, of the center of mass of body i, and its angular speed, rad/s."""
    own = kin.spatial_velocities[i]
    return (velocity_at(kin, i, vec(kin.positions[i])),
            math.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2))


@compiled
def inertia_times(inertia: np.ndarray, w: Vec3) -> Vec3:
    """Product of an inertia (6,), xx, xy, xz, yy, yz, zz, with a vector."""
    return (inertia[0] * w[0] + inertia[1] * w[1] + inertia[2] * w[2],
            inertia[1] * w[0] + inertia[3] * w[1] + inertia[4] * w[2],
            inertia[2] * w[0] + inertia[4] * w[1] + inertia[5] * w[2])


@compiled
def integrate_positions(tree: np.ndarray, q: np.ndarray, v: np.ndarray, h: float,
                        out: np.ndarray) -> None:
    """Write to ``out`` (nq,) the coordinates after h s at constant v; it may be q itself."""
    for i in range(len(tree)):
        body = tree[i]
        at, dof = body.q_start, body.v_start
        if body.parent < 0:
            for k in range(3):
                out[at + k] = q[at + k] + h * v[dof + k]
            at, dof = at + 3, dof + 3
        if body.has_quaternion:
            a, b, c = v[dof] * h, v[dof + 1] * h, v[dof + 2] * h
            angle = math.sqrt(a * a + b * b + c * c)
            sine, cosine = sine_and_cosine(angle / 2)
            share = 0.5 - angle * angle / 48 if angle < 1e-3 else sine / angle
            x, y, z, w = quat_mul(quat(q[at:at + 4]), (a * share, b * share, c * share, cosine))
            n = math.sqrt(x * x + y * y + z * z + w * w)
            put_quat(out[at:at + 4], (x / n, y / n, z / n, w / n))
        else:
            for k in range(body.dof_count):
                out[at + k] = q[at + k] + h * v[dof + k]


@compiled
def normalize(tree: np.ndarray, q: np.ndarray) -> None:
    """Normalize all quaternions in q."""
    for i in range(len(tree)):
        if tree[i].has_quaternion:
            at = tree[i].q_start + (3 if tree[i].parent < 0 else 0)
            size = math.sqrt(q[at] ** 2 + q[at + 1] ** 2 + q[at + 2] ** 2 + q[at + 3] ** 2)
            for k in range(at, at + 4):
                q[k] /= size


@compiled
def place_geoms(tree: np.ndarray, body_root: np.ndarray, geoms: np.ndarray, q: np.ndarray,
                kin: Kinematics) -> None:
    """Write kin.geom_positions and kin.geom_rotations; after forward_kinematics() at q."""
    for k in range(len(geoms)):
        geom = geoms[k]
        i = geom.body
        if i == WORLD:
            put(kin.geom_positions[k], vec(geom.position))
            quat_to_matrix(quat(geom.orientation), kin.geom_rotations[k])
            continue
        turn, root = quat(kin.orientations[i]), root_position(q, tree[body_root[i]].q_start)
        put(kin.geom_positions[k], add(add(root, vec(kin.positions[i])),
                                       quat_rotate(turn, vec(geom.position))))
        quat_to_matrix(quat_mul(turn, quat(geom.orientation)), kin.geom_rotations[k])
