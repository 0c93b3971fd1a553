"""The settings of accuracy: how finely a simulation steps, and what it does besides."""
from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass

from ..model import errors

HUMAN = 1.4
"""m: extent of the default doll, for which Accuracy counts substeps in 10 ms. What is smaller
falls and rolls by its own size sooner, as the root of its size."""


@dataclass(frozen=True)
class Accuracy:
    """How fine. Each mechanism can be switched off, to see its price and its worth."""

    turn: float
    """rad that the fastest bone may turn in one of the engine's substeps."""
    limit: float
    """rad that a joint near its limit may turn in one substep."""
    contact: int
    """Least substeps in 10 ms while something touches and moves."""
    settled: int
    """Least substeps in 10 ms while something touches and hardly moves."""
    sink: float
    """m that a bone may fall in one substep onto the ground."""
    most: int
    """Most substeps in 10 ms."""
    order: int
    """Order of the flight's Runge-Kutta method where nothing is compiled, else it is 8; 0: the
    engine's own step in flight too."""
    flight_turn: float
    """rad that the fastest bone may turn in one such step where nothing is compiled."""
    flight_error: float
    """m or rad by which a compiled step's end may err, by its own estimate."""
    longest: float = 0.05
    """s of flight that are gone through in one step at the most; 0: a tick."""
    land: bool = True
    """A flight goes up to the instant at which a joint reaches its limit; otherwise the engine
    takes over a tick earlier."""
    redo: float = math.radians(1.0)
    """rad past a limit from which a step is done again, four times as fine, as it is when a bone
    sinks deeper than ``sink``; infinity: never."""
    creep: float = 1.1
    """Times as far past a limit or in the ground as at its start that a step may end."""
    adaptive: bool = True
    """Substeps by need; otherwise always ``contact`` in 10 ms."""
    energy: bool = True
    """Take out energy that nothing put in."""
    momentum: bool = True
    """Keep the momentum of what is in the air."""
    centred: bool = True
    """Move single bodies that slide and roll evenly by the mean of their velocities. Dolls err by
    blows, not by this."""
    sleep: bool = True
    """Stop the engine when all is at rest."""


DRAFT = Accuracy(turn=0.3, limit=0.15, contact=3, settled=2, sink=0.009, most=46, order=3,
                 flight_turn=0.4, flight_error=1e-10, land=False, redo=math.radians(6))
NORMAL = Accuracy(turn=0.1, limit=0.06, contact=4, settled=3, sink=0.004, most=128, order=4,
                  flight_turn=0.2, flight_error=1e-11, redo=math.radians(2.5))
EXACT = Accuracy(turn=0.04, limit=0.03, contact=6, settled=4, sink=0.0015, most=256, order=4,
                 flight_turn=0.1, flight_error=1e-13, redo=math.radians(1.5))
ACCURACIES = {'draft': DRAFT, 'normal': NORMAL, 'exact': EXACT}


@functools.lru_cache
def firm(accuracy: Accuracy) -> Accuracy:
    """An accuracy that is fine enough for joints that are pulled with all of a hand's force.

    Steps are as short as a hand's force is steady, so that what each may add would add up.
    """
    return dataclasses.replace(
        accuracy, turn=min(accuracy.turn, 0.06), limit=min(accuracy.limit, 0.025),
        contact=max(accuracy.contact, 8), sink=min(accuracy.sink, 0.006),
        most=max(accuracy.most, 64), redo=min(accuracy.redo, math.radians(2)), creep=1.0)


def resolve_accuracy(accuracy: str | Accuracy) -> Accuracy:
    """The settings that a name stands for; OutOfRange for a name that is none."""
    if isinstance(accuracy, Accuracy):
        return accuracy
    if accuracy not in ACCURACIES:
        raise errors.OutOfRange('accuracy', accuracy, 'one of ' + ', '.join(ACCURACIES))
    return ACCURACIES[accuracy]
