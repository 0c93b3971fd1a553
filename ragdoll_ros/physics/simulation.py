"""A scene, an engine, pushes and time: what turns the first three into states."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model import errors
from ..model.coordinates import GeneralizedState
from ..model.push import Push
from ..model.scene import SECOND, STEP_RANGE, Scene
from ..model.state import State
from .conserving import ConservingStepper
from .engine.protocol import GROUND, Contact, Engine, Wrenches
from .engine.registry import resolve_engine
from .grab import EVENLY, Grab, Hands
from .joint_gap import JointGap
from .push_queue import PushQueue
from .settings import Accuracy, firm, resolve_accuracy
from .sleeping import SleepDetector
from .stepping import StepStats
from .swing.pose import SwingState
from .swing.simulation import SwingSimulation
from .work import longest_stretch

THROWN = SECOND
"""ns for which a doll that was let go is stepped as finely as one that is held."""

LONGEST_THROWN = 0.01
"""s that are gone through at once then: what fails is done again by itself."""

LEAST_SHARE = 0.01
"""Of a tick: stretches under such loads are no shorter, however fast the bone spins."""


class Simulation:
    """A scene that moves: push() it, advance() it by a tick, read its state.

    ``step`` is the tick in s (None: the scene's), ``accuracy`` a name of ACCURACIES or an
    Accuracy, ``engine`` a name of ENGINES or an Engine. ``workers`` is the number of threads, 1 as
    yet. The same pushes at the same ticks give the same states to the bit.
    """

    def __init__(self, scene: Scene, step: float | None = None,
                 accuracy: str | Accuracy = 'normal', engine: str | type[Engine] = 'auto',
                 workers: int = 1) -> None:
        errors.check_range('workers', workers, 1, 1)
        self.scene = scene
        self.step = scene.step if step is None else step
        self._accuracy = resolve_accuracy(accuracy)
        self._moving = ConservingStepper(scene, resolve_engine(engine), self._accuracy)
        self._stepper = self._moving.stepper
        self.mechanics = self._moving.mechanics
        self._moving.lift_out()
        self._start = (self._stepper.engine.save(), self._stepper.coordinates)
        self._gap = JointGap(scene)
        self._sleep_detector = SleepDetector(scene)
        self._swings = SwingSimulation(scene) if any(
            placement.doll.swings for placement in scene.dolls) else None
        self.reset()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def state(self) -> State:
        """Poses and velocities of all bones now."""
        return self._moving.state

    @property
    def swings(self) -> SwingState | None:
        """All masses of the scene's swings now; None for a scene without swings."""
        return self._swings and self._swings.state

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
        return self._pushes.acting(self.time)

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
        """Generalised coordinates and velocities of all dolls now."""
        return self._stepper.coordinates

    @property
    def joint_angles(self) -> np.ndarray:
        """All joint angles, rad, in the order of Scene.angle_names."""
        return self._stepper.sync_engine().joint_angles()

    def push(self, push: Push, channel: str | None = None) -> None:
        """Let a push act from its start on; on a ``channel`` it takes the place of the last.

        Raises UnknownBone, or OutOfRange for a start in the past or a queue that is full.
        """
        self._pushes.add(push, channel, self.time)

    def release(self, channel: str) -> None:
        """End the push on a channel now."""
        self._pushes.release(channel)

    def grab(self, hand: str, bone: str, point: Sequence[float] = (0.0, 0.0, 0.0),
             target: Sequence[float] | None = None) -> None:
        """Let a hand hold a point of a bone; what it held before it lets go.

        ``point`` (3,) m from the bone's centre of mass along the bone's axes; ``target`` (3,) m in
        the world as in drag(), None: where the point is now. Raises UnknownBone, or NotFinite or
        OutOfRange for numbers that are none or too far away.
        """
        self._hands.grab(hand, bone, point, target, self.state)

    def drag(self, hand: str, target: Sequence[float], within: float = EVENLY) -> None:
        """Move a hand to ``target`` (3,) m in the world, evenly ``within`` s of simulated time.

        For a hand that holds nothing, nothing happens. Raises NotFinite or OutOfRange.
        """
        self._hands.drag(hand, target, within)

    def let_go(self, hand: str) -> None:
        """Open a hand; what it held keeps the speed that it has."""
        self._hands.let_go(hand)

    def advance(self) -> State:
        """Go on by one tick; the state at its end."""
        self._stepper.begin_tick(self.step)
        self.stats = self._stepper.stats
        end = self.time + self.tick
        while self.time < end:
            change = self._pushes.next_change(self.time)
            self._advance_until(end if change is None else min(end, change))
        self._redone += self.stats.redone
        self._pushes.drop_ended(self.time)
        self._fall_asleep()
        if self._swings:
            self._swings.follow(self.time, self.state)
        return self.state

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
        self._moving.lift_out()
        engine.forget(self._start[0])
        self._start = (engine.save(), stepper.coordinates)
        return self.reset()

    def reset(self) -> State:
        """Go back to the start, to the bit; pushes that wait are dropped, and hands let go."""
        snapshot, coordinates = self._start
        self._stepper.engine.restore(snapshot)
        self._stepper.place(coordinates)
        self._stepper.begin()
        self._moving.begin()
        self.time = 0
        """Nanoseconds simulated since the start."""
        self._pushes = PushQueue(self.scene)
        self._hands = Hands(self.scene, self.mechanics)
        self._thrown_until = 0
        self._sleep_detector.disturb()
        self._redone = 0
        self.asleep = False
        """Whether all is at rest and the engine stands."""
        self.stats = StepStats()
        """What the last tick took."""
        if self._swings:
            self._swings.begin(self.time, self.state)
        return self.state

    def measures(self) -> dict[str, float]:
        """What went wrong so far, and what the last tick took: names end in their units."""
        stepper = self._stepper
        sunk = -float(stepper.reach.heights(self.state).min())
        error = 0.0 if self.asleep else stepper.estimate_error()
        return {
            **self._moving.measures(),
            'error_estimate_m': error or 0.0,
            'error_trusted': float(error is not None),
            'joint_gap_m': float(self._gap.gaps(self.state).max(initial=0.0)),
            'limit_overshoot_rad': float(
                stepper.engine.layout.past_limits(self.coordinates.q).max(initial=0.0)),
            'sinking_m': max(0.0, sunk),
            'flights': self.stats.flights,
            'substeps': self.stats.substeps,
            'redone_total': self._redone,
            'asleep': float(self.asleep)}

    def close(self) -> None:
        """Release the engine; a second time does nothing."""
        self._stepper.close()

    def _advance_until(self, end: int) -> None:
        """Go on to an instant, ns, before which no push begins or ends."""
        loads = self._pushes.wrenches(self.time, self.state)
        if loads or self._hands:
            self.asleep = False
            self._sleep_detector.disturb()
        if self._hands:
            self._thrown_until = end + THROWN
        thrown = self.time < self._thrown_until
        self._stepper.accuracy = firm(self._accuracy) if thrown else self._accuracy
        substep = self._pulled_substep if self._hands else self._moving.substep
        remaining = (end - self.time) / SECOND
        least = LEAST_SHARE * remaining
        while remaining > 1e-12 and not self.asleep:
            length = min(remaining, LONGEST_THROWN) if thrown else remaining
            if loads:
                length = min(length, max(least, min(
                    longest_stretch(load, self.state, self.mechanics.inertias[load.bone])
                    for load in loads)))
            remaining -= substep(length, loads)
        self.time = end

    def _pulled_substep(self, duration: float, loads: Wrenches) -> float:
        """Go through a stretch as short as hands need it; its length, s."""
        stepper, length = self._stepper, self._hands.stretch(duration)
        pulls = self._hands.pulls(stepper.dynamics, stepper.coordinates, self.state, length)
        length = self._moving.substep(length, [*loads, *pulls])
        self._hands.move(length)
        return length

    def _fall_asleep(self) -> None:
        """Sleep when all has been still for a while with something to rest on."""
        if self.asleep or not self._stepper.accuracy.sleep:
            return
        if self._pushes or self._hands:
            self._sleep_detector.disturb()
        elif (self._sleep_detector.update(self.state, self._moving.motion.kinetic, self.tick)
                and any(GROUND in pair for pair in self._stepper.touching)):
            self._moving.stop()
            self.asleep = True
