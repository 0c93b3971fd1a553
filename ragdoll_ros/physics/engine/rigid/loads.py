"""What acts on a cluster, as records for the kernels: wrenches, springs, drives."""
import math

import numpy as np
from numpy.typing import ArrayLike

from ....model.scene import Scene
from ...kernels.dynamics.loads import (ANGULAR_DRIVE, GRAB, JOINT_SPRING, LINEAR_DRIVE, LOAD,
                                       SPRING)
from ..protocol import AppliedDrive, AppliedJointSpring, Drives, Spring, Springs, Wrenches

NO_LOADS = np.zeros(0, LOAD)
NO_SPRINGS = np.zeros(0, SPRING)
ORIGIN = (0.0, 0.0, 0.0)


def load_records(wrenches: Wrenches, bones: list[int]) -> np.ndarray:
    """LOAD records (m,) of wrenches; ``bones``: indices in the scene of a cluster's bones."""
    loads = np.zeros(len(wrenches), LOAD) if wrenches else NO_LOADS
    for load, wrench in zip(loads, wrenches, strict=True):
        load['bone'], load['local'] = bones.index(wrench.bone), wrench.local
        load['force'], load['torque'], load['point'] = wrench.force, wrench.torque, wrench.point
    return loads


def spring_records(springs: Springs, drives: Drives, scene: Scene, bones: list[int],
                   bodies: list[int]) -> np.ndarray:
    """SPRING records (k,) of springs and drives; ``bones``: indices in the scene of a cluster's
    bones; ``bodies``: the index in ``bones`` of each body of its tree.
    """
    records = []
    for spring in springs:
        body = bodies.index(bones.index(spring.bone))
        records.append(_joint_spring(body, spring, scene) if isinstance(spring, AppliedJointSpring)
                       else _grab(body, spring))
    for drive in drives:
        records += _drive(bodies.index(bones.index(drive.bone)), drive, scene)
    return np.array(records, SPRING) if records else NO_SPRINGS


def _grab(body: int, spring: Spring) -> tuple:
    spring, velocity = spring.after(0.0), ORIGIN
    if spring.left > 0:
        velocity = (spring.target - spring.position) / spring.left
    return _record(GRAB, body, spring.stiffness, spring.damping, spring.most, point=spring.point,
                   target=spring.position, velocity=velocity, time_left=spring.left)


def _joint_spring(body: int, hold: AppliedJointSpring, scene: Scene) -> tuple:
    """The SPRING record of a joint spring. Its mobility is that of the bone alone about its
    thinnest axis; that of the parent is left out.
    """
    return _record(JOINT_SPRING, body, hold.stiffness, hold.damping, hold.most, axis=hold.axis,
                   angle=hold.target, velocity=(hold.rate, 0.0, 0.0), time_left=hold.left,
                   mobility=1 / min(scene.bones[hold.bone].inertia))


def _drive(body: int, drive: AppliedDrive, scene: Scene) -> list[tuple]:
    """Up to two SPRING records without stiffness, at the bone's center of mass. Their mobility is
    that of the bone alone, an upper bound: with a larger mobility damping is evaluated closer to
    the step's end.
    """
    bone = scene.bones[drive.bone]
    mobilities = 1 / bone.mass, 1 / min(bone.inertia)
    return [_record(kind, body, 0.0, gain, most, velocity=target, mobility=mobility)
            for kind, target, gain, most, mobility in zip(
                (LINEAR_DRIVE, ANGULAR_DRIVE), drive.targets, drive.gains, drive.most, mobilities,
                strict=True) if gain > 0]


def _record(kind: int, body: int, stiffness: float, damping: float, most: float, *, axis: int = 0,
            point: ArrayLike = ORIGIN, target: ArrayLike = ORIGIN, velocity: ArrayLike = ORIGIN,
            angle: float = 0.0, time_left: float = math.inf, mobility: float = 0.0) -> tuple:
    """A SPRING record as a tuple, in the order of its fields; by default its target is the origin,
    at rest, for ever.
    """
    return (kind, body, axis, 0, point, target, velocity, angle, time_left, stiffness, damping,
            most, ORIGIN, mobility)
