"""Services: reset, pause, and step while paused."""
from __future__ import annotations

from typing import Protocol

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from ..model.scene import SECOND
from ..physics.simulation import Simulation
from .tally import Tally


class Steered(Protocol):
    """What the services steer: the node."""

    simulation: Simulation
    tally: Tally
    paused: bool

    def tick(self) -> None:
        """Go on by one tick and publish."""

    def reset(self) -> None:
        """Go back to the start, and publish it."""

    def pause(self, wanted: bool) -> None:
        """Hold the time, or let it go on."""


class Services:
    """~/reset, ~/step and ~/pause of a node."""

    def __init__(self, node: Node, steered: Steered) -> None:
        self._node = steered
        node.create_service(Trigger, '~/reset', self.reset)
        node.create_service(Trigger, '~/step', self.step)
        node.create_service(SetBool, '~/pause', self.pause)

    def reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Go back to the start; what is paused stays paused."""
        self._node.reset()
        return _answer(response, True, 'back at the start')

    def step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """One tick; refused unless paused, as the timer makes them otherwise."""
        if not self._node.paused:
            self._node.tally.refuse('~/step', 'not paused')
            return _answer(response, False, 'not paused: call ~/pause with data: true first')
        self._node.tick()
        return _answer(response, True, f'at {self._node.simulation.time / SECOND:.9g} s')

    def pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Hold the time, or let it go on."""
        self._node.pause(request.data)
        word = 'paused' if request.data else 'running'
        return _answer(response, True, f'{word} at {self._node.simulation.time / SECOND:.9g} s')


def _answer(response: object, success: bool, message: str) -> object:
    response.success, response.message = success, message
    return response
