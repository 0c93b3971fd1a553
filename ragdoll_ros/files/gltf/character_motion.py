"""Motions of a doll's bodies by the animations of its character's file.

A body of the doll moves as its bone of the character does: by N inv(B), where N is the global
transform of the bone's node and B its bind matrix, as the skin does. The body's orientation follows
the nearest rotation, without scale and shear; its centre of mass follows the whole transform.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.forward_kinematics import BoneMotion
from ...model.pose import Pose
from ...model.ragdoll import Ragdoll
from .bones import Bones
from .character_file import (
    CharacterFile,
    bind_pose,
    file_to_doll,
    read_character_file,
    rider_of,
    rider_pose,
)

SMALLEST = 1e-30
"""Determinant of a bind pose, as of inverse bind matrices."""

LARGEST = 1e9
"""Of a transform in m, and of its rate, above which an animation is broken."""


@dataclass(frozen=True)
class Carrier:
    """The bone of a character that carries a body of its doll."""

    body: str
    node: int
    pose: Pose
    """Of the body in the character's bind pose, doll's frame."""
    from_bind: np.ndarray
    """(4, 4) from the doll's frame to the bone's in the bind pose."""


@dataclass(frozen=True, eq=False)
class CharacterMotion:
    """An animation of a character's file as BodyMotions of its doll."""

    name: str
    doll: Ragdoll
    _source: CharacterFile
    _to_doll: np.ndarray
    _carriers: tuple[Carrier, ...]

    @property
    def duration(self) -> float:
        """Duration, s, from 0 to the last key. Raises a ModelError for a broken track."""
        return self._source.animations[self.name].duration

    @property
    def key_times(self) -> np.ndarray:
        """Times (k,) of the keys of all tracks, s."""
        tracks = self._source.animations[self.name].tracks.values()
        return np.concatenate([each.times for each in tracks])

    def at(self, times: np.ndarray) -> dict[str, BoneMotion]:
        """Motions of the bodies as their bones move, at ``times`` (...), in the doll's frame."""
        # Overflow shows in the results, which are checked.
        with np.errstate(over='ignore', invalid='ignore'):
            both = np.array(self._source.animations[self.name].worlds(self._source.nodes, times))
            motions = {}
            for carrier in self._carriers:
                moved, rate = self._to_doll @ both[:, carrier.node] @ carrier.from_bind
                largest = max(np.abs(moved).max(), np.abs(rate).max())
                if not largest < LARGEST:
                    raise errors.OutOfRange(f'{self.name}.{carrier.body}', float(largest),
                                            f'transforms of at most {LARGEST:g}, m, and per s')
                place = np.append(carrier.pose.position, 1.0)
                orientation = rotation.multiply(rotation.nearest_rotation(moved[..., :3, :3]),
                                                carrier.pose.orientation)
                motions[carrier.body] = BoneMotion(
                    rotation.multiply(orientation, rotation.inverse(
                        self.doll.bone(carrier.body).orientation)),
                    moved[..., :3, :] @ place, rate[..., :3, :] @ place,
                    rotation.nearest_rotation_spin(moved[..., :3, :3], rate[..., :3, :3]))
        return motions


def read_character_motions(doll: Ragdoll) -> dict[str, CharacterMotion]:
    """The animations of the file of a doll's character, by their names; see load_animations()."""
    source = read_character_file(doll)
    with errors.naming(source.path):
        if not source.animations:
            return {}
    to_doll = file_to_doll(doll, source)
    carriers = _carriers(doll, source.bones, to_doll)
    return {name: CharacterMotion(name, doll, source, to_doll, carriers)
            for name in source.animations}


def _carriers(doll: Ragdoll, bones: Bones, to_doll: np.ndarray) -> tuple[Carrier, ...]:
    """The carriers of all bodies that have riders."""
    index = {name: k for k, name in enumerate(bones.names)}
    found = []
    for body in sorted({rider.bone for rider in doll.riders}):
        rider = rider_of(doll, body)
        bone = index[rider.name]
        bind = bones.bind_matrices[bone]
        if not abs(np.linalg.det(to_doll @ bind)) > SMALLEST:
            raise errors.WrongForm('riders', rider.name, 'a bone with a scale in its bind pose')
        there = bind_pose(to_doll, bind)
        pose = doll.bone(body).pose if there is None else there.compose(
            rider_pose(rider).relative(Pose()))
        found.append(Carrier(body, bones.nodes[bone], pose, np.linalg.inv(to_doll @ bind)))
    return tuple(found)
