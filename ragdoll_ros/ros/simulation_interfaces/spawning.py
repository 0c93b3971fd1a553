"""Services on what comes and goes: dolls are spawned and deleted while time goes on."""
from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...files.scene import MOST_DOLLS
from ...model import rotation
from ...model.errors import RagdollError
from ...model.pose import Pose
from ...model.ragdoll import WORLD
from ...model.rotation import IDENTITY
from ...model.scene import Placement, Scene
from ...model.vectors import unit_vector
from ...physics.actions.grab import checked_point
from ...physics.engine.capabilities import Capability
from ...physics.prepared_change import PreparedChange
from ...physics.simulation import Simulation
from ..messages.convert import to_vector
from .bounds import Kind
from .codes import Code, Feature, Refusal
from .entities import Entities
from .resources.dolls import Found, doll_of
from .resources.spawnables import spawnables
from .run_state import ControlledNode

NAME_NOT_UNIQUE, NAME_INVALID, NAMESPACE_INVALID, INVALID_POSE = 101, 102, 105, 109
"""Results of SpawnEntity."""

ENTITIES_SPAWN_FAILED = 150
"""Result of SpawnEntities."""

MOST_REQUESTS = 100
"""Entities of one request."""

NAME = re.compile(r'[^\s/][^/\x00-\x1f]{0,99}')
"""As in the schema of scenes."""


