"""Repeating a run: the same events at the same ticks, with a check of the states."""
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..files.run_scene import read_placement
from ..model import errors
from ..physics.logged_simulation import accuracy_from, apply_event, state_digest
from ..physics.simulation import Simulation
from .run import Event, ReplayedRun

PASSIVE_KINDS = ('pause', 'parameters', 'limp')
"""Kinds of events that do not act on the simulation."""


@dataclass(frozen=True)
class Check:
    """Whether the state after ``tick`` ticks is that of the run, to the bit."""

    tick: int
    equal: bool


class Player:
    """Repeats a run, with another ``engine`` or ``accuracy`` if given.

    ``warn`` gets a text for what can not be repeated.
    """

    def __init__(self, run: ReplayedRun, warn: Callable[[str], None], engine: str | None = None,
                 accuracy: str | None = None) -> None:
        self._run, self._warn = run, warn
        self._engine, self._accuracy = engine, accuracy
        self.simulation: Simulation | None = None
        """None where events are missing."""
        self.tick = self.ticks_repeated = self.events_repeated = 0
        """The node's tick; counts of repeated ticks and events."""
        self.checks: list[Check] = []

    def ticks(self) -> Iterator[Simulation]:
        """The simulation after each start and tick. Raises a RagdollError for a wrong event."""
        number = -1
        for event in self._run.events:
            self._check_sequence(event, number + 1)
            number = event.number
            while self.simulation is not None and self.tick < event.tick:
                self.simulation.advance()
                self.tick, self.ticks_repeated = self.tick + 1, self.ticks_repeated + 1
                yield self.simulation
            self._apply(event)
            if event.is_start:
                yield self.simulation

    def close(self) -> None:
        """Release the engine."""
        if self.simulation is not None:
            self.simulation.close()
            self.simulation = None

    def _check_sequence(self, event: Event, expected: int) -> None:
        """Stop until the next start if events are missing before this one."""
        if event.kind == 'start':
            return
        if event.number != expected:
            self._warn(f'before event {event.number}, at tick {event.tick}, others are missing: '
                       'the run is repeated up to there, and from the next start or reset on')
            self.close()
        elif event.tick < self.tick:
            raise errors.OutOfRange(f'event {event.number}: tick', event.tick,
                                    f'{self.tick} or later')

    def _apply(self, event: Event) -> None:
        """Apply an event."""
        if event.kind == 'start' or (event.kind == 'reset' and self.simulation is None):
            self._begin(event)
        elif self.simulation is None or event.kind in PASSIVE_KINDS:
            return
        elif event.kind == 'unload':
            self.close()
        elif event.kind == 'state':
            self._check(event.fields.get('sha256'))
        elif event.kind != 'accuracy' or self._accuracy is None:
            try:
                apply_event(self.simulation, event.kind, self._arguments(event))
            except errors.ModelError as error:
                raise error.at(f'event {event.number}') from None
            self.events_repeated += 1

    @staticmethod
    def _arguments(event: Event) -> dict:
        """Arguments of an action; the placement of an ``add``, a text in the event, is parsed."""
        if event.kind != 'add':
            return event.fields
        return {'placement': read_placement(str(event.fields.get('placement')))}

    def _begin(self, event: Event) -> None:
        """Build the simulation of a start event."""
        self.close()
        scene, fields = self._run.scene(event), event.fields
        try:
            self.simulation = Simulation(
                scene, float(fields['step']), self._accuracy or accuracy_from(fields['accuracy']),
                self._engine or str(fields['engine']))
            self.simulation.samples_per_tick = int(fields.get('parts', 1))
        except errors.RagdollError:
            raise
        except (KeyError, TypeError, ValueError):
            raise errors.WrongForm(f'event {event.number}', fields,
                                   'a start with engine, accuracy and step') from None
        self.tick = event.tick
        if 'state' in fields:
            self._check(fields['state'])

    def _check(self, digest: str) -> None:
        self.checks.append(Check(self.tick, state_digest(self.simulation.state) == digest))
