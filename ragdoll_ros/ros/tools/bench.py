"""Cost of a tick by part: simulation, simulation with its guard, conversion, messages.

The baseline, measured alternately in the same process, is a minimal loop: PyBullet stepped at a
fixed 1 ms, one getLinkStates, one publish of a prepared message. Compare the ratios; microseconds
depend on the machine.
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
BASELINE = dataclasses.replace(ACCURACIES['normal'], substeps=10, energy=False)


def cost(action: Callable[[], object]) -> float:
    """Mean CPU time of one call, us, over TICKS calls."""
    begin = time.process_time()
    for _ in range(TICKS):
        action()
    return (time.process_time() - begin) / TICKS * 1e6


def row(node: Node, scene: Scene, accuracy: str, ticks_before: int) -> dict[str, float]:
    """Median cost of each part of a tick and of the baseline, us."""
    simulation = Simulation(scene, accuracy=dataclasses.replace(
        ACCURACIES[accuracy], sleep=ticks_before > 500))
    for _ in range(ticks_before):
        simulation.advance()
    outputs = Outputs(node)
    outputs.set_scene(scene, 'world', 'none')
    message = to_pose_array('world', 0, poses_of(simulation.state))
    publisher = node.create_publisher(PoseArray, '~/baseline', 10)
    baseline = BulletEngine(scene, BASELINE)
    baseline.set_coordinates(simulation.coordinates)

    def step_baseline() -> None:
        baseline.advance(scene.step)
        _ = baseline.state

    guard = Guard(simulation)
    rounds = [{'simulation': cost(simulation.advance),
               'guarded': cost(guard.advance),
               'conversion': cost(lambda: poses_of(simulation.state)),
               'messages': cost(lambda: outputs.publish(simulation, 0, 0)),
               'base engine': cost(step_baseline),
               'base publish': cost(lambda: publisher.publish(message))} for _ in range(ROUNDS)]
    simulation.close()
    baseline.close()
    return {name: statistics.median(found[name] for found in rounds) for name in rounds[0]}


def main() -> None:
    """Print the table."""
    rclpy.init()
    node = Node('bench')
    drop = load_scene('drop')
    high = dataclasses.replace(drop, dolls=(dataclasses.replace(
        drop.dolls[0], position=(0, 0, 1000), spin=(0.2, 0.1, 0.3)),))
    print('us per tick of 10 ms, median; base: 1 ms substeps, getLinkStates, a prepared message')
    print(' ' * 22 + ''.join(f'{name:>14}' for name in (
        'simulation', 'guarded', 'conversion', 'messages', 'base engine',
        'base publish', 'tick / base')))
    for label, scene, before in (('in flight', high, 0), ('on the ground', drop, 100),
                                 ('asleep', drop, 1500)):
        for accuracy in ACCURACIES:
            costs = row(node, scene, accuracy, before)
            ratio = ((costs['guarded'] + costs['messages'])
                     / (costs['base engine'] + costs['base publish']))
            print(f'{label + ", " + accuracy:22}' + ''.join(
                f'{us:14.1f}' for us in costs.values()) + f'{ratio:14.2f}', flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
