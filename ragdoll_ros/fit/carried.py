"""What the bodies carry: every bone of the skeleton, and the swings."""
from __future__ import annotations

import numpy as np

from ..model.pose import Pose
from ..model.ragdoll import Bone, SkeletonFrame
from ..model.swing import Swing
from .reading.character import Character
from .reading.spring_recipe import swing_of


def skeleton_frames(character: Character, carrier: dict[int, Bone]) -> tuple[SkeletonFrame, ...]:
    """Every bone of the skeleton, fixed on the body that carries it, in the skeleton's order.

    ``carrier`` has that body by the index of each of the character's bones.
    """
    frames = []
    for index, name in enumerate(character.bone_names):
        body = carrier[index]
        pose = body.pose.relative(Pose(character.positions[index], character.orientations[index]))
        frames.append(SkeletonFrame(name, body.name, *(np.round(part, 12) + 0.0 for part in pose)))
    return tuple(frames)


def swings(character: Character, carrier: dict[int, Bone], notes: list[str]) -> tuple[Swing, ...]:
    """Each spring of the character as a swing; a note says where its gravity had to be cut."""
    made = []
    for spring in character.springs:
        swing, cut = swing_of(spring, carrier[spring.carrier].name, character.scale)
        made.append(swing)
        if cut:
            notes.append(f'spring {spring.name} has too much gravity: a share of '
                         f'{swing.gravity:g} is taken')
    return tuple(made)
