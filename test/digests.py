"""SHA-256 of what the package computes: what a change of structure must leave as it is, to the bit.

Swings and other engines than rigid round as the processor and the libraries do, so a record is
good for one machine and one set of libraries: make it before the change, compare after it.

    python test/digests.py --out build/before.json
    python test/digests.py --against build/before.json
"""
from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import math
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from fit_rigs import RIGS, fitted

from ragdoll_ros.files.config import scene_names
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.mjcf import to_mjcf
from ragdoll_ros.files.scene import load_scene, scene_text
from ragdoll_ros.files.urdf import scene_to_urdf, to_urdf
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene, above_ground
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.model.swing import Swing, strand
from ragdoll_ros.physics.simulation import Simulation

ACCURACIES = ('draft', 'normal', 'exact')
TICKS = int(os.environ.get('TICKS', '1000'))


def scenes() -> Iterator[tuple[str, Scene]]:
    """Every shipped scene, and eight that go where those do not."""
    for name in scene_names():
        yield name, load_scene(name)
    doll, ground = load_doll('doll'), Ground()
    yield 'collision', Scene('collision', (
        Placement(doll, 'left', (0, 1, 3), velocity=(0, -4, 0), spin=(0, 2, 1)),
        Placement(doll, 'right', (0, -1, 3), velocity=(0, 4, 0))), ground)
    yield 'fitted', above_ground(dataclasses.replace(fitted('mixamo').doll, model=None))
    slope = Ground((math.sin(0.3), 0, math.cos(0.3)), 0.1)
    yield 'tilted', Scene('tilted', (Placement(doll, position=(0, 0, 1)),), slope)
    tail = Swing('tail', 'torso', (-0.05, 0, 0.95), (-1, 0, 0),
                 strand(6, 0.5, 0.1, (0.5, 0.05), 0.4))
    free = Swing('drop', 'head', (0, 0, 1.6), (0, 0, 1), strand(1, 0.1), mode='free',
                 velocity=(0, 0, 2))
    tailed = dataclasses.replace(doll, swings=(tail, free))
    yield 'swings', Scene('swings', (Placement(tailed, spin=(0, 0, 3)),), ground)
    brick = Ragdoll('brick', (Bone('brick', Box((0.1, 0.2, 0.3)), 2.0, (0, 0, 0)),))
    yield 'one_body', Scene('one_body', (
        Placement(brick, position=(0, 0, 0.5), velocity=(1, 0, 0), spin=(3, 1, 2)),), ground)
    yield 'spun', Scene('spun', (Placement(doll, position=(0, 0, 2), spin=(0, 12, 9)),), ground)
    yield 'long_tick', dataclasses.replace(load_scene('drop'), step=0.05)
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.05), 0.01, (0, 0, 0)),))
    yield 'light_ball', Scene('light_ball', (
        Placement(doll), Placement(ball, position=(2, 0, 1.1), velocity=(-5, 0, 0.6))), ground)


def disturb(simulation: Simulation, tick: int) -> None:
    """Pushes of every kind, and a grab that is dragged and let go."""
    names = simulation.scene.bone_names
    last = names[-1]
    if tick == 5:
        simulation.push(Push(names[0], (300, 0, 40), (0, 5, 0)), 'keys')
    elif tick == 20:
        simulation.push(Push(last, (0, 40, 0), (0.1, 0, 0), (0.01, 0, 0), 0.153, local=True))
    elif tick == 60:
        simulation.grab('hand', last)
    elif tick in (61, 70, 90):
        simulation.drag('hand', (0.3, 0.01 * tick, 1.5))
    elif tick == 150:
        simulation.let_go('hand')
    elif tick == 400:
        simulation.push(Push(names[0], (0, 0, 200), duration=0.02, start=simulation.time / 1e9 + 1))


def digest_run(scene: Scene, accuracy: str) -> dict[str, str]:
    """Digests of the states, of the swings', and of what the simulation says of itself."""
    states, told = hashlib.sha256(), hashlib.sha256()
    with Simulation(scene, accuracy=accuracy) as simulation:
        for tick in range(TICKS):
            disturb(simulation, tick)
            states.update(state_bytes(simulation.advance()))
            if simulation.swings is not None:
                states.update(np.ascontiguousarray(simulation.swings.positions).tobytes())
            if tick % 50 == 0:
                told.update(repr(list(simulation.measures().values())).encode())
                told.update(simulation.joint_angles.tobytes())
        return {'states': states.hexdigest(), 'told': told.hexdigest()}


def state_bytes(state: object) -> bytes:
    """All numbers of a state."""
    parts = (state.positions, state.orientations, state.linear_velocities, state.angular_velocities)
    return b''.join(np.ascontiguousarray(part).tobytes() for part in parts)


def digest_text(text: str) -> str:
    """Digest of a file's text."""
    return hashlib.sha256(text.encode()).hexdigest()


def record() -> dict[str, object]:
    """All digests, by name."""
    found: dict[str, object] = {}
    for name in sorted(RIGS):
        scene = above_ground(dataclasses.replace(fitted(name).doll, model=None))
        found[f'fit/{name}'] = digest_text(scene_text(scene, Path('.').resolve()))
    for name, scene in scenes():
        found[f'{name}/yaml'] = digest_text(scene_text(scene, Path('.').resolve()))
        found[f'{name}/urdf'] = digest_text(scene_to_urdf(scene) + to_urdf(
            scene.dolls[0].doll, 'bullet'))
        found[f'{name}/mjcf'] = digest_text(to_mjcf(scene))
        for accuracy in ACCURACIES:
            began = time.monotonic()
            found[f'{name}/{accuracy}'] = digest_run(scene, accuracy)
            print(f'{name} {accuracy}: {time.monotonic() - began:.1f} s', file=sys.stderr)
    return found


def main() -> int:
    """Run the command; 1 if a digest differs."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--out', type=Path, help='write the digests there')
    parser.add_argument('--against', type=Path, help='compare them with those')
    options = parser.parse_args()
    found = record()
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(json.dumps(found, indent=1) + '\n')
    if not options.against:
        return 0
    known = json.loads(options.against.read_text())
    differing = sorted(name for name in {*known, *found} if known.get(name) != found.get(name))
    for name in differing:
        print(f'{name}: {known.get(name)} became {found.get(name)}')
    print(f'{len(found) - len(differing)} of {len(found)} digests equal')
    return bool(differing)


if __name__ == '__main__':
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    sys.exit(main())
