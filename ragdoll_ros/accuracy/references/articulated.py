"""Motion of a doll or a rigid body in flight from the equations of motion.

In generalised coordinates of the kinematic tree, so that joints have no gaps. With J the Jacobians
of all centres of mass, Jw of all angular velocities, and a0, alpha0 the bias accelerations at
dv/dt = 0 (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 3):

    sum_i [m J'J + Jw' I Jw] dv/dt
        = sum_i [J' (m g + f - m a0) + Jw' (tau - I alpha0 - w x I w)] - c v

integrated by DOP853 (Hairer, Norsett, Wanner) at 1e-12, without limits and contacts. The
layout of coordinates is that of model/coordinates.py, joints depth first.
"""
from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.ragdoll import Joint, Ragdoll, joint_axes
from ...model.state import State
from ..trajectory import Trajectory
from .integration import integrate

Wrenches = Callable[[float, State], tuple[np.ndarray, np.ndarray]]
"""Forces (n, 3) N and torques (n, 3) N m on the centres of mass, world axes, by time and state."""


@dataclass(frozen=True)
class _Kinematics:
    centres: np.ndarray  # (n, 3)
    rotations: np.ndarray  # (n, 3, 3), from the bind pose
    omegas: np.ndarray  # (n, 3)
    jv: np.ndarray  # (n, 3, nv)
    jw: np.ndarray  # (n, 3, nv)
    bias_linear: np.ndarray  # (n, 3) bias accelerations: of the centres at dv/dt = 0
    bias_angular: np.ndarray  # (n, 3) the same, angular


