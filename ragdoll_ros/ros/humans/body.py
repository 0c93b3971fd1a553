"""A doll as a body of REP 155 (draft): its id, its URDF from the mid-hips on, its joints."""
from __future__ import annotations

import dataclasses
import itertools
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...files.urdf import to_urdf
from ...model.per_doll import PerDoll
from ...model.pose import Pose
from ...model.ragdoll import Ragdoll
from ...model.scene import Scene

JOINTS = frozenset((
    'waist', 'r_head', 'y_head', 'p_head',
    *(f'{side}_{name}' for side in 'lr' for name in (
        'y_shoulder', 'p_shoulder', 'r_shoulder', 'elbow', 'y_hip', 'p_hip', 'r_hip', 'knee'))))
"""The draft's names of joints: a doll that has them all is a person, as ragdoll_person makes."""

ANY_ID = '\0'
"""Placeholder for the id in a URDF that equal dolls share; not allowed in XML."""


@dataclass(frozen=True)
class Body:
    """A person of a scene; ``root`` and ``angles`` are indices of the scene's bones and angles."""

    id: str
    root: int
    angles: np.ndarray
    joint_names: tuple[str, ...]
    frame: Pose
    """The frame body_<id>, in the root bone's: at the mid-hips, x forwards, z up in bind pose."""
    urdf: str

    @property
    def frame_name(self) -> str:
        """body_<id>, the root link of the URDF."""
        return f'body_{self.id}'


class Person(NamedTuple):
    """What bodies of equal dolls share: the names of the angles and, if the doll is a person, the
    frame and the URDF with ANY_ID for the id. Else ``frame`` is None.
    """

    angle_names: tuple[str, ...]
    frame: Pose | None = None
    urdf: str = ''

    @classmethod
    def of(cls, doll: Ragdoll) -> Person:
        """Return what the bodies of a doll share."""
        names = tuple(name for joint in doll.joints for name in joint.angle_names)
        if set(names) >= JOINTS:
            return cls(names, doll.root.pose.relative(_mid_hips(doll)), body_urdf(doll))
        return cls(names)


def bodies(scene: Scene, most: int, persons: PerDoll[Person] | None = None) -> list[Body]:
    """Return the first persons of a scene, ``most`` at most. ``persons``: what Person.of has made
    for dolls, kept from scene to scene.
    """
    found, ids, first = [], set(), 0
    persons = persons or PerDoll(Person.of)
    for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
        doll = placement.doll
        names, frame, urdf = persons[doll]
        if frame is not None and len(found) < most:
            body_id = _id(placement.name, ids)
            ids.add(body_id)
            found.append(Body(
                body_id, own.start + doll.bones.index(doll.root),
                np.arange(first, first + len(names)), tuple(f'{name}_{body_id}' for name in names),
                frame, urdf.replace(ANY_ID, body_id)))
        first += len(names)
    return found


def _id(name: str, taken: set[str]) -> str:
    """Make the doll's name part of a topic's name: letters, digits and underscores, a letter first.
    A number is added if the name is in ``taken``.
    """
    plain = re.sub('[^A-Za-z0-9_]', '_', name)
    plain = plain if plain[:1].isalpha() else f'b{plain}'
    numbered = (f'{plain}_{count}' for count in itertools.count(2))
    return next(each for each in itertools.chain([plain], numbered) if each not in taken)


def _mid_hips(doll: Ragdoll) -> Pose:
    """Return a frame in the middle between the hip joints with the axes of the doll: its pose in
    the doll's frame, bind pose.
    """
    return Pose(np.mean([joint.anchor for joint in doll.joints
                         if {'l_p_hip', 'r_p_hip'} & set(joint.angle_names)], axis=0))


def body_urdf(doll: Ragdoll) -> str:
    """Return the doll's URDF with a root link body_<id> above it. All names have the suffix _<id>;
    ANY_ID stands for <id>.
    """
    ending, hips = f'_{ANY_ID}', _mid_hips(doll)
    renamed = doll.renamed(lambda name: name + ending)
    joints = tuple(
        dataclasses.replace(joint, names=tuple(name + ending for name in old.angle_names))
        for joint, old in zip(renamed.joints, doll.joints, strict=True))
    text = to_urdf(dataclasses.replace(renamed, name=f'body{ending}', joints=joints))
    # Links between the axes of a joint are the bone's name with /1 and /2, also before the suffix.
    text = re.sub(rf'{ending}/(\d)"', rf'/\1{ending}"', text)
    x, y, z = (np.array(doll.root.position) - hips.position).tolist()
    head, rest = text.split('<robot', 1)
    opening, rest = rest.split('\n', 1)
    return f"""{head}<robot{opening}
  <link name="body{ending}"/>
  <joint name="root{ending}" type="fixed">
    <parent link="body{ending}"/>
    <child link="{doll.root.name}{ending}"/>
    <origin xyz="{x!r} {y!r} {z!r}"/>
  </joint>
{rest}"""
