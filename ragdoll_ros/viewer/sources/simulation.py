"""A simulation in this process as a source, in a thread of its own that alone uses it."""
from __future__ import annotations

import contextlib
import dataclasses
import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future

import numpy as np

from ...files.limits import load_limits
from ...files.scene import load_scene
from ...model import errors
from ...model.push import Push
from ...model.rotation import IDENTITY
from ...model.scene import SECOND, Scene
from ...model.vectors import Vector
from ...physics.actions.grab import DRAG_TIME
from ...physics.sensors.impact_arrow import impact_arrow
from ...physics.simulation import Simulation
from ...realtime.pacer import Pacer
from .recent_impacts import RecentImpacts
from .source import REAL_TIME_FACTORS, Frame, GrabbedPoint, RequestedData, Source, SourceStatus

WINDOW = 1.0
"""s of wall time over which the rate and cost of ticks are measured."""

STATUS_PERIOD = 0.1
"""s of wall time between two updates of the status."""

MEASURE_SHARE = 0.05
"""Share of the thread's time that Simulation.measures() may take: 0.2 s for a thousand dolls."""

ACCURACY = 'normal'
"""At the start."""

FEW_BONES = 200
"""Up to which contacts are kept with each frame, for who looks back: 35 us a tick of one doll."""

MAX_NEW_FRAMES = 300
"""That are kept for the page: 3 s of ticks, in which it may draw nothing."""

JOIN_TIMEOUT = 1.0
"""s that the thread may take to end."""

COMMAND_TIMEOUT = 60.0
"""s that building a scene may take."""


