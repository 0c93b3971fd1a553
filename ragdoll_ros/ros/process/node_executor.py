"""The executor of the node: between ticks it takes messages only, all else ten times a second.

rclpy's executor collects all entities of a node and waits for them anew before each callback, and
once more after it. With a page that shows dolls at rest that took half of the node's CPU time.
"""
from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rclpy.executors import SingleThreadedExecutor

if TYPE_CHECKING:
    from ..ticker import Ticker

MAX_MESSAGES = 1000
"""Of one topic between two ticks: a publisher that is faster must not hold up the rest."""


class NodeExecutor(SingleThreadedExecutor):
    """Makes the ticks of ``ticker`` itself where no entity but the subscriptions is to be polled.

    Messages are taken just before a tick, which is when they begin to act.
    """

    def __init__(self, ticker: Ticker) -> None:
        super().__init__()
        self._ticker = ticker

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for the next tick and make it, or as rclpy's executor does."""
        ticker = self._ticker
        if ticker.polls_any:
            super().spin_once(timeout_sec)
            return
        time.sleep(ticker.wait / 1e9)
        if self.context.ok():
            self._take_messages()
        if self.context.ok() and not ticker.polls_any:
            ticker.run()

    def _take_messages(self) -> None:
        """Call the callbacks of all messages that have come."""
        for node in self.get_nodes():
            for subscription in node.subscriptions:
                for _ in range(MAX_MESSAGES):
                    with subscription.handle:
                        taken = subscription.handle.take_message(subscription.msg_type,
                                                                 subscription.raw)
                    if taken is None:
                        break
                    subscription.callback(taken[0])
