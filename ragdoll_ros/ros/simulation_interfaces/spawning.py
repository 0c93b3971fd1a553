"""Services on what comes and goes: dolls of our YAML are spawned and deleted while time goes on."""
from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...files import yaml_text
from ...files.config import doll_names
from ...files.doll import load_doll
from ...files.scene import MOST_DOLLS, load_scene, scene_from_data
from ...model import rotation
from ...model.errors import RagdollError
from ...model.pose import Pose
from ...model.ragdoll import WORLD
from ...model.rotation import IDENTITY
from ...model.scene import Placement, Scene
from ...model.vectors import unit_vector
from ...physics.actions.grab import checked_point
from ...physics.simulation import Simulation
from ..messages.convert import to_vector
from .bounds import Kind, bounding_box
from .codes import Code, Feature, Refusal
from .entities import Entities
from .run_state import ControlledNode
from .worlds import scene_of

NAME_NOT_UNIQUE, NAME_INVALID, UNSUPPORTED_FORMAT, NO_RESOURCE = 101, 102, 103, 104
NAMESPACE_INVALID, RESOURCE_PARSE_ERROR, UNSUPPORTED_ASSETS, INVALID_POSE = 105, 106, 108, 109
"""Results of SpawnEntity."""

SPAWN_FORMATS = ('yaml',)

NAME = re.compile(r'[^\s/][^/\x00-\x1f]{0,99}')
"""As in the schema of scenes."""

ENGINE = 'rigid'
"""The engine that adds and removes dolls."""


class Spawnable(NamedTuple):
    """A doll in config/, and its box (2, 3) m about its root, lower corner first."""

    name: str
    description: str
    box: np.ndarray


class SpawnServices:
    """Handlers, each ``(request, response)``, which raise Refusal.

    ``messages``: the module simulation_interfaces.msg. ``entities()``: those of the scene.
    """

    FEATURES = {
        'SpawnEntity': (Feature.SPAWNING, Feature.SPAWNING_RESOURCE_STRING),
        'DeleteEntity': (Feature.DELETING,),
        'GetSpawnables': (Feature.SPAWNABLES,)}
    """What each service makes possible, with the engine rigid."""

    def __init__(self, controlled: ControlledNode, messages: Any,
                 entities: Callable[[], Entities]) -> None:
        self._controlled, self._messages, self._entities = controlled, messages, entities
        self._simulation: Simulation | None = None
        self._world: Scene
        """The simulation of the last change, and its scene before the first one."""
        self.handlers = {'SpawnEntity': self._spawn, 'DeleteEntity': self._delete,
                         'GetSpawnables': self._get_spawnables}

    @property
    def has_changed(self) -> bool:
        """Whether dolls have come or gone since the world was loaded."""
        simulation = self._controlled.simulation
        return simulation is self._simulation and simulation.scene is not self._world

    def remove_spawned(self) -> None:
        """Remove all dolls that have come; those that have gone stay away."""
        if not self.has_changed:
            return
        own = {id(placement) for placement in self._world.dolls}
        spawned = [placement.name for placement in self._controlled.simulation.scene.dolls
                   if id(placement) not in own]
        self._controlled.change_dolls(lambda simulation: [
            simulation.remove(name) for name in spawned])

    def _spawn(self, request: Any, response: Any) -> None:
        """Version 2 has a Resource, version 1 its fields."""
        self._check_engine()
        if request.entity_namespace:
            raise Refusal(NAMESPACE_INVALID, f'entity_namespace: {request.entity_namespace[:60]!r};'
                          " expected none, as a doll's topics are the node's")
        pose = self._pose(request.initial_pose)
        resource = getattr(request, 'entity_resource', request)
        placement = self._controlled.run_beside(
            lambda: placement_of(resource.uri, resource.resource_string))
        name = self._unused_name(request.name or placement.name, request.allow_renaming)
        placed = at_root_pose(dataclasses.replace(placement, name=name), pose)
        if len(self._controlled.simulation.scene.dolls) >= MOST_DOLLS:
            raise Refusal(Code.OPERATION_FAILED, f'there are {MOST_DOLLS} dolls, the most')
        self._change(lambda simulation: simulation.add(placed))
        response.entity_name = name

    def _delete(self, request: Any, _: Any) -> None:
        self._check_engine()
        entity = self._entities().find(request.entity)
        if not entity.doll:
            raise Refusal(Code.FEATURE_UNSUPPORTED, f'{entity.name} is ' + (
                'a static body, which stays' if entity.body else 'a bone: delete its doll'))
        self._change(lambda simulation: simulation.remove(entity.doll))

    def _get_spawnables(self, request: Any, response: Any) -> None:
        if request.sources:
            raise Refusal(Code.OPERATION_FAILED,
                          f'sources: {len(request.sources)} not searched; expected none')
        for found in self._controlled.run_beside(spawnables):
            made = self._messages.Spawnable()
            getattr(made, 'entity_resource', made).uri = found.name
            made.description = found.description
            made.spawn_bounds.type = int(Kind.BOX)
            made.spawn_bounds.points = [to_vector(corner) for corner in found.box[::-1]]
            response.spawnables.append(made)

    def _change(self, change: Callable[[Simulation], object]) -> None:
        """Add or remove a doll; before the first change, note the world."""
        simulation = self._controlled.simulation
        if simulation is not self._simulation:
            self._simulation, self._world = simulation, simulation.scene
        self._controlled.change_dolls(change)

    def _check_engine(self) -> None:
        engine = self._controlled.simulation.engine_name
        if engine != ENGINE:
            raise Refusal(Code.FEATURE_UNSUPPORTED,
                          f'engine {engine} adds and removes no dolls; expected {ENGINE}')

    def _pose(self, stamped: Any) -> Pose:
        """The pose of a PoseStamped. Raises Refusal unless it is valid and in the world frame."""
        frame, known = stamped.header.frame_id, self._controlled.settings.frame_id
        if frame not in ('', WORLD, known):
            raise Refusal(INVALID_POSE, f'initial_pose.header.frame_id: {frame[:60]!r}; '
                          f'expected {known}')
        p, q = stamped.pose.position, stamped.pose.orientation
        try:
            return Pose(np.array(checked_point('initial_pose.pose.position', (p.x, p.y, p.z))),
                        np.array(unit_vector('initial_pose.pose.orientation', (q.x, q.y, q.z, q.w),
                                             'a quaternion x, y, z, w, not zero', 4)))
        except RagdollError as error:
            raise Refusal(INVALID_POSE, error) from None

    def _unused_name(self, name: str, allow_renaming: bool) -> str:
        """The name, with a number if it is taken. Raises Refusal."""
        if not NAME.fullmatch(name):
            raise Refusal(NAME_INVALID, f'name: {name[:60]!r}; expected text without / and control '
                          'characters, at most 100 characters')
        taken = {entity.name for entity in self._entities()}
        if name in taken and not allow_renaming:
            raise Refusal(NAME_NOT_UNIQUE, f'name: {name[:60]!r} is taken; expected another one, '
                          'or allow_renaming')
        return next(each for each in _numbered(name) if each not in taken)


