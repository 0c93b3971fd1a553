"""A scene, an engine, pushes and time: what turns the first three into states."""
from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property, partial

import numpy as np

from ..model import errors
from ..model.coordinates import GeneralizedState
from ..model.drive import Drive
from ..model.push import Push
from ..model.scene import SECOND, STEP_RANGE, Scene
from ..model.state import State
from .accuracy import Accuracy, resolve_accuracy
from .actions.grab import EVENLY, Grab, Hands
from .actions.joint_springs import Hold, Holds
from .actions.push_queue import PushQueue
from .engine.protocol import Contacts, Engine, Springs
from .engine.registry import resolve_engine
from .ground_heights import GroundHeights, JointGap
from .sleeping import SleepDetector
from .swing.pose import SwingState
from .swing.simulation import SwingSimulation

MOST_PARTS = 200
"""Of a tick: samples of a sensor of 1 kHz in the longest one."""

MOST_WORKERS = 64
"""Threads: each has its own scratch."""


class Simulation:
    """A scene that moves: push() it, advance() it by a tick, read its state.

    ``step`` is the tick in s (None: the scene's), ``accuracy`` a name of ACCURACIES or an
    Accuracy, ``engine`` a name of ENGINES or an Engine. ``workers`` is the number of threads over
    which dolls are spread that do not touch, 'auto': as many as there are cores. The same pushes at
    the same ticks give the same states to the bit, for any number of them.
    """

    def __init__(self, scene: Scene, step: float | None = None,
                 accuracy: str | Accuracy = 'normal', engine: str | type[Engine] = 'auto',
                 workers: int | str = 1) -> None:
        if workers == 'auto':
            workers = len(os.sched_getaffinity(0))
        errors.check_range('workers', workers, 1, MOST_WORKERS)
        self.scene = scene
        self.step = scene.step if step is None else step
        self._parts = 1
        self.starts = 0
        """How often it has begun, at first, by reset() or by place()."""
        choice = resolve_engine(engine)
        self.engine_name, self.engine_reason = choice.name, choice.reason
        """The engine that is taken; why it is not the one that 'auto' takes first."""
        self._make = partial(choice.make, scene, workers=int(workers))
        self._engine: Engine = self._make(resolve_accuracy(accuracy))
        self._placed: GeneralizedState | None = None
        self._start = self._engine.save()
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
        return self._engine.state

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
        return self._engine.accuracy

    @accuracy.setter
    def accuracy(self, accuracy: str | Accuracy) -> None:
        self._engine.accuracy = resolve_accuracy(accuracy)

    @property
    def parts(self) -> int:
        """Equal parts that a tick is gone in, one after the other; ``trail`` has the states between
        them. May be changed between ticks; other parts are other steps, and other last digits.
        """
        return self._parts

    @parts.setter
    def parts(self, parts: int) -> None:
        errors.check_range('parts', parts, 1, MOST_PARTS)
        self._parts = int(parts)

    @property
    def kinetic_energy(self) -> float:
        """Of all dolls now, J."""
        return float(self._engine.motion.kinetic.sum())

    @property
    def energy_excess(self) -> float:
        """Energy that nothing has put in since the start, J; losses make it negative."""
        return self._engine.energy_excess

    @property
    def energy_error(self) -> float:
        """Share of the energy at hand that a tick of this engine may make from nothing."""
        return self._engine.energy_error

    @property
    def pushes(self) -> tuple[Push, ...]:
        """Pushes that act now; a drive as the push that it is on a bone at rest."""
        return self._pushes.acting(self.time)

    @property
    def grabs(self) -> tuple[Grab, ...]:
        """What hands hold now."""
        return self._hands.grabs

    @property
    def holds(self) -> tuple[Hold, ...]:
        """Joint angles that are held now."""
        return self._holds.holds

    @property
    def contacts(self) -> Contacts:
        """What touches now."""
        return self._engine.contacts()

    @property
    def bones_on_ground(self) -> np.ndarray:
        """Which bones (n,) touch the ground now: those of contacts, but sooner told."""
        return self._engine.bones_on_ground()

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls now."""
        return self._engine.coordinates

    @property
    def joint_angles(self) -> np.ndarray:
        """All joint angles, rad, in the order of Scene.angle_names."""
        return self._engine.joint_angles

    @property
    def joint_rates(self) -> np.ndarray:
        """What the joint angles change by, rad/s."""
        return self._engine.joint_rates

    def push(self, push: Push | Drive, channel: str | None = None) -> None:
        """Let a push act from its start on; on a ``channel`` it takes the place of the last.

        Raises UnknownBone, or OutOfRange for a start in the past or a queue that is full.
        """
        self._pushes.add(push, channel, self.time)

    def release(self, channel: str) -> bool:
        """End the push on a channel now; whether there was one."""
        return self._pushes.release(channel)

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

    def hold(self, angle: str, stiffness: float, damping: float = 0.0,
             target: float | None = None) -> None:
        """Let a spring hold a joint angle of Scene.angle_names: -stiffness (angle - target) -
        damping rate, N m; ``target`` in rad, None: as it is now. What held it before ends.

        Raises UnknownJoint; OutOfRange or NotFinite for numbers that can not be; WrongAxes for a
        ball joint without limits, which has no angles; WrongForm where the engine is not rigid.
        """
        if not self._engine.holds:
            raise errors.WrongForm('engine', self.engine_name, 'rigid, which holds joints')
        self._holds.hold(angle, stiffness, damping, target, self.joint_angles)

    def go_limp(self, angles: Sequence[str] | None = None) -> None:
        """Let joint angles go that are held, None: all of them. Raises UnknownJoint."""
        self._holds.go_limp(angles)

    def advance(self) -> State:
        """Go on by one tick; the state at its end. Raises Closed after close()."""
        begin, trail = self.time, [self.state]
        for part in range(1, self._parts + 1):
            end = begin + self.tick * part // self._parts
            if self.asleep and not self._pushes and not self._springs:
                self.time = end
            while self.time < end:
                change = self._pushes.next_change(self.time)
                self._advance_until(end if change is None else min(end, change))
            trail.append(self.state)
        self.trail = tuple(trail)
        self._pushes.drop_ended(self.time)
        self._fall_asleep()
        if self._swings:
            self._swings.follow(self.time, self.state)
        return self.state

    def place(self, coordinates: GeneralizedState) -> State:
        """Put the dolls elsewhere, with other velocities, and take that as the start of all.

        Bones that overlap there do not collide from then on, and what is in the ground is lifted;
        what merely rests on something, up to pressed() deep in it, rests on. Raises OutOfRange for
        coordinates of other lengths than the scene's, NotFinite or NotUnit for what is no pose.
        """
        layout = self._engine.layout
        q, v = np.array(coordinates.q, float), np.array(coordinates.v, float)
        if (q.shape, v.shape) != ((layout.sizes[0],), (layout.sizes[1],)):
            raise errors.OutOfRange('coordinates', (q.shape, v.shape), f'{layout.sizes} numbers')
        errors.check_finite('coordinates', (*q.tolist(), *v.tolist()))
        layout.check_orientations(q)
        self._placed = GeneralizedState(q, v)
        self._engine.place(self._placed)
        self._engine.forget(self._start)
        self._start = self._engine.save()
        return self.reset()

    def checkpoint(self) -> object:
        """Where all is now, for go_back(); cheap enough for each tick."""
        return self.time, self._engine.checkpoint()

    def go_back(self, checkpoint: tuple) -> State:
        """Go on from where all was at a checkpoint; swings hang at rest there. Pushes and hands go
        on as they are.

        A new engine does: what was bad may have spread through the old one, as a NaN does through
        PyBullet's search for contacts.
        """
        self.time, there = checkpoint
        self._engine.close()
        self._engine = self._make(self.accuracy)
        if self._placed is not None:
            self._engine.place(self._placed)
        self._start = self._engine.save()
        self._engine.go_back(there)
        self._sleep_detector.disturb()
        self.asleep = bool(self._engine.resting.all())
        if self._swings:
            self._swings.begin(self.time, self.state)
        return self.state

    def reset(self) -> State:
        """Go back to the start, to the bit; pushes that wait are dropped, hands let go, and no
        joint is held.
        """
        self.starts += 1
        self._engine.restore(self._start)
        self.time = 0
        """Nanoseconds simulated since the start."""
        self.trail: tuple[State, ...] = (self.state,)
        """States of the last tick: at its start and at the end of each of its ``parts``."""
        self._pushes = PushQueue(self.scene)
        self._hands, self._holds = Hands(self.scene), Holds(self.scene)
        self._sleep_detector.disturb()
        self.asleep = False
        """Whether all is at rest and the engine stands."""
        if self._swings:
            self._swings.begin(self.time, self.state)
        return self.state

    def measures(self) -> dict[str, float]:
        """What went wrong so far, and what the last tick took: names end in their units."""
        engine = self._engine
        return {
            **engine.measures(),
            'joint_gap_m': float(self._gap.gaps(self.state).max(initial=0.0)),
            'limit_overshoot_rad': max(0.0, float(
                engine.layout.limit_violations(self.coordinates.q).max(initial=0.0))),
            'sinking_m': max(0.0, -float(self._heights(self.state).min())),
            'asleep': self.asleep}

    def close(self) -> None:
        """Release the engine; a second time does nothing."""
        self._engine.close()
        self._engine = _ClosedEngine()

    def _advance_until(self, end: int) -> None:
        """Go on to an instant, ns, before which no push begins or ends."""
        acting = (self._pushes.wrenches(self.time, self.state), self._springs,
                  self._pushes.drives(self.time))
        if any(acting):
            self.asleep = False
        if not self.asleep:
            duration = (end - self.time) / SECOND
            self._engine.advance(duration, *acting)
            self._hands.move(duration)
        self.time = end

    @cached_property
    def _gap(self) -> JointGap:
        return JointGap(self.scene)

    @cached_property
    def _heights(self) -> GroundHeights:
        return GroundHeights(self.scene)

    @property
    def _springs(self) -> Springs:
        """Of hands and of held joints."""
        return (*self._hands.springs, *self._holds.springs)

    def _fall_asleep(self) -> None:
        """Dolls sleep that have been still for a while, with all that they touch, where something
        of them rests on the ground.
        """
        engine = self._engine
        if self.asleep or not self.accuracy.sleep:
            return
        ready = self._sleep_detector.update(self.state, engine.motion.kinetic, self.tick)
        pushed = self._pushes.bones(self.time)
        for bone in (*pushed, *(spring.bone for spring in self._springs)):
            doll = self.scene.doll_of_bone[bone]
            self._sleep_detector.disturb(doll)
            ready[doll] = False
        if not np.count_nonzero(ready):
            return
        ready |= engine.resting
        awake = np.bincount(engine.groups, ~ready) > 0
        borne = np.bincount(engine.groups, engine.grounded()) > 0
        dolls = (borne & ~awake)[engine.groups] & ~engine.resting
        if dolls.any():
            engine.stop(dolls)
            self.asleep = bool(engine.resting.all())


class _ClosedEngine:
    """Stands where an engine was that is closed."""

    def close(self) -> None:
        """Nothing is left to release."""

    def __getattr__(self, name: str) -> object:
        raise errors.Closed('the simulation is closed: build another one')
