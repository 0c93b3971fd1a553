"""Entities of a scene: its dolls and static bodies by name, and each bone as doll/bone."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...model.errors import ModelError, one_of
from ...model.ragdoll import Ragdoll
from ...model.scene import Scene
from ...model.static_body import StaticBody
from ..humans.body import JOINTS
from .codes import Code, Refusal

if TYPE_CHECKING:
    from ...physics.simulation import Simulation

INVALID_POSE = 101
"""Result of SetEntityState."""

HUMAN_BONES = {'head', 'torso', 'left_thigh', 'right_thigh'}
"""Bones of the default doll and of the article's, which are human as well."""

CHARACTERS = ('.glb', '.gltf', '.vrm')
"""Ends of the names of rigged characters' files."""

MAX_TEXT, MAX_TAGS = 1000, 100
"""Characters of a description or tag, and number of tags."""


class Category(IntEnum):
    """The standard's categories."""

    OBJECT = 0
    ROBOT = 1
    HUMAN = 2
    DYNAMIC_OBJECT = 4
    STATIC_OBJECT = 5


@dataclass(frozen=True)
class Info:
    """What an entity is."""

    category: Category
    description: str = ''
    tags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Entity:
    """A doll, a bone or a static body.

    ``bones`` are its indices in arrays over bones, ``root`` the index of the bone whose pose is the
    entity's; a static body has no bones. ``doll`` is the name of a whole doll, else empty.
    """

    name: str
    info: Info
    bones: range = range(0)
    root: int = -1
    doll: str = ''
    body: StaticBody | None = None

    def state_row(self, simulation: Simulation) -> np.ndarray:
        """Position m, quaternion xyzw, linear m/s and angular velocity rad/s (13,), world frame.

        Of a doll those of its root bone's centre of mass; a static body rests.
        """
        if self.body is not None:
            return np.array([*self.body.position, *self.body.orientation, *np.zeros(6)])
        return simulation.state.rows[self.root]

    def set_state(self, simulation: Simulation, pose: Sequence[float] | None,
                  twist: Sequence[float] | None) -> None:
        """Set pose (7,) and twist (6,) of a doll's root, world frame; None: as it is.

        Raises Refusal for a static body or bone, or for numbers that are not valid.
        """
        if self.body is not None and twist is not None and any(twist):
            raise Refusal(Code.OPERATION_FAILED, f'{self.name} is static: it has no twist')
        if not self.doll:
            what = 'a static body, which stays' if self.body else "a bone: set its doll's state"
            raise Refusal(Code.FEATURE_UNSUPPORTED, f'{self.name} is {what}')
        given = {} if pose is None else {'position': pose[:3], 'orientation': pose[3:]}
        if twist is not None:
            given |= {'velocity': twist[:3], 'spin': twist[3:]}
        if not given:
            return
        try:
            simulation.set_state(self.doll, **given)
        except ModelError as error:
            code = INVALID_POSE if error.path in ('position', 'orientation') else (
                Code.OPERATION_FAILED)
            raise Refusal(code, error) from None


class Entities:
    """The entities of a scene. ``infos``: infos by name, taken over as if set by set_info(), of
    entities that the scene has.
    """

    def __init__(self, scene: Scene, infos: Mapping[str, Info] | None = None) -> None:
        self._scene = scene
        self._listed = {each.name: each for each in (*_dolls(scene), *_bodies(scene))}
        self.infos = {name: info for name, info in (infos or {}).items()
                      if name in self._listed or name in self._bones}
        """What set_info() has set, by name."""

    def __iter__(self) -> Iterator[Entity]:
        """All but the bones: dolls, then static bodies."""
        return iter(self._listed.values())

    def find(self, name: str) -> Entity:
        """An entity by its name, or a bone by doll/bone. Raises Refusal: not found."""
        found = self._listed.get(name) or self._bones.get(name)
        if found is None:
            raise Refusal(Code.NOT_FOUND, f'entity: {name[:60]!r}; expected '
                          f'{one_of(list(self._listed), name)}, or doll/bone')
        return found

    def info(self, entity: Entity) -> Info:
        """What the entity is, as set last."""
        return self.infos.get(entity.name, entity.info)

    def set_info(self, entity: Entity, info: Info) -> None:
        """Replace what the entity is. Raises Refusal for too many or too long texts."""
        longest = max(map(len, (info.description, *info.tags)))
        if longest > MAX_TEXT or len(info.tags) > MAX_TAGS:
            raise Refusal(Code.OPERATION_FAILED, f'info: {longest} characters, {len(info.tags)} '
                          f'tags; expected at most {MAX_TEXT} characters, {MAX_TAGS} tags')
        self.infos[entity.name] = info

    @cached_property
    def _bones(self) -> dict[str, Entity]:
        return {f'{placement.name}/{bone.name}': Entity(
            f'{placement.name}/{bone.name}', Info(Category.OBJECT, f'bone of {placement.name}'),
            range(index, index + 1), index)
            for placement, own in zip(self._scene.dolls, self._scene.bone_slices, strict=True)
            for index, bone in enumerate(placement.doll.bones, own.start)}


def _dolls(scene: Scene) -> Iterator[Entity]:
    for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
        doll = placement.doll
        root = own.start + doll.bones.index(doll.root)
        yield Entity(placement.name, Info(_category(doll), f'doll of {len(doll.bones)} bones'),
                     range(own.start, own.stop), root, placement.name)


def _bodies(scene: Scene) -> Iterator[Entity]:
    for body in scene.bodies:
        yield Entity(body.name, Info(Category.STATIC_OBJECT, f'static {body.shape.kind}'),
                     body=body)


def _category(doll: Ragdoll) -> Category:
    """Classify a doll: human by the names of its joints or bones, or if it is fitted to a rigged
    character; else a robot if it has joints, else an object.
    """
    names = {name for joint in doll.joints for name in joint.angle_names}
    if (names >= JOINTS or {bone.name for bone in doll.bones} >= HUMAN_BONES
            or str(doll.model or '').lower().endswith(CHARACTERS)):
        return Category.HUMAN
    return Category.ROBOT if doll.joints else Category.OBJECT