class SpawnServices:
    """Handlers, each ``(request, response)``, which raise Refusal.

    ``messages``: the module simulation_interfaces.msg. ``entities()``: the entities of the scene.
    """

    FEATURES = {
        'SpawnEntity': (Feature.SPAWNING, Feature.SPAWNING_RESOURCE_STRING),
        'SpawnEntities': (Feature.SPAWNING_ENTITIES,),
        'DeleteEntity': (Feature.DELETING,),
        'GetSpawnables': (Feature.SPAWNABLES,)}
    """What each service makes possible, with an engine that has SCENE_CHANGES."""

    def __init__(self, controlled: ControlledNode, messages: Any,
                 entities: Callable[[], Entities]) -> None:
        self._controlled, self._messages, self._entities = controlled, messages, entities
        self._simulation: Simulation | None = None
        self._world: Scene
        """The simulation of the last change, and its scene before the first one."""
        self.handlers = {
            'SpawnEntity': self._spawn, 'SpawnEntities': self._spawn_several,
            'DeleteEntity': self._delete, 'GetSpawnables': self._get_spawnables}

    @property
    def has_changed(self) -> bool:
        """Whether dolls have come or gone since the world was loaded."""
        simulation = self._controlled.simulation
        return simulation is self._simulation and simulation.scene is not self._world

    def remove_spawned(self) -> None:
        """Remove all dolls that were spawned; those that were deleted stay away."""
        if not self.has_changed:
            return
        own = {id(placement) for placement in self._world.dolls}
        spawned = [placement.name for placement in self._controlled.simulation.scene.dolls
                   if id(placement) not in own]
        for name in spawned:
            self._remove(name)

    def _spawn(self, request: Any, response: Any) -> None:
        self._check_engine()
        placed, response.result.error_message = self._placed(request, {}, self._taken())
        self._add([placed])
        response.entity_name = placed.name

    def _spawn_several(self, request: Any, response: Any) -> None:
        """Spawn all entities that can be, in one change. One that cannot does not hinder the
        others; Refusal is raised at the end.
        """
        self._check_engine()
        if len(request.spawn_requests) > MOST_REQUESTS:
            raise Refusal(Code.OPERATION_FAILED, f'spawn_requests: {len(request.spawn_requests)}; '
                          f'expected at most {MOST_REQUESTS}')
        read: dict[tuple[str, str], Found] = {}
        spawned: list[Placement] = []
        for one in request.spawn_requests:
            made = self._messages.SpawnResult()
            response.results.append(made)
            try:
                taken = self._taken() | {placement.name for placement in spawned}
                placed, made.result.error_message = self._placed(one, read, taken)
                made.entity_name, made.result.result = placed.name, int(Code.OK)
                spawned.append(placed)
            except Refusal as refused:
                made.result.result, made.result.error_message = refused.code, str(refused)
        if spawned:
            self._add(spawned)
        failed = len(response.results) - len(spawned)
        if failed:
            raise Refusal(ENTITIES_SPAWN_FAILED,
                          f'{failed} of {len(response.results)} failed: see results')

    def _placed(self, request: Any, read: dict[tuple[str, str], Found],
                taken: set[str]) -> tuple[Placement, str]:
        """Return the placement that a SpawnEntity asks for, and notes on its resource.

        ``read``: resources by uri and text, each read once; ``taken``: names in use. A request of
        version 1 has the fields of a Resource itself. Raises Refusal.
        """
        if request.entity_namespace:
            raise Refusal(NAMESPACE_INVALID, f'entity_namespace: {request.entity_namespace[:60]!r};'
                          " expected none, as a doll's topics are the node's")
        pose = self._pose(request.initial_pose)
        resource = getattr(request, 'entity_resource', request)
        key = resource.uri, resource.resource_string
        if key not in read:
            read[key] = self._controlled.run_beside(lambda: doll_of(*key))
        placement, notes = read[key]
        name = _unused_name(request.name or placement.name, request.allow_renaming, taken)
        if len(taken) - len(self._controlled.simulation.scene.bodies) >= MOST_DOLLS:
            raise Refusal(Code.OPERATION_FAILED, f'there are {MOST_DOLLS} dolls, the most')
        return at_root_pose(dataclasses.replace(placement, name=name), pose), '; '.join(notes)

    def _taken(self) -> set[str]:
        """Names of all dolls and bodies."""
        return {entity.name for entity in self._entities()}

    def _delete(self, request: Any, _: Any) -> None:
        self._check_engine()
        entity = self._entities().find(request.entity)
        if not entity.doll:
            raise Refusal(Code.FEATURE_UNSUPPORTED, f'{entity.name} is ' + (
                'a static body, which stays' if entity.body else 'a bone: delete its doll'))
        self._remove(entity.doll)

    def _get_spawnables(self, request: Any, response: Any) -> None:
        """List what can be spawned. Sources that are no folders are named in the result and not an
        error.
        """
        found, response.result.error_message = self._controlled.run_beside(
            lambda: spawnables(request.sources))
        for each in found:
            made = self._messages.Spawnable()
            getattr(made, 'entity_resource', made).uri = each.uri
            made.description = each.description
            if each.box is not None:
                made.spawn_bounds.type = int(Kind.BOX)
                made.spawn_bounds.points = [to_vector(corner) for corner in each.box[::-1]]
            response.spawnables.append(made)

    def _add(self, placements: list[Placement]) -> None:
        """Add dolls, all at once."""
        self._change(lambda simulation: simulation.prepare_add(placements))

    def _remove(self, doll: str) -> None:
        self._change(lambda simulation: simulation.prepare_remove(doll))

    def _change(self, prepare: Callable[[Simulation], PreparedChange]) -> None:
        """Change the dolls; before the first change, note the world."""
        simulation = self._controlled.simulation
        if simulation is not self._simulation:
            self._simulation, self._world = simulation, simulation.scene
        self._controlled.change_dolls(prepare)

    def _check_engine(self) -> None:
        simulation = self._controlled.simulation
        if Capability.SCENE_CHANGES not in simulation.capabilities:
            raise Refusal(Code.FEATURE_UNSUPPORTED, f'engine {simulation.engine_name} adds and '
                          'removes no dolls; expected rigid')

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


def _unused_name(name: str, allow_renaming: bool, taken: set[str]) -> str:
    """The name, with a number if it is taken. Raises Refusal."""
    if not NAME.fullmatch(name):
        raise Refusal(NAME_INVALID, f'name: {name[:60]!r}; expected text without / and control '
                      'characters, at most 100 characters')
    if name in taken and not allow_renaming:
        raise Refusal(NAME_NOT_UNIQUE, f'name: {name[:60]!r} is taken; expected another one, '
                      'or allow_renaming')
    return next(each for each in _numbered(name) if each not in taken)


def at_root_pose(placement: Placement, pose: Pose) -> Placement:
    """The placement with the centre of mass and the axes of its root at ``pose``, world frame."""
    origin = dataclasses.replace(placement, position=(0.0, 0.0, 0.0), orientation=IDENTITY)
    root = origin.bone_pose(placement.doll.root)
    turn = rotation.multiply(pose.orientation, rotation.inverse(root.orientation))
    position = pose.position - rotation.rotate(turn, root.position)
    return dataclasses.replace(placement, position=tuple(position.tolist()),
                               orientation=tuple(turn.tolist()))


def _numbered(name: str) -> Iterator[str]:
    yield name
    yield from (f'{name[:90]}_{number}' for number in range(2, MOST_DOLLS + 3))
