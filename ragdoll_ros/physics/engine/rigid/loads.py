"""What acts on a cluster, as records for the kernels: wrenches, springs, drives."""
import math

import numpy as np

from ....model.scene import Scene
from ...kernels.dynamics.loads import (ANGULAR_DRIVE, GRAB, JOINT_SPRING, LINEAR_DRIVE, LOAD,
                                       SPRING)
from ..protocol import AppliedDrive, AppliedJointSpring, Drives, Spring, Springs, Wrenches

NO_LOADS = np.zeros(0, LOAD)
NO_SPRINGS = np.zeros(0, SPRING)


def load_records(wrenches: Wrenches, bones: list[int]) -> np.ndarray:
    """LOAD records (m,) of wrenches; ``bones``: indices in the scene of a cluster's bones."""
    loads = np.zeros(len(wrenches), LOAD)
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


def _grab(body: int, spring: Spring) -> np.ndarray:
    spring = spring.after(0.0)
    record = _record(GRAB, body, spring.stiffness, spring.damping, spring.most)
    record['point'], record['target'] = spring.point, spring.position
    if spring.left > 0:
        record['target_velocity'] = (spring.target - spring.position) / spring.left
    record['time_left'] = spring.left
    return record


def _joint_spring(body: int, hold: AppliedJointSpring, scene: Scene) -> np.ndarray:
    """Its mobility is that of the bone alone about its thinnest axis, an upper bound."""
    record = _record(JOINT_SPRING, body, hold.stiffness, hold.damping, hold.most)
    record['axis'], record['target_angle'] = hold.axis, hold.target
    record['target_velocity'][0], record['time_left'] = hold.rate, hold.left
    record['mobility'] = 1 / min(scene.bones[hold.bone].inertia)
    return record


def _drive(body: int, drive: AppliedDrive, scene: Scene) -> list[np.ndarray]:
    """Up to two springs without stiffness, at the bone's center of mass. Their mobility is the
    bone's own, an upper bound: overestimated stiffness moves the evaluation towards the step's end.
    """
    bone, records = scene.bones[drive.bone], []
    mobilities = 1 / bone.mass, 1 / min(bone.inertia)
    for kind, target, gain, most, mobility in zip(
            (LINEAR_DRIVE, ANGULAR_DRIVE), drive.targets, drive.gains, drive.most, mobilities,
            strict=True):
        if gain > 0:
            record = _record(kind, body, 0.0, gain, most)
            record['target_velocity'], record['mobility'] = target, mobility
            records.append(record)
    return records


def _record(kind: int, body: int, stiffness: float, damping: float, most: float) -> np.ndarray:
    """A spring record with these values; its target is the origin, at rest, for ever."""
    record = np.zeros((), SPRING)
    record['kind'], record['body'], record['time_left'] = kind, body, math.inf
    record['stiffness'], record['damping'], record['max_force'] = stiffness, damping, most
    return record
