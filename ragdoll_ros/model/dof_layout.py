"""Generalised coordinates q and velocities v of dolls, and their layout."""
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import errors, rotation
from .ragdoll import Limits, Ragdoll

UNLIMITED: Limits = (-math.inf, math.inf)


@dataclass(frozen=True)
class GeneralizedState:
    """Generalised coordinates and velocities of all dolls, concatenated (MuJoCo's qpos and qvel).

    For each doll ``q`` has the root's position (3) m and orientation (4), then the joints' depth
    first: an angle (rad) for each axis, or for a free ball joint a quaternion (4) from the child's
    to the parent's side of the joint's frame. ``v`` has the root's linear (3) m/s and angular (3)
    rad/s velocity in the world frame, then the joints' rates (rad/s), a free ball joint's three
    along the child's side of the joint's frame.
    """

    q: np.ndarray
    v: np.ndarray


class DofLayout:
    """Indices into q and v, the joints of each doll depth first."""

    def __init__(self, dolls: Sequence[Ragdoll]) -> None:
        bounds: list[Limits] = []
        plain_q: list[int] = []
        plain_v: list[int] = []
        roots: list[tuple[int, int]] = []
        balls: list[tuple[int, int]] = []
        angles: list[int] = []
        rates: list[int] = []
        self._free_angles: list[tuple[slice, slice, slice]] = []
        """Of each free ball joint: its slices of the joint angles, of q and of v."""
        v = 0
        self.doll_q: list[slice] = []
        self.doll_v: list[slice] = []
        """Each doll's slice of q and of v."""
        for doll in dolls:
            q, first_v, at = len(bounds), v, {}
            plain_q += range(q, q + 3)
            plain_v += range(v, v + 3)
            roots.append((q + 3, v + 3))
            bounds += [UNLIMITED] * 7
            v += 6
            for joint in doll.joints_depth_first():
                at[joint.child] = len(bounds), v
                if joint.is_free_ball:
                    balls.append((len(bounds), v))
                    bounds += [UNLIMITED] * 4
                else:
                    plain_q += range(len(bounds), len(bounds) + joint.dof)
                    plain_v += range(v, v + joint.dof)
                    bounds += [pair or UNLIMITED for pair in joint.angle_limits]
                v += joint.dof
            for joint in doll.joints:
                begin, first = at[joint.child]
                if joint.is_free_ball:
                    self._free_angles.append((slice(len(angles), len(angles) + 3),
                                              slice(begin, begin + 4), slice(first, first + 3)))
                angles += range(begin, begin + joint.dof)
                rates += range(first, first + joint.dof)
            self.doll_q.append(slice(q, len(bounds)))
            self.doll_v.append(slice(first_v, v))
        self.sizes = (len(bounds), v)
        """Lengths of q and of v: nq, nv."""
        self._angles, self._rates = np.array(angles, int), np.array(rates, int)
        """(k,) index in q of each joint angle, and in v of its rate, in the order of
        Scene.angle_names."""
        self._scalars = (np.array(plain_q), np.array(plain_v))
        self._quaternions = self._indices(roots + balls)
        self.root_orientations, self.root_angular_velocities = self._indices(roots)
        self.root_positions = self.root_orientations[:, :1] - 3 + np.arange(3)
        """(d, 4) and (d, 3): indices in q of each root's orientation and position."""
        self.root_velocities = self.root_angular_velocities[:, :1] - 3 + np.arange(3)
        """(d, 3) each: indices in v of each root's linear and angular velocity."""
        low, high = np.array(bounds)[plain_q].T
        some = np.isfinite(low) | np.isfinite(high)
        self.limited = (self._scalars[0][some], self._scalars[1][some])
        """Indices in q of the limited angles, and in v of their rates."""
        self.limits = (low[some], high[some])

    @property
    def quaternions(self) -> np.ndarray:
        """(m, 4): indices in q of all quaternions."""
        return self._quaternions[0]

    def normalized(self, q: np.ndarray) -> np.ndarray:
        """A copy of q with unit quaternions."""
        q, at = q.copy(), self._quaternions[0]
        q[at] = rotation.normalized(q[at])
        return q

    def check_orientations(self, q: np.ndarray) -> None:
        """Raise NotUnit for a quaternion of length zero."""
        if (np.linalg.norm(q[self._quaternions[0]], axis=1) < 1e-9).any():
            raise errors.NotUnit('coordinates', 0.0, 'quaternions x, y, z, w, not zero')

    def joint_angles(self, q: np.ndarray) -> np.ndarray:
        """All joint angles (k,) rad in the order of Scene.angle_names; a free ball joint's are
        intrinsic Euler angles x, y, z.
        """
        angles = q[self._angles]
        for own, at, _ in self._free_angles:
            angles[own] = rotation.to_euler_xyz(q[at])
        return angles

    def with_joint_angles(self, q: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """A copy of q with joint angles (k,) rad in the order of Scene.angle_names."""
        q = q.copy()
        free = np.ones(len(angles), bool)
        for own, at, _ in self._free_angles:
            free[own] = False
            q[at] = rotation.from_euler_xyz(*angles[own])
        q[self._angles[free]] = angles[free]
        return q

    def with_joint_rates(self, coordinates: GeneralizedState, rates: np.ndarray) -> np.ndarray:
        """A copy of the velocities v with joint rates (k,) rad/s: the inverse of joint_rates()."""
        v = coordinates.v.copy()
        v[self._rates] = rates
        for own, at, spin in self._free_angles:
            v[spin] = rotation.euler_xyz_spin(rotation.to_euler_xyz(coordinates.q[at]), rates[own])
        return v

    def joint_rates(self, coordinates: GeneralizedState) -> np.ndarray:
        """Time derivatives (k,) rad/s of joint_angles()."""
        rates = coordinates.v[self._rates]
        for own, at, spin in self._free_angles:
            rates[own] = rotation.euler_xyz_rates(rotation.to_euler_xyz(coordinates.q[at]),
                                                  coordinates.v[spin])
        return rates

    def derivatives(self, coordinates: GeneralizedState) -> np.ndarray:
        """Time derivatives (nq,) of q at the velocities v: those of quaternions per s."""
        q, v, (at, spins) = coordinates.q, coordinates.v, self._quaternions
        rates = np.zeros_like(q)
        rates[self._scalars[0]] = v[self._scalars[1]]
        # A spin s in the outer axes turns q by (s, 0) q / 2, one in its own axes by q (s, 0) / 2.
        own = np.concatenate([v[spins], np.zeros((len(at), 1))], axis=1)
        roots = len(self.root_orientations)
        rates[at[:roots]] = rotation.multiply(own[:roots], q[at[:roots]]) / 2
        rates[at[roots:]] = rotation.multiply(q[at[roots:]], own[roots:]) / 2
        return rates

    def velocities(self, q: np.ndarray, derivatives: np.ndarray) -> np.ndarray:
        """Velocities v (nv,) at the time derivatives (nq,) of q: the inverse of derivatives()."""
        v, (at, spins) = np.zeros(self.sizes[1]), self._quaternions
        v[self._scalars[1]] = derivatives[self._scalars[0]]
        roots, back = len(self.root_orientations), rotation.inverse(q[at])
        v[spins[:roots]] = 2 * rotation.multiply(derivatives[at[:roots]], back[:roots])[:, :3]
        v[spins[roots:]] = 2 * rotation.multiply(back[roots:], derivatives[at[roots:]])[:, :3]
        return v

    def displacement(self, q: np.ndarray, target: np.ndarray) -> np.ndarray:
        """The velocities (nv,) that, if they are constant, take q to ``target`` in 1 s."""
        v, (at, spins) = np.zeros(self.sizes[1]), self._quaternions
        v[self._scalars[1]] = target[self._scalars[0]] - q[self._scalars[0]]
        roots, back = len(self.root_orientations), rotation.inverse(q[at])
        v[spins[:roots]] = rotation.rotation_vector(
            rotation.multiply(target[at[:roots]], back[:roots]))
        v[spins[roots:]] = rotation.rotation_vector(
            rotation.multiply(back[roots:], target[at[roots:]]))
        return v

    def continued(self, rows: np.ndarray) -> np.ndarray:
        """Coordinates (k, nq) from one instant to the next, without jumps: each quaternion is the
        nearer one of q and -q, and angles without limits go on past a turn.
        """
        rows = rows.copy()
        for at in self._quaternions[0]:
            own = rows[:, at]
            turns = np.sum(own[1:] * own[:-1], axis=1) < 0
            rows[:, at] = own * np.append(1.0, np.where(turns, -1.0, 1.0).cumprod())[:, None]
        free = np.setdiff1d(self._scalars[0], [*self.limited[0], *self.root_positions.ravel()])
        rows[:, free] = np.unwrap(rows[:, free], axis=0)
        return rows

    def limit_violations(self, q: np.ndarray) -> np.ndarray:
        """Excess (k,) rad of the limited angles over their limits; negative inside."""
        angles = q[self.limited[0]]
        return np.maximum(angles - self.limits[1], self.limits[0] - angles)

    @staticmethod
    def _indices(starts: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
        table = np.array(starts, int).reshape(-1, 2)
        return table[:, :1] + np.arange(4), table[:, 1:] + np.arange(3)
