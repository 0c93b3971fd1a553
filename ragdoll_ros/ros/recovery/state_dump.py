"""Ring buffer of the last states and what acted on them, written to a file after a bad state."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...model.push import Push
from ...physics.actions.grab import Grab
from ...physics.guard import BadState
from ...physics.simulation import Simulation

LENGTH = 100
"""Ticks in the buffer."""


class StateDump:
    """The last LENGTH states of a simulation, with the pushes and grabs that acted in each tick.

    States are kept by reference, without a copy; 100 of a thousand dolls take 100 MB.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._ticks: deque[tuple] = deque(maxlen=LENGTH)
        self.record_inputs()

    def record_inputs(self) -> None:
        """Record pushes and grabs; to be called before a tick."""
        self._inputs = self._simulation.pushes, self._simulation.grabs

    def record_state(self) -> None:
        """Record the state after a tick."""
        self._ticks.append((self._simulation.time, self._simulation.state, *self._inputs))

    def write(self, path: Path, bad: BadState) -> None:
        """Write the buffer and the ``bad`` state as an .npz, readable without pickle.

        Raises OSError if that fails, and removes the file.
        """
        ticks = [*self._ticks, (bad.time, bad.state, *self._inputs)][-LENGTH:]
        times, states, pushes, grabs = zip(*ticks, strict=True)
        simulation = self._simulation
        try:
            with path.open('xb') as file:
                np.savez(
                    file, reason=bad.reason, scene=simulation.scene.name,
                    engine=simulation.engine_name, bone_names=simulation.scene.bone_names,
                    times=np.array(times), states=np.array([state.rows for state in states]),
                    **_table('push', pushes, _push_row, 10, lambda push: push.bone),
                    **_table('grab', grabs, _grab_row, 6, lambda grab: grab.bone))
        except OSError:
            path.unlink(missing_ok=True)
            raise


def _table(name: str, inputs: Sequence[Sequence], row: object, width: int,
           bone: object) -> dict[str, np.ndarray]:
    """The inputs of all ticks as arrays (k,): index of the tick, bone, and numbers (k, width)."""
    flat = [(tick, one) for tick, those in enumerate(inputs) for one in those]
    return {f'{name}_ticks': np.array([tick for tick, _ in flat], np.int64),
            f'{name}_bones': np.array([bone(one) for _, one in flat], str),
            f'{name}_numbers': np.array([row(one) for _, one in flat], float).reshape(-1, width)}


def _push_row(push: Push) -> list[float]:
    return [*push.force, *push.torque, *push.point, push.local]


def _grab_row(grab: Grab) -> list[float]:
    return [*grab.point, *grab.target]
