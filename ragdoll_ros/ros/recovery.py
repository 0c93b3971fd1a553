"""Bad states never get out: what the node does where a tick ends in one."""
from __future__ import annotations

import os
import time
from pathlib import Path

from rclpy.logging import get_logging_directory
from rclpy.node import Node

from ..model.scene import SECOND
from ..physics.guard import BadState, Guard
from ..physics.simulation import Simulation
from .state_dump import StateDump

IN_A_ROW = 3
"""Bad ticks after which going back has not helped, and the scene begins anew."""

MOST_DUMPS = 10
"""Files that a node writes at the most; what goes wrong more often is told by the first ones."""

LOG_PERIOD = 1.0
"""s between two lines about bad states of which no file was written."""


class Rescue:
    """Takes the simulation that the node uses on, tick by tick, and tells of each bad state: in the
    log, in a file with what led there, and in facts() for /diagnostics.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.count = 0
        """Bad states so far."""
        self._dumps = 0
        self._reason = self._dump = ''

    def use(self, simulation: Simulation) -> None:
        """Take this one on from now on."""
        self._guard, self._last_states = Guard(simulation), StateDump(simulation)
        self._in_a_row = 0

    def advance(self, directory: str) -> bool:
        """Go on by one tick, or by none where it was bad; whether the tick stands. ``directory``:
        where files go; empty: where ROS has its logs.
        """
        self._last_states.acting()
        bad = self._guard.advance()
        if bad is None:
            self._last_states.note()
            self._in_a_row = 0
            return True
        self.count += 1
        self._in_a_row += 1
        self._reason = bad.reason
        self._tell(bad, directory)
        return False

    @property
    def failed(self) -> bool:
        """Whether going back has not helped, and a new simulation is wanted."""
        return self._in_a_row >= IN_A_ROW

    def facts(self) -> dict[str, object]:
        """For /diagnostics."""
        return {'bad_states': self.count, 'bad_state': self._reason, 'state_dump': self._dump}

    def _tell(self, bad: BadState, directory: str) -> None:
        """Log it; write a file for the first of several in a row, as all others begin alike."""
        logger = self._node.get_logger()
        line = f'bad state at {bad.time / SECOND:.9g} s was not published: {bad.reason}; '
        if self._in_a_row == IN_A_ROW:
            logger.error(f'{line}the scene begins anew', throttle_duration_sec=LOG_PERIOD)
        elif self._in_a_row > 1 or self._dumps == MOST_DUMPS:
            logger.error(f'{line}the doll is where it was', throttle_duration_sec=LOG_PERIOD)
        else:
            self._dumps += 1
            logger.error(f'{line}the doll is where it was; {self._written(bad, directory)}')

    def _written(self, bad: BadState, directory: str) -> str:
        """Write a file; which one, or why there is none."""
        folder = Path(directory).expanduser() if directory else get_logging_directory()
        name = self._node.get_fully_qualified_name().strip('/').replace('/', '_')
        path = folder / f'{name}_{time.strftime("%Y%m%d_%H%M%S")}_{os.getpid()}_{self._dumps}.npz'
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._last_states.write(path, bad)
        except OSError as error:
            return f'the last states could not be written: {error}'
        self._dump = str(path)
        return f'the last states are in {path}'
