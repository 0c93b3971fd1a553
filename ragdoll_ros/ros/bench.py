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
    spent = dict.fromkeys(('of it engine', 'of it reading'), 0.0)

    def timed(name: str) -> Callable:
        method = getattr(BulletEngine, name)
        part = 'of it engine' if name == 'step' else 'of it reading'

        def run(*arguments: object) -> object:
            begin = time.process_time()
            try:
                return method(*arguments)
            finally:
                spent[part] += time.process_time() - begin
        return run

    names = ('step', 'read', 'coordinates', 'touching')
    return type('TimedEngine', (BulletEngine,), {**{name: timed(name) for name in names},
                                                 'spent': spent})


def row(node: Node, scene: Scene, accuracy: str, ticks_before: int) -> dict[str, float]:
    """Median costs in us of a tick's parts, ours and the bare loop's, turn by turn."""
    engine = timed_engine()
    simulation = Simulation(scene, engine=engine, accuracy=dataclasses.replace(
        ACCURACIES[accuracy], sleep=ticks_before > 500))
    for _ in range(ticks_before):
        simulation.advance()
    outputs = Outputs(node)
    outputs.describe(scene, 'world')
    ready = to_pose_array('world', 0, poses_of(simulation.state))
    publisher = node.create_publisher(PoseArray, '~/bare', 10)
    bare_engine, close = bare_loop(scene, simulation.coordinates, BARE_SUBSTEPS)
    rounds = []
    for _ in range(ROUNDS):
        before = dict(engine.spent)
        rounds.append({
            'simulation': cost(simulation.advance),
            **{part: (engine.spent[part] - before[part]) / TICKS * 1e6 for part in before},
            'conversion': cost(lambda: poses_of(simulation.state)),
            'messages': cost(lambda: outputs.publish(simulation, 0, 0)),
            'bare engine': cost(bare_engine),
            'bare publish': cost(lambda: publisher.publish(ready))})
    simulation.close()
    close()
    return {name: statistics.median(found[name] for found in rounds) for name in rounds[0]}


def main() -> None:
    """Print the table."""
    rclpy.init()
    node = Node('bench')
    drop = load_scene('drop')
    high = dataclasses.replace(drop, dolls=(dataclasses.replace(
        drop.dolls[0], position=(0, 0, 1000), spin=(0.2, 0.1, 0.3)),))
    print('us a tick of 10 ms, median; bare: fixed 1 ms substeps, getLinkStates, a ready message')
    print(' ' * 22 + ''.join(f'{name:>14}' for name in (
        'simulation', 'of it engine', 'of it reading', 'conversion', 'messages', 'bare engine',
        'bare publish', 'tick / bare')))
    for label, scene, before in (('in flight', high, 0), ('on the ground', drop, 100),
                                 ('asleep', drop, 1500)):
        for accuracy in ACCURACIES:
            costs = row(node, scene, accuracy, before)
            ratio = ((costs['simulation'] + costs['messages'])
                     / (costs['bare engine'] + costs['bare publish']))
            print(f'{label + ", " + accuracy:22}' + ''.join(
                f'{us:14.1f}' for us in costs.values()) + f'{ratio:14.2f}', flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
