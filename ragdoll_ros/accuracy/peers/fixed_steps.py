"""PyBullet and MuJoCo on our scene in plain steps, as a program without this package takes them."""
from collections.abc import Callable

from ...model.state import State
from ...physics.engine.substepped.engine import SubsteppedEngine
from ..cases.trial import Trial


class FixedSteps:
    """A trial with at least ``substeps`` equal steps per tick by the library of an engine.

    There are more where explicit damping would be unstable. The engine translates the scene and
    reads states; its energy account and its correction of energy and momentum are not used.
    """

    def __init__(self, trial: Trial, substeps: int, make: Callable[..., SubsteppedEngine]) -> None:
        self._trial, self._substeps = trial, substeps
        self._tick, self._count = trial.scene.step, 0
        self._engine = make(trial.scene)
        if trial.start is not None:
            self._engine.set_coordinates(trial.start)

    @property
    def state(self) -> State:
        """Poses and velocities of all bones, read from the library."""
        return self._engine.state

    def advance(self) -> None:
        """Advance by one tick."""
        begin = self._count * self._tick
        loads = self._trial.loads(begin, begin + self._tick) if self._trial.pushes else ()
        self._engine.take_substeps(self._tick, self._substeps, loads)
        self._count += 1

    def close(self) -> None:
        """Free all resources."""
        self._engine.close()
