"""The last states and what acted on them, in memory, and as a file where something went wrong."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..model.push import Push
from ..physics.actions.grab import Grab
from ..physics.guard import BadState
from ..physics.simulation import Simulation

STATES = 100
"""Ticks that are remembered."""


class StateDump:
    """The last STATES states of a simulation, each with what acted as its tick began.

    A state is no copy but that which the tick has made, so that to remember it costs next to
    nothing; those of a thousand dolls take 1 MB each.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._ticks: deque[tuple] = deque(maxlen=STATES)
        self.acting()

    def acting(self) -> None:
        """Note what acts, before a tick."""
        self._acting = self._simulation.pushes, self._simulation.grabs

    def note(self) -> None:
        """Note what the tick has come to."""
        self._ticks.append((self._simulation.time, self._simulation.state, *self._acting))

    def write(self, path: Path, bad: BadState) -> None:
        """Write all, ``bad`` last, as an .npz that numpy.load opens without pickle.

        Raises OSError where it cannot be written; nothing is left of it then.
        """
        ticks = [*self._ticks, (bad.time, bad.state, *self._acting)][-STATES:]
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


def _table(name: str, acting: Sequence[Sequence], row: object, width: int,
           bone: object) -> dict[str, np.ndarray]:
    """What acted in all ticks: at which of them, on which bone, and its numbers (k, width)."""
    flat = [(tick, one) for tick, those in enumerate(acting) for one in those]
    return {f'{name}_ticks': np.array([tick for tick, _ in flat], np.int64),
            f'{name}_bones': np.array([bone(one) for _, one in flat], str),
            f'{name}_numbers': np.array([row(one) for _, one in flat], float).reshape(-1, width)}


def _push_row(push: Push) -> list[float]:
    return [*push.force, *push.torque, *push.point, push.local]


def _grab_row(grab: Grab) -> list[float]:
    return [*grab.point, *grab.target]
