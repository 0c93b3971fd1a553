"""CPU time of a fall of 3 s at each accuracy, by parts, and of MuJoCo's rollout; of the formats.

python docs/falls_cost.py [--falls 40] [--recipe faint] [--accuracy draft normal]
"""
from __future__ import annotations

import argparse
import pickle
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
from mujoco.rollout import rollout

from ragdoll_ros.falls import simulate as falls
from ragdoll_ros.falls.formats import lerobot
from ragdoll_ros.falls.formats.registry import FORMATS
from ragdoll_ros.falls.manifest import Manifest
from ragdoll_ros.falls.recipe import Recipe, load_recipe, recipe_of
from ragdoll_ros.falls.shard import DatasetJob, Shard
from ragdoll_ros.falls.start import start_of
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.engine.rigid import clusters
from ragdoll_ros.physics.simulation import Simulation

PARTS = ('machine code', 'the rest of ticks', 'frames', 'set up', 'Parquet')


class Clock:
    """CPU time of functions, s, by label."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)

    def timed(self, label: str, function: Callable) -> Callable:
        """The function, timed."""
        def call(*arguments: object, **keywords: object) -> object:
            began = time.process_time()
            try:
                return function(*arguments, **keywords)
            finally:
                self.spent[label] += time.process_time() - began
        return call


def watch(clock: Clock) -> None:
    """Measure the parts of a fall from now on."""
    clusters.kernels = SimpleNamespace(
        advance=clock.timed('machine code', clusters.kernels.advance))
    falls.Guard.advance = clock.timed('ticks', falls.Guard.advance)
    falls._Recorder.add = clock.timed('frames', falls._Recorder.add)


def parts_of(recipe: Recipe, count: int, clock: Clock) -> list[float]:
    """Milliseconds per fall of each of PARTS."""
    list(falls.generate(recipe, range(2)))
    clock.spent.clear()
    began = time.process_time()
    made = list(falls.generate(recipe, range(count)))
    simulated = time.process_time() - began
    lerobot.shard_files(recipe, made[:2], 0)
    began = time.process_time()
    lerobot.shard_files(recipe, made, 0)
    written = time.process_time() - began
    code, ticks, frames = (clock.spent[key] for key in ('machine code', 'ticks', 'frames'))
    rest = simulated - ticks - frames
    return [1000 / count * part for part in (code, ticks - code, frames, rest, written)]


def seconds(function: Callable) -> tuple[float, object]:
    """CPU time of a call, s, and what it returns."""
    began = time.process_time()
    found = function()
    return time.process_time() - began, found


def formats_of(recipe: Recipe, count: int) -> None:
    """Print the cost of each format and of all: in a worker, and in the process that writes."""
    recipe = recipe_of({**recipe.data, 'record': {**recipe.data['record'], 'imu_rate': 200}})
    list(falls.generate(recipe, range(1)))
    simulated, made = seconds(lambda: list(falls.generate(recipe, range(count))))
    names = [*FORMATS, ','.join(FORMATS)]
    print(f'\nSimulated with 200 samples a second: {1000 * simulated / count:.0f} ms a fall\n')
    print('| format | encoded in a worker, ms a fall | written, ms a fall | kB a fall |')
    print('| --- | --- | --- | --- |')
    for name in names:
        job = DatasetJob(recipe, count, name)
        job.formats[0].shard_files(recipe, made[:2], 0)
        encoded, files = seconds(lambda job=job: {
            path: content for each in job.formats
            for path, content in each.shard_files(recipe, made, 0).items()})
        # As it comes from a worker: pickled there, unpickled here.
        sent = pickle.dumps(Shard(0, range(count), files, {}))
        with tempfile.TemporaryDirectory() as folder:
            manifest = Manifest.begin(Path(folder), job)
            written, _ = seconds(lambda manifest=manifest, sent=sent: manifest.add(
                pickle.loads(sent)))
        size = sum(map(len, files.values())) / count / 1000
        label = 'all' if ',' in name else f'`{name}`'
        print(f'| {label} | {1000 * encoded / count:.1f} | {1000 * written / count:.2f} | '
              f'{size:.0f} |', flush=True)
    workers = (simulated + encoded) / written
    print(f'\nWith all formats, writing takes as long as {workers:.0f} workers take to make falls.')


def mujocos(recipe: Recipe, count: int, accuracy: str, threads: int) -> float:
    """Milliseconds per fall of MuJoCo's rollout from the same starts, all steps kept."""
    models, states = [], []
    step = 0.01 / ACCURACIES[accuracy].substeps
    for number in range(count):
        start = start_of(recipe, number)
        with Simulation(start.scene, accuracy=accuracy, engine='mujoco') as simulation:
            falls.begin(simulation, start)
            simulation._engine.take_substeps(step, 1)
            model, data = simulation._engine._model, simulation._engine._data
            state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
            mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
            models.append(model)
            states.append(state)
    data = [mujoco.MjData(models[0]) for _ in range(threads)]
    steps = round(recipe.data['duration'] / step)
    began = time.process_time()
    rollout(models, data, np.array(states), nstep=steps)
    return 1000 / count * (time.process_time() - began)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--falls', type=int, default=40)
    parser.add_argument('--recipe', default='faint')
    parser.add_argument('--accuracy', nargs='+', choices=ACCURACIES, default=[*ACCURACIES])
    options = parser.parse_args()
    given, clock = load_recipe(options.recipe), Clock()
    watch(clock)
    print('| accuracy | ' + ' | '.join(PARTS) + ' | all, ms a fall | MuJoCo, ms a fall |')
    print('| --- ' * (len(PARTS) + 3) + '|')
    for accuracy in options.accuracy:
        if given.data['limp']:
            recipe = recipe_of({**given.data, 'accuracy': accuracy})
            _print(accuracy, parts_of(recipe, options.falls, clock), '')
        # The engine mujoco has no joint springs: all joints are limp from the start.
        recipe = recipe_of({**given.data, 'accuracy': accuracy, 'limp': []})
        _print(f'{accuracy}, limp from the start', parts_of(recipe, options.falls, clock),
               f'{mujocos(recipe, options.falls, accuracy, 1):.1f}')
    if given.data['record']['imus']:  # some formats are those of a sensor
        formats_of(given, options.falls)


def _print(label: str, parts: list[float], theirs: str) -> None:
    print(f'| {label} | ' + ' | '.join(f'{part:.1f}' for part in parts)
          + f' | {sum(parts):.1f} | {theirs} |', flush=True)


if __name__ == '__main__':
    main()
