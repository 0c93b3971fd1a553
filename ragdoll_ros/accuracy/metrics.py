"""Metrics of a trajectory: energy, momentum, joint gaps, limit overshoot, penetration, settling.

Computed from poses and velocities of the bones alone, in the same way for every method, without
code of the simulation. Arrays run over t instants and n bones.
"""
import math

import numpy as np

from ..model import rotation
from ..model.ragdoll import Joint
from ..model.scene import Placement, Scene
from .cases.trial import Trial
from .trajectory import Trajectory

JointEnd = tuple[int, np.ndarray, np.ndarray]
"""A bone at a joint: its index, the anchor (m) in the bone's frame, and the quaternion from the
bone's axes to the doll's."""

REST_SPEED = 0.01
"""m/s: a trajectory has settled when all bones stay slower."""

RECOVERED = math.radians(0.2)
"""Overshoot, rad, below which a joint that starts past its limit counts as recovered."""


class Metrics:
    """Metrics of trajectories of one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._masses = np.array([bone.mass for bone in scene.bones])
        self._inertias = np.array([bone.inertia for bone in scene.bones])
        self._gravity = np.array(scene.gravity)
        self._joints = [(joint, [self._end(placement, name, joint.anchor)
                                 for name in (joint.parent, joint.child)])
                        for placement in scene.dolls for joint in placement.doll.joints]

    def kinetic_energy(self, trajectory: Trajectory) -> np.ndarray:
        """Kinetic energy (t,) J."""
        linear, body = trajectory.linear_velocities, _body_rates(trajectory)
        return (np.einsum('n,tnd,tnd->t', self._masses, linear, linear)
                + np.einsum('nd,tnd,tnd->t', self._inertias, body, body)) / 2

    def energy(self, trajectory: Trajectory) -> np.ndarray:
        """Kinetic and potential energy (t,) J. Zero is the height of the ground's point nearest to
        the origin, or of the origin.
        """
        zero = np.zeros(3)
        if self.scene.ground is not None:
            zero = np.array(self.scene.ground.normal) * self.scene.ground.offset
        height = -np.einsum('n,tnd,d->t', self._masses, trajectory.positions - zero, self._gravity)
        return self.kinetic_energy(trajectory) + height

    def momentum(self, trajectory: Trajectory) -> np.ndarray:
        """Momentum (t, 3) N s."""
        return np.einsum('n,tnd->td', self._masses, trajectory.linear_velocities)

    def angular_momentum(self, trajectory: Trajectory) -> np.ndarray:
        """Angular momentum (t, 3) N m s about the centre of mass of all bones."""
        return sum(self._angular_momenta(trajectory)).sum(axis=1)

    def _angular_momenta(self, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
        """Orbital and spin angular momenta of the bones, (t, n, 3) N m s each."""
        centre = np.einsum('n,tnd->td', self._masses, trajectory.positions) / self._masses.sum()
        arms = trajectory.positions - centre[:, None]
        orbital = np.cross(arms, self._masses[:, None] * trajectory.linear_velocities)
        own = rotation.rotate(trajectory.orientations, self._inertias * _body_rates(trajectory))
        return orbital, own

    def work(self, trial: Trial, trajectory: Trajectory) -> np.ndarray:
        """Cumulative work (t,) J of the pushes.

        Force times displacement is exact, as the force is constant within a tick. The integral of
        the angular velocity w over a tick of h s is the rotation vector plus h^2 / 12 w_start x
        w_end (Magnus series).
        """
        work = np.zeros(len(trajectory.times))
        for push in trial.pushes:
            bone = self.scene.bone_index(push.bone)
            middle = (trajectory.times[1:] + trajectory.times[:-1]) / 2
            acts = (push.start <= middle) & (middle < push.start + push.duration)
            place = trajectory.positions[:, bone] + rotation.rotate(
                trajectory.orientations[:, bone], np.array(push.point))
            omegas = trajectory.angular_velocities[:, bone]
            orientations = trajectory.orientations[:, bone]
            swept = rotation.rotation_vector(rotation.multiply(
                orientations[1:], rotation.inverse(orientations[:-1])))
            swept += (np.diff(trajectory.times)[:, None] ** 2 / 12
                      * np.cross(omegas[:-1], omegas[1:]))
            gained = np.diff(place, axis=0) @ push.force + swept @ push.torque
            work[1:] += np.cumsum(gained * acts)
        return work

    def energy_excess(self, trial: Trial, trajectory: Trajectory, released: float = 0.0) -> float:
        """Energy gain: the largest rise of E - W above its running minimum, less ``released``, over
        the running maximum of E0 + ``released`` + W.

        ``released``, J, is energy that the start itself may release. NaN if that maximum never is >
        0; infinity if a share is not finite.
        """
        energy, work = self.energy(trajectory), self.work(trial, trajectory)
        own = np.maximum.accumulate(energy[0] + released + work)
        if not own[-1] > 0:
            return math.nan
        left = energy - work
        risen = left - np.minimum.accumulate(left) - released
        with np.errstate(invalid='ignore', divide='ignore'):
            shares = np.where(own > 0, risen / own, 0.0)
        return max(0.0, float(shares.max())) if np.isfinite(shares).all() else math.inf

    def momentum_drift(self, trial: Trial, trajectory: Trajectory) -> float:
        """Largest momentum not accounted for by forces, over the largest sum of m |v|."""
        expected = self._masses.sum() * self._gravity * trajectory.times[:, None]
        for push in trial.pushes:
            acted = np.clip(trajectory.times - push.start, 0, push.duration)
            expected = expected + acted[:, None] * push.force
        momentum = self.momentum(trajectory)
        scale = np.einsum('n,tn->t', self._masses,
                          np.linalg.norm(trajectory.linear_velocities, axis=-1)).max()
        return _share(np.abs(momentum - momentum[0] - expected).max(), scale)

    def angular_momentum_drift(self, trajectory: Trajectory) -> float:
        """Largest change of angular momentum about the centre of mass, over the largest sum of |L|
        of the bones' orbital and spin parts.
        """
        total = self.angular_momentum(trajectory)
        scale = sum(np.linalg.norm(part, axis=-1)
                    for part in self._angular_momenta(trajectory)).sum(axis=1).max()
        return _share(np.abs(total - total[0]).max(), scale)

    def joint_gap(self, trajectory: Trajectory) -> float:
        """Largest distance, m, between the two anchors of a joint."""
        worst = 0.0
        for _, ends in self._joints:
            parent, child = (trajectory.positions[:, bone]
                             + rotation.rotate(trajectory.orientations[:, bone], arm)
                             for bone, arm, _ in ends)
            worst = max(worst, float(np.linalg.norm(parent - child, axis=-1).max()))
        return worst

    def joint_angles(self, trajectory: Trajectory) -> np.ndarray:
        """Joint angles (t, angles) rad in the order of Scene.angle_names, from the poses alone."""
        columns = []
        for joint, ends in self._joints:
            parent, child = (rotation.multiply(trajectory.orientations[:, bone], back)
                             for bone, _, back in ends)
            relative = rotation.matrix(rotation.multiply(rotation.inverse(parent), child))
            columns += _angles(joint, relative)
        return np.stack(columns, axis=-1) if columns else np.zeros((len(trajectory.times), 0))

    def overshoot(self, trajectory: Trajectory) -> float:
        """Largest angle past a joint limit, rad; 0 if none is passed."""
        return float(self.overshoots(trajectory).max())

    def overshoots(self, trajectory: Trajectory) -> np.ndarray:
        """Largest angle past a joint limit at each instant, (t,) rad; 0 if none is passed."""
        limits = [pair or (-math.inf, math.inf) for joint, _ in self._joints
                  for pair in joint.angle_limits]
        if not limits:
            return np.zeros(len(trajectory.times))
        lower, upper = np.array(limits).T
        angles = self.joint_angles(trajectory)
        return np.maximum(angles - upper, lower - angles).max(axis=1).clip(min=0.0)

    def after_limit_recovery(self, trajectory: Trajectory) -> Trajectory:
        """The part from the first instant at which no joint is past its limit by more than
        RECOVERED; all, if there is none.
        """
        past = self.overshoots(trajectory)
        inside = past <= RECOVERED
        back = int(np.argmax(inside)) if not inside[0] and inside.any() else 0
        return trajectory.part(slice(back, None))

    def penetration(self, trajectory: Trajectory) -> float:
        """Largest penetration of any bone into the ground, m; 0 if none."""
        ground = self.scene.ground
        if ground is None:
            return 0.0
        normal, deepest = np.array(ground.normal), 0.0
        for index, bone in enumerate(self.scene.bones):
            inward = rotation.rotate(rotation.inverse(trajectory.orientations[:, index]), -normal)
            height = trajectory.positions[:, index] @ normal - ground.offset
            deepest = max(deepest, float((bone.shape.support(inward) - height).max()))
        return deepest

    def settling_time(self, trajectory: Trajectory) -> float:
        """Time, s, after which every bone stays slower than REST_SPEED; infinity if never."""
        speeds = np.linalg.norm(trajectory.linear_velocities, axis=-1).max(axis=1)
        fast = np.flatnonzero(~(speeds < REST_SPEED))
        if not len(fast):
            return 0.0
        return float(trajectory.times[fast[-1] + 1]) if fast[-1] + 1 < len(speeds) else math.inf

    def _end(self, placement: Placement, name: str, anchor: tuple[float, float, float]) -> JointEnd:
        bone = placement.doll.bone(name)
        return (self.scene.bone_index(self.scene.qualified(placement, name)),
                bone.pose.apply_inverse(anchor), rotation.inverse(bone.orientation))


def compare(trajectory: Trajectory, truth: Trajectory) -> dict[str, float]:
    """Largest and RMS error of positions (m) and of orientations (rad), over bones and time."""
    apart = np.linalg.norm(trajectory.positions - truth.positions, axis=-1)
    angles = rotation.angle_between(trajectory.orientations, truth.orientations)
    return {'position_worst_m': float(apart.max()), 'position_rms_m': _rms(apart),
            'angle_worst_rad': float(angles.max()), 'angle_rms_rad': _rms(angles)}


def _body_rates(trajectory: Trajectory) -> np.ndarray:
    """Angular velocities (t, n, 3) rad/s in the bones' axes."""
    return rotation.rotate(rotation.inverse(trajectory.orientations), trajectory.angular_velocities)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _share(value: float, scale: float) -> float:
    return float(value / scale) if scale > 0 else 0.0


def _angles(joint: Joint, relative: np.ndarray) -> list[np.ndarray]:
    """Angles of a joint from rotations (t, 3, 3) of the child relative to the parent."""
    if joint.kind == 'fixed':
        return []
    if joint.kind == 'hinge':
        axis = np.array(joint.axes[0])
        across = rotation.matrix(rotation.shortest_arc((0, 0, 1), axis))[:, 0]
        carried = relative @ across
        return [np.arctan2(carried @ np.cross(axis, across), carried @ across)]
    if joint.kind == 'universal':
        first, second = map(np.array, joint.axes)
        carried, back = relative @ second, np.swapaxes(relative, 1, 2) @ first
        return [np.arctan2(carried @ np.cross(first, second), carried @ second),
                np.arctan2(-(back @ np.cross(second, first)), back @ first)]
    frame = rotation.matrix(rotation.shortest_arc((0, 0, 1), np.array(joint.axes[0])))
    r = frame.T @ relative @ frame
    return [np.arctan2(-r[:, 1, 2], r[:, 2, 2]), np.arcsin(np.clip(r[:, 0, 2], -1, 1)),
            np.arctan2(-r[:, 0, 1], r[:, 0, 0])]
