"""Services on entities: lists, states, infos, bounds."""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...model.drive import MAX_SPEED
from ...model.ragdoll import WORLD
from ...model.scene import Scene
from ...physics.simulation import Simulation
from ..inputs.subscriptions import limited
from ..messages.convert import to_header, to_pose, to_vector
from .bounds import Kind, Volume, own_box
from .codes import Code, Feature, Refusal
from .entities import Category, Entities, Entity, Info
from .filters import Filters
from .run_state import ControlledNode

SET_ENTITY_STATE = '~/set_entity_state'


class EntityServices:
    """Handlers, each ``(request, response)``, which raise Refusal.

    ``messages``: the module simulation_interfaces.msg. ``after`` is called when a state has been
    set.
    """

    FEATURES = {
        'GetEntities': (Feature.ENTITY_TAGS, Feature.ENTITY_CATEGORIES, Feature.ENTITY_BOUNDS_BOX),
        'GetEntitiesStates': (Feature.ENTITY_STATE_GETTING,),
        'GetEntityState': (Feature.ENTITY_STATE_GETTING,),
        'SetEntityState': (Feature.ENTITY_STATE_SETTING,),
        'GetEntityInfo': (Feature.ENTITY_INFO_GETTING,),
        'SetEntityInfo': (Feature.ENTITY_INFO_SETTING,),
        'GetEntityBounds': (Feature.ENTITY_BOUNDS,)}
    """What each service makes possible."""

    def __init__(self, controlled: ControlledNode, messages: Any,
                 after: Callable[[], None]) -> None:
        self._controlled, self._messages, self._after = controlled, messages, after
        self._simulation: Simulation | None = None
        self._scene: Scene | None = None
        self.handlers = {
            'GetEntities': self._get_entities, 'GetEntitiesStates': self._get_entities_states,
            'GetEntityState': self._get_entity_state, 'SetEntityState': self._set_entity_state,
            'GetEntityInfo': self._get_entity_info, 'SetEntityInfo': self._set_entity_info,
            'GetEntityBounds': self._get_entity_bounds}

    @property
    def entities(self) -> Entities:
        """The entities of the current scene. Infos are kept while dolls come and go."""
        simulation = self._controlled.simulation
        if simulation.scene is not self._scene:
            self._entities = Entities(simulation.scene, self._entities.infos if (
                simulation is self._simulation) else {})
            self._simulation, self._scene = simulation, simulation.scene
        return self._entities

    def _get_entities(self, request: Any, response: Any) -> None:
        response.entities = [entity.name for entity in self._selected(request.filters)]

    def _get_entities_states(self, request: Any, response: Any) -> None:
        found = self._selected(request.filters)
        response.entities = [entity.name for entity in found]
        response.states = [self._fill_state(self._messages.EntityState(), entity)
                           for entity in found]

    def _get_entity_state(self, request: Any, response: Any) -> None:
        self._fill_state(response.state, self.entities.find(request.entity))

    def _set_entity_state(self, request: Any, response: Any) -> None:
        """Set the state of an entity. A request of version 2 of the standard says whether to set
        pose and twist; one of version 1 sets both.
        """
        entity, state, frame = (self.entities.find(request.entity), request.state,
                                request.state.header.frame_id)
        if frame not in ('', WORLD, self._controlled.settings.frame_id):
            raise Refusal(Code.OPERATION_FAILED, f'state.header.frame_id: {frame[:60]!r}; '
                          f'expected {self._controlled.settings.frame_id}')
        pose = twist = None
        if getattr(request, 'set_pose', True):
            p, q = state.pose.position, state.pose.orientation
            pose = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
        if getattr(request, 'set_twist', True):
            twist = [value for name in ('linear', 'angular') for value in limited(
                self._controlled.input_counts, SET_ENTITY_STATE, f'state.twist.{name}',
                getattr(state.twist, name), MAX_SPEED, 'the limit')]
        entity.set_state(self._controlled.simulation, pose, twist)
        if pose is None and twist is None:
            response.result.error_message = 'nothing is set: set_pose and set_twist are false'
        else:
            self._after()

    def _get_entity_info(self, request: Any, response: Any) -> None:
        info = self.entities.info(self.entities.find(request.entity))
        response.info.category.category = int(info.category)
        response.info.description, response.info.tags = info.description, list(info.tags)

    def _set_entity_info(self, request: Any, _: Any) -> None:
        entity, info = self.entities.find(request.entity), request.info
        category = info.category.category
        if category not in list(Category):
            raise Refusal(Code.OPERATION_FAILED, f'info.category: {category}; expected one of '
                          + ', '.join(f'{each} ({each.name.lower()})' for each in Category))
        self.entities.set_info(entity, Info(Category(category), info.description,
                                            tuple(info.tags)))

    def _get_entity_bounds(self, request: Any, response: Any) -> None:
        """Fill in the bounding box, the upper corner first. What is unbounded, as a plane, gets no
        bounds.
        """
        simulation, entity = self._controlled.simulation, self.entities.find(request.entity)
        lower, upper = own_box(entity, simulation.scene, simulation.state)
        if not np.isfinite((lower, upper)).all():
            return
        response.bounds.type = int(Kind.BOX)
        response.bounds.points = [to_vector(upper), to_vector(lower)]

    def _selected(self, filters: Any) -> list[Entity]:
        simulation, bounds = self._controlled.simulation, filters.bounds
        return Filters(
            filters.filter, [each.category for each in filters.categories], filters.tags.tags,
            filters.tags.filter_mode,
            Volume.of(bounds.type, [(p.x, p.y, p.z) for p in bounds.points])).select(
            self.entities, simulation.scene, simulation.state)

    def _fill_state(self, state: Any, entity: Entity) -> Any:
        """Fill an EntityState and return it; accelerations are not known and stay zero."""
        row = entity.state_row(self._controlled.simulation)
        state.header = to_header(self._controlled.stamp, self._controlled.settings.frame_id)
        state.pose = to_pose(row[:7].tolist())
        state.twist.linear, state.twist.angular = to_vector(row[7:10]), to_vector(row[10:])
        return state
