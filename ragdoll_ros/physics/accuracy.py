"""The settings of accuracy: how finely a simulation steps, and what it does besides."""
from __future__ import annotations

from dataclasses import dataclass

from ..model import errors


@dataclass(frozen=True)
class Accuracy:
    """How fine."""

    step: float
    """s: the rigid engine's longest step while something touches."""
    flight_error: float
    """m or rad by which the end of a step of its flight may err, by its own estimate."""
    substeps: float
    """Of PyBullet and MuJoCo in 10 ms; a stretch has a whole number of them, not fewer."""
    sleep: bool = True
    """Stop the engine when all is at rest."""
    energy: bool = True
    """Take out energy that nothing put in, and keep the momentum of what is in the air, where an
    engine does not do so by itself: PyBullet."""


DRAFT = Accuracy(step=4e-3, flight_error=1e-10, substeps=4)
NORMAL = Accuracy(step=2.5e-3, flight_error=1e-11, substeps=10)
EXACT = Accuracy(step=5e-4, flight_error=1e-13, substeps=40)
ACCURACIES = {'draft': DRAFT, 'normal': NORMAL, 'exact': EXACT}


def resolve_accuracy(accuracy: str | Accuracy) -> Accuracy:
    """The settings that a name stands for; OutOfRange for a name that is none."""
    if isinstance(accuracy, Accuracy):
        return accuracy
    if accuracy not in ACCURACIES:
        raise errors.OutOfRange('accuracy', accuracy, 'one of ' + ', '.join(ACCURACIES))
    return ACCURACIES[accuracy]