def placement_of(uri: str, text: str) -> Placement:
    """The doll of a resource, a scene of one doll or a doll, as it is placed there; its ground and
    bodies are left out. Raises Refusal; says nothing of a file that is no scene.
    """
    try:
        if uri:
            scene = load_scene(scene_of(uri, '', UNSUPPORTED_FORMAT))
        elif not text.strip():
            raise Refusal(NO_RESOURCE, 'uri and resource_string are empty; expected a name in '
                          'config/, a path, or YAML')
        elif text.lstrip().startswith('<'):
            raise Refusal(UNSUPPORTED_FORMAT, 'resource_string: expected a scene or doll as YAML')
        else:
            scene = scene_from_data(yaml_text.parse(text.encode()), Path('/resource_string'))
    except Refusal:
        raise
    except RagdollError as error:
        raise Refusal(RESOURCE_PARSE_ERROR, error) from None
    if len(scene.dolls) > 1:
        raise Refusal(UNSUPPORTED_ASSETS, f'a scene of {len(scene.dolls)} dolls; expected of one')
    return scene.dolls[0]


def at_root_pose(placement: Placement, pose: Pose) -> Placement:
    """The placement with the centre of mass and the axes of its root at ``pose``, world frame."""
    origin = dataclasses.replace(placement, position=(0.0, 0.0, 0.0), orientation=IDENTITY)
    root = origin.bone_pose(placement.doll.root)
    turn = rotation.multiply(pose.orientation, rotation.inverse(root.orientation))
    position = pose.position - rotation.rotate(turn, root.position)
    return dataclasses.replace(placement, position=tuple(position.tolist()),
                               orientation=tuple(turn.tolist()))


@functools.cache
def spawnables() -> Sequence[Spawnable]:
    """The dolls in config/."""
    found = []
    for name in doll_names():
        doll = load_doll(name)
        box = bounding_box([(bone.shape, doll.root.pose.relative(bone.pose))
                            for bone in doll.bones])
        found.append(Spawnable(name, f'doll of {len(doll.bones)} bones, {doll.mass:.3g} kg', box))
    return tuple(found)


def _numbered(name: str) -> Iterator[str]:
    yield name
    yield from (f'{name[:90]}_{number}' for number in range(2, MOST_DOLLS + 3))
