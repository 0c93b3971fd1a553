"""A scene, an engine, pushes and time: what turns the first three into states."""
from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model import errors, rotation
from ..model.coordinates import GeneralizedState
from ..model.push import Push
from ..model.scene import SECOND, STEP_RANGE, Scene
from ..model.state import State
from . import backend
from .engine.bullet import BulletEngine
from .engine.protocol import GROUND, AppliedWrench, Contact, Engine, pressed
from .grab import EVENLY, Grab, Hands, Pull
from .joint_gap import JointGap
from .motion import Motion
from .settings import Accuracy, firm, resolve_accuracy
from .sleeping import SleepDetector
from .stepping import Stepper, StepResult, StepStats
from .swing.pose import SwingState
from .swing.simulation import swing_simulation
from .work import longest_stretch, mean_load, work

MOST_PUSHES = 1000
"""Pushes that may wait at once; one more is refused."""

THROWN = SECOND
"""ns for which a doll that was let go is stepped as finely as one that is held."""

LONGEST_THROWN = 0.01
"""s that are gone through at once then: what fails is done again by itself."""

LEAST_SHARE = 0.01
"""Of a tick: stretches under such loads are no shorter, however fast the bone spins."""


@dataclass
class _Active:
    """A push with its times in ns; its load once it has begun."""

    push: Push
    bone: int
    start: int
    end: int
    channel: str | None
    load: AppliedWrench | None = None


