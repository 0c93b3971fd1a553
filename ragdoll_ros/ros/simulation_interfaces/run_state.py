"""The simulation's state as the standard has it: stopped, playing or paused; and its reset.

Stopped is paused at the start, as the node is with ``start_paused``, after a stop or a new world.
"""
from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Protocol

from ...physics.simulation import Simulation
from ..parameters.node_settings import NodeSettings
from ..services import Controlled
from .codes import Code, Refusal

ALREADY_IN_TARGET_STATE, INCORRECT_TRANSITION = 101, 103
"""Results of SetSimulationState."""

TIME, STATE, SPAWNED, ALL = 1, 2, 4, 255
"""Scopes of a reset, bits but for ALL; 0 is ALL as well."""


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

    @property
    def settings(self) -> NodeSettings:
        """Values of the parameters."""

    @property
    def stamp(self) -> int:
        """Stamp of the current state, ns."""


class RunState:
    """State of a node's simulation; ``shut_down()`` ends the node."""

    def __init__(self, controlled: ControlledNode, shut_down: Callable[[], None]) -> None:
        self._controlled, self._shut_down = controlled, shut_down
        self._stopped = self.run if controlled.settings.start_paused else None

    @property
    def run(self) -> tuple[Simulation, int]:
        """What a reset or a new scene changes."""
        return self._controlled.simulation, self._controlled.simulation.reset_count

    @property
    def state(self) -> RunningState:
        """The state now."""
        if not self._controlled.paused:
            return RunningState.PLAYING
        if self._stopped == self.run and self._controlled.simulation.time == 0:
            return RunningState.STOPPED
        return RunningState.PAUSED

    def set(self, target: int) -> None:
        """Change the state. Raises Refusal."""
        if target == self.state:
            raise Refusal(ALREADY_IN_TARGET_STATE, f'already {RunningState(target).name.lower()}')
        if target == RunningState.PLAYING:
            self._controlled.pause(False)
        elif target == RunningState.PAUSED:
            self._stopped = None
            if not self._controlled.paused:
                self._controlled.pause(True)
        elif target in (RunningState.STOPPED, RunningState.QUITTING):
            self.stop()
            self._controlled.reset()
            self._stopped = self.run
            if target == RunningState.QUITTING:
                self._shut_down()
        else:
            raise Refusal(INCORRECT_TRANSITION, f'state: {target}; expected 0 (stopped), '
                          '1 (playing), 2 (paused) or 3 (quitting)')

    def stop(self) -> None:
        """Pause, as stopped if the simulation is at its start."""
        if not self._controlled.paused:
            self._controlled.pause(True)
        self._stopped = self.run

    def reset(self, scope: int) -> None:
        """Reset the state, and time unless the scope leaves it out; then go on as before.

        Nothing is ever spawned. Raises Refusal for a scope without the state.
        """
        scope = scope or ALL
        if not scope & STATE or (scope > TIME | STATE | SPAWNED and scope != ALL):
            raise Refusal(Code.FEATURE_UNSUPPORTED, f'scope: {scope}; expected 0 or 255 (all), '
                          '3 (time and state) or 2 (state)')
        was_stopped = self.state == RunningState.STOPPED
        self._controlled.reset(keep_time=not scope & TIME)
        if was_stopped:
            self._stopped = self.run
