"""A source of its own: a simulation in this process, in a thread that alone touches it."""
from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future

import numpy as np

from ...files.scene import load_scene
from ...model import errors, rotation
from ...model.push import Push
from ...model.scene import SECOND, Scene
from ...model.vectors import Vector
from ...physics.actions.grab import DRAG_TIME
from ...physics.simulation import Simulation
from ...realtime.pacer import Pacer
from .source import PACES, Frame, Held, Report, Source, Wanted
from .tempo import Tempo

REPORT_PERIOD = 0.1
"""s on the wall between two reports."""

MEASURE_SHARE = 0.05
"""Share of the simulation's thread that looks at what went wrong so far may take: one look at a
thousand dolls takes 0.2 s."""

ACCURACY = 'normal'
"""That a page begins with."""

ENDING = 1.0
"""s that the thread may take to end."""

PATIENCE = 60.0
"""s that building a scene may take."""


class Simulated(Source):
    """Steps a scene by the clock on the wall, while a page is open to show it.

    The first doll's root is pushed.
    """

    def __init__(self, scene: Scene, engine: str = 'auto') -> None:
        self._commands: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._wanted = Wanted()
        self._frame: Frame | None = None
        self._tempo = Tempo()
        self._simulation = Simulation(scene, engine=engine, workers='auto')
        self._report = Report(pace=_pace_of(scene), engine=engine, accuracy=ACCURACY,
                              engine_name=self._simulation.engine_name)
        self._pacer = Pacer(1.0, 0)
        self._next_report = self._next_measure = 0.0
        self._show()
        self._restart()
        self._thread = threading.Thread(target=self._run, name='simulation', daemon=True)
        self._thread.start()

    @property
    def frame(self) -> Frame | None:
        return self._frame

    @property
    def report(self) -> Report:
        return self._report

    def want(self, wanted: Wanted) -> None:
        if wanted != self._wanted:
            self._commands.put(lambda: self._want(wanted))

    def push(self, force: Vector, duration: float) -> None:
        self._commands.put(lambda: self._push(force, duration))

    def pause(self, wanted: bool) -> bool:
        self._commands.put(lambda: self._tell(paused=wanted))
        return True

    def step(self) -> None:
        self._commands.put(lambda: self._report.paused and self._tick())

    def reset(self) -> None:
        self._commands.put(self._reset)

    def set_pace(self, pace: float) -> None:
        errors.check_range('pace', pace, *PACES)
        self._commands.put(lambda: self._tell(pace=pace))

    def load(self, name: str) -> None:
        self.use(load_scene(name))

    def take_engine(self, name: str) -> None:
        self._wait_for(lambda: self._replace(self._simulation.scene, name))

    def take_accuracy(self, name: str) -> None:
        self._wait_for(lambda: self._take_accuracy(name))

    def use(self, scene: Scene) -> None:
        self._wait_for(lambda: self._replace(scene, self._report.engine))

    def grab(self, hand: str, bone: str, point: Vector, target: Vector) -> None:
        self._commands.put(lambda: self._simulation.grab(hand, bone, point, target))

    def drag(self, hand: str, target: Vector) -> None:
        self._commands.put(lambda: self._simulation.drag(
            hand, target, DRAG_TIME * self._report.pace))

    def let_go(self, hand: str) -> None:
        self._commands.put(lambda: self._simulation.let_go(hand))

    def close(self) -> None:
        self._commands.put(None)
        self._thread.join(ENDING)
        self._simulation.close()

    def _wait_for(self, change: Callable[[], None]) -> None:
        """Have the simulation's thread do something; what it raises is raised here."""
        done: Future[None] = Future()

        def run() -> None:
            try:
                done.set_result(change())
            except Exception as error:
                done.set_exception(error)

        self._commands.put(run)
        done.result(PATIENCE)

    def _run(self) -> None:
        while True:
            try:
                command = self._commands.get(timeout=self._patience())
            except queue.Empty:
                if self._pacer.due(time.monotonic_ns()):
                    self._tick()
                continue
            if command is None:
                return
            try:
                command()
            except errors.RagdollError as error:
                # What a page asks for may not be any more, as the scene has changed.
                self._tell(problem=str(error))
            self._show()

    @property
    def _goes(self) -> bool:
        return self._wanted.frames and not self._report.paused

    def _patience(self) -> float | None:
        """Time until the next tick, s; None while the time stands."""
        return self._pacer.wait(time.monotonic_ns()) / SECOND if self._goes else None

    def _want(self, wanted: Wanted) -> None:
        stood, self._wanted = not self._goes, wanted
        if stood:
            self._restart()

    def _tell(self, **changes: object) -> None:
        """Change the report, and what follows from it."""
        self._report = Report(**{**vars(self._report), **changes})
        self._restart()

    def _restart(self) -> None:
        """Start the clock anew from here; nothing is caught up."""
        self._tempo.forget()
        self._pacer.period = self._simulation.tick / self._report.pace
        self._pacer.start(time.monotonic_ns())

    def _push(self, force: Vector, duration: float) -> None:
        scene = self._simulation.scene
        doll = scene.dolls[0]
        bone = scene.qualified(doll, doll.doll.root.name)
        self._simulation.push(Push(bone, force, duration=duration), 'page')

    def _take_accuracy(self, name: str) -> None:
        self._simulation.accuracy = name
        self._tell(accuracy=name)

    def _reset(self) -> None:
        self._simulation.reset()
        self._next_report = self._next_measure = 0.0

    def _replace(self, scene: Scene, engine: str) -> None:
        simulation = Simulation(scene, accuracy=self._report.accuracy, engine=engine,
                                workers='auto')
        pace = self._report.pace if scene is self._simulation.scene else _pace_of(scene)
        self._simulation.close()
        self._simulation = simulation
        # What the last one measured says nothing of this one.
        self._next_report = self._next_measure = 0.0
        self._tell(pace=pace, problem='', engine=engine, engine_name=simulation.engine_name)
        self._show()

    def _tick(self) -> None:
        """Go on by one tick; a state that is not finite is never shown."""
        begin = time.monotonic()
        try:
            state = self._simulation.advance()
            finite = math.isfinite(float(state.rows.sum()))
        except (ArithmeticError, ValueError):
            finite = False
        self._tempo.tick(begin, time.monotonic(), self._simulation.step)
        if not finite:
            self._replace(self._simulation.scene, self._report.engine)
            self._tell(problem='the numbers ran away; the scene was started anew')
        self._show()

    def _show(self) -> None:
        simulation, wanted = self._simulation, self._wanted
        swings, touching = simulation.swings, simulation.contacts if wanted.contacts else None
        self._frame = Frame(
            simulation.scene, simulation.time / SECOND, simulation.state, simulation.pushes,
            held=tuple(self._held()),
            rods=None if swings is None else swings.rods,
            contacts=None if touching is None else touching.positions,
            angles=simulation.joint_angles if wanted.angles else None,
            forces=None if touching is None else touching.normals * touching.forces[:, None])
        if time.monotonic() >= self._next_report:
            self._next_report = time.monotonic() + REPORT_PERIOD
            self._report = Report(**{**vars(self._report), 'measures': self._measures(),
                                     'reached': self._tempo.pace, 'tick_cost': self._tempo.cost})

    def _measures(self) -> dict[str, float]:
        """What went wrong so far, of now or, where that takes long, of a while ago."""
        begin = time.monotonic()
        if begin < self._next_measure:
            return self._report.measures
        measures = self._simulation.measures()
        self._next_measure = begin + (time.monotonic() - begin) / MEASURE_SHARE
        return measures

    def _held(self) -> Iterator[Held]:
        state = self._simulation.state
        for grab in self._simulation.grabs:
            bone = self._simulation.scene.bone_index(grab.bone)
            point = rotation.rotate(state.orientations[bone], np.array(grab.point))
            yield Held(grab.bone, state.positions[bone] + point, np.array(grab.target))


def _pace_of(scene: Scene) -> float:
    return min(max(scene.pace, PACES[0]), PACES[1])
