"""What looks wrong with a doll that is well-formed: the mistakes that are easily made."""
from __future__ import annotations

import math

import numpy as np

from ...model import rotation
from ...model.ragdoll import Joint, Ragdoll, joint_axes
from ..reading.scale import SMALLEST, TALLEST
from ..roles.names import doll_roles
from ..roles.person import is_person
from .finding import Finding

DENSEST, STEEL = 3000.0, 8000.0
"""kg/m^3 of animals (bone has 1 900, stone 2 700), and of robots."""

IMPOSSIBLE = 25_000.0
"""kg/m^3; osmium, the densest of all, has 22 600."""

BENDS = {'shin': (-1, 'a knee that bends forwards'),
         'forearm': (1, 'an elbow that bends backwards'),
         'thigh': (1, 'a hip that lifts the knee backwards')}
"""By role: which way along x the first axis takes the child, and what it is if it does not."""


BENT, PAST = math.radians(35), math.radians(20)
"""A limb bent by more than BENT in the bind pose tells which way it folds (paws are bound past
straight); how far past straight is doubtful, and wrong twice that."""


def find_doubts(doll: Ragdoll, measured: bool = False) -> list[Finding]:
    """About the size, a density, a joint that bends the wrong way.

    A robot is ``measured``: may be of steel, and bend as it likes.
    """
    if measured:
        return [*_size(doll), *_densities(doll, STEEL, math.inf)]
    return [*_size(doll), *_densities(doll, DENSEST, IMPOSSIBLE), *_bends(doll)]


def extent(doll: Ragdoll) -> float:
    """Longest edge of the box around the doll in the bind pose, m."""
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    reaches = [directions @ np.array(bone.position) + bone.shape.support(rotation.rotate(
        rotation.inverse(np.array(bone.orientation)), directions)) for bone in doll.bones]
    furthest = np.max(reaches, axis=0)
    return float((furthest[:3] + furthest[3:]).max())


def _size(doll: Ragdoll) -> list[Finding]:
    size = extent(doll)
    if size > TALLEST:
        unit = 'centimetres' if size < 1000 else 'millimetres'
        return [Finding(f'a doll {size:.4g} m long: the size smells of {unit}')]
    if size < SMALLEST:
        return [Finding(f'a doll {size:.4g} m long: the size smells of a scale applied twice')]
    return []


def _densities(doll: Ragdoll, most: float, impossible: float) -> list[Finding]:
    densities = {bone.name: bone.mass / bone.shape.volume for bone in doll.bones}
    return [Finding(f'{name}: a density of {density:.0f} kg/m^3, over {most:.0f}',
                    density > impossible)
            for name, density in densities.items() if density > most]


def _bends(doll: Ragdoll) -> list[Finding]:
    roles = doll_roles(doll)
    if not is_person(roles, np.array([bone.position for bone in doll.bones])):
        return _unfolding(doll)
    role_of = dict(zip((bone.name for bone in doll.bones), roles, strict=True))
    found = []
    for joint in doll.joints:
        role = role_of[joint.child]
        if role in BENDS and joint.kind in ('hinge', 'universal', 'ball'):
            sign, complaint = BENDS[role]
            if sign * _reach_forward(doll, joint) < -0.05:
                found.append(_told(joint, complaint, True))
    return found


def _unfolding(doll: Ragdoll) -> list[Finding]:
    """Hinges that are bent in the bind pose, and whose range takes them far past straight."""
    anchors = {joint.child: np.array(joint.anchor) for joint in doll.joints}
    found = []
    for joint in doll.joints:
        if joint.kind != 'hinge' or joint.parent not in anchors or joint.limits[0] is None:
            continue
        below = [anchors[each.child] for each in doll.joints if each.parent == joint.child]
        end = np.mean(below, axis=0) if below else np.array(doll.bone(joint.child).position)
        above, along = anchors[joint.child] - anchors[joint.parent], end - joint.anchor
        bend = math.atan2(float(np.cross(above, along) @ joint.axes[0]), float(above @ along))
        low, high = joint.limits[0] if bend > 0 else (-joint.limits[0][1], -joint.limits[0][0])
        past = -low - abs(bend)
        if abs(bend) > BENT and past > PAST:
            found.append(_told(joint, f'a limb that goes {math.degrees(past):.0f} degrees past '
                                      'straight', past > 2 * PAST or past > abs(bend) + high))
    return found


def _told(joint: Joint, complaint: str, wrong: bool) -> Finding:
    low, high = (math.degrees(angle) for angle in joint.angle_limits[0])
    return Finding(f'{joint.child}: {complaint} (limits {low:.0f} to {high:.0f} degrees)', wrong)


def _reach_forward(doll: Ragdoll, joint: Joint) -> float:
    """How far the middle of its range takes the child's centre along x, by its distance."""
    pair = joint.angle_limits[0]
    if pair is None:
        return 0.0
    arm = np.array(doll.bone(joint.child).position) - joint.anchor
    length = float(np.linalg.norm(arm))
    if length < 1e-9:
        return 0.0
    turn = rotation.from_axis_angle(joint_axes(joint)[0], sum(pair) / 2)
    return float(rotation.rotate(turn, arm)[0] - arm[0]) / length
