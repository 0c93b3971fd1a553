"""Recovery from bad states: they are not published, logged, and dumped to a file."""
from __future__ import annotations

import os
import time
from pathlib import Path

from rclpy.logging import get_logging_directory
from rclpy.node import Node

from ...model.scene import SECOND
from ...physics.guard import BadState, Guard
from ...physics.simulation import Simulation
from .state_dump import StateDump

MAX_CONSECUTIVE = 3
"""Bad ticks in a row after which the scene is restarted instead of the tick repeated."""

MAX_DUMPS = 10
"""Files that a node writes at most."""

LOG_PERIOD = 1.0
"""s: throttle of the log lines about bad states without a file."""


class Recovery:
    """Advances the node's simulation, undoes a tick that ends in a bad state, and reports it."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.count = 0
        """Bad states so far."""
        self._dumps = 0
        self._reason = self._dump = ''

    def set_simulation(self, simulation: Simulation) -> None:
        """Advance this simulation from now on."""
        self._guard, self._state_dump = Guard(simulation), StateDump(simulation)
        self._consecutive = 0

    def advance(self, directory: str) -> bool:
        """Make one tick; False if it was bad and has been undone. ``directory`` for state dumps;
        '': ROS's log directory.
        """
        self._state_dump.record_inputs()
        bad = self._guard.advance()
        if bad is None:
            self._state_dump.record_state()
            self._consecutive = 0
            return True
        self.count += 1
        self._consecutive += 1
        self._reason = bad.reason
        self._report(bad, directory)
        return False

    @property
    def failed(self) -> bool:
        """Whether undoing ticks has not helped and the scene must be restarted."""
        return self._consecutive >= MAX_CONSECUTIVE

    def diagnostics(self) -> dict[str, object]:
        """Values for /diagnostics."""
        return {'bad_states': self.count, 'bad_state': self._reason, 'state_dump': self._dump}

    def _report(self, bad: BadState, directory: str) -> None:
        """Log it; write a file for the first of several in a row, as the others are alike."""
        logger = self._node.get_logger()
        line = f'bad state at {bad.time / SECOND:.9g} s was not published: {bad.reason}; '
        if self._consecutive == MAX_CONSECUTIVE:
            logger.error(f'{line}the scene restarts', throttle_duration_sec=LOG_PERIOD)
        elif self._consecutive > 1 or self._dumps == MAX_DUMPS:
            logger.error(f'{line}the tick was undone', throttle_duration_sec=LOG_PERIOD)
        else:
            self._dumps += 1
            logger.error(f'{line}the tick was undone; {self._write_dump(bad, directory)}')

    def _write_dump(self, bad: BadState, directory: str) -> str:
        """Write a state dump. Returns a sentence with its path, or the error."""
        folder = Path(directory).expanduser() if directory else get_logging_directory()
        name = self._node.get_fully_qualified_name().strip('/').replace('/', '_')
        path = folder / f'{name}_{time.strftime("%Y%m%d_%H%M%S")}_{os.getpid()}_{self._dumps}.npz'
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._state_dump.write(path, bad)
        except OSError as error:
            return f'the last states could not be written: {error}'
        self._dump = str(path)
        return f'the last states are in {path}'
