"""Runs actions of users, such as pushes and resets, in the order in which pages send them."""
from __future__ import annotations

import traceback
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Event = TypeVar('Event')


class UserActions:
    """A queue of actions with one worker thread.

    Viser runs each callback in a pool of threads, so a push could overtake an earlier reset, which
    then cancelled it. Coroutines run in order, in viser's event loop, but must not block; a step
    that ends editing does.
    """

    def __init__(self) -> None:
        self._worker = ThreadPoolExecutor(1, 'actions')

    def run(self, action: Callable[..., object], *args: object) -> Future:
        """Queue an action; returns its future. An exception of it is printed."""
        done = self._worker.submit(action, *args)
        done.add_done_callback(_print_error)
        return done

    def callback(self, action: Callable[[Event], object]
                 ) -> Callable[[Event], Coroutine[None, None, None]]:
        """Return a callback for viser that queues ``action`` with its event."""
        async def take(event: Event) -> None:
            self.run(action, event)

        return take


def _print_error(done: Future) -> None:
    if (error := done.exception()) is not None:
        traceback.print_exception(error)
