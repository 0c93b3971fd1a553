"""Joint kinds and limits: from what the bone is called, else from how the skeleton is built."""
from __future__ import annotations

import dataclasses
import math

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone, Joint
from ..reading.character import Character
from ..roles.names import side_of
from ..roles.person import is_person
from ..shapes.shapes import DECIMALS
from ..skeleton.groups import Group
from .anatomy import ELBOW, KNEE, RANGES, persons_joint
from .folding import FOLDED, STRAIGHT, above_of, animal_fold
from .neutral import FORWARD, HEADS, LEFT, UP, neutral

BALLS = {'neck': (35, 40), 'head': (45, 55), 'spine': (25, 25), 'hips': (25, 25),
         'clavicle': (15, 10), 'upper_arm': (80, 50), 'thigh': (60, 30), 'tail': (45, 20),
         'soft': (30, 20), 'wing': (60, 20), 'finger': (30, 10)}
"""Swing and twist, degrees, by role."""

FIRST, LATER = (60, 30), (45, 30)
"""The same by topology: a limb's first joint, and the others."""

LOSS_TIME, SHORTEST_LOSS = 0.7, 0.01
"""Seconds: see ``damped``."""


def make_joint(character: Character, groups: list[Group], index: int, along: np.ndarray) -> Joint:
    """Joint of a group's body to its parent's, at the root of its bone, without damping.

    ``along`` (3,) is the unit direction of its bone (bind pose, doll's frame).
    """
    group = groups[index]
    parent = groups[group.parent]
    anchor = np.round(group.anchor, DECIMALS) + 0.0
    if group.tied:
        return Joint(parent.name, group.name, 'fixed', anchor)
    above = above_of(character, groups, index)
    children = [sum(other.parent == k for other in groups) for k in (index, group.parent)]
    side = side_of(group.name) or int(np.sign(anchor[1]))
    if is_person([each.role for each in groups],
                 character.positions[[each.bone for each in groups]]):
        rest = group.role in RANGES and neutral(character, groups, index, side, above, along)
        heads = sum(each.role in HEADS for each in groups) if group.role in HEADS else 1
        joint = persons_joint(parent.name, group.name, group.role, side, anchor, rest,
                              1 / heads) if rest else None
    else:
        fold = animal_fold(character, groups, index, along)
        joint = fold.joint(parent.name, group.name, anchor) if fold else None
    if joint is not None:
        return joint
    return _by_role(parent.name, group.name, group.role, side, anchor, above, along,
                    children[0] <= 1 and children[1] == 1)


def _by_role(parent: str, child: str, role: str | None, side: int, anchor: np.ndarray,
             above: np.ndarray | None, along: np.ndarray, chain: bool) -> Joint:
    """Joint as the child's role has it, else as the skeleton is built.

    ``above`` (3,) is the unit direction from the parent's joint to this one, None where the
    parent is the root; ``chain`` tells whether both go on without a branch; ``side`` is 1 on the
    left, -1 on the right.
    """
    if role == 'shin' or role == 'forearm':
        # A knee takes the foot backwards, an elbow the hand forwards (or up).
        toward = -FORWARD if role == 'shin' else FORWARD
        axis, limits = _folding(above, along, toward, KNEE if role == 'shin' else ELBOW)
        return Joint(parent, child, 'hinge', anchor, (axis,), (limits,))
    if role == 'thigh' and abs(along @ UP) > 0.7:
        outward = (-20, 45) if side >= 0 else (-45, 20)
        return _universal(parent, child, anchor, LEFT, FORWARD, (-110, 30), outward)
    if role == 'foot':
        return _universal(parent, child, anchor, LEFT, FORWARD, (-30, 40), (-20, 20))
    if role == 'toe':
        return Joint(parent, child, 'hinge', anchor, (LEFT,), (_radians(-50, 10),))
    if role == 'hand':
        axis = _across(along, FORWARD)
        return _universal(parent, child, anchor, axis, np.cross(along, axis), (-70, 70), (-30, 30))
    if role in BALLS:
        return _ball(parent, child, anchor, along, *BALLS[role])
    return _by_topology(parent, child, anchor, above, along, chain)


def damped(joint: Joint, parent: Bone, child: Bone) -> Joint:
    """The joint with a living body's damping, N m s/rad, so that the doll comes to rest.

    The child alone, swinging about the joint, loses its speed within LOSS_TIME; about no axis of
    the joint do the two lose theirs sooner than within SHORTEST_LOSS, or flights would be stiff.
    """
    if joint.kind == 'fixed':
        return joint
    axes = np.eye(3) if joint.kind == 'ball' else np.array(joint.axes)
    eases = [1 / ((axes @ rotation.matrix(np.array(bone.orientation))) ** 2 @ bone.inertia)
             for bone in (parent, child)]
    about = max(child.inertia) + child.mass * float(
        np.sum(np.subtract(child.position, joint.anchor) ** 2))
    damping = min(about / LOSS_TIME, float(1 / np.add(*eases).max()) / SHORTEST_LOSS)
    return dataclasses.replace(joint, damping=float(f'{damping:.3g}'))


def _by_topology(parent: str, child: str, anchor: np.ndarray, above: np.ndarray | None,
                 along: np.ndarray, chain: bool) -> Joint:
    """A bend within a limb is a hinge that straightens and folds; all else is a ball."""
    if above is None:
        return _ball(parent, child, anchor, along, *FIRST)
    bend = _angle(above, along)
    if chain and STRAIGHT < bend < FOLDED:
        return Joint(parent, child, 'hinge', anchor, (np.cross(above, along),),
                     ((-bend, FOLDED - bend),))
    return _ball(parent, child, anchor, along, *LATER)


def _folding(above: np.ndarray | None, along: np.ndarray, toward: np.ndarray,
             folded: float) -> tuple[np.ndarray, tuple[float, float]]:
    """Axis and limits of a hinge that takes ``along`` toward a direction, to ``folded`` rad.

    Bent that way in the bind pose already, it rotates about the axis of that bend and stops
    where it is straight.
    """
    axis = _across(along, toward)
    if above is not None:
        bend, turned = _angle(above, along), np.cross(above, along)
        if STRAIGHT < bend < folded and turned @ axis > 0.5 * np.linalg.norm(turned):
            return turned, (-bend, folded - bend)
    return axis, (0.0, folded)


def _across(along: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Unit axis of the rotation of ``along`` toward a direction; toward up where it is that one."""
    axis = np.cross(along, toward)
    if np.linalg.norm(axis) < 0.3:
        axis = np.cross(along, UP if abs(along @ UP) < 0.9 else LEFT)
    return axis / np.linalg.norm(axis)


def _ball(parent: str, child: str, anchor: np.ndarray, along: np.ndarray, swing: float,
          twist: float) -> Joint:
    limits = (_radians(-swing, swing), _radians(-twist, twist))
    return Joint(parent, child, 'ball', anchor, (along,), limits)


def _universal(parent: str, child: str, anchor: np.ndarray, first: np.ndarray,
               second: np.ndarray, *limits: tuple[float, float]) -> Joint:
    return Joint(parent, child, 'universal', anchor, (first, second),
                 tuple(_radians(*pair) for pair in limits))


def _radians(low: float, high: float) -> tuple[float, float]:
    return math.radians(low), math.radians(high)


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
