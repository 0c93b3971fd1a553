"""What a tick costs and what of: simulation, by itself and checked, conversion, messages.

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

from ...files.scene import load_scene
from ...model.scene import Scene
from ...physics.accuracy import ACCURACIES
from ...physics.engine.substepped.bullet import BulletEngine
from ...physics.guard import Guard
from ...physics.simulation import Simulation
from ..messages.convert import poses_of, to_pose_array
from ..outputs import Outputs

ROUNDS = 15
TICKS = 20
BARE = dataclasses.replace(ACCURACIES['normal'], substeps=10, energy=False)


def cost(action: Callable[[], object]) -> float:
    """CPU time in us of one call, over TICKS calls."""
    begin = time.process_time()
    for _ in range(TICKS):
        action()
    return (time.process_time() - begin) / TICKS * 1e6


def row(node: Node, scene: Scene, accuracy: str, ticks_before: int) -> dict[str, float]:
    """Median costs in us of a tick's parts, ours and the bare loop's, turn by turn."""
    simulation = Simulation(scene, accuracy=dataclasses.replace(
        ACCURACIES[accuracy], sleep=ticks_before > 500))
    for _ in range(ticks_before):
        simulation.advance()
    outputs = Outputs(node)
    outputs.describe(scene, 'world', 'none')
    ready = to_pose_array('world', 0, poses_of(simulation.state))
    publisher = node.create_publisher(PoseArray, '~/bare', 10)
    bare = BulletEngine(scene, BARE)
    bare.set_coordinates(simulation.coordinates)

    def step_barely() -> None:
        bare.advance(scene.step)
        _ = bare.state

    guard = Guard(simulation)
    rounds = [{'simulation': cost(simulation.advance),
               'checked': cost(guard.advance),
               'conversion': cost(lambda: poses_of(simulation.state)),
               'messages': cost(lambda: outputs.publish(simulation, 0, 0)),
               'bare engine': cost(step_barely),
               'bare publish': cost(lambda: publisher.publish(ready))} for _ in range(ROUNDS)]
    simulation.close()
    bare.close()
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
        'simulation', 'checked', 'conversion', 'messages', 'bare engine',
        'bare publish', 'tick / bare')))
    for label, scene, before in (('in flight', high, 0), ('on the ground', drop, 100),
                                 ('asleep', drop, 1500)):
        for accuracy in ACCURACIES:
            costs = row(node, scene, accuracy, before)
            ratio = ((costs['checked'] + costs['messages'])
                     / (costs['bare engine'] + costs['bare publish']))
            print(f'{label + ", " + accuracy:22}' + ''.join(
                f'{us:14.1f}' for us in costs.values()) + f'{ratio:14.2f}', flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
