"""Which way the legs of an animal fold: by the bend they are bound in, else by their place.

A knee folds backwards, and the hock below it forwards; an elbow forwards, and the wrist below it
backwards. So of a straight leg the pair (hind, or front, nearer to where the character faces) and
the order within the leg decide.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...model.ragdoll import Joint
from ..reading.character import Character
from ..skeleton.groups import Group, partner
from .neutral import FORWARD, UP

STRAIGHT, PAST, FOLDED, FLAT = (math.radians(angle) for angle in (12, 35, 145, 70))
"""A joint bent less than STRAIGHT in the bind pose tells nothing, one bent up to PAST against what
its place tells is bound past straight, as paws are; how far one folds; a foot bent more than FLAT
stands flat on the ground."""

ORDERS = {'shin': 1, 'forearm': 1, 'foot': 2, 'hand': 2}
"""Of roles: which joint of its leg it hangs on, the hip being 0."""

STEEP = 0.8
"""A leg goes down: the cosine of its angle to the vertical is this at the least."""

APART = 0.2
"""Front and hind legs are so far apart, of the character's length."""


@dataclass(frozen=True)
class Fold:
    """How a joint of a leg folds."""

    axis: np.ndarray
    limits: tuple[float, float]
    guessed: bool
    """Whether only its place tells."""

    def joint(self, parent: str, child: str, anchor: np.ndarray) -> Joint:
        """The hinge that folds so."""
        return Joint(parent, child, 'hinge', anchor, (self.axis,), (self.limits,))


def animal_fold(character: Character, groups: list[Group], index: int,
                along: np.ndarray) -> Fold | None:
    """Fold of the joint to a group's parent if it is a knee, elbow, hock or wrist, else None.

    ``along`` (3,) is the unit direction of its bone.
    """
    group, above, leg = groups[index], above_of(character, groups, index), _leg(groups, index)
    named = group.role in ORDERS
    order = ORDERS.get(group.role, len(leg) - 1)
    if above is None or not (named or (
            group.role is None and 1 <= order <= 2 and _is_paired(character, groups, leg[0])
            and along @ UP < -STEEP)):
        return None
    turned = np.cross(above, along)
    bend = math.atan2(float(np.linalg.norm(turned)), float(above @ along))
    if order == 2 and bend > FLAT:
        return None
    expected = None
    if along @ UP < -STEEP:
        front = _is_front(character, groups, leg[0])
        front = group.role in ('forearm', 'hand') if front is None else front
        expected = np.cross(along, FORWARD if front == (order == 1) else -FORWARD)
        expected = expected / np.linalg.norm(expected)
    # Sideways is a bend of its own; only one the other way is past straight.
    against = expected is not None and turned @ expected < -0.5 * np.linalg.norm(turned)
    if bend > (PAST if against else STRAIGHT):
        return Fold(turned / np.linalg.norm(turned), (-bend, FOLDED - bend), False)
    if expected is None:
        return None
    return Fold(expected, (0.0, FOLDED + (bend if against else 0.0)), not named)


def guesses(character: Character, groups: list[Group], directions: list[np.ndarray]) -> list[str]:
    """A note on the limbs of unknown names that no bend tells of either."""
    folds, balls = [], []
    for index, (group, along) in enumerate(zip(groups, directions, strict=True)):
        above, leg = above_of(character, groups, index), _leg(groups, index)
        if group.role or above is None or len(leg) < 2 or not _is_paired(
                character, groups, leg[0]):
            continue
        fold = animal_fold(character, groups, index, along)
        if fold is not None and fold.guessed:
            folds.append(group.name)
        elif fold is None and above @ along > math.cos(STRAIGHT):
            balls.append(group.name)
    return [f'no name and no bend tells which way {_listed(names)} fold{"s" * (len(names) == 1)}: '
            f'{guess}' for names, guess in ((folds, 'as legs in their place do'),
                                            (balls, 'ball joints are taken')) if names]


def above_of(character: Character, groups: list[Group], index: int) -> np.ndarray | None:
    """Unit direction (3,) from the parent's joint to the group's; None below the root."""
    group, parent = groups[index], groups[groups[index].parent]
    step = group.anchor - parent.anchor
    length = float(np.linalg.norm(step))
    return step / length if group.parent >= 0 <= parent.parent and length > 1e-6 else None


def _listed(names: list[str]) -> str:
    rest = len(names) - 4
    return ', '.join(names[:4]) + (f' and {rest} more' if rest > 0 else '')


def _leg(groups: list[Group], index: int) -> list[int]:
    """Groups from the first of the leg to this one: up to where the body branches."""
    leg = [index]
    while (above := groups[leg[0]].parent) >= 0 and groups[above].parent >= 0 and sum(
            group.parent == above for group in groups) == 1:
        leg.insert(0, above)
    return leg


def _is_paired(character: Character, groups: list[Group], first: int) -> bool:
    return partner(character, groups, first) != first


def _is_front(character: Character, groups: list[Group], first: int) -> bool | None:
    """Whether a leg is one of the front ones; None where there are no two pairs."""
    inner = {group.parent for group in groups}
    # What steps down from the trunk, and goes on.
    starts = [_leg(groups, index)[0] for index, group in enumerate(groups)
              if index not in inner and group.parent >= 0
              and _goes_down(character, groups, index)]
    places = [groups[start].anchor[0] for start in starts
              if _is_paired(character, groups, start)]
    if not places or max(places) - min(places) < APART * character.extent:
        return None
    return bool(groups[first].anchor[0] > (max(places) + min(places)) / 2)


def _goes_down(character: Character, groups: list[Group], end: int) -> bool:
    """Whether a limb's last joint is below its first by most of their distance."""
    leg = _leg(groups, end)
    step = groups[end].anchor - groups[leg[0]].anchor
    return bool(len(leg) > 1 and -step @ UP > STEEP * np.linalg.norm(step))
