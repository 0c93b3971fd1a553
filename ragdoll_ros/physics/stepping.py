"""Stepping by need: how finely to go through the next moment, and by which method.

In the air, with no joint at its limit, Runge-Kutta flies (flight.py, compiled/), up to the instant
of the next touch or limit. Everything else is the engine's own step, cut as finely as speed, limits
and contacts ask for.
"""
from __future__ import annotations

import bisect
import math
from dataclasses import dataclass

import numpy as np

from ..model import rotation
from ..model.coordinates import GeneralizedState
from ..model.scene import Scene
from ..model.state import State
from . import backend
from .engine.protocol import GROUND, Engine, Wrenches
from .flight import STIFFEST, Path
from .motion import damping_rate
from .settings import HUMAN, Accuracy

SOON = 0.015
"""s ahead that limits and ground are looked for."""

LANDED = 1e-6
"""m or rad by which a flight may end past the ground or a limit."""

MET = 2e-5
"""m by which bones may overlap where a flight ends because they touch."""

MOST_LOOKS = 30
"""Looks at a path that may be spent on finding the instant of a touch; some five are."""

MOST_FLIGHTS = 12
"""Runge-Kutta steps in 10 ms at the most: from there on the engine's own cost less."""

FINER = 3
"""Steps that tell the error of one step of a flight."""

ROUNDING = 4 * float(np.finfo(float).eps)
"""Share of the largest coordinate that a tick's sums may lose to rounding; no error is less."""

LAG = 0.1
"""Share of a motion that joint damping may take away before the engine hears that it is slower."""

GRADES = sorted({math.ceil(2 ** (k / 2)) for k in range(40)})
"""Counts of substeps: 1, 2, 3, 4, 6, 8, 12 ... A change makes the engine set up its step anew."""

HELPED = 0.98
"""Share of an overshoot that finer steps must come below to be tried once more: where contacts
press a joint past its limit, they never do."""

EVEN = 3.0
"""Accelerations up to so many times gravity's are those of an even motion, not of a blow."""

SHORTEST = 1e-7
"""s: a piece of flight shorter than this is not worth its stages."""


@dataclass
class StepStats:
    """What a tick took."""

    flights: int = 0
    """Runge-Kutta steps."""
    substeps: int = 0
    """Substeps of the engine."""
    redone: int = 0
    """Steps done again."""


@dataclass(frozen=True)
class StepResult:
    """A stretch of motion that is done: how long, and how fine the engine's substeps were."""

    duration: float
    """s."""
    substep: float
    """s; 0 for a flight."""
    touched: set[tuple[int, int]]
    """Pairs of dolls, or of a doll and GROUND, that touched or may have."""
    lag: float = 0.0
    """s: for which bones moved with the velocity at the end, not with the mean one."""


