"""What acts on a cluster, as tables for compiled code: wrenches, springs, drives."""
from __future__ import annotations

import math

import numpy as np

from ....model.scene import Scene
from ...kernels.system import HAND, HOLDS, MOVES, TURNS
from ..protocol import AppliedDrive, AppliedJointSpring, Drives, Spring, Springs, Wrenches

NO_LOADS = np.zeros((0, 11))
NO_SPRINGS = np.zeros((0, 20))


def load_rows(wrenches: Wrenches, bones: list[int]) -> np.ndarray:
    """Wrenches as a table (m, 11), on ``bones`` of a cluster."""
    rows = np.zeros((len(wrenches), 11))
    for row, load in zip(rows, wrenches, strict=True):
        row[0], row[1:4], row[4:7], row[7:10], row[10] = (
            bones.index(load.bone), load.force, load.torque, load.point, load.local)
    return rows


def spring_rows(springs: Springs, drives: Drives, scene: Scene, bones: list[int],
                records: list[int]) -> np.ndarray:
    """Springs and drives as a table (k, 20), on ``bones`` of a cluster that stand in ``records``.

    A row: record, point, where the hand is and how it moves, for how long, stiffness, damping, the
    most that it pulls with; whether it pulls with less and, if not, with what (scratch); what it
    is; a drive's mobility.
    """
    rows = []
    for spring in springs:
        record = records.index(bones.index(spring.bone))
        rows.append(_hold(record, spring, scene) if isinstance(spring, AppliedJointSpring)
                    else _hand(record, spring))
    for drive in drives:
        rows += _drive(records.index(bones.index(drive.bone)), drive, scene)
    return np.array(rows) if rows else NO_SPRINGS


def _hand(record: int, spring: Spring) -> np.ndarray:
    spring = spring.after(0.0)
    speed = (spring.target - spring.position) / spring.left if spring.left > 0 else np.zeros(3)
    return np.concatenate([[record], spring.point, spring.position, speed, [
        spring.left, spring.stiffness, spring.damping, spring.most, 1.0, 0.0, 0.0, 0.0, HAND, 0.0]])


def _hold(record: int, hold: AppliedJointSpring, scene: Scene) -> np.ndarray:
    """The mobility is that of the bone alone about its thinnest axis, the most that it can be."""
    mobility = 1 / min(scene.bones[hold.bone].inertia)
    row = np.zeros(20)
    row[[0, 1, 4]] = record, hold.axis, hold.target
    row[10:15] = math.inf, hold.stiffness, hold.damping, math.inf, 1.0
    row[18:] = HOLDS, mobility
    return row


def _drive(record: int, drive: AppliedDrive, scene: Scene) -> list[np.ndarray]:
    """Up to two springs without stiffness, at the bone's centre.

    The mobility is that of the bone alone, the most that it can be: a drive that is taken for
    stiffer than it is ends nearer to the step's end.
    """
    bone, none = scene.bones[drive.bone], np.zeros(6)
    mobilities = 1 / bone.mass, 1 / min(bone.inertia)
    return [np.concatenate([[record], none, target, [math.inf, 0.0, gain, most, 1.0, 0.0, 0.0, 0.0,
                                                     kind, mobility]])
            for kind, target, gain, most, mobility in zip(
                (MOVES, TURNS), drive.targets, drive.gains, drive.most, mobilities, strict=True)
            if gain > 0]
