"""Methods that the report compares: engines with their settings."""
import dataclasses
import functools
import importlib.util
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from time import process_time
from typing import Protocol

import numpy as np

from ..model import errors
from ..model.state import State
from ..physics import kernels
from ..physics.accuracy import ACCURACIES, NORMAL, Accuracy
from ..physics.engine.registry import resolve_engine
from ..physics.engine.substepped.bullet import BulletEngine
from ..physics.engine.substepped.mujoco import MujocoEngine
from ..physics.simulation import Simulation
from .cases.trial import Trial
from .peers.dart import Dart
from .peers.drake import Drake
from .peers.fixed_steps import FixedSteps
from .peers.quickstart import STEP as QUICKSTART_STEP
from .peers.quickstart import Quickstart
from .trajectory import Trajectory

TICK = 0.01
"""s: substeps are counted per tick of this length."""

RIGID = 'rigid'
"""Name of this package's own engine, which solves impacts at their time of impact."""

MIN_FLIGHT_ERROR = 1e-13
"""m or rad: smaller error estimates in flight are rounding."""

PLAIN = dataclasses.replace(NORMAL, energy=False, sleep=False)
"""Accuracy for plain steps: nothing is corrected."""


OPTIONAL = {'dart': 'dartpy', 'drake': 'pydrake'}
"""Peers that are compared only where they are installed (extra `peers`), and their modules."""


class MethodRun(Protocol):
    """A running trial; implemented by Simulation and by the classes of peers/."""

    @property
    def state(self) -> State:
        """Current poses and velocities of all bones."""

    def advance(self) -> object:
        """Advance by one tick."""

    def close(self) -> None:
        """Free all resources."""


@dataclass(frozen=True)
class Method:
    """An engine with settings. Methods of a ``family`` share a line in plots; ``substeps`` is 0 for
    ours and for core.
    """

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
    """Of stepping alone; ours are whole ticks of a Simulation, which include the poses."""
    reading: np.ndarray
    """Of reading the poses and velocities of all bones after the step."""
    measures: dict[str, float] = field(default_factory=dict)
    """Simulation.measures() at the end; empty for other engines."""

    @property
    def cpu_s_per_s(self) -> float:
        """CPU seconds of stepping per simulated second."""
        return float(self.costs.sum() / self.trajectory.times[-1])

    @property
    def reading_s_per_s(self) -> float:
        """CPU seconds of reading all poses once per tick, per simulated second."""
        return float(self.reading.sum() / self.trajectory.times[-1])


@functools.cache
def has_rigid_engine() -> bool:
    """Whether the rigid engine can be created here."""
    try:
        resolve_engine(RIGID)
    except (errors.RagdollError, ImportError):
        return False
    return True


def contact_step(setting: str = 'normal') -> float:
    """Nominal step, s, of the rigid engine in contact, at a setting."""
    return ACCURACIES[setting].step


def fixed_steps(step: float) -> Accuracy:
    """Accuracy with contact steps of nominally ``step`` s, without energy correction and sleep,
    which hide errors.
    """
    return dataclasses.replace(NORMAL, step=step, substeps=TICK / step, energy=False, sleep=False,
                               flight_error=MIN_FLIGHT_ERROR)


def start_simulation(trial: Trial, accuracy: str | Accuracy, engine: str = 'auto') -> Simulation:
    """Start a trial in a Simulation, as the node runs it."""
    simulation = Simulation(trial.scene, accuracy=accuracy, engine=engine)
    if trial.start is not None:
        simulation.place(trial.start)
    for push in trial.pushes:
        simulation.push(push)
    return simulation


def run(method: Method, trial: Trial) -> Result:
    """Simulate a trial; stepping and reading are timed apart."""
    tick = method.tick or trial.scene.step
    times = trial.times(tick)
    running = method.start(trial)
    try:
        states, stamps = [running.state], np.empty((len(times) - 1, 3))
        for stamp in stamps:
            stamp[0] = process_time()
            running.advance()
            stamp[1] = process_time()
            states.append(running.state)
            stamp[2] = process_time()
        measures = running.measures() if isinstance(running, Simulation) else {}
    finally:
        running.close()
    costs, reading = np.diff(stamps, axis=1).T
    return Result(Trajectory.of(times, states), costs, reading, measures)


def median_run(method: Method, trial: Trial, repeats: int) -> Result:
    """Simulate a trial several times; the cost of each tick is its median."""
    results = [run(method, trial) for _ in range(repeats)]
    costs, reading = (np.median([getattr(result, name) for result in results], axis=0)
                      for name in ('costs', 'reading'))
    return dataclasses.replace(results[0], costs=costs, reading=reading)