class SimulationSource(Source):
    """Simulates a scene in wall time while a page is open.

    Until another bone is chosen, pushes go to the first doll's root, or if that is fixed to a bone
    that hangs on it.
    """

    def __init__(self, scene: Scene, engine: str = 'auto') -> None:
        self._commands: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._requested = RequestedData()
        self._frame: Frame | None = None
        self._new_frames: deque[Frame] = deque(maxlen=MAX_NEW_FRAMES)
        self._runs = 0
        """Number of runs of the simulations before this one."""
        self._impacts = RecentImpacts()
        self._recorded: Simulation | None = None
        """The simulation whose impacts are recorded."""
        self._pushed_bone = ''
        self._statistics = TickStatistics()
        self._simulation = Simulation(scene, engine=engine, workers='auto')
        self._status = SourceStatus(
            real_time_factor=_real_time_factor(scene), engine=engine, accuracy=ACCURACY,
            engine_name=self._simulation.engine_name)
        self._pacer = Pacer(1.0, 0)
        self._next_status = self._next_measure = 0.0
        self._update_frame()
        self._restart_clock()
        self._thread = threading.Thread(target=self._run, name='simulation', daemon=True)
        self._thread.start()

    @property
    def frame(self) -> Frame | None:
        return self._frame

    def take_frames(self) -> list[Frame]:
        return [self._new_frames.popleft() for _ in range(len(self._new_frames))]

    @property
    def status(self) -> SourceStatus:
        return self._status

    @property
    def pushed_bone(self) -> str:
        scene = self._simulation.scene
        if self._pushed_bone in scene.bone_names:
            return self._pushed_bone
        return scene.first_pushed_bone

    def request(self, requested: RequestedData) -> None:
        if requested != self._requested:
            self._commands.put(lambda: self._set_requested(requested))

    def push(self, force: Vector, duration: float) -> None:
        self._commands.put(lambda: self._push(force, duration))

    def push_bone(self, bone: str) -> None:
        self._pushed_bone = bone

    def pause(self, paused: bool) -> bool:
        self._commands.put(lambda: self._update_status(paused=paused))
        return True

    def step(self) -> None:
        self._commands.put(lambda: self._status.paused and self._tick())

    def reset(self) -> None:
        self._commands.put(self._reset)

    def go_limp(self) -> None:
        self._commands.put(lambda: self._simulation.go_limp())

    def set_strength(self, strength: float) -> None:
        self._commands.put(lambda: self._simulation.set_strength(strength))

    def set_real_time_factor(self, factor: float) -> None:
        errors.check_range('real_time_factor', factor, *REAL_TIME_FACTORS)
        self._commands.put(lambda: self._update_status(real_time_factor=factor))

    def load(self, name: str) -> None:
        self.set_scene(load_scene(name))

    def set_engine(self, name: str) -> None:
        self._run_and_wait(lambda: self._replace(self._simulation.scene, name))

    def set_accuracy(self, name: str) -> None:
        self._run_and_wait(lambda: self._set_accuracy(name))

    def set_scene(self, scene: Scene) -> None:
        self._run_and_wait(lambda: self._replace(scene, self._status.engine))

    def grab(self, hand: str, bone: str, point: Vector, target: Vector) -> None:
        self._commands.put(lambda: self._move_hand(
            lambda: self._simulation.grab(hand, bone, point, target)))

    def drag(self, hand: str, target: Vector) -> None:
        self._commands.put(lambda: self._move_hand(lambda: self._simulation.drag(
            hand, target, DRAG_TIME * self._status.real_time_factor)))

    def let_go(self, hand: str) -> None:
        self._commands.put(lambda: self._simulation.let_go(hand))

    def set_state(self, doll: str, position: Vector, velocity: Vector) -> None:
        self._commands.put(lambda: self._simulation.set_state(
            doll, position, IDENTITY, velocity, (0.0, 0.0, 0.0)))

    def close(self) -> None:
        self._commands.put(None)
        self._thread.join(JOIN_TIMEOUT)
        self._simulation.close()

    def _run_and_wait(self, change: Callable[[], None]) -> None:
        """Run a function in the simulation's thread; what it raises is raised here."""
        done: Future[None] = Future()

        def run() -> None:
            try:
                done.set_result(change())
            except Exception as error:
                done.set_exception(error)

        self._commands.put(run)
        done.result(COMMAND_TIMEOUT)

    def _run(self) -> None:
        while True:
            try:
                wait = self._pacer.wait(time.monotonic_ns()) / SECOND if self._is_running else None
                command = self._commands.get(timeout=wait)
            except queue.Empty:
                if self._pacer.due(time.monotonic_ns()):
                    self._tick()
                continue
            if command is None:
                return
            try:
                command()
            except errors.RagdollError as error:
                # The scene may have changed since the page sent the command.
                self._update_status(problem=str(error))
            self._update_frame()

    @property
    def _is_running(self) -> bool:
        return self._requested.frames and not self._status.paused

    def _set_requested(self, requested: RequestedData) -> None:
        was_running, self._requested = self._is_running, requested
        self._record_impacts()
        if not was_running:
            self._restart_clock()

    def _update_status(self, **changes: object) -> None:
        self._status = dataclasses.replace(self._status, **changes)
        self._restart_clock()

    def _restart_clock(self) -> None:
        """Schedule ticks from now on; missed ticks are not made up for."""
        self._statistics.clear()
        self._pacer.period = self._simulation.tick / self._status.real_time_factor
        self._pacer.start(time.monotonic_ns())

    def _push(self, force: Vector, duration: float) -> None:
        self._simulation.push(Push(self.pushed_bone, force, duration=duration), 'page')

    @staticmethod
    def _move_hand(move: Callable[[], None]) -> None:
        """Move a hand, unless the pointer points nowhere, or the bone is not there any more."""
        with contextlib.suppress(errors.RagdollError):
            move()

    def _set_accuracy(self, name: str) -> None:
        self._simulation.accuracy = name
        self._update_status(accuracy=name)

    def _reset(self) -> None:
        self._simulation.reset()
        self._next_status = self._next_measure = 0.0

    def _replace(self, scene: Scene, engine: str) -> None:
        simulation = Simulation(scene, accuracy=self._status.accuracy, engine=engine,
                                workers='auto')
        factor = (self._status.real_time_factor if scene is self._simulation.scene
                  else _real_time_factor(scene))
        self._runs += self._simulation.reset_count
        self._simulation.close()
        self._simulation = simulation
        self._record_impacts()
        # The measures of the last simulation do not hold for this one.
        self._next_status = self._next_measure = 0.0
        self._update_status(real_time_factor=factor, problem='', engine=engine,
                            engine_name=simulation.engine_name)
        self._update_frame()

    def _record_impacts(self) -> None:
        """Begin or end the recording of impacts as requested; there is none in some engines."""
        wanted = self._simulation if self._requested.impacts else None
        if wanted is self._recorded:
            return
        self._recorded = None
        with contextlib.suppress(errors.RagdollError):
            self._simulation.record_impacts(load_limits() if wanted else None)
            self._recorded = wanted

    def _tick(self) -> None:
        """Advance by one tick; a state that is not finite is not shown and restarts the scene."""
        begin = time.monotonic()
        try:
            state = self._simulation.advance()
            finite = math.isfinite(float(state.rows.sum()))
        except (ArithmeticError, ValueError):
            finite = False
        self._statistics.add(begin, time.monotonic(), self._simulation.step)
        if not finite:
            self._replace(self._simulation.scene, self._status.engine)
            self._update_status(problem='the state was not finite; the scene was restarted')
        self._update_frame()

    def _update_frame(self) -> None:
        simulation, requested = self._simulation, self._requested
        swings = simulation.swings
        contacts = simulation.contacts if requested.contacts or (
            len(simulation.scene.bones) <= FEW_BONES) else None
        work = sum(simulation.work)
        run = self._runs + simulation.reset_count
        new = simulation.impacts if simulation is self._recorded else ()
        self._frame = Frame(
            simulation.scene, simulation.time / SECOND, simulation.state, simulation.pushes,
            grabs=tuple(self._grabs()),
            rods=None if swings is None else swings.rods,
            contacts=None if contacts is None else contacts.positions,
            angles=simulation.joint_angles if requested.angles else None,
            forces=None if contacts is None else contacts.normals * contacts.forces[:, None],
            pairs=None if contacts is None else np.stack(
                [contacts.a, contacts.b, contacts.bodies], axis=1),
            impacts=self._impacts.add(run, simulation.time / SECOND, map(impact_arrow, new)),
            run=run, energy=work + simulation.energy_excess, work=work)
        self._new_frames.append(self._frame)
        if time.monotonic() >= self._next_status:
            self._next_status = time.monotonic() + STATUS_PERIOD
            self._status = dataclasses.replace(
                self._status, measures=self._measures(), tick_cost=self._statistics.mean_cost,
                measured_real_time_factor=self._statistics.real_time_factor)

    def _measures(self) -> dict[str, float]:
        """Current measures, or older ones where computing them takes long."""
        begin = time.monotonic()
        if begin < self._next_measure:
            return self._status.measures
        measures = self._simulation.measures()
        self._next_measure = begin + (time.monotonic() - begin) / MEASURE_SHARE
        return measures

    def _grabs(self) -> Iterator[GrabbedPoint]:
        state = self._simulation.state
        for grab in self._simulation.grabs:
            pose = state.poses(self._simulation.scene.bone_index(grab.bone))
            yield GrabbedPoint(grab.bone, pose.apply(np.array(grab.point)), np.array(grab.target))


