"""Accuracy: step sizes and tolerances of a simulation, and the named settings."""
from dataclasses import dataclass

from ..model import errors

TOUCHING, TOUCHING_SPEED = 1e-6, 2e-3
"""m or rad, and m/s or rad/s: what is nearer than the first, or than the second times a step, if
that is more, touches. In each step what rests drifts off by a term of third order in its length."""


@dataclass(frozen=True)
class Accuracy:
    """Step sizes and tolerances of the engines."""

    step: float
    """s: nominal step of the rigid engine in contact; what moves slowly takes longer ones."""
    flight_error: float
    """m or rad: local error tolerance of the rigid engine's integrator without contact."""
    substeps: float
    """Substeps of PyBullet and MuJoCo in 10 ms; rounded up for each interval."""
    sleep: bool = True
    """Put dolls at rest to sleep."""
    energy: bool = True
    """Correct energy, and momentum without contact, where the engine does not conserve them:
    PyBullet."""
    solve_error: float = 1e-4
    """Residual to which the rigid engine solves contacts: in large islands a share of the largest
    velocity at them, as the step begins, or as it would end without contacts, if less; in small
    ones a share of 1 mm/s."""

    @property
    def touching(self) -> float:
        """Distance, m or rad, below which things touch in the rigid engine."""
        return max(TOUCHING, TOUCHING_SPEED * self.step)


DRAFT = Accuracy(step=4e-3, flight_error=1e-10, substeps=4, solve_error=1e-3)
NORMAL = Accuracy(step=2.5e-3, flight_error=1e-11, substeps=10, solve_error=1e-4)
EXACT = Accuracy(step=5e-4, flight_error=1e-13, substeps=40, solve_error=1e-5)
ACCURACIES = {'draft': DRAFT, 'normal': NORMAL, 'exact': EXACT}


def resolve_accuracy(accuracy: str | Accuracy) -> Accuracy:
    """Look up a named setting; raises OutOfRange for an unknown name."""
    if isinstance(accuracy, Accuracy):
        return accuracy
    if accuracy not in ACCURACIES:
        raise errors.OutOfRange('accuracy', accuracy, 'one of ' + ', '.join(ACCURACIES))
    return ACCURACIES[accuracy]
