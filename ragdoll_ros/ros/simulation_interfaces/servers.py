"""Servers of the standard's services, if the package simulation_interfaces is installed.

Their names are below the node's name, as ~/get_entities.
"""
from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.node import Node

from ...model.errors import RagdollError
from ..inputs.no_world import NO_WORLD
from .codes import Code, Refusal
from .entity_services import EntityServices
from .resources.world_loader import WorldLoader
from .run_state import ControlledNode, RunState
from .simulation_services import SimulationServices
from .spawning import SpawnServices
from .stepping import Stepper

try:
    from simulation_interfaces import action, msg, srv
except ImportError as error:  # not on PyPI, which has the rest of ROS
    srv, MISSING = None, str(error)

RESULT_TIMEOUT = 60
"""s that the result of an action is kept for who asks."""

QUIT_DELAY = 0.2
"""s from the request to quit to the end of the node: the response is sent before."""


WITHOUT_WORLD = {'GetSimulatorFeatures', 'GetSimulationState', 'SetSimulationState',
                 'GetSpawnables', 'GetAvailableWorlds', 'LoadWorld', 'UnloadWorld',
                 'GetCurrentWorld'}
"""Services that answer while no world is loaded; all others are refused."""


class SimulationInterfaces:
    """The servers on ``node``; ``controlled`` is the same node. ``after``: see EntityServices."""

    def __init__(self, node: Node, controlled: ControlledNode, steady: Clock,
                 after: Callable[[], None]) -> None:
        self._node, self._controlled, self._steady = node, controlled, steady
        self.actions: list[ActionServer] = []
        self.status = ''
        """For /diagnostics: how many services there are, or why there are none."""
        if srv is None:
            self.status = f'not served, as simulation_interfaces is not installed: {MISSING}'
            return
        self._loader = WorldLoader(node, steady, controlled.load_world)
        run_state = RunState(controlled, self._loader, self._shut_down)
        entities = EntityServices(controlled, msg, after)
        spawning = SpawnServices(controlled, msg, lambda: entities.entities)
        simulation = SimulationServices(
            controlled, run_state, Stepper(node, steady, controlled, run_state), msg, action,
            self._loader, spawning)
        # In a group of their own, as StepSimulation waits: others are served meanwhile.
        self._group = ReentrantCallbackGroup()
        served = {name: handler for name, handler in {
            **simulation.handlers, **entities.handlers, **spawning.handlers}.items()
            if hasattr(srv, name)}
        for name, handler in served.items():
            self._serve(name, handler)
        self.actions.append(ActionServer(
            node, action.SimulateSteps, '~/simulate_steps', simulation.simulate_steps,
            callback_group=self._group, cancel_callback=simulation.accept_cancel,
            result_timeout=RESULT_TIMEOUT))
        simulation.served = tuple(served)
        self.status = f'{len(served)} services, 1 action'

    def destroy(self) -> None:
        """Destroy the action server, which the node does not destroy, and cancel a load that is
        under way.
        """
        if srv is not None:
            self._loader.cancel('the node ends')
        while self.actions:
            self.actions.pop().destroy()

    def _serve(self, name: str, handler: Callable) -> None:
        """Create a service; what its handler raises becomes the result, and is counted."""
        topic = f'~/{snake_case(name)}'

        async def serve(request: Any, response: Any) -> Any:
            refused = None
            try:
                if name not in WITHOUT_WORLD and not self._controlled.has_world:
                    raise Refusal(Code.INCORRECT_STATE, NO_WORLD)
                waiting = handler(request, response)
                if inspect.isawaitable(waiting):
                    await waiting
            except RagdollError as error:
                refused = error
                self._controlled.input_counts.refuse(topic, error)
            if hasattr(response, 'result'):
                response.result.result = int(Code.OK) if refused is None else getattr(
                    refused, 'code', int(Code.OPERATION_FAILED))
                response.result.error_message = (response.result.error_message
                                                 if refused is None else str(refused))
            return response

        self._node.create_service(getattr(srv, name), topic, serve, callback_group=self._group)

    def _shut_down(self) -> None:
        """End the process as a signal does, soon."""
        self._node.get_logger().info('quitting, as ~/set_simulation_state asks')
        self._node.create_timer(QUIT_DELAY, self._node.context.try_shutdown, clock=self._steady)


def snake_case(name: str) -> str:
    """Convert a name such as GetEntities to get_entities."""
    return re.sub('(?<=[a-z])(?=[A-Z])', '_', name).lower()
