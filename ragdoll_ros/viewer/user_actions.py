"""Runs what users do on pages in the order in which they do it."""
from __future__ import annotations

import traceback
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import ParamSpec, TypeVar

Event = TypeVar('Event')
Args = ParamSpec('Args')


class UserActions:
    """Runs actions one after another, in a thread of its own.

    Viser calls callbacks that are no coroutines in many threads: a push could overtake the reset
    before it, which then undid it. Coroutines keep the order but must not wait, as a step does that
    ends editing.
    """

    def __init__(self) -> None:
        self._worker = ThreadPoolExecutor(1, 'actions')

    def run(self, action: Callable[Args, object], *args: Args.args, **kwargs: Args.kwargs) -> None:
        """Run an action after all before it; returns at once. Its errors are printed."""
        self._worker.submit(action, *args, **kwargs).add_done_callback(_print_error)

    def callback(self, action: Callable[[Event], object]
                 ) -> Callable[[Event], Coroutine[None, None, None]]:
        """Return what viser calls in its thread with an event, on which the action is run."""
        async def take(event: Event) -> None:
            self.run(action, event)

        return take


def _print_error(done: Future) -> None:
    if (error := done.exception()) is not None:
        traceback.print_exception(error)
