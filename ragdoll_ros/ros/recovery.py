"""Recovery from bad states: they are not published, but undone, logged, and dumped to a file."""
from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from rclpy.logging import get_logging_directory
from rclpy.node import Node

from ..model.push import Push
from ..model.scene import SECOND
from ..physics.actions.grab import Grab
from ..physics.guard import BadState, Guard
from ..physics.simulation import Simulation

MAX_CONSECUTIVE = 3
"""Bad ticks in a row after which the scene is restarted instead of the tick repeated."""

DUMP_LENGTH = 100
"""Ticks in a state dump."""

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
        """Make one tick; False if it was bad and undone. ``directory`` of dumps; '': ROS's log."""
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
        """Log a bad state. Write a file for the first of several in a row, as the others are alike,
        and MAX_DUMPS at most.
        """
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


class StateDump:
    """The last DUMP_LENGTH states of a simulation, with the pushes and grabs of each tick.

    States are kept by reference, without a copy; 100 of a thousand dolls take 100 MB.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._ticks: deque[tuple] = deque(maxlen=DUMP_LENGTH)
        self.record_inputs()

    def record_inputs(self) -> None:
        """Record pushes and grabs; to be called before a tick."""
        self._inputs = self._simulation.pushes, self._simulation.grabs

    def record_state(self) -> None:
        """Record the state after a tick."""
        self._ticks.append((self._simulation.time, self._simulation.state, *self._inputs))

    def write(self, path: Path, bad: BadState) -> None:
        """Write the states, ``bad`` last, as .npz without pickle; on an OSError remove the file."""
        ticks = [*self._ticks, (bad.time, bad.state, *self._inputs)][-DUMP_LENGTH:]
        times, states, pushes, grabs = zip(*ticks, strict=True)
        simulation = self._simulation
        try:
            with path.open('xb') as file:
                np.savez(
                    file, reason=bad.reason, scene=simulation.scene.name,
                    engine=simulation.engine_name, bone_names=simulation.scene.bone_names,
                    times=np.array(times), states=np.array([state.rows for state in states]),
                    **_table('push', pushes, 10, lambda push: [*push.force, *push.torque,
                                                               *push.point, push.local]),
                    **_table('grab', grabs, 6, lambda grab: [*grab.point, *grab.target]))
        except OSError:
            path.unlink(missing_ok=True)
            raise


def _table(name: str, inputs: Sequence[Sequence[Push | Grab]], width: int,
           row: Callable[[Push | Grab], list[float]]) -> dict[str, np.ndarray]:
    """The inputs of all ticks: index of the tick (k,), bone (k,) and numbers (k, width)."""
    flat = [(tick, one) for tick, those in enumerate(inputs) for one in those]
    return {f'{name}_ticks': np.array([tick for tick, _ in flat], np.int64),
            f'{name}_bones': np.array([one.bone for _, one in flat], str),
            f'{name}_numbers': np.array([row(one) for _, one in flat], float).reshape(-1, width)}
