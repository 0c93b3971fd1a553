"""Repeats a recorded run of the node to the bit: checks it, compares it, publishes it again."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from ..files.bag import read_messages
from ..files.run_scene import versions
from ..model import errors
from ..physics.accuracy import ACCURACIES
from ..physics.engine.registry import ENGINES
from ..physics.simulation import Simulation
from ..recordings.mcap_file import load_recording
from ..recordings.save import check_format
from .comparison import Comparison
from .kept import Keeper, save
from .player import Player
from .run import ReplayedRun, read_run

EXAMPLE = """examples:
  ragdoll_replay rosbag2_2026_01_31-12_00_00      are its hashes those of the run?
  ragdoll_replay run.mcap --accuracy exact        where does a finer one part from it?
  ragdoll_replay run.mcap --save fall.glb --save fall.bvh     for Blender; .csv and .mcap, too
  ragdoll_replay run.mcap --publish --pace 0.5    on the topics of a node `ragdoll`
"""

NO_ROS = "--publish needs ROS 2: source it, or pip install 'ragdoll_ros[ros]'"


def main(arguments: list[str] | None = None) -> int:
    """Run the command: 0, 1 if the run parts from what was recorded, 2 if it can not be read."""
    arguments = sys.argv[1:] if arguments is None else arguments
    at = arguments.index('--ros-args') if '--ros-args' in arguments else len(arguments)
    options, for_ros = parser().parse_args(arguments[:at]), arguments[at:]
    compares = options.engine or options.accuracy
    if compares and options.publish:
        parser().error('--publish: not with --engine or --accuracy, which compare')
    if compares and options.save:
        parser().error('--save: not with --engine or --accuracy, which compare')
    if for_ros and not options.publish:
        parser().error(f'{" ".join(for_ros)}: only with --publish')
    try:
        for path in options.save:
            check_format(path)
        if options.save and not options.publish and has_poses_alone(options.bag):
            save(load_recording(options.bag), options.save, warn)
            return 0
        run = read_run(options.bag, options.node, warn)
        tell(run)
        if compares:
            return compare(run, options.engine, options.accuracy)
        return replay(run, options, for_ros)
    except errors.RagdollError as error:
        print(error, file=sys.stderr)
        return 2


def parser() -> argparse.ArgumentParser:
    """Options of the command."""
    parser = argparse.ArgumentParser(
        'ragdoll_replay', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, help='a folder of `ros2 bag record` with ~/events and '
                        '~/scene, or a .mcap or .db3 file')
    parser.add_argument('--node', help='whose run, where a bag holds several: /east/ragdoll')
    parser.add_argument('--engine', choices=ENGINES, help='compare with this engine')
    parser.add_argument('--accuracy', choices=ACCURACIES, help='compare with this accuracy')
    parser.add_argument('--save', metavar='FILE', type=Path, action='append', default=[],
                        help='write the run, or the poses that were recorded, as an animation '
                        '(.glb: glTF, .bvh) or a table (.csv), or as poses for ragdoll_viewer '
                        '--play (.mcap); more than once for several')
    parser.add_argument('--publish', action='store_true', help='publish the run on the topics of '
                        'a node `ragdoll` as it goes, by the clock on the wall')
    parser.add_argument('--pace', type=pace, default=1.0, help='with --publish: simulated s in '
                        'each s on the wall (%(default)s)')
    return parser


def pace(text: str) -> float:
    """Read a pace."""
    if not 0.001 <= float(text) <= 100:
        raise argparse.ArgumentTypeError(f'{text}: expected 0.001 to 100')
    return float(text)


def tell(run: ReplayedRun) -> None:
    """Say whose run it is, and warn where others than what is here have computed it."""
    scenes = ', '.join(scene.name for scene in run.scenes.values())
    print(f'{run.node}: scene {scenes or "unknown"}, {len(run.events)} events')
    for recorded in run.versions:
        if recorded != versions():
            warn(f'recorded by {recorded}; here is {versions()}: the last bits may differ')


def replay(run: ReplayedRun, options: argparse.Namespace, for_ros: list[str]) -> int:
    """Repeat a run and check it, publish and save it as asked; the exit code."""
    player, keeper = Player(run, warn), Keeper(warn)
    steps = keeper.through(player.ticks()) if options.save else player.ticks()
    try:
        if options.publish:
            _publish(steps, options.pace, for_ros)
        else:
            for _ in steps:
                pass
    finally:
        player.close()
    if options.save:
        save(keeper.recording(), options.save, warn)
    checks = player.checks
    parted = next((index for index, check in enumerate(checks) if not check.equal), None)
    print(f'{player.made} ticks and {player.acts} acts repeated, '
          f'{sum(check.equal for check in checks)} of {len(checks)} hashes equal')
    if parted is None:
        return 0
    before = f'after tick {checks[parted - 1].tick}, ' if parted else ''
    print(f'The runs part {before}at tick {checks[parted].tick} at the latest')
    return 1


def has_poses_alone(bag: Path) -> bool:
    """Whether a recording tells where all was, as the page's do, and not what acted."""
    topics = {topic.rpartition('/')[2] for topic, *_ in read_messages(bag, lambda _: None)}
    return 'poses' in topics and 'events' not in topics


def compare(run: ReplayedRun, engine: str | None, accuracy: str | None) -> int:
    """Repeat a run as it was and otherwise, and say where both part; the exit code."""
    comparison = Comparison()
    one, other = Player(run, warn), Player(run, lambda _: None, engine, accuracy)
    try:
        for here, there in zip(one.ticks(), other.ticks(), strict=True):
            comparison.take(one.tick, here, there)
    finally:
        one.close()
        other.close()
    print(f'As recorded beside {" ".join(filter(None, (engine, accuracy)))}:')
    print('\n'.join(comparison.lines()))
    return 0


def warn(text: str) -> None:
    """Say what is not as it should be."""
    print(f'warning: {text}', file=sys.stderr)


def _publish(steps: Iterator[Simulation], pace: float, for_ros: list[str]) -> None:
    try:
        from .published import publish
    except ImportError as error:
        raise errors.Unreadable('', str(error), NO_ROS) from None
    publish(steps, pace, for_ros)


if __name__ == '__main__':
    sys.exit(main())
