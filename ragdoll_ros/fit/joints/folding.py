"""Fold direction of legged animals' joints: from the bend in the bind pose, else from the position.

A knee (stifle) folds backwards and the hock below it forwards; an elbow forwards and the wrist
(carpus) below it backwards. So for a straight leg the pair (hind or front) and the order within the
leg decide. The fetlock above pastern and hoof folds backwards in both.
"""
import math
from dataclasses import dataclass

import numpy as np

from ...model.ragdoll import Joint
from ..reading.character import Character
from ..skeleton.groups import BodyGroup, mirrored_group
from .neutral import FORWARD, UP

MIN_BEND, MAX_HYPEREXTENSION, MAX_FOLD, MAX_FOOT_BEND = (
    math.radians(angle) for angle in (12, 35, 145, 70))
"""Smallest bend in the bind pose that shows the fold direction; largest bend against the expected
direction that counts as hyperextension (paws); flexion from straight; bend from which on a foot
is plantigrade."""

JOINT_ORDER = {'shin': 1, 'forearm': 1, 'foot': 2, 'hand': 2}
"""Index of a role's joint within its leg; the hip has index 0."""

DIGITS = ('toe', 'finger')
"""Roles of the bones below a fetlock."""

DIGIT_FLEXION, DIGIT_EXTENSION = math.radians(80), math.radians(25)
"""Rotation of a digit backwards from straight; forwards beyond straight, or beyond the bind pose
where that is bent forwards already, as a standing horse's pasterns are."""

MIN_STEEPNESS = 0.8
"""Smallest cosine of the angle between a leg and the vertical."""

MIN_PAIR_DISTANCE = 0.2
"""Smallest distance between front and hind legs, as a fraction of the character's extent."""


@dataclass(frozen=True)
class Fold:
    """Fold of a leg's joint: hinge axis (3,) and limits, rad."""

    axis: np.ndarray
    limits: tuple[float, float]
    guessed: bool
    """Whether only the position in the body determines it."""

    def joint(self, parent: str, child: str, anchor: np.ndarray) -> Joint:
        """Hinge joint with this fold."""
        return Joint(parent, child, 'hinge', anchor, (self.axis,), (self.limits,))


def leg_fold(character: Character, groups: list[BodyGroup], index: int,
             along: np.ndarray) -> Fold | None:
    """Fold of the joint to a group's parent if it is a knee, elbow, hock, wrist or a digit's joint.

    None for other joints and where the fold direction is unknown. ``along`` (3,) is the unit
    direction of the group's bone.
    """
    group, leg = groups[index], _leg(groups, index)
    above = parent_direction(character, groups, index)
    if group.role in DIGITS:
        return _digit_fold(character, groups, leg[0], above, along)
    named = group.role in JOINT_ORDER
    order = JOINT_ORDER.get(group.role, len(leg) - 1)
    if above is None or not (named or (
            group.role is None and 1 <= order <= 2 and _is_paired(character, groups, leg[0])
            and along @ UP < -MIN_STEEPNESS)):
        return None
    turned = np.cross(above, along)
    bend = math.atan2(float(np.linalg.norm(turned)), float(above @ along))
    if order == 2 and bend > MAX_FOOT_BEND:
        return None
    expected = None
    if along @ UP < -MIN_STEEPNESS:
        front = _is_front(character, groups, leg[0])
        front = group.role in ('forearm', 'hand') if front is None else front
        expected = np.cross(along, FORWARD if front == (order == 1) else -FORWARD)
        expected = expected / np.linalg.norm(expected)
    # A sideways bend is kept; only a bend against the expected direction is hyperextension.
    against = expected is not None and turned @ expected < -0.5 * np.linalg.norm(turned)
    if bend > (MAX_HYPEREXTENSION if against else MIN_BEND):
        return Fold(turned / np.linalg.norm(turned), (-bend, MAX_FOLD - bend), False)
    if expected is None:
        return None
    return Fold(expected, (0.0, MAX_FOLD + (bend if against else 0.0)), not named)


