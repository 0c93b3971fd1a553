"""A simulation that tells what acts on it, as it takes effect, and a way to do the same again.

An act is a call of one of Simulation's methods, told by its name and its arguments as plain
numbers, texts and lists. Between acts are ticks, which whoever calls advance() counts. From the
same scene on, the same acts at the same ticks give the same states to the bit.
"""
from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Sequence

import numpy as np

from ..model import errors
from ..model.coordinates import GeneralizedState
from ..model.drive import Drive
from ..model.push import Push
from ..model.state import State
from .accuracy import Accuracy
from .actions.grab import EVENLY
from .simulation import Simulation


class RecordedSimulation(Simulation):
    """A Simulation that calls ``tell(name, arguments)`` after each act."""

    tell: Callable[[str, dict], object] = staticmethod(lambda name, arguments: None)

    @property
    def conditions(self) -> dict:
        """By what it simulates: engine, accuracy, tick in s, and its parts."""
        return {'engine': self.engine_name, 'accuracy': dataclasses.asdict(self.accuracy),
                'step': self.step, 'parts': self.parts}

    @Simulation.step.setter
    def step(self, step: float) -> None:
        """As Simulation's."""
        Simulation.step.fset(self, step)
        self.tell('step', {'step': self.step})

    @Simulation.parts.setter
    def parts(self, parts: int) -> None:
        """As Simulation's."""
        Simulation.parts.fset(self, parts)
        self.tell('parts', {'parts': self.parts})

    @Simulation.accuracy.setter
    def accuracy(self, accuracy: str | Accuracy) -> None:
        """As Simulation's."""
        Simulation.accuracy.fset(self, accuracy)
        self.tell('accuracy', dataclasses.asdict(self.accuracy))

    def push(self, push: Push | Drive, channel: str | None = None) -> None:
        """As Simulation's; a drive is told as one."""
        super().push(push, channel)
        self.tell('drive' if isinstance(push, Drive) else 'push',
                  {**vars(push), 'channel': channel})

    def release(self, channel: str) -> bool:
        """As Simulation's; told where it ends a push."""
        ended = super().release(channel)
        if ended:
            self.tell('release', {'channel': channel})
        return ended

    def grab(self, hand: str, bone: str, point: Sequence[float] = (0.0, 0.0, 0.0),
             target: Sequence[float] | None = None) -> None:
        """As Simulation's."""
        super().grab(hand, bone, point, target)
        self.tell('grab', {'hand': hand, 'bone': bone, 'point': _plain(point),
                           'target': None if target is None else _plain(target)})

    def drag(self, hand: str, target: Sequence[float], within: float = EVENLY) -> None:
        """As Simulation's."""
        super().drag(hand, target, within)
        self.tell('drag', {'hand': hand, 'target': _plain(target), 'within': within})

    def let_go(self, hand: str) -> None:
        """As Simulation's."""
        super().let_go(hand)
        self.tell('let_go', {'hand': hand})

    def hold(self, angle: str, stiffness: float, damping: float = 0.0,
             target: float | None = None) -> None:
        """As Simulation's."""
        super().hold(angle, stiffness, damping, target)
        self.tell('hold', {'angle': angle, 'stiffness': float(stiffness),
                           'damping': float(damping),
                           'target': None if target is None else float(target)})

    def go_limp(self, angles: Sequence[str] | None = None) -> None:
        """As Simulation's."""
        super().go_limp(angles)
        self.tell('go_limp', {'angles': None if angles is None else list(angles)})

    def place(self, coordinates: GeneralizedState) -> State:
        """As Simulation's; the reset in it is a part of it."""
        tell, self.tell = self.tell, RecordedSimulation.tell
        try:
            state = super().place(coordinates)
        finally:
            self.tell = tell
        self.tell('place', {'q': _plain(coordinates.q), 'v': _plain(coordinates.v)})
        return state

    def reset(self) -> State:
        """As Simulation's."""
        state = super().reset()
        self.tell('reset', self.conditions)
        return state

    def go_back(self, checkpoint: object) -> State:
        """As Simulation's; told as from where it comes back to, as no tick stands in between."""
        state = super().go_back(checkpoint)
        self.tell('go_back', {})
        return state


def repeat(simulation: Simulation, name: str, arguments: dict) -> None:
    """Do again what was told. WrongForm for what is no act; else what the act itself raises."""
    try:
        _ACTS[name](simulation, **arguments)
    except errors.RagdollError:
        raise
    except (KeyError, TypeError, ValueError):
        raise errors.WrongForm(name, arguments, 'an act of ' + ', '.join(_ACTS)) from None


def accuracy_from(fields: dict) -> Accuracy:
    """The accuracy that conditions and acts tell; a ModelError for what is none."""
    try:
        accuracy = Accuracy(**fields)
        errors.check_positive('accuracy', (accuracy.step, accuracy.flight_error, accuracy.substeps))
    except TypeError:
        names = [field.name for field in dataclasses.fields(Accuracy)]
        raise errors.WrongForm('accuracy', fields, 'numbers: ' + ', '.join(names)) from None
    return accuracy


def state_digest(state: State) -> str:
    """SHA-256 of a state's rows (n, 13): little-endian float64, bone by bone."""
    return hashlib.sha256(np.ascontiguousarray(state.rows, '<f8')).hexdigest()


_ACTS: dict[str, Callable[..., object]] = {
    'push': lambda simulation, channel, **push: simulation.push(Push(**push), channel),
    'drive': lambda simulation, channel, **drive: simulation.push(Drive(**drive), channel),
    **{name: lambda simulation, name=name, **arguments: getattr(simulation, name)(**arguments)
       for name in ('release', 'grab', 'drag', 'let_go', 'hold', 'go_limp')},
    'step': lambda simulation, step: setattr(simulation, 'step', step),
    'parts': lambda simulation, parts: setattr(simulation, 'parts', parts),
    'accuracy': lambda simulation, **fields: setattr(simulation, 'accuracy', accuracy_from(fields)),
    'place': lambda simulation, q, v: simulation.place(GeneralizedState(np.array(q), np.array(v))),
    'go_back': lambda simulation: simulation.go_back(simulation.checkpoint()),
    # What it tells beside is for who begins there.
    'reset': lambda simulation, **_: simulation.reset()}


def _plain(values: Sequence[float]) -> list[float]:
    return [float(value) for value in values]
