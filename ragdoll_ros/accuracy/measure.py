"""What is measured on a motion: energy, momentum, gaps, overshoot, sinking, settling.

Written apart from mechanics.py, by which the simulation steers itself: the judge brings his own
scales. Everything is taken from poses and velocities of the bones, in the same way for every
method. Arrays run over t instants and n bones.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model import rotation
from ..model.ragdoll import Joint
from ..model.scene import Placement, Scene
from .trajectory import Trajectory
from .trial import Trial

REST_SPEED = 0.01
"""m/s: slower than this, for good, counts as settled."""


@dataclass(frozen=True)
class _Hinge:
    """One joint, ready to be measured on world poses of its two bones."""

    joint: Joint
    parent: int
    child: int
    parent_arm: np.ndarray  # anchor from the parent's centre, parent's shape axes
    child_arm: np.ndarray
    parent_turn: np.ndarray  # from the doll's axes to the bone's, quaternion
    child_turn: np.ndarray


class Measure:
    """Yardsticks of one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._masses = np.array([bone.mass for bone in scene.bones])
        self._inertias = np.array([bone.inertia for bone in scene.bones])
        self._gravity = np.array(scene.gravity)
        self._joints = [self._prepared(placement, joint)
                        for placement in scene.dolls for joint in placement.doll.joints]

    def kinetic(self, moved: Trajectory) -> np.ndarray:
        """Kinetic energy (t,) J."""
        body = rotation.rotate(rotation.inverse(moved.orientations), moved.angular_velocities)
        return (np.einsum('n,tnd,tnd->t', self._masses, moved.linear_velocities,
                          moved.linear_velocities)
                + np.einsum('nd,tnd,tnd->t', self._inertias, body, body)) / 2

    def energy(self, moved: Trajectory) -> np.ndarray:
        """Kinetic energy and that of height (t,) J; height counts from the ground."""
        zero = np.zeros(3)
        if self.scene.ground is not None:
            zero = np.array(self.scene.ground.normal) * self.scene.ground.offset
        height = -np.einsum('n,tnd,d->t', self._masses, moved.positions - zero, self._gravity)
        return self.kinetic(moved) + height

    def momentum(self, moved: Trajectory) -> np.ndarray:
        """Momentum (t, 3) N s."""
        return np.einsum('n,tnd->td', self._masses, moved.linear_velocities)

    def spin(self, moved: Trajectory) -> np.ndarray:
        """Angular momentum (t, 3) N m s about the centre of mass of all bones."""
        centre = np.einsum('n,tnd->td', self._masses, moved.positions) / self._masses.sum()
        arms = moved.positions - centre[:, None]
        body = rotation.rotate(rotation.inverse(moved.orientations), moved.angular_velocities)
        own = rotation.rotate(moved.orientations, self._inertias * body)
        return (np.cross(arms, self._masses[:, None] * moved.linear_velocities) + own).sum(axis=1)

    def work(self, trial: Trial, moved: Trajectory) -> np.ndarray:
        """Work (t,) J that the pushes have done so far.

        Force times way is exact, as the force is steady within a tick. The integral of the
        angular velocity w is the tick's turn plus t^2 / 12 w_start x w_end (Magnus' series).
        """
        work = np.zeros(len(moved.times))
        for push in trial.pushes:
            bone = self.scene.bone_index(push.bone)
            middle = (moved.times[1:] + moved.times[:-1]) / 2
            acts = (push.start <= middle) & (middle < push.start + push.duration)
            place = moved.positions[:, bone] + rotation.rotate(
                moved.orientations[:, bone], np.array(push.point))
            spins, turns = moved.angular_velocities[:, bone], moved.orientations[:, bone]
            swept = rotation.rotation_vector(rotation.multiply(
                turns[1:], rotation.inverse(turns[:-1])))
            swept += np.diff(moved.times)[:, None] ** 2 / 12 * np.cross(spins[:-1], spins[1:])
            gained = np.diff(place, axis=0) @ push.force + swept @ push.torque
            work[1:] += np.cumsum(gained * acts)
        return work

    def excess(self, trial: Trial, moved: Trajectory) -> float:
        """Worst max(E - E0 - W) / max(E0 + W): energy from nothing, as a share of the doll's own.

        NaN where there is no energy to compare it with.
        """
        energy, work = self.energy(moved), self.work(trial, moved)
        own = np.maximum.accumulate(energy[0] + work)
        if not own[-1] > 0:
            return math.nan
        with np.errstate(invalid='ignore', divide='ignore'):
            shares = np.where(own > 0, (energy - energy[0] - work) / own, 0.0)
        return float(shares.max()) if np.isfinite(shares).all() else math.inf

    def momentum_drift(self, trial: Trial, moved: Trajectory) -> float:
        """Worst momentum that no force accounts for, as a share of sum m |v|."""
        expected = self._masses.sum() * self._gravity * moved.times[:, None]
        for push in trial.pushes:
            acted = np.clip(moved.times - push.start, 0, push.duration)
            expected = expected + acted[:, None] * push.force
        momentum = self.momentum(moved)
        scale = np.einsum('n,tn->t', self._masses,
                          np.linalg.norm(moved.linear_velocities, axis=-1)).max()
        return _share(np.abs(momentum - momentum[0] - expected).max(), scale)

    def spin_drift(self, moved: Trajectory) -> float:
        """Worst change of angular momentum about the centre of mass, as a share of sum |L|."""
        spin = self.spin(moved)
        body = rotation.rotate(rotation.inverse(moved.orientations), moved.angular_velocities)
        centre = np.einsum('n,tnd->td', self._masses, moved.positions) / self._masses.sum()
        about = np.cross(moved.positions - centre[:, None],
                         self._masses[:, None] * moved.linear_velocities)
        scale = (np.linalg.norm(about, axis=-1)
                 + np.linalg.norm(self._inertias * body, axis=-1)).sum(axis=1).max()
        return _share(np.abs(spin - spin[0]).max(), scale)

    def gap(self, moved: Trajectory) -> float:
        """Worst distance in m between the two ends of a joint."""
        worst = 0.0
        for hinge in self._joints:
            ends = [moved.positions[:, bone] + rotation.rotate(moved.orientations[:, bone], arm)
                    for bone, arm in ((hinge.parent, hinge.parent_arm),
                                      (hinge.child, hinge.child_arm))]
            worst = max(worst, float(np.linalg.norm(ends[0] - ends[1], axis=-1).max()))
        return worst

    def angles(self, moved: Trajectory) -> np.ndarray:
        """Joint angles (t, angles) rad in the order of Scene.angle_names, from the poses alone."""
        columns = []
        for hinge in self._joints:
            parent = rotation.multiply(moved.orientations[:, hinge.parent], hinge.parent_turn)
            child = rotation.multiply(moved.orientations[:, hinge.child], hinge.child_turn)
            turn = rotation.matrix(rotation.multiply(rotation.inverse(parent), child))
            columns += _angles(hinge.joint, turn)
        return np.stack(columns, axis=-1) if columns else np.zeros((len(moved.times), 0))

    def overshoot(self, moved: Trajectory) -> float:
        """Worst angle in rad past a limit; 0 where none is passed."""
        limits = [pair or (-math.inf, math.inf) for hinge in self._joints
                  for pair in hinge.joint.angle_limits]
        if not limits:
            return 0.0
        lower, upper = np.array(limits).T
        angles = self.angles(moved)
        return float(max(0.0, np.maximum(angles - upper, lower - angles).max()))

    def sinking(self, moved: Trajectory) -> float:
        """Deepest place in m of any bone's lowest point below the ground; 0 above it."""
        ground = self.scene.ground
        if ground is None:
            return 0.0
        normal, deepest = np.array(ground.normal), 0.0
        for index, bone in enumerate(self.scene.bones):
            inward = rotation.rotate(rotation.inverse(moved.orientations[:, index]), -normal)
            height = moved.positions[:, index] @ normal - ground.offset
            deepest = max(deepest, float((bone.shape.reach(inward) - height).max()))
        return deepest

    def settled(self, moved: Trajectory) -> float:
        """Instant in s after which every bone stays slower than REST_SPEED; infinity: never."""
        speeds = np.linalg.norm(moved.linear_velocities, axis=-1).max(axis=1)
        fast = np.flatnonzero(~(speeds < REST_SPEED))
        if not len(fast):
            return 0.0
        return float(moved.times[fast[-1] + 1]) if fast[-1] + 1 < len(speeds) else math.inf

    def _prepared(self, placement: Placement, joint: Joint) -> _Hinge:
        bones, arms, turns = [], [], []
        for name in (joint.parent, joint.child):
            bone = placement.doll.bone(name)
            back = rotation.inverse(bone.orientation)
            bones.append(self.scene.bone_index(self.scene.qualified(placement, name)))
            arms.append(rotation.rotate(back, np.subtract(joint.anchor, bone.position)))
            turns.append(back)
        return _Hinge(joint, *bones, *arms, *turns)


