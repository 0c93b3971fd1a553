"""Attachments of the bodies: frames of the skeleton's bones, and swings."""
from __future__ import annotations

import numpy as np

from ..model.pose import Pose
from ..model.ragdoll import Bone, SkeletonFrame
from ..model.swing import Swing
from .reading.character import Character
from .reading.spring_to_swing import swing_from_spring


def skeleton_frames(character: Character, carrier: dict[int, Bone]) -> tuple[SkeletonFrame, ...]:
    """Frame of every bone of the skeleton, fixed to a body, in the skeleton's order.

    ``carrier`` maps the index of a character's bone to that body.
    """
    frames = []
    for index, name in enumerate(character.bone_names):
        body = carrier[index]
        pose = body.pose.relative(Pose(character.positions[index], character.orientations[index]))
        frames.append(SkeletonFrame(name, body.name, *(np.round(part, 12) + 0.0 for part in pose)))
    return tuple(frames)


def swings(character: Character, carrier: dict[int, Bone], notes: list[str]) -> tuple[Swing, ...]:
    """The character's spring bones as swings; a note reports gravity that had to be clamped."""
    made = []
    for spring in character.springs:
        swing, cut = swing_from_spring(spring, carrier[spring.carrier].name, character.scale)
        made.append(swing)
        if cut:
            notes.append(f'gravity of spring {spring.name} is clamped to a factor of '
                         f'{swing.gravity:g}')
    return tuple(made)