def _digit_fold(character: Character, groups: list[BodyGroup], first: int,
                above: np.ndarray | None, along: np.ndarray) -> Fold | None:
    """Fold of a pastern, hoof or claw that points down, of an animal with front and hind legs."""
    if above is None or along @ UP > -0.5 or _is_front(character, groups, first) is None:
        return None
    axis = np.cross(along, -FORWARD)
    axis = axis / np.linalg.norm(axis)
    bend = math.atan2(float(np.cross(above, along) @ axis), float(above @ along))
    return Fold(axis, (-max(bend, 0.0) - DIGIT_EXTENSION, DIGIT_FLEXION - max(bend, 0.0)), False)


def note_guesses(character: Character, groups: list[BodyGroup],
                 directions: list[np.ndarray]) -> list[str]:
    """Notes on limbs whose fold direction neither name nor bend determines."""
    folds, balls = [], []
    for index, (group, along) in enumerate(zip(groups, directions, strict=True)):
        above, leg = parent_direction(character, groups, index), _leg(groups, index)
        if group.role or above is None or len(leg) < 2 or not _is_paired(character, groups, leg[0]):
            continue
        fold = leg_fold(character, groups, index, along)
        if fold is not None and fold.guessed:
            folds.append(group.name)
        elif fold is None and above @ along > math.cos(MIN_BEND):
            balls.append(group.name)
    return [f'neither name nor bend shows the fold direction of {_listed(names)}: {guess}'
            for names, guess in ((folds, 'that of legs in their place is used'),
                                 (balls, 'ball joints are used')) if names]


def parent_direction(character: Character, groups: list[BodyGroup],
                     index: int) -> np.ndarray | None:
    """Unit direction (3,) from the parent's anchor to the group's; None for the root, for its
    children and where the anchors coincide.
    """
    group, parent = groups[index], groups[groups[index].parent]
    step = group.anchor - parent.anchor
    length = float(np.linalg.norm(step))
    return step / length if group.parent >= 0 <= parent.parent and length > 1e-6 else None


def _listed(names: list[str]) -> str:
    rest = len(names) - 4
    return ', '.join(names[:4]) + (f' and {rest} more' if rest > 0 else '')


def _leg(groups: list[BodyGroup], index: int) -> list[int]:
    """Indices of a leg's groups, from the first below a branching body or the root to this one."""
    leg = [index]
    while (above := groups[leg[0]].parent) >= 0 and groups[above].parent >= 0 and sum(
            group.parent == above for group in groups) == 1:
        leg.insert(0, above)
    return leg


def _is_paired(character: Character, groups: list[BodyGroup], first: int) -> bool:
    return mirrored_group(character, groups, first) != first


def _is_front(character: Character, groups: list[BodyGroup], first: int) -> bool | None:
    """Whether a leg is a front leg; None unless there are front and hind legs."""
    inner = {group.parent for group in groups}
    # Limbs of several bodies that point down from the trunk.
    starts = [_leg(groups, index)[0] for index, group in enumerate(groups)
              if index not in inner and group.parent >= 0 and _goes_down(groups, index)]
    places = [groups[start].anchor[0] for start in starts if _is_paired(character, groups, start)]
    if not places or max(places) - min(places) < MIN_PAIR_DISTANCE * character.extent:
        return None
    return bool(groups[first].anchor[0] > (max(places) + min(places)) / 2)


def _goes_down(groups: list[BodyGroup], end: int) -> bool:
    """Whether a limb of several bodies points down within MIN_STEEPNESS."""
    leg = _leg(groups, end)
    step = groups[end].anchor - groups[leg[0]].anchor
    return bool(len(leg) > 1 and -step @ UP > MIN_STEEPNESS * np.linalg.norm(step))
