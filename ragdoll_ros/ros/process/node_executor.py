"""The executor of the node: it takes messages before each tick, other entities less often.

Services, actions and timers are polled ten times a second, QoS events once a second. rclpy's
executor collects all entities of a node and waits for them anew before each callback, and once more
after it. This takes as long as a tick: with a page that shows dolls at rest, it took half of the
node's CPU time.
"""
from __future__ import annotations

import contextlib
import time

from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException

from ..ticker import SERVICE_INTERVAL, Ticker

MAX_MESSAGES = 1000
"""Of one topic between two ticks: a publisher that is faster must not hold up the rest."""


class NodeExecutor(SingleThreadedExecutor):
    """Makes the ticks of ``ticker`` itself, while there are any.

    Messages are taken just before a tick, which is when they begin to act. Other entities are
    polled after a tick, if the ticker says so.
    """

    def __init__(self, ticker: Ticker) -> None:
        super().__init__()
        self._ticker = ticker
        ticker.drive()

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for the next tick, or until services are to be polled; while there are no ticks, do
        as rclpy's executor does.
        """
        ticker = self._ticker
        if not ticker.running:
            super().spin_once(timeout_sec)
            return
        time.sleep(min(ticker.wait, SERVICE_INTERVAL) / 1e9)
        if self.context.ok():
            self._take_messages()
        if self.context.ok() and ticker.running:
            ticker.run()
        if self.context.ok() and ticker.polls_any:
            self._poll()

    def _poll(self) -> None:
        """Call the callbacks of all that is ready now, entities of all kinds."""
        with contextlib.suppress(ShutdownException, TimeoutException):
            while True:
                callback, _, _ = self.wait_for_ready_callbacks(0)
                callback()
                callback.result()

    def _take_messages(self) -> None:
        """Call the callbacks of all messages that have come, at most MAX_MESSAGES of a topic."""
        for node in self.get_nodes():
            for subscription in node.subscriptions:
                take = subscription.handle.take_message
                for _ in range(MAX_MESSAGES):
                    if (taken := take(subscription.msg_type, subscription.raw)) is None:
                        break
                    subscription.callback(taken[0])
