"""The simulation's state as the standard has it: stopped, playing or paused; and its reset.

Stopped means paused at the start: after a start with ``start_paused``, a stop, or loading a world.
"""
from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Protocol, TypeVar

from ...physics.prepared_change import PreparedChange
from ...physics.simulation import Simulation
from ..inputs.no_world import NO_WORLD
from ..parameters.node_settings import NodeSettings
from ..services import Controlled
from .codes import Code, Refusal
from .resources.world_loader import Loaded, WorldLoader

if TYPE_CHECKING:
    from rcl_interfaces.msg import SetParametersResult

ALREADY_IN_TARGET_STATE, INCORRECT_TRANSITION = 101, 103
"""Results of SetSimulationState."""

TIME, STATE, SPAWNED, ALL = 1, 2, 4, 255
"""Scopes of a reset, bits but for ALL; 0 is ALL as well."""


Result = TypeVar('Result')


class RunningState(IntEnum):
    """The standard's states."""

    STOPPED = 0
    PLAYING = 1
    PAUSED = 2
    QUITTING = 3
    NO_WORLD = 4
    LOADING_WORLD = 5


class ControlledNode(Controlled, Protocol):
    """What the services act on: the ragdoll node."""

    def load_world(self, name: str) -> Loaded:
        """Load a scene, for use_world(); may run beside the ticks."""

    def use_world(self, loaded: Loaded) -> SetParametersResult:
        """Replace the present world."""

    def unload_world(self) -> None:
        """End the world."""

    @property
    def settings(self) -> NodeSettings:
        """Values of the parameters."""

    @property
    def stamp(self) -> int:
        """Stamp of the current state, ns."""

    def run_beside(self, make: Callable[[], Result]) -> Result:
        """Run ``make`` while the ticks go on, and return what it returns."""

    def change_dolls(self, prepare: Callable[[Simulation], PreparedChange]) -> None:
        """Add or remove dolls as ``prepare(simulation)`` says; time goes on, topics follow."""


class RunState:
    """State of a node's simulation; ``shut_down()`` ends the node."""

    def __init__(self, controlled: ControlledNode, loader: WorldLoader,
                 shut_down: Callable[[], None]) -> None:
        self._controlled, self._loader, self._shut_down = controlled, loader, shut_down
        self._stopped = self.run if controlled.settings.start_paused else None

    @property
    def run(self) -> tuple[Simulation, int, bool]:
        """Identifies the run: a reset, a new scene or its end changes it."""
        controlled = self._controlled
        return (controlled.simulation, controlled.simulation.reset_count, controlled.has_world)

    @property
    def state(self) -> RunningState:
        """The state now."""
        if self._loader.is_loading:
            return RunningState.LOADING_WORLD
        if not self._controlled.has_world:
            return RunningState.NO_WORLD
        if not self._controlled.paused:
            return RunningState.PLAYING
        if self._stopped == self.run and self._controlled.simulation.time == 0:
            return RunningState.STOPPED
        return RunningState.PAUSED

    def set(self, target: int) -> None:
        """Change the state. Raises Refusal."""
        if target == self.state:
            raise Refusal(ALREADY_IN_TARGET_STATE, f'already {RunningState(target).name.lower()}')
        if target in (RunningState.STOPPED, RunningState.QUITTING):
            self._loader.cancel(f'the state {target} ({RunningState(target).name.lower()}) was set')
        if target in (RunningState.STOPPED, RunningState.PLAYING, RunningState.PAUSED) and (
                self.state in (RunningState.NO_WORLD, RunningState.LOADING_WORLD)):
            raise Refusal(INCORRECT_TRANSITION, 'a world is being loaded' if (
                self._loader.is_loading) else NO_WORLD)
        if target == RunningState.PLAYING:
            self._controlled.pause(False)
        elif target == RunningState.PAUSED:
            self._stopped = None
            if not self._controlled.paused:
                self._controlled.pause(True)
        elif target in (RunningState.STOPPED, RunningState.QUITTING):
            if self._controlled.has_world:
                self.stop()
                self._controlled.reset()
                self._stopped = self.run
            if target == RunningState.QUITTING:
                self._shut_down()
        else:
            raise Refusal(INCORRECT_TRANSITION, f'state: {target}; expected 0 (stopped), '
                          '1 (playing), 2 (paused) or 3 (quitting)')

    def stop(self) -> None:
        """Pause. The state is then stopped if the simulation is at its start, else paused."""
        if not self._controlled.paused:
            self._controlled.pause(True)
        self._stopped = self.run

    def reset(self, reset: Callable[[], object]) -> None:
        """Go back to a start by ``reset()``; the state stays stopped, paused or playing."""
        was_stopped = self.state == RunningState.STOPPED
        reset()
        if was_stopped:
            self._stopped = self.run


def checked_scope(scope: int) -> int:
    """The scope of a reset; 0 is ALL. Raises Refusal for time without state, and unknown bits."""
    scope = scope or ALL
    known = scope <= TIME | STATE | SPAWNED and scope != TIME and scope != TIME | SPAWNED
    if scope != ALL and not known:
        raise Refusal(Code.FEATURE_UNSUPPORTED, f'scope: {scope}; expected 0 or 255 (all), 2 '
                      '(state), 3 (time and state), 4 (spawned), or 6 or 7')
    return scope
