"""Joint kinds and limits by the role of the bone, else by the topology of the skeleton."""
import dataclasses
import math

import numpy as np

from ...files.bone_names.names import side_of
from ...model import rotation
from ...model.ragdoll import Bone, Joint
from ..reading.character import Character
from ..roles.person import is_person
from ..shapes.fitting import DECIMALS
from ..skeleton.groups import BodyGroup
from .anatomy import ELBOW, KNEE, RANGES, human_joint
from .folding import MAX_FOLD, MIN_BEND, leg_fold, parent_direction
from .neutral import FORWARD, HEAD_ROLES, LEFT, UP, find_neutral

BALL_LIMITS = {'neck': (35, 40), 'head': (45, 55), 'spine': (25, 25), 'hips': (25, 25),
               'clavicle': (15, 10), 'upper_arm': (80, 50), 'thigh': (60, 30), 'tail': (45, 20),
               'soft': (30, 20), 'wing': (60, 20), 'finger': (30, 10)}
"""Swing and twist limits, degrees, by role."""

FIRST_BALL, OTHER_BALL = (60, 30), (45, 30)
"""Swing and twist limits, degrees, by topology: first joint of a limb, other joints."""

DECAY_TIME, MIN_DECAY_TIME = 0.7, 0.01
"""s; see ``with_damping``."""


def make_joint(character: Character, groups: list[BodyGroup], index: int,
               along: np.ndarray) -> Joint:
    """Joint between a group's body and its parent's, without damping.

    ``along`` (3,) is the unit direction of the group's bone (bind pose, doll's frame).
    """
    group = groups[index]
    parent = groups[group.parent]
    anchor = np.round(group.anchor, DECIMALS) + 0.0
    if group.fixed:
        return Joint(parent.name, group.name, 'fixed', anchor)
    above = parent_direction(character, groups, index)
    children = [sum(other.parent == k for other in groups) for k in (index, group.parent)]
    side = side_of(group.name) or int(np.sign(anchor[1]))
    if is_person([each.role for each in groups],
                 character.positions[[each.bone for each in groups]]):
        rest = group.role in RANGES and find_neutral(character, groups, index, side, above, along)
        heads = sum(each.role in HEAD_ROLES for each in groups) if group.role in HEAD_ROLES else 1
        joint = human_joint(parent.name, group.name, group.role, side, anchor, rest,
                            1 / heads) if rest else None
    else:
        fold = leg_fold(character, groups, index, along)
        joint = fold.joint(parent.name, group.name, anchor) if fold else None
    if joint is not None:
        return joint
    return _by_role(parent.name, group.name, group.role, side, anchor, above, along,
                    children[0] <= 1 and children[1] == 1)


def _by_role(parent: str, child: str, role: str | None, side: int, anchor: np.ndarray,
             above: np.ndarray | None, along: np.ndarray, chain: bool) -> Joint:
    """Joint by the child's role, else by topology.

    ``above`` (3,) is the unit direction from the parent's anchor to this one, None where the
    parent is the root; ``chain``: neither parent nor child branches; ``side``: 1 left, -1 right.
    """
    if role == 'shin' or role == 'forearm':
        # A knee moves the foot backwards, an elbow the hand forwards (or up).
        toward = -FORWARD if role == 'shin' else FORWARD
        axis, limits = _fold_axis(above, along, toward, KNEE if role == 'shin' else ELBOW)
        return Joint(parent, child, 'hinge', anchor, (axis,), (limits,))
    if role == 'thigh' and abs(along @ UP) > 0.7:
        outward = (-20, 45) if side >= 0 else (-45, 20)
        return _universal(parent, child, anchor, LEFT, FORWARD, (-110, 30), outward)
    if role == 'foot':
        return _universal(parent, child, anchor, LEFT, FORWARD, (-30, 40), (-20, 20))
    if role == 'toe':
        return Joint(parent, child, 'hinge', anchor, (LEFT,), (_radians(-50, 10),))
    if role == 'hand':
        axis = _hinge_axis(along, FORWARD)
        return _universal(parent, child, anchor, axis, np.cross(along, axis), (-70, 70), (-30, 30))
    if role in BALL_LIMITS:
        return _ball(parent, child, anchor, along, *BALL_LIMITS[role])
    return _by_topology(parent, child, anchor, above, along, chain)


def with_damping(joint: Joint, parent: Bone, child: Bone) -> Joint:
    """The joint with passive damping, N m s/rad, about that of a living body.

    The child alone, swinging about the anchor, has an angular velocity that decays with the time
    constant DECAY_TIME. The relative velocity of both bodies about any axis of the joint decays no
    faster than with MIN_DECAY_TIME, which bounds the stiffness of the equations of motion.
    """
    if joint.kind == 'fixed':
        return joint
    axes = np.eye(3) if joint.kind == 'ball' else np.array(joint.axes)
    mobilities = [1 / ((axes @ rotation.matrix(np.array(bone.orientation))) ** 2 @ bone.inertia)
                  for bone in (parent, child)]
    about = max(child.inertia) + child.mass * float(
        np.sum(np.subtract(child.position, joint.anchor) ** 2))
    damping = min(about / DECAY_TIME, float(1 / np.add(*mobilities).max()) / MIN_DECAY_TIME)
    return dataclasses.replace(joint, damping=float(f'{damping:.3g}'))


def _by_topology(parent: str, child: str, anchor: np.ndarray, above: np.ndarray | None,
                 along: np.ndarray, chain: bool) -> Joint:
    """Joint by the bind pose: a hinge that straightens and folds for a bend within a limb, else a
    ball.
    """
    if above is None:
        return _ball(parent, child, anchor, along, *FIRST_BALL)
    bend = _angle(above, along)
    if chain and MIN_BEND < bend < MAX_FOLD:
        return Joint(parent, child, 'hinge', anchor, (np.cross(above, along),),
                     ((-bend, MAX_FOLD - bend),))
    return _ball(parent, child, anchor, along, *OTHER_BALL)


def _fold_axis(above: np.ndarray | None, along: np.ndarray, toward: np.ndarray,
               folded: float) -> tuple[np.ndarray, tuple[float, float]]:
    """Axis and limits of a hinge that rotates ``along`` towards a direction, up to ``folded`` rad.

    If the limb is bent that way in the bind pose, the hinge has the axis of that bend and its
    lower limit at the straight limb.
    """
    axis = _hinge_axis(along, toward)
    if above is not None:
        bend, turned = _angle(above, along), np.cross(above, along)
        if MIN_BEND < bend < folded and turned @ axis > 0.5 * np.linalg.norm(turned):
            return turned, (-bend, folded - bend)
    return axis, (0.0, folded)


def _hinge_axis(along: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Unit axis that rotates ``along`` towards a direction. If they are nearly parallel, it rotates
    ``along`` upwards, or to the left where ``along`` is vertical.
    """
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