class TickStatistics:
    """Rate and cost of ticks over the last WINDOW of wall time. Not thread-safe."""

    def __init__(self) -> None:
        self._ticks: deque[tuple[float, float, float]] = deque()

    def add(self, begin: float, end: float, simulated: float) -> None:
        """Record a tick of ``simulated`` s, computed between two instants of wall time, s."""
        self._ticks.append((begin, end, simulated))
        while self._ticks[0][0] < begin - WINDOW:
            self._ticks.popleft()

    def clear(self) -> None:
        """Forget all ticks."""
        self._ticks.clear()

    @property
    def real_time_factor(self) -> float:
        """Simulated time per wall time; NaN before half a window has passed."""
        if not self._ticks or self._ticks[-1][0] - self._ticks[0][0] < WINDOW / 2:
            return math.nan
        simulated = sum(tick[2] for tick in self._ticks) - self._ticks[0][2]
        return simulated / (self._ticks[-1][0] - self._ticks[0][0])

    @property
    def mean_cost(self) -> float:
        """Mean wall time of computing a tick, s; NaN before the first."""
        if not self._ticks:
            return math.nan
        return sum(end - begin for begin, end, _ in self._ticks) / len(self._ticks)


def _real_time_factor(scene: Scene) -> float:
    return min(max(scene.pace, REAL_TIME_FACTORS[0]), REAL_TIME_FACTORS[1])
