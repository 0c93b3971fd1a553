"""Reproducibility of a crowd over threads, resets and processes: SHA-256 of all states.

Sixty dolls: some collide, some are pushed, some sleep and are woken, one is far from all others.
"""
import dataclasses
import hashlib
import subprocess
import sys
from collections import Counter

from ...files.repeat import repeated
from ...files.scene import load_scene
from ...model.push import Push
from ...model.scene import Placement, Scene
from ...physics.simulation import Simulation

TICKS = 1000
PUSHES = {1: Push('doll_12/torso', (300.0, 200.0, 300.0), duration=0.2),
          8: Push('doll_30/torso', (0.0, 0.0, 900.0), duration=0.1)}
"""By tenths of the run: a push on a moving doll, and one on a sleeping doll."""


def sixty() -> Scene:
    """A lone doll, 50 dolls on their faces, most of them soon asleep, and 9 that fall onto them."""
    drop = load_scene('drop')
    doll = drop.dolls[0].doll
    lying = repeated(
        Placement(doll, 'doll', (0.0, 0.0, 0.12), (0.0, 1.0, 0.0, 1.0)),
        {'count': 50, 'grid': (2.5, 2.5, 0.0), 'columns': (10, 5), 'turned': 'yaw', 'seed': 1})
    falling = repeated(
        Placement(doll, 'falling', (1.0, 0.0, 0.8), spin=(0.2, 0.3, 0.0)),
        {'count': 9, 'grid': (7.5, 5.0, 0.5), 'columns': (3, 3)})
    lone = Placement(doll, 'lone', (-20.0, 0.0, 0.0), spin=(0.2, 0.3, 0.0))
    return dataclasses.replace(drop, name='sixty', dolls=(lone, *lying, *falling))


def run(simulation: Simulation, ticks: int, seen: Counter | None = None) -> tuple[str, str]:
    """Digests of all states of the scene and of its first doll, from the start. If given, ``seen``
    counts dolls in clusters, and how often dolls fell asleep and woke.
    """
    scene, crowd, first = simulation.scene, hashlib.sha256(), hashlib.sha256()
    engine, pushes = simulation._engine, PUSHES if len(scene.dolls) > 1 else {}
    for tick in range(ticks):
        rested = engine.sleeping.copy()
        if 10 * tick % ticks == 0 and 10 * tick // ticks in pushes:
            simulation.push(pushes[10 * tick // ticks])
        rows = simulation.advance().rows
        crowd.update(rows.tobytes())
        first.update(rows[scene.bone_slices[0]].tobytes())
        if seen is not None:
            joined = len(scene.dolls) - len(set(engine.cluster_of_doll.tolist()))
            seen['joined'] = max(seen['joined'], joined)
            seen['slept'] += int((engine.sleeping & ~rested).sum())
            seen['woke'] += int((rested & ~engine.sleeping).sum())
    return crowd.hexdigest(), first.hexdigest()


def of_workers(workers: int, ticks: int = TICKS, rounds: int = 1,
               seen: Counter | None = None) -> list[tuple[str, str]]:
    """Results of run() with some workers: one for each of the ``rounds``, with a reset between
    them.
    """
    found = []
    with Simulation(sixty(), engine='rigid', workers=workers) as simulation:
        for _ in range(rounds):
            found.append(run(simulation, ticks, seen if not found else None))
            simulation.reset()
    return found


def of_first_alone(ticks: int = TICKS) -> str:
    """Digest of the first doll simulated alone."""
    scene = sixty()
    with Simulation(dataclasses.replace(scene, dolls=scene.dolls[:1]),
                    engine='rigid') as simulation:
        return run(simulation, ticks)[0]


def digests() -> None:
    """Print digests with one, two and three workers, after a reset and of another process, and of
    the first doll alone.
    """
    seen = Counter()
    (crowd, first), again = of_workers(1, rounds=2, seen=seen)
    print(f'\nSHA-256 of {TICKS} ticks of {len(sixty().dolls)} dolls; at most '
          f'{seen["joined"]} in clusters, {seen["slept"]} fell asleep, {seen["woke"]} woke')
    other = subprocess.run([sys.executable, '-m', __name__], capture_output=True, text=True,
                           check=True).stdout.strip()
    print(f'{"1 worker":24}{crowd}\n{"first doll in the crowd":24}{first}')
    for name, found, wanted in (
            ('1 worker, after a reset', again[0], crowd), ('2 workers', of_workers(2)[0][0], crowd),
            ('3 workers', of_workers(3)[0][0], crowd), ('another process', other, crowd),
            ('first doll, alone', of_first_alone(), first)):
        print(f'{name:24}{found} {"equal" if found == wanted else "UNEQUAL"}', flush=True)


if __name__ == '__main__':
    print(of_workers(2)[0][0])
