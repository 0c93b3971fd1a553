"""The services ~/reset, ~/step and ~/pause."""
from __future__ import annotations

from typing import Protocol

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from ..model.scene import SECOND
from ..physics.simulation import Simulation
from .inputs.input_counts import InputCounts


class Controlled(Protocol):
    """What the services act on: the ragdoll node."""

    simulation: Simulation
    paused: bool
    input_counts: InputCounts

    def reset(self, keep_time: bool = False) -> None:
        """Reset to the start; ``keep_time``: simulated time continues."""

    def tick(self) -> None:
        """Make one tick."""

    def pause(self, paused: bool) -> None:
        """Pause or resume."""


class Services:
    """Servers of ~/reset, ~/step and ~/pause on ``node``; ``controlled`` is the same node."""

    def __init__(self, node: Node, controlled: Controlled) -> None:
        self._controlled = controlled
        node.create_service(Trigger, '~/reset', self._reset)
        node.create_service(Trigger, '~/step', self._step)
        node.create_service(SetBool, '~/pause', self._pause)

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

    def _time(self) -> float:
        return self._controlled.simulation.time / SECOND


def _respond(response: object, success: bool, message: str) -> object:
    response.success, response.message = success, message
    return response
