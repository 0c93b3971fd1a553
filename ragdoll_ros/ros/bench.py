"""What a tick costs and what of: engine, the rest of the simulation, messages.

Beside it, in the same process and turn by turn, the barest loop that does the same job: PyBullet
stepped at a fixed 1 ms, one getLinkStates, one publish of a ready message. Take the ratios; the
microseconds are this machine's.
"""
from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable

import rclpy
from geometry_msgs.msg import PoseArray
from rclpy.node import Node

from ..files.scene import load_scene
from ..model.scene import Scene
from ..physics.engine.bullet import BulletEngine, bare_loop
from ..physics.settings import ACCURACIES
from ..physics.simulation import Simulation
from .messages import poses_of, to_pose_array
from .outputs import Outputs

ROUNDS = 15
TICKS = 20
BARE_SUBSTEPS = 10


def cost(action: Callable[[], object]) -> float:
    """CPU time in us of one call, over TICKS calls."""
    begin = time.process_time()
    for _ in range(TICKS):
        action()
    return (time.process_time() - begin) / TICKS * 1e6


def timed_engine() -> type[BulletEngine]:
    """An engine that adds up the s that it spends on stepping and on reading."""
    spent = {'step': 0.0, 'read': 0.0}

    def timed(part: str, method: Callable) -> Callable:
        def run(*arguments: object) -> object:
            begin = time.perf_counter()
            try:
                return method(*arguments)
            finally:
                spent[part] += time.perf_counter() - begin
        return run

    methods = {name: timed(part, getattr(BulletEngine, name)) for name, part in (
        ('step', 'step'), ('read', 'read'), ('coordinates', 'read'), ('get_state', 'read'),
        ('touching', 'read'))}
    return type('TimedEngine', (BulletEngine,), {**methods, 'spent': spent})


class Bench:
    """One scene in one condition: our tick and the bare loop, turn by turn."""

    def __init__(self, node: Node, scene: Scene, accuracy: str, ticks_before: int) -> None:
        timed = timed_engine()
        self._spent = timed.spent
        self._simulation = Simulation(scene, engine=timed, accuracy=dataclasses.replace(
            ACCURACIES[accuracy], sleep=ticks_before > 500))
        self._outputs = Outputs(node)
        self._outputs.describe(scene, 'world')
        for _ in range(ticks_before):
            self._simulation.advance()
        ready = to_pose_array('world', 0, poses_of(self._simulation.state))
        publisher = node.create_publisher(PoseArray, '~/bare', 10)
        self._bare_engine, self._close = bare_loop(
            scene, self._simulation.coordinates, BARE_SUBSTEPS)
        self._publish_bare = lambda: publisher.publish(ready)

    def row(self) -> dict[str, float]:
        """Median costs in us of a tick's parts."""
        parts: dict[str, list[float]] = {}
        simulation, outputs = self._simulation, self._outputs
        for _ in range(ROUNDS):
            before = dict(self._spent)
            parts.setdefault('simulation', []).append(cost(simulation.advance))
            for part, name in (('step', 'of it engine'), ('read', 'of it reading')):
                spent = (self._spent[part] - before[part]) / TICKS * 1e6
                parts.setdefault(name, []).append(spent)
            for name, action in (
                    ('conversion', lambda: poses_of(simulation.state)),
                    ('messages', lambda: outputs.publish(simulation, 0, 0)),
                    ('bare engine', self._bare_engine), ('bare publish', self._publish_bare)):
                parts.setdefault(name, []).append(cost(action))
        self._simulation.close()
        self._close()
        return {name: statistics.median(costs) for name, costs in parts.items()}


def main() -> None:
    """Print the table."""
    rclpy.init()
    node = Node('bench')
    drop = load_scene('drop')
    high = dataclasses.replace(drop, dolls=(dataclasses.replace(
        drop.dolls[0], position=(0, 0, 1000), spin=(0.2, 0.1, 0.3)),))
    print('us a tick of 10 ms, median; bare: fixed 1 ms substeps, getLinkStates, a ready message')
    names = ('simulation', 'of it engine', 'of it reading', 'conversion', 'messages',
             'bare engine', 'bare publish')
    print(f'{"":22}' + ''.join(f'{name:>14}' for name in (*names, 'tick / bare')))
    for label, scene, before in (('in flight', high, 0), ('on the ground', drop, 100),
                                 ('asleep', drop, 1500)):
        for accuracy in ACCURACIES:
            row = Bench(node, scene, accuracy, before).row()
            ratio = ((row['simulation'] + row['messages'])
                     / (row['bare engine'] + row['bare publish']))
            print(f'{label + ", " + accuracy:22}' + ''.join(
                f'{row[name]:14.1f}' for name in names) + f'{ratio:14.2f}', flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