class Simulation:
    """A scene that moves: push() it, advance() it by a tick, read its state.

    ``step`` is the tick in s (None: the scene's), ``accuracy`` a name of ACCURACIES or an
    Accuracy. The same pushes at the same ticks give the same states to the bit.
    """

    def __init__(self, scene: Scene, step: float | None = None,
                 accuracy: str | Accuracy = 'normal',
                 engine: type[Engine] = BulletEngine) -> None:
        self.scene = scene
        self.step = scene.step if step is None else step
        self.mechanics = backend.mechanics_of(scene)
        self._accuracy = resolve_accuracy(accuracy)
        self._stepper = Stepper(scene, engine, self._accuracy)
        self._conservation = backend.conservation_of(scene, self.mechanics,
                                                     self._stepper.engine.layout)
        self._lift_out()
        self._start = (self._stepper.engine.save(), self._stepper.coordinates)
        self._gap = JointGap(scene)
        self._rest = SleepDetector(scene)
        self._swings = swing_simulation(scene)
        self.reset()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def state(self) -> State:
        """Poses and velocities of all bones now."""
        return self._state

    @property
    def swings(self) -> SwingState | None:
        """All masses of the scene's swings now; None for a scene without swings."""
        return self._swings and self._swings.state

    @property
    def swing_names(self) -> list[str]:
        """Name of each mass of the swings, in their order."""
        return self._swings.names if self._swings else []

    @property
    def step(self) -> float:
        """A tick in s; may be changed between ticks."""
        return self.tick / SECOND

    @step.setter
    def step(self, step: float) -> None:
        errors.check_range('step', step, *STEP_RANGE)
        self.tick = round(step * SECOND)
        """Nanoseconds in a tick."""

    @property
    def accuracy(self) -> Accuracy:
        """How fine; may be changed between ticks."""
        return self._accuracy

    @accuracy.setter
    def accuracy(self, accuracy: str | Accuracy) -> None:
        self._accuracy = self._stepper.accuracy = resolve_accuracy(accuracy)

    @property
    def pushes(self) -> tuple[Push, ...]:
        """Pushes that act now."""
        return tuple(active.push for active in self._queue
                     if active.start <= self.time < active.end)

    @property
    def grabs(self) -> tuple[Grab, ...]:
        """What hands hold now."""
        return self._hands.grabs

    @property
    def contacts(self) -> list[Contact]:
        """What touches now."""
        return self._stepper.sync_engine().contacts()

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates of all dolls now."""
        return self._stepper.coordinates

    @property
    def joint_angles(self) -> np.ndarray:
        """All joint angles, rad, in the order of Scene.angle_names."""
        return self._stepper.sync_engine().joint_angles()

    def push(self, push: Push, channel: str | None = None) -> None:
        """Let a push act from its start on; on a ``channel`` it takes the place of the last.

        Raises UnknownBone, or OutOfRange for a start in the past or a queue that is full.
        """
        bone = self.scene.bone_index(push.bone)
        start = self.time if push.start is None else round(push.start * SECOND)
        if start < self.time:
            raise errors.OutOfRange('start', push.start, f'{self.time / SECOND:g} s or later')
        if channel is not None:
            self.release(channel)
        if len(self._queue) >= MOST_PUSHES:
            raise errors.OutOfRange('pushes', len(self._queue) + 1, f'at most {MOST_PUSHES}')
        end = start + max(1, round(push.duration * SECOND))
        self._queue.append(_Active(push, bone, start, end, channel))

    def release(self, channel: str) -> None:
        """End the push on a channel now."""
        self._queue = [active for active in self._queue if active.channel != channel]

    def grab(self, hand: str, bone: str, point: Sequence[float] = (0.0, 0.0, 0.0),
             target: Sequence[float] | None = None) -> None:
        """Let a hand hold a point of a bone; what it held before it lets go.

        ``point`` (3,) m from the bone's centre of mass along the bone's axes; ``target`` (3,) m in
        the world as in drag(), None: where the point is now. Raises UnknownBone, or NotFinite or
        OutOfRange for numbers that are none or too far away.
        """
        self._hands.grab(hand, bone, point, target, self._state)

    def drag(self, hand: str, target: Sequence[float], within: float = EVENLY) -> None:
        """Move a hand to ``target`` (3,) m in the world, evenly ``within`` s of simulated time.

        For a hand that holds nothing, nothing happens. Raises NotFinite or OutOfRange.
        """
        self._hands.drag(hand, target, within)

    def let_go(self, hand: str) -> None:
        """Open a hand; what it held keeps the speed that it has."""
        self._hands.let_go(hand)

    def advance(self) -> State:
        """Go on by one tick."""
        self._stepper.begin_tick(self.step)
        self.stats = self._stepper.stats
        end = self.time + self.tick
        while self.time < end:
            self._advance_until(min(end, self._next_change()))
        self._redone += self.stats.redone
        self._queue = [active for active in self._queue if active.end > self.time]
        self._fall_asleep()
        if self._swings:
            self._swings.follow(self.time, self._state)
        return self._state

    def place(self, coordinates: GeneralizedState) -> State:
        """Put the dolls elsewhere, with other velocities, and take that as the start of all.

        Bones that overlap there do not collide from then on, and what is in the ground is lifted;
        what merely rests on something, up to pressed() deep in it, rests on. Raises OutOfRange for
        coordinates of other lengths than the scene's.
        """
        stepper = self._stepper
        q, v = np.array(coordinates.q, float), np.array(coordinates.v, float)
        sizes = stepper.engine.layout.sizes
        if (q.shape, v.shape) != ((sizes[0],), (sizes[1],)):
            raise errors.OutOfRange('coordinates', (q.shape, v.shape), f'{sizes} numbers')
        stepper.place(GeneralizedState(q, v))
        engine = stepper.sync_engine()
        engine.exclude_initial_penetrations()
        stepper.begin()
        self._lift_out()
        engine.forget(self._start[0])
        self._start = (engine.save(), stepper.coordinates)
        return self.reset()

    def reset(self) -> State:
        """Go back to the start, to the bit; pushes that wait are dropped, and hands let go."""
        snapshot, coordinates = self._start
        self._stepper.engine.restore(snapshot)
        self._stepper.place(coordinates)
        self._stepper.begin()
        self._begin()
        return self._state

    def measures(self) -> dict[str, float]:
        """Tell what went wrong so far, and what the last tick took: names end in their units."""
        stepper, conservation = self._stepper, self._conservation
        sunk = -float(stepper.reach.heights(self._state).min())
        error = 0.0 if self.asleep else stepper.estimate_error()
        return {
            'energy_excess_J': float((self._motion.energy - conservation.start
                                      - conservation.worked).sum()),
            'energy_projected_J': float(conservation.budget.taken),
            'stopped_total': conservation.budget.stops,
            'work_of_pushes_J': float(conservation.worked.sum()) - self._grabbed,
            'work_of_grabs_J': self._grabbed,
            'error_estimate_m': error or 0.0,
            'error_trusted': float(error is not None),
            'joint_gap_m': float(self._gap.gaps(self._state).max(initial=0.0)),
            'limit_overshoot_rad': float(
                stepper.engine.layout.past_limits(self.coordinates.q).max(initial=0.0)),
            'sinking_m': max(0.0, sunk),
            'flights': self.stats.flights,
            'substeps': self.stats.substeps,
            'redone_total': self._redone,
            'asleep': float(self.asleep)}

    def close(self) -> None:
        """Give the engine back; a second time does nothing."""
        self._stepper.close()

    def _lift_out(self) -> None:
        """Set dolls that begin in the ground onto it: else they stay, or are thrown out."""
        stepper, layout = self._stepper, self._stepper.engine.layout
        heights = stepper.reach.heights(stepper.state)
        depths = -np.minimum.reduceat(heights, self.mechanics.starts)
        sunk = depths > pressed(self.scene)
        if sunk.any():
            q = stepper.coordinates.q.copy()
            ways = np.where(sunk, depths, 0)
            q[layout.root_positions] += np.outer(ways, self.scene.ground.normal)
            stepper.place(dataclasses.replace(stepper.coordinates, q=q))
            stepper.begin()

    def _begin(self) -> None:
        self.time = 0
        """Nanoseconds simulated since the start."""
        self._queue: list[_Active] = []
        self._hands = Hands(self.scene, self.mechanics)
        self._thrown_until = 0
        self._grabbed = 0.0
        """J: work of hands since the start."""
        self._state = self._stepper.state
        self._motion = self.mechanics.motion(self._state)
        self._conservation.open(self._state)
        self._rest.disturb()
        self._redone = 0
        self.asleep = False
        """Whether all is at rest and the engine stands."""
        self.stats = StepStats()
        """What the last tick took."""
        if self._swings:
            self._swings.begin(self.time, self._state)

    def _next_change(self) -> int:
        """Instant, ns, at which the next push begins or ends."""
        times = [time for active in self._queue for time in (active.start, active.end)]
        return min((time for time in times if time > self.time), default=self.time + self.tick)

    def _advance_until(self, end: int) -> None:
        """Go on to an instant between which no push begins or ends."""
        loads = [self._load(active) for active in self._queue
                 if active.start <= self.time < active.end]
        if loads or self._hands:
            self.asleep = False
            self._rest.disturb()
        if self._hands:
            self._thrown_until = end + THROWN
        thrown = self.time < self._thrown_until
        self._stepper.accuracy = firm(self._accuracy) if thrown else self._accuracy
        substep = self._pulled if self._hands else self._substep
        remaining = (end - self.time) / SECOND
        least = LEAST_SHARE * remaining
        while remaining > 1e-12 and not self.asleep:
            length = min(remaining, LONGEST_THROWN) if thrown else remaining
            if loads:
                length = min(length, max(least, min(
                    longest_stretch(load, self._state, self.mechanics.inertias[load.bone])
                    for load in loads)))
            remaining -= substep(length, loads)
        self.time = end

    def _pulled(self, duration: float, loads: list[AppliedWrench]) -> float:
        """Go through a stretch as short as hands need it; give its length, s."""
        stepper, length = self._stepper, self._hands.stretch(duration)
        pulls = self._hands.pulls(stepper.dynamics, stepper.coordinates, self._state, length)
        length = self._substep(length, [*loads, *pulls])
        self._hands.move(length)
        return length

    def _substep(self, duration: float, loads: list[AppliedWrench]) -> float:
        """Go through one stretch of motion and see to what must be kept; give its length, s."""
        stepper, before, motion = self._stepper, self._state, self._motion
        start = stepper.coordinates
        piece = stepper.step(duration, loads)
        self._update_state(stepper.state)
        if loads:
            self._enter_work(loads, before, piece)
        if stepper.accuracy.momentum and (piece.substep or not stepper.dynamics.keeps_momentum):
            self._keep_momentum(motion, piece, loads, before)
        if stepper.accuracy.energy:
            self._keep_energy(start, piece.touched)
        return piece.duration

    def _update_state(self, state: State) -> None:
        self._state = state
        self._motion = self.mechanics.motion(state)

    def _correct(self, coordinates: GeneralizedState) -> None:
        self._stepper.place(coordinates)
        self._update_state(self._stepper.state)

    def _keep_momentum(self, before: Motion, piece: StepResult, loads: list[AppliedWrench],
                       state: State) -> None:
        """Give dolls that touched nothing outside themselves the momentum that they must have.

        What loads that turn with a bone give in a flight, nobody knows better than the flight.
        """
        touched = self._conservation.touched(piece.touched) if piece.touched else None
        if touched is not None and touched.all():
            return
        if not piece.substep and any(load.local for load in loads):
            return
        impulse = moment = 0.0
        if loads:
            impulse, moment = self._given(loads, piece.duration, state)
        self._state, self._motion, turn = self._conservation.keep_momentum(
            self._state, before, self._motion, piece.duration, impulse, moment, touched)
        self._stepper.shift(self._state, turn)

    def _given(self, loads: list[AppliedWrench], duration: float,
               before: State) -> tuple[np.ndarray, np.ndarray | None]:
        """Impulse (d, 3) N s and moment (d, 3) N m s of loads; no moment where a force has one."""
        impulse, moment = np.zeros((2, len(self.scene.dolls), 3))
        for load in loads:
            doll = self.mechanics.doll_of[load.bone]
            force, torque = mean_load(load, before, self._state)
            impulse[doll] += force * duration
            moment[doll] += torque * duration
        return impulse, None if any(load.force.any() for load in loads) else moment

    def _keep_energy(self, start: GeneralizedState, touched: set[tuple[int, int]]) -> None:
        """Take out energy from nothing; what was in the air keeps its momentum for sure.

        Dolls that may have ``touched`` share their budget: a bounce is over within a step.
        """
        conservation = self._conservation
        groups = conservation.groups(touched)
        surplus = conservation.surplus(self._motion, groups)
        if (surplus > 0).any():
            stepper = self._stepper
            # What is tolerated goes with the kinetic energy: once more, with what is left of it.
            for _ in range(2):
                self._correct(conservation.without_surplus(
                    start, stepper.coordinates, self._motion, surplus, bool(touched)))
                surplus = conservation.surplus(self._motion, groups)
                if (surplus <= 0).all():
                    break
            burst = conservation.burst(self._motion, groups)
            if burst.any():
                self._correct(conservation.stopped(start, stepper.coordinates, burst))
        conservation.close_step(self._motion.energy, groups)

    def _enter_work(self, loads: list[AppliedWrench], before: State, piece: StepResult) -> None:
        done = np.zeros(len(self.scene.dolls))
        for load in loads:
            joules = work(load, before, self._state, piece)
            done[self.mechanics.doll_of[load.bone]] += joules
            if isinstance(load, Pull):
                self._grabbed += joules
        self._conservation.add_work(done)

    def _load(self, active: _Active) -> AppliedWrench:
        """Give a push's load; its point is tied to the bone when the push begins."""
        if active.load is None:
            push = active.push
            point = np.array(push.point)
            if not push.local:
                turn = self._state.orientations[active.bone]
                point = rotation.rotate(rotation.inverse(turn), point)
            active.load = AppliedWrench(active.bone, np.array(push.force), np.array(push.torque),
                                        point,
                               push.local)
        return active.load

    def _fall_asleep(self) -> None:
        """Sleep when all has been still for a while with something to rest on."""
        if self.asleep or not self._stepper.accuracy.sleep:
            return
        if self._queue or self._hands:
            self._rest.disturb()
        elif (self._rest.update(self._state, self._motion.kinetic, self.tick)
                and any(GROUND in pair for pair in self._stepper.touching)):
            coordinates = self._stepper.coordinates
            self._correct(dataclasses.replace(coordinates, v=np.zeros_like(coordinates.v)))
            self._conservation.close_step(self._motion.energy,
                                          self._conservation.groups(self._stepper.touching))
            self.asleep = True
