"""The services ~/reset, ~/step, ~/pause and ~/go_limp."""
from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from ..model.scene import SECOND
from ..physics.simulation import Simulation
from .inputs.input_counts import InputCounts
from .inputs.no_world import NO_WORLD


class Controlled(Protocol):
    """What the services act on: the ragdoll node."""

    simulation: Simulation
    has_world: bool
    paused: bool
    input_counts: InputCounts

    def reset(self, keep_time: bool = False) -> None:
        """Reset to the start; ``keep_time``: simulated time continues."""

    def tick(self) -> None:
        """Make one tick."""

    def pause(self, paused: bool) -> None:
        """Pause or resume."""


class Services:
    """Servers of these services on ``node``; ``controlled`` is the same node."""

    def __init__(self, node: Node, controlled: Controlled) -> None:
        self._controlled = controlled
        for kind, name, serve in ((Trigger, '~/reset', self._reset),
                                  (Trigger, '~/step', self._step),
                                  (SetBool, '~/pause', self._pause),
                                  (Trigger, '~/go_limp', self._go_limp)):
            node.create_service(kind, name, partial(self._serve, name, serve))

    def _serve(self, name: str, serve: Callable, request: object, response: object) -> object:
        """Answer, or refuse without a world."""
        if self._controlled.has_world:
            return serve(request, response)
        self._controlled.input_counts.refuse(name, NO_WORLD)
        return _respond(response, False, NO_WORLD)

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Reset to the start; a paused node stays paused."""
        self._controlled.reset()
        return _respond(response, True, 'back at the start')

    def _step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Make one tick; refused unless paused, when the timer makes the ticks."""
        if not self._controlled.paused:
            self._controlled.input_counts.refuse('~/step', 'not paused')
            return _respond(response, False, 'not paused: call ~/pause with data: true first')
        self._controlled.tick()
        return _respond(response, True, f'at {self._time():.9g} s')

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._controlled.pause(request.data)
        word = 'paused' if request.data else 'running'
        return _respond(response, True, f'{word} at {self._time():.9g} s')

    def _go_limp(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Let all dolls with animations or motors go limp; refused if there is none."""
        simulation = self._controlled.simulation
        dolls = simulation.powered
        if not dolls:
            self._controlled.input_counts.refuse('~/go_limp', 'no doll with animation or motors')
            return _respond(response, False, 'no doll is moved by an animation or by motors')
        simulation.go_limp()
        return _respond(response, True, f'{", ".join(dolls)} limp at {self._time():.9g} s')

    def _time(self) -> float:
        return self._controlled.simulation.time / SECOND


def _respond(response: object, success: bool, message: str) -> object:
    response.success, response.message = success, message
    return response
