"""Stepping by need: how finely to go through the next moment, and by which method.

In the air, with no joint at its limit, Runge-Kutta flies (flight.py), up to the instant of the
next touch or limit. Everything else is the engine's own step, cut as finely as speed, limits
and contacts ask for.
"""
from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .coordinates import Coordinates
from .engine.protocol import GROUND, Engine, Load
from .flight import fly
from .mechanics import Shift, cross, damping_rate
from .reach import Reach
from .scene import Scene
from .state import State


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
    """Order of the flight's Runge-Kutta method; 0: the engine's own step in flight too."""
    flight_turn: float
    """rad that the fastest bone may turn in one Runge-Kutta step."""
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
    sleep: bool = True
    """Stop the engine when all is at rest."""


DRAFT = Accuracy(turn=0.15, limit=0.1, contact=4, settled=2, sink=0.01, most=32, order=2,
                 flight_turn=0.8, redo=math.radians(8))
NORMAL = Accuracy(turn=0.06, limit=0.05, contact=6, settled=4, sink=0.005, most=128, order=3,
                  flight_turn=0.4, redo=math.radians(3))
EXACT = Accuracy(turn=0.02, limit=0.02, contact=12, settled=8, sink=0.002, most=256, order=4,
                 flight_turn=0.2, redo=math.radians(1.5))
ACCURACIES = {'draft': DRAFT, 'normal': NORMAL, 'exact': EXACT}


@functools.lru_cache
def firm(accuracy: Accuracy) -> Accuracy:
    """Give an accuracy that is fine enough for joints that are pulled with all of a hand's force.

    Steps are as short as a hand's force is steady, so that what each may add would add up.
    """
    return dataclasses.replace(
        accuracy, turn=min(accuracy.turn, 0.06), limit=min(accuracy.limit, 0.025),
        contact=max(accuracy.contact, 8), sink=min(accuracy.sink, 0.006),
        most=max(accuracy.most, 64), redo=min(accuracy.redo, math.radians(2)), creep=1.0)


AT_LIMIT = 1e-3
"""rad: a joint as near as this to its limit, and moving toward it, is at the limit."""

SOON = 0.015
"""s ahead that limits and ground are looked for."""

LANDED = 1e-6
"""m or rad by which a flight may end past the ground or a limit."""

MOST_SECANTS = 4
"""Flights that may be spent on finding the instant of a touch."""

MOST_FLIGHTS = 12
"""Runge-Kutta steps in a tick at the most: from there on the engine's own cost less."""

FINER = 3
"""Steps of order 4 that tell the error of one step of a flight."""

STIFFEST = 1.5
"""Step times the fastest rate at which damping ends a motion: from 2 on, explicit steps make
energy of it."""

SHORTEST = 1e-7
"""s: a piece of flight shorter than this is not worth its stages."""


@dataclass
class Effort:
    """What a tick took."""

    flights: int = 0
    """Runge-Kutta steps."""
    substeps: int = 0
    """Substeps of the engine."""
    redone: int = 0
    """Steps done again."""


@dataclass(frozen=True)
class Piece:
    """A stretch of motion that is done: how long, and how fine the engine's substeps were."""

    duration: float
    """s."""
    substep: float
    """s; 0 for a flight."""


