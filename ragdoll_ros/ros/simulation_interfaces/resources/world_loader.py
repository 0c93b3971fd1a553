"""Loads worlds in a thread, one at a time, while the node runs; a load can be cancelled."""
from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Protocol

from rclpy.clock import Clock
from rclpy.node import Node
from rclpy.task import Future

from ....physics.simulation import Simulation
from ...ticker import BESIDE_INTERVAL
from ..codes import Code, Refusal

POLL_PERIOD = 0.002
"""s between two looks whether a world has been loaded."""


class Loaded(Protocol):
    """A world that is not used yet."""

    simulation: Simulation


class Load:
    """A world that is being loaded; the future ``ended`` is done when it is loaded, has failed or
    is cancelled.
    """

    def __init__(self, make: Callable[[], Loaded], before: threading.Thread | None) -> None:
        self.cancelled = ''
        """Why it was cancelled; empty: it was not."""
        self.ended = Future()
        self._make, self._before = make, before
        self._found: list[Loaded] = []
        self._failure: BaseException | None = None
        self._lock = threading.Lock()
        self.thread = threading.Thread(target=self._run, name='load world', daemon=True)

    def _run(self) -> None:
        """Make the world, unless cancelled. The thread of the load before ends first, so that
        cancelled loads do not pile up.
        """
        if self._before is not None:
            self._before.join()
            self._before = None
        if self.cancelled:
            return
        try:
            found = self._make()
        except BaseException as failure:  # for the thread that waits
            self._failure = failure
            return
        with self._lock:
            self._found.append(found)
            if self.cancelled:
                found.simulation.close()

    def cancel(self, reason: str) -> None:
        """End the wait for the world; the simulation that is made is closed."""
        with self._lock:
            self.cancelled = reason
            if self._found:
                self._found[0].simulation.close()
        self.ended.set_result(None)

    @property
    def world(self) -> Loaded:
        """What was made. Raises what making it raised, and Refusal if it was cancelled."""
        if self.cancelled:
            raise Refusal(Code.OPERATION_FAILED, f'cancelled: {self.cancelled}')
        if self._failure is not None:
            raise self._failure
        return self._found[0]


class WorldLoader:
    """Loads what ``make(name)`` returns; the simulation of a cancelled load is closed."""

    def __init__(self, node: Node, steady: Clock, make: Callable[[str], Loaded]) -> None:
        self._make = make
        self._load: Load | None = None
        self._last: threading.Thread | None = None
        self._interval = sys.getswitchinterval()
        self._timer = node.create_timer(POLL_PERIOD, self._on_timer, clock=steady,
                                        autostart=False)

    @property
    def is_loading(self) -> bool:
        """Whether a world is being loaded."""
        return self._load is not None

    async def load(self, name: str) -> Loaded:
        """Load a world; a load that is under way is cancelled. Raises what making it raises, and
        Refusal if it is cancelled.
        """
        self.cancel('another world is to be loaded')
        load = self._load = Load(lambda: self._make(name), self._last)
        self._last = load.thread
        self._interval = sys.getswitchinterval()
        sys.setswitchinterval(BESIDE_INTERVAL)
        load.thread.start()
        self._timer.reset()
        await load.ended
        if self._load is load:
            self._end()
        return load.world

    def cancel(self, reason: str) -> bool:
        """Cancel the load that is under way. Returns whether there was one."""
        load = self._end()
        if load is not None:
            load.cancel(reason)
        return load is not None

    def _on_timer(self) -> None:
        if not self._load.thread.is_alive():
            self._timer.cancel()
            self._load.ended.set_result(None)

    def _end(self) -> Load | None:
        """End the load that is under way and return it; None if there is none."""
        load, self._load = self._load, None
        if load is not None:
            self._timer.cancel()
            sys.setswitchinterval(self._interval)
        return load