class Stepper:
    """Moves a scene on. Holds where it is: ``coordinates``, ``state``, what is ``touching``."""

    def __init__(self, scene: Scene, make_engine: type[Engine], accuracy: Accuracy) -> None:
        self._accuracy = accuracy
        self.engine = make_engine(scene)
        self.dynamics = backend.dynamics_of(scene, make_engine, self.engine.layout)
        self.reach = backend.reach_of(scene)
        self._layout = self.engine.layout
        self._limits = backend.limits_of(self._layout)
        self._roots = np.array([
            own.start + placement.doll.bones.index(placement.doll.root)
            for own, placement in zip(scene.bone_slices, scene.dolls, strict=True)])
        self._rigid = len(scene.bones) == len(scene.dolls)
        self._solid = bool(scene.ground or scene.self_collision or len(scene.dolls) > 1)
        """Whether anything can touch at all."""
        self._damping_rate = damping_rate(scene)
        self._gravity = math.hypot(*scene.gravity)
        self._lightest = min(bone.mass for bone in scene.bones)
        smallest = min(placement.doll.extent for placement in scene.dolls)
        self._span = 0.01 * min(1.0, math.sqrt(smallest / HUMAN))
        """s in which as many substeps are taken as the accuracy says for 10 ms."""
        self._stale = False
        """Whether the engine has yet to hear of where all is."""
        self._blocked: bool
        """Whether something that no flight can foresee comes next: bones that meet."""
        self._departure: GeneralizedState
        """Where the tick began."""
        self._flown: list[tuple[float, Wrenches]] | None
        """Durations, s, and loads of the tick's flights; None: it was not all flight."""
        self._path: Path | None
        """The step of a flight that is under way: it may lead over many ticks."""
        self._along: float
        """s: where on the path."""
        self._counted: int
        """Steps of the path that were counted."""
        self._loaded = False
        """Whether it is a path under loads, which ends with the piece."""
        self.stats = StepStats()
        self.begin()

    @property
    def accuracy(self) -> Accuracy:
        """How fine; may be changed between pieces."""
        return self._accuracy

    @accuracy.setter
    def accuracy(self, accuracy: Accuracy) -> None:
        if accuracy is not self._accuracy:
            self._accuracy, self._path = accuracy, None

    def update_state(self) -> None:
        """Read where the engine is."""
        self.state: State
        self.coordinates: GeneralizedState
        if self.dynamics.cheap:
            self.coordinates = self.engine.coordinates()
            self.state = self.dynamics.state(self.coordinates)
        else:
            self.state, self.coordinates = self.engine.read(), self.engine.coordinates()
        self.touching = self.engine.touching()

    def begin(self) -> None:
        """Start from where all is, and forget what was before."""
        self.sync_engine()
        self._blocked = False
        self._path = None
        self._flown = None
        self._limits.forget()
        self.update_state()

    def place(self, coordinates: GeneralizedState) -> None:
        """Put the scene elsewhere; what touches stays as it was."""
        self._path = None
        self._set(coordinates)

    def shift(self, state: State, turn: np.ndarray | None) -> None:
        """Take ``state``, to which dolls were moved on as rigid bodies and turned by ``turn``
        (d, 4), if at all; the engine hears of it when it is next needed.
        """
        layout = self._layout
        q, v = self.coordinates.q.copy(), self.coordinates.v.copy()
        q[layout.root_positions] = state.positions[self._roots]
        if turn is not None:
            q[layout.root_orientations] = rotation.multiply(turn, q[layout.root_orientations])
        v[layout.root_velocities] = state.linear_velocities[self._roots]
        v[layout.root_spins] = state.angular_velocities[self._roots]
        before = self.coordinates
        self.coordinates, self.state, self._stale = GeneralizedState(q, v), state, True
        self._limits.same(before, self.coordinates)

    def sync_engine(self) -> Engine:
        """The engine, with the dolls in it where they are."""
        if self._stale:
            self.engine.place(self.coordinates)
            self._stale = False
        return self.engine

    def begin_tick(self, tick: float) -> None:
        """Count efforts, and note what is flown, from here on, for ``tick`` s."""
        self.stats = StepStats()
        self._most_flights = math.ceil(MOST_FLIGHTS * max(1.0, tick / self._span))
        self._departure, self._flown = self.coordinates, []

    def step(self, duration: float, loads: Wrenches) -> StepResult:
        """Move on by ``duration`` s, or by less: up to the next touch or limit in a flight."""
        if self._may_fly(duration):
            flown = self._fly(duration, loads)
            if flown > 0:
                if self._flown is not None:
                    self._flown.append((flown, loads))
                return StepResult(flown, 0.0, set())
        self._path = self._flown = None
        return self._engine_step(duration, loads)

    def estimate_error(self) -> float | None:
        """Estimate the error, m, that the last tick added to the worst position.

        By flying it again in steps a third as long: the error of that is 81 times smaller and
        more. None if the tick was not all flight.
        """
        if not self._flown:
            return None
        coordinates, steps = self._departure, FINER * max(1, self.stats.flights)
        for duration, loads in self._flown:
            coordinates = self.dynamics.fly(coordinates, duration, steps, loads)
        missed = self.dynamics.state(coordinates).positions - self.state.positions
        rounding = ROUNDING * float(np.abs(self.state.positions).max())
        return max(rounding, float(np.linalg.norm(missed, axis=1).max()))

    def close(self) -> None:
        """Release the engines."""
        self.engine.close()
        self.dynamics.close()

    def _may_fly(self, duration: float) -> bool:
        """Whether nothing touches and no joint presses against its limit."""
        if (not self.accuracy.order or self.touching or self._blocked
                or self.stats.flights >= self._most_flights):
            return False
        return not self._limits.is_active(self.coordinates, 0.0 if self.accuracy.land else duration)

    def _fly(self, duration: float, loads: Wrenches) -> float:
        """Fly up to ``duration`` s; give the time flown, 0 where something comes in between."""
        if loads or self._loaded:
            self._path, self._loaded = None, bool(loads)
        parts = self.reach.ccd_steps(self.state, duration) if self._solid else 1
        if not self._leads_on(duration):
            parts = max(parts, math.ceil(
                duration / self.dynamics.longest(self.accuracy, self._fastest())))
        if parts > self._most_flights:
            return 0.0
        stretch, flown = duration / parts, 0.0
        while flown < duration * (1 - 1e-9):
            start, state = self.coordinates, self.state
            self._onward(stretch, duration - flown if loads else self.accuracy.longest, loads)
            begin = self._along
            ahead = self._ahead(begin + stretch)
            if ahead is None:
                self._path = None
                return flown
            if not self.accuracy.land and self._limits.max_violation(ahead) > 0:
                self._limits.hold(ahead)
                return flown
            self._fly_to(ahead)
            room = self._room()
            if room >= 0 and not self.touching:
                flown += stretch
                self._along += stretch
                continue
            self._limits.hold(self.coordinates)
            early, least = stretch, self._room(start, state)
            if room < 0:
                early = self._find_event_time(begin, stretch, least, room) if least > 0 else 0.0
            early = self._bisect_collision(begin, early)
            self._path = None
            if early > SHORTEST:
                return flown + early
            self._back_to(start, state, set())
            self._blocked = True
            return flown
        return duration

    def _leads_on(self, stretch: float) -> bool:
        """Whether a path is under way that leads on by ``stretch`` s."""
        path = self._path
        return path is not None and self._along + stretch <= path.duration * (1 + 1e-9)

    def _onward(self, stretch: float, longest: float, loads: Wrenches) -> None:
        """See that the path leads on from here by ``stretch`` s at the least.

        A new one is as many stretches long as speeds allow, and fit into ``longest`` s.
        """
        if self._leads_on(stretch):
            return
        path, fastest = self._path, self._fastest()
        over = path is not None and self._along > path.duration * (1 - 1e-9)
        longest = min(longest, self.dynamics.longest(self.accuracy, fastest))
        count = max(1, math.floor(longest / stretch * (1 + 1e-9)))
        self._path = self.dynamics.path(self.coordinates, stretch * count, self.accuracy, fastest,
                                        loads, path if over else None)
        self._along, self._counted = 0.0, 0

    def _ahead(self, time: float) -> GeneralizedState | None:
        """Where the path leads to; its steps are counted."""
        ahead = self._path.at(time)
        self.stats.flights += self._path.count - self._counted
        self._counted = self._path.count
        return ahead

    def _find_event_time(self, begin: float, stretch: float, least: float, room: float) -> float:
        """Go back along the path to where a limit or the ground is just reached; give the time, s.

        ``least`` > 0 > ``room`` (rad or m) are there where the stretch begins and ends. The end is
        a hair past the touch: the engine takes a gap that is left for room to move in within its
        first substep, and would eat that much of a bounce. Zero if that does not come out.
        """
        grounded = self.reach.clearance(self.state) < 0
        early, late = 0.0, stretch
        above, below = least + LANDED / 2, room + LANDED / 2
        for _ in range(MOST_LOOKS):
            time = (early * below - late * above) / (below - above)
            coordinates = self._path.at(begin + time)
            if grounded:
                self._set(coordinates)
                off = self._room() + LANDED / 2
            else:
                off = LANDED / 2 - self._limits.max_violation(coordinates)
            if abs(off) <= LANDED / 2:
                self._fly_to(coordinates)
                return time
            # Regula falsi, by halves where one end stays (Dowell and Jarratt, BIT 11, 1971).
            if off * below < 0:
                early, above = late, below
            else:
                above /= 2
            late, below = time, off
        return 0.0

    def _bisect_collision(self, begin: float, late: float) -> float:
        """Go back along the path to where bones begin to touch, if they do; give the time, s.

        By bisection, down to a depth that the engine's way of pushing bones apart, depth over
        RETURN, makes no speed of.
        """
        if not any(GROUND not in pair for pair in self.touching):
            return late
        early, speed = 0.0, self.reach.closing(self.state)
        while (late - early) * speed > MET:
            time = (early + late) / 2
            self._fly_to(self._path.at(begin + time))
            if any(GROUND not in pair for pair in self.touching):
                late = time
            else:
                early = time
        self._fly_to(self._path.at(begin + late))
        return late

    def _fly_to(self, coordinates: GeneralizedState) -> None:
        self._set(coordinates)
        self.touching = self.sync_engine().touching() if self._solid else set()

    def _set(self, coordinates: GeneralizedState) -> None:
        self.coordinates, self._stale = coordinates, True
        self.state = self.dynamics.state(coordinates) if self.dynamics.cheap else (
            self.sync_engine().read())

    def _back_to(self, start: GeneralizedState, state: State,
                 touching: set[tuple[int, int]]) -> None:
        self._stale = True
        self.coordinates, self.state, self.touching = start, state, touching

    def _room(self, coordinates: GeneralizedState | None = None,
              state: State | None = None) -> float:
        """Room (rad or m) to the nearest limit or the ground; below zero: past it."""
        room = -self._limits.max_violation(coordinates or self.coordinates)
        return min(room, self.reach.clearance(state or self.state))

    def _fastest(self) -> float:
        """Fastest turning, rad/s, of a bone or about a limited axis."""
        return max(self.reach.max_angular_speed(self.state), self._limits.fastest(self.coordinates))

    def _engine_step(self, duration: float, loads: Wrenches) -> StepResult:
        """Take the engine's own step, finer where that overshoots less.

        What is too far already at its start is jammed: that takes a solver more turns. Where a
        bone sinks however fine the step is, friction pushes it in faster than the ground bears
        it up (Painleve's paradox, at which an engine's solver never ends): then the ground has no
        friction for this step.
        """
        near = self._near(duration, loads)
        start, state, touching = self.coordinates, self.state, self.touching
        far, deep = self._too_far()
        self.sync_engine().set_solver_iterations(far > 1 or deep > 1)
        far, deep = max(1.0, self.accuracy.creep * far), max(1.0, self.accuracy.creep * deep)
        substeps = self._substeps(duration, bool(loads))
        self._blocked = False
        most = max(1, math.ceil(self.accuracy.most * duration / self._span))
        coarsest, last, slips = substeps, math.inf, False
        watch = bool(near) and not any(a != b for a, b in touching)
        while True:
            self.sync_engine()
            touched = self._run(duration, substeps, loads, watch)
            past, sunk = self._too_far()
            past, sunk = past / far, sunk / deep
            over = max(past, sunk)
            finest = substeps >= most or over > HELPED * last
            if over <= 1 or (finest and (slips or sunk <= max(1.0, past))):
                break
            self._back_to(start, state, touching)
            self.stats.redone += 1
            if finest:
                self.engine.set_ground_friction(True)
                substeps, last, slips = coarsest, math.inf, True
            else:
                substeps, last = min(most, 4 * substeps), over
        if slips:
            self.engine.set_ground_friction(False)
        substep = lag = duration / substeps
        if (self._rigid and self.accuracy.centred and touching
                and self._went_evenly(state, duration)):
            self._centre(start, substep)
            lag = 0.0
        return StepResult(duration, substep, touched if watch else near, lag)

    def _went_evenly(self, before: State, duration: float) -> bool:
        """Whether nothing was struck: no bone's velocity changed by more than a fall's."""
        return self.reach.change(before, self.state) < EVEN * self._gravity * duration

    def _centre(self, start: GeneralizedState, substep: float) -> None:
        """Take half a substep's change of velocity back out of the displacement.

        The engine moves all by the velocity that each substep ends with; by the mean of begin and
        end (the trapezoidal rule) an even motion is right to order 2.
        """
        back = (self.coordinates.v - start.v) * (-substep / 2)
        self._set(self.dynamics.integrate_configuration(self.coordinates, back))

    def _near(self, duration: float, loads: Wrenches) -> set[tuple[int, int]]:
        """Pairs of dolls, or of a doll and GROUND, that may touch within ``duration`` s."""
        pull = max((math.hypot(*load.force) for load in loads), default=0.0)
        return self.reach.broadphase_pairs(self.state, duration,
                                           self._gravity + pull / self._lightest,
                               self.touching)

    def _too_far(self) -> tuple[float, float]:
        """How far past a limit and in the ground, in units of what is put up with."""
        past = max(0.0, self._limits.max_violation(self.coordinates))
        sunk = -self.reach.clearance(self.state)
        return past / self.accuracy.redo, sunk / self.accuracy.sink

    def _run(self, duration: float, substeps: int, loads: Wrenches,
             watch: bool) -> set[tuple[int, int]]:
        """Let the engine go; what changes with the motion is looked at again now and then.

        Gives the pairs that touched in one of the substeps, if these are to be watched.
        """
        calls = math.ceil(self._damping_rate * duration / LAG)
        if watch or any(load.local or load.point.any() for load in loads):
            calls = substeps
        calls = max(1, min(calls, substeps))
        touched = set()
        for call in range(calls):
            share = substeps * (call + 1) // calls - substeps * call // calls
            self.engine.step(duration * share / substeps, share, loads)
            if watch:
                touched |= self.engine.touched()
        self.stats.substeps += substeps
        self.update_state()
        return {(a, b) for a, b in touched if a != b}

    def _substeps(self, duration: float, pushed: bool) -> int:
        """Count the substeps that this state asks for, one of the grades."""
        accuracy, state = self.accuracy, self.state
        tens = duration / self._span
        if not accuracy.adaptive:
            return max(1, math.ceil(accuracy.contact * tens))
        spin = self.reach.max_angular_speed(state)
        need = max(1.0, spin * duration / accuracy.turn, 4.0 * tens if pushed else 0.0,
                   self._damping_rate * duration / STIFFEST)
        need = max(need, self._limits.approach(self.coordinates, SOON) * duration / accuracy.limit)
        falling = self.reach.falling(state, SOON)
        if self.touching or falling or self._blocked:
            moving = falling > 0.3 or spin > 1.0 or self._blocked
            need = max(need, (accuracy.contact if moving else accuracy.settled) * tens,
                       falling * duration / accuracy.sink)
        most = max(1, math.ceil(accuracy.most * tens))
        return min(most, GRADES[bisect.bisect_left(GRADES, min(need, most))])

