"""A run again: the same acts at the same ticks, and whether the same states come of them."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..model import errors
from ..physics.logged_simulation import accuracy_from, repeat, state_digest
from ..physics.simulation import Simulation
from .run import Event, ReplayedRun

TOLD = ('pause', 'parameters')
"""Kinds of events that do nothing by themselves."""


@dataclass(frozen=True)
class Check:
    """Whether the state after ``tick`` ticks was that of the run, to the bit."""

    tick: int
    equal: bool


class Player:
    """Repeats a run, by another ``engine`` or ``accuracy`` if one is named.

    ``warn`` is told what can not be repeated.
    """

    def __init__(self, run: ReplayedRun, warn: Callable[[str], None], engine: str | None = None,
                 accuracy: str | None = None) -> None:
        self._run, self._warn = run, warn
        self._engine, self._accuracy = engine, accuracy
        self.simulation: Simulation | None = None
        """What repeats the run now; None where it is not known how it went on."""
        self.tick = self.made = 0
        """Ticks of the node so far; those that were repeated."""
        self.acts = 0
        self.checks: list[Check] = []

    def ticks(self) -> Iterator[Simulation]:
        """The simulation after each start and each tick. RagdollError for what is no run."""
        number = -1
        for event in self._run.events:
            self._follow(event, number + 1)
            number = event.number
            while self.simulation is not None and self.tick < event.tick:
                self.simulation.advance()
                self.tick, self.made = self.tick + 1, self.made + 1
                yield self.simulation
            self._take(event)
            if event.is_start:
                yield self.simulation

    def close(self) -> None:
        """Give the engine back."""
        if self.simulation is not None:
            self.simulation.close()
            self.simulation = None

    def _follow(self, event: Event, expected: int) -> None:
        """Give up, until the next start, where events are missing before this one."""
        if event.kind == 'start':
            return
        if event.number != expected:
            self._warn(f'before event {event.number}, at tick {event.tick}, others are missing: '
                       'the run is repeated up to there, and from the next start or reset on')
            self.close()
        elif event.tick < self.tick:
            raise errors.OutOfRange(f'event {event.number}: tick', event.tick,
                                    f'{self.tick} or later')

    def _take(self, event: Event) -> None:
        """Let an event take effect."""
        if event.kind == 'start' or (event.kind == 'reset' and self.simulation is None):
            self._begin(event)
        elif self.simulation is None or event.kind in TOLD:
            return
        elif event.kind == 'state':
            self._check(event.fields.get('sha256'))
        elif event.kind != 'accuracy' or self._accuracy is None:
            self._repeat(event)

    def _begin(self, event: Event) -> None:
        """Begin at a start, by what it tells."""
        self.close()
        scene, fields = self._run.scene(event), event.fields
        try:
            self.simulation = Simulation(
                scene, float(fields['step']),
                self._accuracy or accuracy_from(fields['accuracy']),
                self._engine or str(fields['engine']))
            self.simulation.parts = int(fields.get('parts', 1))
        except errors.RagdollError:
            raise
        except (KeyError, TypeError, ValueError):
            raise errors.WrongForm(f'event {event.number}', fields,
                                   'a start with engine, accuracy and step') from None
        self.tick = event.tick
        if 'state' in fields:
            self._check(fields['state'])

    def _repeat(self, event: Event) -> None:
        try:
            repeat(self.simulation, event.kind, event.fields)
        except errors.ModelError as error:
            raise error.at(f'event {event.number}') from None
        self.acts += 1

    def _check(self, digest: str) -> None:
        self.checks.append(Check(self.tick, state_digest(self.simulation.state) == digest))