class Stepper:
    """Moves a scene on. Holds where it is: ``coordinates``, ``state``, what is ``touching``."""

    def __init__(self, scene: Scene, make_engine: type[Engine],
                 accuracy: Accuracy) -> None:
        self.accuracy = accuracy
        self.engine = make_engine(scene)
        self._make_free = functools.partial(make_engine, scene, free=True)
        self._free = self._make_free() if accuracy.order else None
        self.reach = Reach(scene)
        self._layout = self.engine.layout
        self._normal = np.array(scene.ground.normal if scene.ground else (0.0, 0.0, 1.0))
        self._damped = any(joint.damping for placement in scene.dolls
                           for joint in placement.doll.joints)
        self._fading = damping_rate(scene)
        self._stale: bool
        """Whether the engine has yet to hear of a shift."""
        self._blocked: bool
        """Whether something that no flight can foresee comes next: bones that meet."""
        self._held: np.ndarray
        """(k,) whether a flight ended at this limit and the joint has leaned on it since."""
        self._departure: Coordinates
        """Where the tick began."""
        self._flown: list[tuple[float, Sequence[Load]]] | None
        """Durations, s, and loads of the tick's flights; None: it was not all flight."""
        self.effort = Effort()
        self.begin()

    @property
    def free(self) -> Engine:
        """The scene without contacts and limits, to be asked for accelerations."""
        if self._free is None:
            self._free = self._make_free()
        return self._free

    def look(self) -> None:
        """Read where the engine is."""
        self.state: State = self.engine.read()
        self.coordinates: Coordinates = self.engine.coordinates()
        self.touching = self.engine.touching()

    def begin(self) -> None:
        """Start from where the engine is, and forget what was before."""
        self._stale = self._blocked = False
        self._past_at = (None, np.zeros(0))
        self._flown = None
        self._held = np.zeros(len(self._layout.limits[0]), bool)
        self.look()

    def place(self, coordinates: Coordinates) -> None:
        """Put the scene elsewhere; what touches stays as it was."""
        self.engine.place(coordinates)
        self._stale = False
        self.coordinates = coordinates
        self.state = self.engine.read()

    def shift(self, shift: Shift, state: State) -> None:
        """Move dolls on as rigid bodies, to where they are in ``state``; the engine hears of it
        when it is next needed.
        """
        layout = self._layout
        q, v = self.coordinates.q.copy(), self.coordinates.v.copy()
        arms = q[layout.root_positions] - shift.centre
        q[layout.root_positions] += shift.way
        v[layout.root_velocities] += shift.linear + cross(shift.spin, arms)
        v[layout.root_spins] += shift.spin
        self.coordinates, self.state, self._stale = Coordinates(q, v), state, True

    def settle(self) -> Engine:
        """Give the engine, with the dolls in it where they are."""
        if self._stale:
            self.engine.place(self.coordinates)
            self._stale = False
        return self.engine

    def go(self, duration: float, loads: Sequence[Load]) -> Piece:
        """Move on by ``duration`` s, or by less: up to the next touch or limit in a flight."""
        if not (self.effort.flights or self.effort.substeps):
            self._departure, self._flown = self.coordinates, []
        if self._may_fly():
            flown = self._fly(duration, loads)
            if flown > 0:
                if self._flown is not None:
                    self._flown.append((flown, loads))
                return Piece(flown, 0.0)
        self._blocked = False
        self._flown = None
        return Piece(duration, self._step(duration, loads))

    def estimate_error(self) -> float | None:
        """Estimate the error, m, that the last tick added to the worst position.

        By flying it again at order 4 in steps a third as long: the error of that is 81 times
        smaller at the least. None if the tick was not all flight.
        """
        if not self._flown:
            return None
        coordinates, steps = self._departure, FINER * self.effort.flights
        for duration, loads in self._flown:
            coordinates = fly(self._free, coordinates, duration, 4, steps, loads)
        self._free.place(coordinates)
        missed = self._free.read().positions - self.state.positions
        return float(np.linalg.norm(missed, axis=1).max())

    def close(self) -> None:
        """Give both engines back."""
        self.engine.close()
        if self._free is not None:
            self._free.close()

    def _may_fly(self) -> bool:
        """Tell whether nothing touches and no joint presses against its limit."""
        if (self._free is None or not self.accuracy.order or self.touching or self._blocked
                or self.effort.flights >= MOST_FLIGHTS):
            return False
        past = self._past()
        if not len(past) or past.max() < -AT_LIMIT:
            return True
        self._held &= past > -AT_LIMIT
        pressing = (past >= -AT_LIMIT) & (self._layout.limit_speeds(self.coordinates) > 0)
        return not (self._held | pressing | (past > AT_LIMIT)).any()

    def _fly(self, duration: float, loads: Sequence[Load]) -> float:
        """Fly up to ``duration`` s; give the time flown, 0 where something comes in between."""
        steps = max(self._flight_steps(duration), self.reach.strides(self.state, duration))
        if steps > MOST_FLIGHTS:
            return 0.0
        piece = duration / steps
        flown = 0.0
        while flown < duration * (1 - 1e-9):
            start, state, least = self.coordinates, self.state, self._room()
            self._fly_to(fly(self._free, start, piece, self.accuracy.order, 1, loads))
            self.effort.flights += 1
            room = self._room()
            if room >= 0 and not self.touching:
                flown += piece
                continue
            self._held |= self._past() > 0
            if least > 0 > room:
                early = self._land(start, piece, least, room, loads)
                if early > 0:
                    return flown + early
            self._back_to(start, state, set())
            self._blocked = True
            return flown
        return duration

    def _land(self, start: Coordinates, piece: float, least: float, room: float,
              loads: Sequence[Load]) -> float:
        """Fly to where a limit or the ground is just reached, by secants; give the time, s.

        Zero if that does not come out, or if bones overlap there: within the rest of the tick,
        which may be a sliver, they would burst apart. The end is a hair past it: the engine takes
        a gap that is left for room to move in within its first substep, and would eat that much
        of a bounce.
        """
        early, late = 0.0, piece
        for _ in range(MOST_SECANTS):
            closing = (least - room) / (late - early)
            time = min(max(early + (least + LANDED / 2) / closing, early), late)
            if time <= SHORTEST:
                return 0.0
            self._fly_to(fly(self._free, start, time, self.accuracy.order, 1, loads))
            self.effort.flights += 1
            reached = self._room()
            if any(GROUND not in pair for pair in self.touching):
                return 0.0
            if -LANDED <= reached <= 0:
                return time
            if reached > 0:
                early, least = time, reached
            else:
                late, room = time, reached
        return time if reached > -AT_LIMIT else 0.0

    def _fly_to(self, end: Coordinates) -> None:
        self.place(end)
        self.touching = self.engine.touching()

    def _back_to(self, start: Coordinates, state: State,
                 touching: set[tuple[int, int]]) -> None:
        self.engine.place(start)
        self._stale = False
        self.coordinates, self.state, self.touching = start, state, touching

    def _room(self) -> float:
        """Room (rad or m) to the nearest limit or the ground; below zero: past it."""
        past = self._past()
        room = -float(past.max()) if len(past) else math.inf
        return min(room, self.reach.clearance(self.state))

    def _flight_steps(self, duration: float) -> int:
        spin = math.sqrt(np.einsum('ij,ij->i', self.state.angular, self.state.angular).max())
        rate = max(spin, np.abs(self.coordinates.v[self._layout.limited[1]]).max(initial=0.0))
        return max(1, math.ceil(rate * duration / self.accuracy.flight_turn),
                   math.ceil(self._fading * duration / STIFFEST))

    def _step(self, duration: float, loads: Sequence[Load]) -> float:
        """Take the engine's own step, finer if it overshoots a limit; give its substep, s."""
        self.settle()
        start, state, touching = self.coordinates, self.state, self.touching
        bound = max(1.0, self.accuracy.creep * self._too_far())
        substeps = self._substeps(duration, bool(loads))
        most = max(1, math.ceil(self.accuracy.most * duration / 0.01))
        while True:
            self._run(duration, substeps, loads)
            if substeps >= most or self._too_far() <= bound:
                return duration / substeps
            self._back_to(start, state, touching)
            substeps = min(most, 4 * substeps)
            self.effort.redone += 1

    def _past(self) -> np.ndarray:
        """Angles (k,) rad by which the limited joints are past their limits now; kept."""
        if self._past_at[0] is not self.coordinates:
            past = self._layout.past_limits(self.coordinates.q)
            self._past_at = (self.coordinates, past)
        return self._past_at[1]

    def _too_far(self) -> float:
        """Tell how far past a limit or in the ground, in units of what is put up with."""
        past = float(self._past().max(initial=0.0))
        sunk = -self.reach.clearance(self.state)
        return max(past / self.accuracy.redo, sunk / self.accuracy.sink)

    def _run(self, duration: float, substeps: int, loads: Sequence[Load]) -> None:
        """Let the engine go; what changes with the motion is looked at again each substep."""
        if self._damped or any(load.local or load.point.any() for load in loads):
            for _ in range(substeps):
                self.engine.step(duration / substeps, 1, loads)
        else:
            self.engine.step(duration, substeps, loads)
        self.effort.substeps += substeps
        self.look()

    def _substeps(self, duration: float, pushed: bool) -> int:
        """Count the substeps that this state asks for, a power of two."""
        accuracy, state = self.accuracy, self.state
        tens = duration / 0.01
        if not accuracy.adaptive:
            return max(1, math.ceil(accuracy.contact * tens))
        spin = math.sqrt(np.einsum('ij,ij->i', state.angular, state.angular).max())
        need = max(1.0, spin * duration / accuracy.turn, 4.0 * tens if pushed else 0.0,
                   self._fading * duration / STIFFEST)
        speeds = self._layout.limit_speeds(self.coordinates)
        if len(speeds):
            past = self._past()
            near = speeds[past + SOON * speeds > 0]
            need = max(need, near.max(initial=0.0) * duration / accuracy.limit)
        falling = self.reach.falling(state, SOON)
        if self.touching or falling:
            moving = falling > 0.3 or spin > 1.0
            need = max(need, (accuracy.contact if moving else accuracy.settled) * tens,
                       falling * duration / accuracy.sink)
        most = max(1, math.ceil(accuracy.most * tens))
        return min(most, math.ceil(2 ** (math.ceil(2 * math.log2(need)) / 2)))