def compare(moved: Trajectory, truth: Trajectory) -> dict[str, float]:
    """Worst and RMS distance (m) of all centres of mass, worst and RMS angle (rad) of all bones."""
    apart = np.linalg.norm(moved.positions - truth.positions, axis=-1)
    turned = rotation.angle_between(moved.orientations, truth.orientations)
    return {'position_worst_m': float(apart.max()), 'position_rms_m': _rms(apart),
            'angle_worst_rad': float(turned.max()), 'angle_rms_rad': _rms(turned)}


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _share(value: float, scale: float) -> float:
    return float(value / scale) if scale > 0 else 0.0


def _angles(joint: Joint, turn: np.ndarray) -> list[np.ndarray]:
    """Angles of one joint from turns (t, 3, 3) of the child relative to the parent."""
    if joint.kind == 'fixed':
        return []
    if joint.kind == 'hinge':
        axis = np.array(joint.axes[0])
        across = rotation.matrix(rotation.shortest_arc((0, 0, 1), axis))[:, 0]
        turned = turn @ across
        return [np.arctan2(turned @ np.cross(axis, across), turned @ across)]
    if joint.kind == 'universal':
        first, second = map(np.array, joint.axes)
        carried, back = turn @ second, np.swapaxes(turn, 1, 2) @ first
        return [np.arctan2(carried @ np.cross(first, second), carried @ second),
                np.arctan2(-(back @ np.cross(second, first)), back @ first)]
    frame = rotation.matrix(rotation.shortest_arc((0, 0, 1), np.array(joint.axes[0])))
    r = frame.T @ turn @ frame
    return [np.arctan2(-r[:, 1, 2], r[:, 2, 2]), np.arcsin(np.clip(r[:, 0, 2], -1, 1)),
            np.arctan2(-r[:, 0, 1], r[:, 0, 0])]