def ours(accuracy: str | Accuracy, name: str | None = None) -> Method:
    """Our simulation at a named accuracy, or with a given one."""
    name = name or f'ours-{accuracy}'
    return Method(name, name.replace('-', ' '), 'ours', functools.partial(
        start_simulation, accuracy=accuracy), order=kernels.ORDER if kernels.ready() else 1)


def core(step: float) -> Method:
    """The rigid engine with contact steps of nominally ``step`` s."""
    return Method(f'core-{step:g}', f'core, steps of {step * 1e6:g} µs', 'core', functools.partial(
        start_simulation, accuracy=fixed_steps(step), engine=RIGID))


def reference(refinement: int) -> Method:
    """Numerical reference: the rigid engine with its step divided by ``refinement``.

    PyBullet at 128 substeps where the rigid engine is not available; the label names it.
    """
    return (core(contact_step() / refinement) if has_rigid_engine() else bullet(128))


def quickstart() -> Method:
    """PyBullet as in its quickstart guide."""
    return Method('quickstart', 'PyBullet quickstart, 1/240 s', 'quickstart', Quickstart, 1,
                  QUICKSTART_STEP)


def bullet(substeps: int) -> Method:
    """PyBullet on our scene with fixed substeps."""
    make = functools.partial(BulletEngine, accuracy=PLAIN)
    return Method(f'bullet-{substeps}', f'PyBullet N = {substeps}', 'PyBullet', functools.partial(
        FixedSteps, substeps=substeps, make=make), substeps, order=1)


def mujoco(integrator: str, substeps: int) -> Method:
    """MuJoCo on our scene with fixed substeps."""
    make = functools.partial(MujocoEngine, accuracy=PLAIN, integrator=integrator)
    return Method(f'mujoco-{integrator}-{substeps}', f'MuJoCo {integrator} N = {substeps}',
                  f'MuJoCo {integrator}', functools.partial(
                      FixedSteps, substeps=substeps, make=make), substeps,
                  order={'rk4': 4}.get(integrator, 1))


def dart(substeps: int) -> Method:
    """DART on our scene with fixed substeps."""
    return Method(f'dart-{substeps}', f'DART N = {substeps}', 'DART', functools.partial(
        Dart, substeps=substeps), substeps, order=1)


def drake(substeps: int) -> Method:
    """Drake on our scene with fixed substeps."""
    return Method(f'drake-{substeps}', f'Drake N = {substeps}', 'Drake', functools.partial(
        Drake, substeps=substeps), substeps, order=1)


def installed(names: Iterable[str]) -> list[str]:
    """Names of methods whose engine is installed."""
    return [name for name in names if not missing_peers([name])]


def missing_peers(names: Iterable[str] = OPTIONAL) -> list[str]:
    """Modules of optional peers that are not installed, of the peers or methods in ``names``."""
    families = {name.partition('-')[0] for name in names}
    return [module for family, module in OPTIONAL.items()
            if family in families and importlib.util.find_spec(module) is None]


def all_methods(substeps: Iterable[int] = (1, 2, 4, 8, 16, 32)) -> list[Method]:
    """Ours at three accuracies, the quickstart, PyBullet and MuJoCo with fixed substeps."""
    counts = tuple(substeps)
    return [*map(ours, ACCURACIES), quickstart(), *map(bullet, counts),
            *(mujoco(integrator, count) for integrator in ('euler', 'implicitfast', 'rk4')
              for count in counts)]


BY_SUBSTEPS = {'bullet': bullet, 'dart': dart, 'drake': drake}


def by_name(name: str) -> Method:
    """Find a method by its name; OutOfRange lists the valid ones."""
    family, _, rest = name.partition('-')
    try:
        if family == 'ours' and rest in ACCURACIES:
            return ours(rest)
        if name == 'quickstart':
            return quickstart()
        if family == 'core':
            return core(float(rest))
        if family in BY_SUBSTEPS:
            return BY_SUBSTEPS[family](int(rest))
        if family == 'mujoco':
            integrator, _, count = rest.partition('-')
            return mujoco(integrator, int(count))
    except ValueError:
        pass
    raise errors.OutOfRange('method', name,
                            'ours-*, quickstart, core-SECONDS, bullet-N, mujoco-*-N, dart-N, '
                            'drake-N')