class Articulated:
    """Equations of motion of one doll in ``gravity`` m/s^2."""

    def __init__(self, doll: Ragdoll, gravity: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        self.doll = doll
        self.gravity = np.array(gravity, float)
        self._index = {bone.name: i for i, bone in enumerate(doll.bones)}
        self._masses = np.array([bone.mass for bone in doll.bones])
        self._binds = np.array([rotation.matrix(bone.orientation) for bone in doll.bones])
        self._inertias = np.array([bind @ np.diag(bone.inertia) @ bind.T for bone, bind
                                   in zip(doll.bones, self._binds, strict=True)])
        self._q_of, self._v_of, self.nq, self.nv = _layout(doll)
        self._damping = np.zeros(self.nv)
        for joint in doll.joints:
            self._damping[self._v_of[joint.child]] = joint.damping
        self._ordered = [self._prepared(joint) for joint in doll.joints_depth_first()]

    def bind(self, position: Sequence[float] = (0, 0, 0),
             orientation: Sequence[float] = rotation.IDENTITY) -> np.ndarray:
        """Coordinates q (nq,) of the bind pose, the doll's frame posed at ``position`` m."""
        q = np.zeros(self.nq)
        root = self.doll.root
        q[:3] = position + rotation.rotate(np.array(orientation), root.position)
        q[3:7] = rotation.multiply(orientation, root.orientation)
        for joint in self.doll.joints:
            if joint.is_free_ball:
                q[self._q_of[joint.child]] = rotation.IDENTITY
        return q

    def state(self, q: np.ndarray, v: np.ndarray) -> State:
        """Poses and velocities of all bones."""
        kin = self._kinematics(q, v)
        rotations = np.array([rotation.from_matrix(rotated @ bind)
                              for rotated, bind in zip(kin.rotations, self._binds, strict=True)])
        return State(kin.centres, rotations, kin.jv @ v, kin.omegas)

    def acceleration(self, q: np.ndarray, v: np.ndarray, forces: np.ndarray | None = None,
                     torques: np.ndarray | None = None) -> np.ndarray:
        """dv/dt (nv,) under forces (n, 3) N and torques (n, 3) N m at the centres of mass."""
        kin = self._kinematics(q, v)
        inertias = kin.rotations @ self._inertias @ kin.rotations.transpose(0, 2, 1)
        momenta = (inertias @ kin.omegas[..., None])[..., 0]
        force = self._masses[:, None] * (self.gravity - kin.bias_linear)
        torque = -(inertias @ kin.bias_angular[..., None])[..., 0] - np.cross(kin.omegas, momenta)
        if forces is not None:
            force = force + forces
        if torques is not None:
            torque = torque + torques
        nv = self.nv
        flat_v, flat_w = kin.jv.reshape(-1, nv), kin.jw.reshape(-1, nv)
        mass = (flat_v.T @ (self._masses[:, None, None] * kin.jv).reshape(-1, nv)
                + flat_w.T @ (inertias @ kin.jw).reshape(-1, nv))
        return np.linalg.solve(mass, flat_v.T @ force.ravel() + flat_w.T @ torque.ravel()
                               - self._damping * v)

    def trajectory(self, q: np.ndarray, v: np.ndarray, times: Sequence[float],
                   wrenches: Wrenches | None = None, breaks: Sequence[float] = ()) -> Trajectory:
        """Motion from times[0]; ``breaks``, s, are the discontinuities of the wrenches."""
        times = np.asarray(times, float)
        edges = [times[0], *sorted(t for t in breaks if times[0] < t < times[-1]), times[-1]]
        y = np.concatenate([q, v])
        states = {times[0]: self.state(q, v)}
        for begin, end in itertools.pairwise(edges):
            asked = np.unique([begin, *times[(begin < times) & (times <= end)], end])
            derivative = functools.partial(self._derivative, middle=(begin + end) / 2,
                                           wrenches=wrenches)
            rows = integrate(derivative, y, asked)
            for t, row in zip(asked, rows, strict=True):
                states[t] = self.state(row[:self.nq], row[self.nq:])
            y = rows[-1]
        return Trajectory.of(times, [states[t] for t in times])

    def _derivative(self, t: float, y: np.ndarray, middle: float,
                    wrenches: Wrenches | None) -> np.ndarray:
        """Time derivative of (q, v); wrenches, constant between breaks, are those at ``middle``."""
        q, v = y[:self.nq], y[self.nq:]
        loads = wrenches(middle, self.state(q, v)) if wrenches else ()
        rates = np.empty_like(q)
        rates[:3] = v[:3]
        rates[3:7] = _quaternion_rate(q[3:7], v[3:6], outer=True)
        for joint, *_ in self._ordered:
            into, out = self._q_of[joint.child], self._v_of[joint.child]
            rates[into] = _quaternion_rate(q[into], v[out], outer=False) \
                if joint.is_free_ball else v[out]
        return np.concatenate([rates, self.acceleration(q, v, *loads)])

    def _prepared(self, joint: Joint) -> tuple:
        parent, child = self.doll.bone(joint.parent), self.doll.bone(joint.child)
        return (joint, self._index[joint.parent], self._index[joint.child],
                np.subtract(joint.anchor, parent.position),
                np.subtract(child.position, joint.anchor),
                [(axis, _skew(axis), _skew(axis) @ _skew(axis)) for axis in joint_axes(joint)])

    def _kinematics(self, q: np.ndarray, v: np.ndarray) -> _Kinematics:
        """Forward kinematics, from the root to the leaves."""
        n, nv = len(self._masses), self.nv
        centres, omegas = np.zeros((n, 3)), np.zeros((n, 3))
        bias_linear, bias_angular = np.zeros((n, 3)), np.zeros((n, 3))
        rotations, jv, jw = np.zeros((n, 3, 3)), np.zeros((n, 3, nv)), np.zeros((n, 3, nv))
        root = self._index[self.doll.root.name]
        centres[root], omegas[root] = q[:3], v[3:6]
        rotations[root] = rotation.matrix(rotation.normalized(q[3:7])) @ self._binds[root].T
        jv[root, :, :3] = jw[root, :, 3:6] = np.eye(3)
        for joint, parent, child, to_anchor, from_anchor, axes in self._ordered:
            rotated, axis_columns = self._child_rotation(joint, rotations[parent], axes, q)
            rates = v[self._v_of[joint.child]]
            omega, bias = omegas[parent], bias_angular[parent].copy()
            jw[child] = jw[parent]
            jw[child][:, self._v_of[joint.child]] = axis_columns
            if joint.is_free_ball:
                bias += _skew(omega) @ (axis_columns @ rates)
                omega = omega + axis_columns @ rates
            else:
                for axis, rate in zip(axis_columns.T, rates, strict=True):
                    bias += _skew(omega) @ axis * rate
                    omega = omega + axis * rate
            before, after = rotations[parent] @ to_anchor, rotated @ from_anchor
            old, new = _skew(omegas[parent]), _skew(omega)
            centres[child] = centres[parent] + before + after
            jv[child] = jv[parent] - _skew(before) @ jw[parent] - _skew(after) @ jw[child]
            bias_linear[child] = (bias_linear[parent] - _skew(before) @ bias_angular[parent]
                            + old @ (old @ before) - _skew(after) @ bias + new @ (new @ after))
            rotations[child], omegas[child], bias_angular[child] = rotated, omega, bias
        return _Kinematics(centres, rotations, omegas, jv, jw, bias_linear, bias_angular)

    def _child_rotation(self, joint: Joint, parent: np.ndarray, axes: list,
                q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Child's rotation from the bind pose, and the world axes (3, k) of the joint's rates."""
        values = q[self._q_of[joint.child]]
        if joint.is_free_ball:
            frame = np.column_stack([axis for axis, *_ in axes])
            rotated = parent @ frame @ rotation.matrix(rotation.normalized(values)) @ frame.T
            return rotated, rotated @ frame
        rotated, columns = parent, np.empty((3, len(axes)))
        for k, ((axis, cross, square), angle) in enumerate(zip(axes, values, strict=True)):
            columns[:, k] = rotated @ axis
            rotated = rotated + rotated @ (np.sin(angle) * cross + (1 - np.cos(angle)) * square)
        return rotated, columns


def _layout(doll: Ragdoll) -> tuple[dict[str, slice], dict[str, slice], int, int]:
    q_of, v_of, nq, nv = {}, {}, 7, 6
    for joint in doll.joints_depth_first():
        size = 4 if joint.is_free_ball else joint.dof
        q_of[joint.child], v_of[joint.child] = slice(nq, nq + size), slice(nv, nv + joint.dof)
        nq, nv = nq + size, nv + joint.dof
    return q_of, v_of, nq, nv


def _skew(a: np.ndarray) -> np.ndarray:
    """Matrix of the cross product a x."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _quaternion_rate(q: np.ndarray, omega: np.ndarray, outer: bool) -> np.ndarray:
    """dq/dt of a body with angular velocity omega, in the outer frame or in the body's."""
    pure = np.append(omega, 0.0)
    return (rotation.multiply(pure, q) if outer else rotation.multiply(q, pure)) / 2


def torque_free_rotation(inertia: Sequence[float], omega: Sequence[float],
                         times: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Orientations (t, 4) and angular velocities (t, 3) rad/s in body axes, by Euler's equations.

    ``inertia`` are the principal moments, ``omega`` is the initial angular velocity in the
    principal axes, which are the world's at the start.
    """
    moments = np.array(inertia, float)

    def derivative(t: float, y: np.ndarray) -> np.ndarray:
        q, w = y[:4], y[4:]
        turn = rotation.multiply(q, np.append(w, 0.0)) / 2
        return np.concatenate([turn, np.cross(moments * w, w) / moments])

    start = np.concatenate([rotation.IDENTITY, omega])
    rows = integrate(derivative, start, times)
    return rotation.normalized(rows[:, :4]), rows[:, 4:]
