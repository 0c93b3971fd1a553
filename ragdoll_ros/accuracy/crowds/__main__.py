"""`python -m ragdoll_ros.accuracy.crowds`: cost of dolls that fall, lie, sleep and pile up.

Except in the pile and the digests, dolls are 2.5 m apart and do not touch. Compare ratios: absolute
times depend on the machine.
"""
import argparse
import dataclasses
import math
import resource
import time

import numpy as np

from ...files.repeat import repeated
from ...files.scene import load_scene
from ...model.push import Push
from ...model.scene import Placement, Scene
from ...physics.accuracy import ACCURACIES
from ...physics.simulation import Simulation
from . import crowd_digests, pile

CROWD_SIZES = (1, 10, 100, 1000)
SPACING = 2.5
SAMPLED = 100
"""Smaller crowds are averaged over the same 100 dolls, as no two falls cost the same."""

FALL = 2.0
"""s in which dolls fall by 0.4 m and come to lie."""


def grid(count: int, **placed: object) -> Scene:
    """``count`` default dolls, SPACING m apart; ``placed`` are fields of their Placement."""
    drop = load_scene('drop')
    first = Placement(drop.dolls[0].doll, **placed)
    return dataclasses.replace(drop, name='grid', dolls=tuple(
        repeated(first, {'count': count, 'grid': (SPACING, SPACING, 0.0)})))


def turning(count: int, first: int = 0) -> Scene:
    """``count`` dolls with different small spins, which depend on their numbers; these begin at
    ``first``.
    """
    level = grid(count)
    return dataclasses.replace(level, dolls=tuple(
        dataclasses.replace(doll, spin=(0.1 * math.sin(first + k), 0.1 * math.cos(first + k), 0.0))
        for k, doll in enumerate(level.dolls)))


def lying(count: int) -> Scene:
    """``count`` dolls on their faces, soon asleep."""
    return grid(count, position=(0.0, 0.0, 0.12), orientation=(0.0, 1.0, 0.0, 1.0))


def falling(scene: Scene, accuracy: str, workers: int = 1) -> tuple[float, float]:
    """CPU and wall time per doll and tick, us, while the dolls fall and come to lie."""
    count = len(scene.dolls)
    with Simulation(scene, accuracy=dataclasses.replace(
            ACCURACIES[accuracy], sleep=False), workers=workers) as simulation:
        ticks = round(FALL / simulation.step)
        cpu, wall = time.process_time(), time.perf_counter()
        for _ in range(ticks):
            simulation.advance()
        each = 1e6 / ticks / count
        return (time.process_time() - cpu) * each, (time.perf_counter() - wall) * each


def falls() -> None:
    """Print the cost per doll of crowds. Of crowds below SAMPLED dolls it is the mean of as many as
    make SAMPLED dolls.
    """
    print(f'us per doll and tick of 10 ms over {FALL:g} s of a fall; "real time": number of dolls '
          'whose tick takes 10 ms')
    print(f'{"":22}{"CPU":>10}{"over one":>10}{"2 workers":>12}{"wall ratio":>12}{"real time":>12}')
    for accuracy in ACCURACIES:
        alone = 0.0
        for count in CROWD_SIZES:
            crowds = [turning(count, first) for first in range(0, max(SAMPLED, count), count)]
            cpu, wall, shared = np.mean([(*falling(crowd, accuracy), falling(crowd, accuracy, 2)[1])
                                         for crowd in crowds], axis=0)
            alone = alone or cpu
            print(f'{accuracy + f", {count}":22}{cpu:10.1f}{cpu / alone:10.2f}{shared:12.1f}'
                  f'{wall / shared:12.2f}{1e4 / shared:12.0f}', flush=True)


def sleepers() -> None:
    """Print the cost of sleeping dolls, set-up time, peak memory, and how many dolls a
    push moves.
    """
    print('\nasleep: us per tick of all dolls; set-up, s; peak memory of the process, MB')
    for count in CROWD_SIZES:
        begin = time.perf_counter()
        with Simulation(lying(count)) as simulation:
            set_up = time.perf_counter() - begin
            while not simulation.asleep and simulation.time < 30e9:
                simulation.advance()
            begin = time.process_time()
            for _ in range(1000):
                simulation.advance()
            tick = (time.process_time() - begin) * 1e3
            before = simulation.state.rows
            simulation.push(Push(simulation.scene.bone_names[0], (0.0, 0.0, 800.0), duration=0.1))
            for _ in range(10):
                simulation.advance()
            moved = (simulation.state.rows != before).any(axis=1)
            print(f'{count:6} dolls:{tick:8.1f} us,'
                  f' set up in {set_up:.2f} s, a push moves '
                  f'{len(set(simulation.scene.doll_of_bone[moved].tolist()))} doll(s); '
                  f'{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB', flush=True)


PARTS = {'falls': falls, 'sleepers': sleepers, 'pile': pile.pile, 'digests': crowd_digests.digests}


def main() -> None:
    """Print the selected parts."""
    parser = argparse.ArgumentParser(
        prog='python -m ragdoll_ros.accuracy.crowds', description='Measure the cost of crowds.',
        epilog='example: python -m ragdoll_ros.accuracy.crowds --part pile --part digests')
    parser.add_argument('--part', action='append', choices=PARTS,
                        help='only this part; repeatable: falls (5 min), sleepers (1 min), '
                             'pile (at most 14 min), digests (1 min); default: all')
    for name in parser.parse_args().part or PARTS:
        PARTS[name]()


if __name__ == '__main__':
    main()
