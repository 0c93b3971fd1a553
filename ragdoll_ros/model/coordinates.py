"""Generalised coordinates q and velocities v of all dolls of a scene, and their layout."""
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import errors, rotation
from .ragdoll import Limits, Ragdoll
from .scene import Placement
from .scene_change import SceneChange

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

    def limit_violations(self, q: np.ndarray) -> np.ndarray:
        """Excess (k,) rad of the limited angles over their limits; negative inside."""
        angles = q[self.limited[0]]
        return np.maximum(angles - self.limits[1], self.limits[0] - angles)

    @staticmethod
    def _indices(starts: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
        table = np.array(starts, int).reshape(-1, 2)
        return table[:, :1] + np.arange(4), table[:, 1:] + np.arange(3)


def placed_coordinates(placements: Sequence[Placement],
                       layout: DofLayout | None = None) -> GeneralizedState:
    """Coordinates and velocities of dolls as they are placed: where a simulation starts.
    ``layout``: that of the dolls, if there is one already.
    """
    layout = layout or DofLayout([placement.doll for placement in placements])
    q, v = np.zeros(layout.sizes[0]), np.zeros(layout.sizes[1])
    for index, placement in enumerate(placements):
        pose, velocity = placement.root_motion
        q[layout.root_positions[index]] = pose.position
        q[layout.root_orientations[index]] = pose.orientation
        v[layout.root_velocities[index]] = velocity
        v[layout.root_angular_velocities[index]] = placement.spin
    angles, rates = (np.array([
        getattr(placement, key).get(name, 0.0) for placement in placements
        for joint in placement.doll.joints for name in joint.angle_names])
        for key in ('angles', 'rates'))
    state = GeneralizedState(layout.with_joint_angles(q, angles), v)
    return GeneralizedState(state.q, layout.with_joint_rates(state, rates))


def changed_coordinates(coordinates: GeneralizedState, change: SceneChange) -> GeneralizedState:
    """Coordinates and velocities of the dolls after a change: those of ``coordinates``, which are
    of the dolls before, and new dolls as they are placed.
    """
    before, after = (DofLayout([placement.doll for placement in scene.dolls])
                     for scene in (change.before, change.after))
    placed = placed_coordinates(change.after.dolls)
    for doll, old in enumerate(change.old_dolls):
        if old >= 0:
            placed.q[after.doll_q[doll]] = coordinates.q[before.doll_q[old]]
            placed.v[after.doll_v[doll]] = coordinates.v[before.doll_v[old]]
    return placed
