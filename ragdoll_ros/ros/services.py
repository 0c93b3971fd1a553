"""Services that hold the time, take it on by one tick, and set it back."""
from __future__ import annotations

from typing import Protocol

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from ..model.scene import SECOND
from ..physics.simulation import Simulation
from .input_counts import Tally


class Served(Protocol):
    """What the services act on: the node's time."""

    simulation: Simulation
    paused: bool
    tally: Tally

    def reset(self) -> None:
        """Go back to the start."""

    def tick(self) -> None:
        """Go on by one tick."""

    def pause(self, wanted: bool) -> None:
        """Hold the time, or let it go on."""


class Services:
    """Serves ~/reset, ~/step and ~/pause of a ``node`` for ``served``, which is the same one."""

    def __init__(self, node: Node, served: Served) -> None:
        self._served = served
        node.create_service(Trigger, '~/reset', self._reset)
        node.create_service(Trigger, '~/step', self._step)
        node.create_service(SetBool, '~/pause', self._pause)

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Go back to the start; what is paused stays paused."""
        self._served.reset()
        return _answer(response, True, 'back at the start')

    def _step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """One tick; refused unless paused, as the timer makes them otherwise."""
        if not self._served.paused:
            self._served.tally.refuse('~/step', 'not paused')
            return _answer(response, False, 'not paused: call ~/pause with data: true first')
        self._served.tick()
        return _answer(response, True, f'at {self._time():.9g} s')

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._served.pause(request.data)
        word = 'paused' if request.data else 'running'
        return _answer(response, True, f'{word} at {self._time():.9g} s')

    def _time(self) -> float:
        return self._served.simulation.time / SECOND


def _answer(response: object, success: bool, message: str) -> object:
    response.success, response.message = success, message
    return response
