"""Many steps while paused, in slices of a timer, so that other callbacks get their turns."""
from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.clock import Clock
from rclpy.node import Node
from rclpy.task import Future

from ..inputs.no_world import NO_WORLD
from ..ticker import MAX_CALLBACK_TIME
from .codes import Code, Refusal
from .run_state import ControlledNode, RunState


@dataclass
class Order:
    """Steps that are being made; ``done`` gets why they ended early, or an empty text."""

    steps: int
    run: tuple
    progress: Callable[[int, int], object] | None
    is_cancelled: Callable[[], bool]
    done: Future
    made: int = 0


class Stepper:
    """Makes steps of a paused node; one order at a time."""

    def __init__(self, node: Node, steady: Clock, controlled: ControlledNode,
                 run_state: RunState) -> None:
        self._controlled, self._run_state = controlled, run_state
        self._order: Order | None = None
        self._timer = node.create_timer(0.0, self._on_timer, clock=steady, autostart=False)

    async def step(self, steps: int, progress: Callable[[int, int], object] | None = None,
                   is_cancelled: Callable[[], bool] = lambda: False) -> None:
        """Make so many steps. Raises Refusal if the node is not paused, does not stay so, is reset
        or has an order already; and at a cancellation.

        ``progress(made, left)`` is called after each step. Then each step has a callback of its
        own: clients take one message of feedback at a time, and none after the result.
        """
        if not self._controlled.has_world:
            raise Refusal(Code.INCORRECT_STATE, NO_WORLD)
        if not self._controlled.paused:
            raise Refusal(Code.OPERATION_FAILED, 'not paused: set the state 2 (paused) first')
        if self._order is not None:
            raise Refusal(Code.INCORRECT_STATE, f'{self._order.steps - self._order.made} steps of '
                          'another call are still to be made')
        self._order = Order(steps, self._run_state.run, progress, is_cancelled, Future())
        self._timer.reset()
        order = self._order
        reason = await order.done
        if reason:
            raise Refusal(Code.OPERATION_FAILED, f'{reason} after {order.made} of {steps} steps')

    def _on_timer(self) -> None:
        """Make one step if the order has ``progress``, else steps for MAX_CALLBACK_TIME at most."""
        order, end = self._order, time.monotonic_ns() + MAX_CALLBACK_TIME
        while (reason := self._reason_to_end(order)) is None:
            self._controlled.tick()
            order.made += 1
            if order.progress is not None:
                order.progress(order.made, order.steps - order.made)
            if order.progress is not None or time.monotonic_ns() > end:
                return
        self._timer.cancel()
        self._order = None
        order.done.set_result(reason)

    def _reason_to_end(self, order: Order) -> str | None:
        """Return why no more steps are made, '' if all are made, or None if more are to be made."""
        if order.made >= order.steps:
            return ''
        if order.is_cancelled():
            return 'cancelled'
        if order.run != self._run_state.run:
            return 'reset, or another scene or none,'
        return None if self._controlled.paused else 'resumed'
