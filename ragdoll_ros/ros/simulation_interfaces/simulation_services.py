"""Services on the simulation as a whole: features, state, reset, steps, worlds."""
from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

from rclpy.action import CancelResponse

from ...model.errors import RagdollError
from ...physics.engine.capabilities import Capability
from ..inputs.no_world import NO_WORLD
from .codes import Code, Feature, Refusal
from .entity_services import EntityServices
from .resources.dolls import SPAWN_FORMATS
from .resources.world_loader import Loaded, WorldLoader
from .resources.worlds import (
    NO_WORLD_LOADED,
    RESOURCE_PARSE_ERROR,
    World,
    available,
    scene_of,
)
from .run_state import ALL, SPAWNED, STATE, TIME, ControlledNode, RunState, checked_scope
from .spawning import SpawnServices
from .stepping import Stepper

SPAWNING = {Feature.SIMULATION_RESET_SPAWNED,
            *(feature for each in SpawnServices.FEATURES.values() for feature in each)}
"""Features that need an engine that adds and removes dolls."""

INFO = ('ragdoll_ros: docs/simulation_interfaces.md; entities are dolls, static bodies, and bones '
        'as doll/bone; accelerations are not filled')


class SimulationServices:
    """Handlers, each ``(request, response)``, which raise Refusal.

    ``messages``, ``actions``: the modules simulation_interfaces.msg and .action.
    """

    FEATURES = {
        'GetSimulatorFeatures': (),
        'GetSimulationState': (Feature.SIMULATION_STATE_GETTING,),
        'SetSimulationState': (Feature.SIMULATION_STATE_SETTING, Feature.SIMULATION_STATE_PAUSE),
        'ResetSimulation': (Feature.SIMULATION_RESET, Feature.SIMULATION_RESET_STATE,
                            Feature.SIMULATION_RESET_SPAWNED),
        'StepSimulation': (Feature.STEP_SIMULATION_SINGLE, Feature.STEP_SIMULATION_MULTIPLE),
        'GetAvailableWorlds': (Feature.AVAILABLE_WORLDS,),
        'LoadWorld': (Feature.WORLD_LOADING,),
        'UnloadWorld': (Feature.WORLD_UNLOADING,),
        'GetCurrentWorld': (Feature.WORLD_INFO_GETTING,)}
    """What each service makes possible."""

    ACTION_FEATURES = (Feature.STEP_SIMULATION_ACTION,)

    def __init__(self, controlled: ControlledNode, run_state: RunState, stepper: Stepper,
                 messages: Any, actions: Any, loader: WorldLoader,
                 spawning: SpawnServices) -> None:
        self._controlled, self._run_state, self._stepper = controlled, run_state, stepper
        self._messages, self._actions = messages, actions
        self._loader, self._spawning = loader, spawning
        self.served: tuple[str, ...] = ()
        """Names of the services that are served."""
        self.handlers = {
            'GetSimulatorFeatures': self._get_features, 'GetSimulationState': self._get_state,
            'SetSimulationState': self._set_state, 'ResetSimulation': self._reset,
            'StepSimulation': self._step, 'GetAvailableWorlds': self._get_available_worlds,
            'LoadWorld': self._load_world, 'UnloadWorld': self._unload_world,
            'GetCurrentWorld': self._get_current_world}

    async def simulate_steps(self, goal: Any) -> Any:
        """Execute the action's goal: feedback after each step; aborted or cancelled as refused."""
        feedback, result = (self._actions.SimulateSteps.Feedback(),
                            self._actions.SimulateSteps.Result())

        def publish(made: int, left: int) -> None:
            feedback.completed_steps, feedback.remaining_steps = made, left
            goal.publish_feedback(feedback)

        try:
            await self._stepper.step(goal.request.steps, publish,
                                     lambda: goal.is_cancel_requested)
        except Refusal as refused:
            result.result.result, result.result.error_message = refused.code, str(refused)
            (goal.canceled if goal.is_cancel_requested else goal.abort)()
        else:
            result.result.result = int(Code.OK)
            goal.succeed()
        return result

    @staticmethod
    def accept_cancel(_: Any) -> CancelResponse:
        """Every goal may be cancelled."""
        return CancelResponse.ACCEPT

    def _get_features(self, _: Any, response: Any) -> None:
        response.features.features = features(
            self.served, self._controlled.simulation.capabilities)
        response.features.spawn_formats = list(SPAWN_FORMATS)
        response.features.custom_info = INFO

    def _get_state(self, _: Any, response: Any) -> None:
        response.state.state = int(self._run_state.state)

    def _set_state(self, request: Any, _: Any) -> None:
        self._run_state.set(request.state.state)

    async def _reset(self, request: Any, _: Any) -> None:
        """All is the world as it was loaded; other scopes keep what was deleted away."""
        scope, spawning = checked_scope(request.scope), self._spawning
        if scope == ALL and spawning.has_changed:
            loaded = await self._loaded(self._controlled.settings.scene)
            self._run_state.reset(lambda: self._use(loaded))
            return
        if scope & SPAWNED:
            spawning.remove_spawned()
        if scope & STATE:
            self._run_state.reset(lambda: self._controlled.reset(keep_time=not scope & TIME))

    async def _step(self, request: Any, _: Any) -> None:
        await self._stepper.step(request.steps)

    def _get_available_worlds(self, request: Any, response: Any) -> None:
        if request.filter.tags:
            raise Refusal(Code.FEATURE_UNSUPPORTED, 'filter.tags: worlds have no tags')
        worlds, message = available(request.additional_sources, request.continue_on_error)
        response.worlds = [self._fill(self._messages.WorldResource(), world) for world in worlds]
        response.result.error_message = message

    async def _load_world(self, request: Any, response: Any) -> None:
        """Version 2 has a Resource, version 1 its fields. The present world goes on until the new
        one is there.
        """
        resource = getattr(request, 'world_resource', request)
        self._use(await self._loaded(scene_of(resource.uri, resource.resource_string)))
        self._run_state.stop()
        self._fill(response.world, self._world())

    def _unload_world(self, _: Any, __: Any) -> None:
        cancelled = self._loader.cancel('the world is to be unloaded')
        if self._controlled.has_world:
            self._controlled.unload_world()
        elif not cancelled:
            raise Refusal(NO_WORLD_LOADED, NO_WORLD)

    def _get_current_world(self, _: Any, response: Any) -> None:
        if not self._controlled.has_world:
            raise Refusal(NO_WORLD_LOADED, NO_WORLD)
        self._fill(response.world, self._world())

    async def _loaded(self, name: str) -> Loaded:
        """A world, loaded while all is served. Raises Refusal."""
        try:
            return await self._loader.load(name)
        except Refusal:
            raise
        except RagdollError as error:
            raise Refusal(RESOURCE_PARSE_ERROR, error) from None

    def _use(self, loaded: Loaded) -> None:
        """Replace the present world. Raises Refusal."""
        done = self._controlled.use_world(loaded)
        if not done.successful:
            raise Refusal(RESOURCE_PARSE_ERROR, done.reason)

    def _world(self) -> World:
        scene = self._controlled.simulation.scene
        return World(scene.name, self._controlled.settings.scene, scene.description)

    @staticmethod
    def _fill(resource: Any, world: World) -> Any:
        """Fill a WorldResource and return it."""
        resource.name, resource.description = world.name, world.description
        resource.world_resource.uri = world.uri
        return resource


def features(served: Iterable[str], capabilities: Collection[Capability]) -> list[int]:
    """Return the features of the action and of the ``served`` services as numbers, ascending;
    without those of spawning if the engine cannot add or remove dolls.
    """
    possible = {**SimulationServices.FEATURES, **EntityServices.FEATURES, **SpawnServices.FEATURES}
    found = {*SimulationServices.ACTION_FEATURES,
             *(feature for name in served for feature in possible[name])}
    return sorted(found if Capability.SCENE_CHANGES in capabilities else found - SPAWNING)
