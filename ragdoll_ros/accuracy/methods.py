"""Methods that the report compares: engines with their settings."""
from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from time import process_time
from typing import Protocol

import numpy as np

from ..model import errors
from ..model.state import State
from ..physics import kernels
from ..physics.accuracy import ACCURACIES, Accuracy
from ..physics.engine.protocol import Engine
from ..physics.engine.substepped.bullet import BulletEngine
from ..physics.engine.substepped.mujoco import MujocoEngine
from ..physics.simulation import Simulation
from . import step_sizes
from .cases.trial import Trial
from .quickstart import STEP as QUICKSTART_STEP
from .quickstart import Quickstart
from .trajectory import Trajectory


class MethodRun(Protocol):
    """A running trial; implemented by Simulation."""

    @property
    def state(self) -> State:
        """Current poses and velocities of all bones."""

    def advance(self) -> State:
        """Advance by one tick."""

    def close(self) -> None:
        """Free all resources."""


@dataclass(frozen=True)
class Method:
    """An engine with settings; ``family`` is its line in plots, ``substeps`` 0 if adaptive."""

    name: str
    label: str
    family: str
    start: Callable[[Trial], MethodRun]
    substeps: int = 0
    tick: float | None = None
    """Tick, s; None: the trial's."""
    order: int | None = None
    """Theoretical order of convergence in flight."""


@dataclass(frozen=True)
class Result:
    """Trajectory of a trial by a method, and CPU time of each tick, (t - 1,) s."""

    trajectory: Trajectory
    costs: np.ndarray
    measures: dict[str, float] = field(default_factory=dict)
    """Simulation.measures() at the end; empty for other engines."""

    @property
    def cpu_s_per_s(self) -> float:
        """CPU seconds per simulated second."""
        return float(self.costs.sum() / self.trajectory.times[-1])


class _FixedSteps:
    """An engine with a fixed number of substeps per tick."""

    def __init__(self, trial: Trial, substeps: int, make: Callable[..., Engine]) -> None:
        self._trial = trial
        self._tick, self._count = trial.scene.step, 0
        self._engine = make(trial.scene, step_sizes.fixed_steps(self._tick / substeps))
        if trial.start is not None:
            self._engine.set_coordinates(trial.start)

    @property
    def state(self) -> State:
        return self._engine.state

    def advance(self) -> State:
        begin = self._count * self._tick
        loads = self._trial.loads(begin, begin + self._tick) if self._trial.pushes else ()
        self._engine.advance(self._tick, loads)
        self._count += 1
        return self.state

    def close(self) -> None:
        self._engine.close()


def start_simulation(trial: Trial, accuracy: str | Accuracy, engine: str = 'auto') -> Simulation:
    """Start a trial in a Simulation, as the node runs it."""
    simulation = Simulation(trial.scene, accuracy=accuracy, engine=engine)
    if trial.start is not None:
        simulation.place(trial.start)
    for push in trial.pushes:
        simulation.push(push)
    return simulation


def run(method: Method, trial: Trial) -> Result:
    """Simulate a trial."""
    tick = method.tick or trial.scene.step
    times = trial.times(tick)
    running = method.start(trial)
    try:
        states, costs = [running.state], np.empty(len(times) - 1)
        for index in range(len(costs)):
            before = process_time()
            state = running.advance()
            costs[index] = process_time() - before
            states.append(state)
        measures = running.measures() if isinstance(running, Simulation) else {}
    finally:
        running.close()
    return Result(Trajectory.of(times, states), costs, measures)


def median_run(method: Method, trial: Trial, repeats: int) -> Result:
    """Simulate a trial several times; the cost of each tick is its median."""
    results = [run(method, trial) for _ in range(repeats)]
    costs = np.median([result.costs for result in results], axis=0)
    return dataclasses.replace(results[0], costs=costs)


def ours(accuracy: str | Accuracy, name: str | None = None, engine: str = 'auto') -> Method:
    """Our simulation at a named accuracy, or with a given one."""
    name = name or f'ours-{accuracy}'
    order = kernels.ORDER if engine == 'auto' and kernels.ready() else 1
    return Method(name, name.replace('-', ' '), 'ours', functools.partial(
        start_simulation, accuracy=accuracy, engine=engine), order=order)


def core(step: float) -> Method:
    """The rigid engine with fixed steps of ``step`` s."""
    return Method(f'core-{step:g}', f'core, steps of {step * 1e6:g} µs', 'core', functools.partial(
        start_simulation, accuracy=step_sizes.fixed_steps(step), engine=step_sizes.RIGID))


def reference(refinement: int) -> Method:
    """Numerical reference: the rigid engine with its step divided by ``refinement``.

    PyBullet at 128 substeps where the rigid engine is not available; the label names it.
    """
    return (core(step_sizes.contact_step() / refinement) if step_sizes.has_rigid_engine()
            else bullet(128))


def quickstart() -> Method:
    """PyBullet as in its quickstart guide."""
    return Method('quickstart', 'PyBullet quickstart, 1/240 s', 'quickstart', Quickstart, 1,
                  QUICKSTART_STEP)


def bullet(substeps: int) -> Method:
    """PyBullet on our scene with fixed substeps."""
    return Method(f'bullet-{substeps}', f'PyBullet N = {substeps}', 'PyBullet', functools.partial(
        _FixedSteps, substeps=substeps, make=BulletEngine), substeps, order=1)


def mujoco(integrator: str, substeps: int) -> Method:
    """MuJoCo on our scene with fixed substeps."""
    make = functools.partial(MujocoEngine, integrator=integrator)
    return Method(f'mujoco-{integrator}-{substeps}', f'MuJoCo {integrator} N = {substeps}',
                  f'MuJoCo {integrator}', functools.partial(
                      _FixedSteps, substeps=substeps, make=make), substeps,
                  order={'rk4': 4}.get(integrator, 1))


SUBSTEPS = (1, 2, 4, 8, 16, 32)


def all_methods(substeps: Iterable[int] = SUBSTEPS) -> list[Method]:
    """Ours at three accuracies, the quickstart, PyBullet and MuJoCo with fixed substeps."""
    counts = tuple(substeps)
    return [*map(ours, ACCURACIES), quickstart(), *map(bullet, counts),
            *(mujoco(integrator, count) for integrator in ('euler', 'implicitfast', 'rk4')
              for count in counts)]


def by_name(name: str) -> Method:
    """Find a method by its name; OutOfRange lists the valid ones."""
    family, _, rest = name.partition('-')
    try:
        if family == 'ours' and rest in ACCURACIES:
            return ours(rest)
        if name == 'quickstart':
            return quickstart()
        if family in ('bullet', 'core'):
            return bullet(int(rest)) if family == 'bullet' else core(float(rest))
        if family == 'mujoco':
            integrator, _, count = rest.partition('-')
            return mujoco(integrator, int(count))
    except ValueError:
        pass
    raise errors.OutOfRange('method', name,
                            'ours-*, quickstart, core-SECONDS, bullet-N, mujoco-*-N')
