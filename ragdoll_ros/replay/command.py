"""Replay a recorded run of the node to the bit: check it, compare it, save it, publish it."""
import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..files.bags.bag import read_messages
from ..files.run_scene import versions
from ..model import errors
from ..model.scene import SECOND
from ..physics.accuracy import ACCURACIES
from ..physics.engine.registry import ENGINES
from ..physics.simulation import Simulation
from ..recordings.mcap_file import load_recording
from ..recordings.recording import Recorder, Recording
from ..recordings.save import check_format, save_recording
from .player import Player
from .run import ReplayedRun, read_run

EXAMPLE = """examples:
  ragdoll_replay rosbag2_2026_01_31-12_00_00      check the hashes of its states
  ragdoll_replay run.mcap --accuracy exact        compare with a finer integration
  ragdoll_replay run.mcap --save fall.glb --save fall.bvh     for Blender; also .csv, .mcap
  ragdoll_replay run.mcap --publish --pace 0.5    on the topics of a node `ragdoll`
"""

NO_ROS = "--publish needs ROS 2: source it, or pip install 'ragdoll_ros[ros]'"

THRESHOLDS = (1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 1e-1, 1.0)
"""m, thresholds of the largest distance between a bone in one run and in the other."""


def main(arguments: list[str] | None = None) -> int:
    """Run the command. Exit code: 0, 1 if the replay differs from the recording, 2 for an error,
    such as a file that cannot be read.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    at = arguments.index('--ros-args') if '--ros-args' in arguments else len(arguments)
    options, for_ros = parser().parse_args(arguments[:at]), arguments[at:]
    compares = options.engine or options.accuracy
    for option in ('publish', 'save'):
        if compares and getattr(options, option):
            parser().error(f'--{option}: not with --engine or --accuracy, which compare')
    if for_ros and not options.publish:
        parser().error(f'{" ".join(for_ros)}: only with --publish')
    try:
        for path in options.save:
            check_format(path)
        if options.save and not options.publish and has_only_poses(options.bag):
            save(load_recording(options.bag), options.save)
            return 0
        run = read_run(options.bag, options.node, warn)
        print_summary(run)
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
    parser.add_argument('--node', help='full name of the node, such as /east/ragdoll, if a bag '
                        'has several')
    parser.add_argument('--engine', choices=ENGINES, help='repeat the run with this engine, and '
                        'compare')
    parser.add_argument('--accuracy', choices=ACCURACIES, help='repeat the run with this '
                        'accuracy, and compare')
    parser.add_argument('--save', metavar='FILE', type=Path, action='append', default=[],
                        help='write the run, or the recorded poses, as an animation (.glb: glTF, '
                        '.bvh), a table (.csv), or poses for ragdoll_viewer --play (.mcap); '
                        'repeatable')
    parser.add_argument('--publish', action='store_true', help='publish the run in real time on '
                        'the topics of a node `ragdoll`')
    parser.add_argument('--pace', type=pace, default=1.0, help='with --publish: real-time '
                        'factor (%(default)s)')
    return parser


def pace(text: str) -> float:
    """Parse a real-time factor."""
    if not 0.001 <= float(text) <= 100:
        raise argparse.ArgumentTypeError(f'{text}: expected 0.001 to 100')
    return float(text)


def print_summary(run: ReplayedRun) -> None:
    """Print the node, scenes and number of events of a run; warn if other versions computed it."""
    scenes = ', '.join(scene.name for scene in run.scenes.values())
    print(f'{run.node}: scene {scenes or "unknown"}, {len(run.events)} events')
    for recorded in run.versions:
        if recorded != versions():
            warn(f'recorded by {recorded}; here is {versions()}: the last bits may differ')


def replay(run: ReplayedRun, options: argparse.Namespace, for_ros: list[str]) -> int:
    """Repeat a run and check it; publish and save it if asked. Returns the exit code."""
    player, recorder = Player(run, warn), FirstSceneRecorder()
    steps = recorder.record(player.ticks()) if options.save else player.ticks()
    try:
        if options.publish:
            try:
                from .published import publish
            except ImportError as error:
                raise errors.Unreadable('', str(error), NO_ROS) from None
            publish(steps, options.pace, for_ros)
        else:
            for _ in steps:
                pass
    finally:
        player.close()
    if options.save:
        save(recorder.recording(), options.save)
    checks = player.checks
    differs = next((index for index, check in enumerate(checks) if not check.equal), None)
    print(f'{player.ticks_repeated} ticks and {player.events_repeated} events repeated, '
          f'{sum(check.equal for check in checks)} of {len(checks)} hashes equal')
    if differs is None:
        return 0
    before = f'after tick {checks[differs - 1].tick}, ' if differs else ''
    print(f'The runs differ {before}at tick {checks[differs].tick} at the latest')
    return 1


def has_only_poses(bag: Path) -> bool:
    """Whether a recording has poses, like recordings of the page, and no events."""
    topics = {topic.rpartition('/')[2] for topic, *_ in read_messages(bag, lambda _: None)}
    return 'poses' in topics and 'events' not in topics


def compare(run: ReplayedRun, engine: str | None, accuracy: str | None) -> int:
    """Repeat a run as recorded and with other settings, and print the difference. Returns the exit
    code.
    """
    comparison = Comparison()
    one, other = Player(run, warn), Player(run, lambda _: None, engine, accuracy)
    try:
        for first, second in zip(one.ticks(), other.ticks(), strict=True):
            comparison.add(one.tick, first, second)
    finally:
        one.close()
        other.close()
    print(f'As recorded beside {" ".join(filter(None, (engine, accuracy)))}:')
    print('\n'.join(comparison.lines()))
    return 0


class Comparison:
    """Compares two runs tick by tick."""

    def __init__(self) -> None:
        self._rows: list[str] = []
        self._last = self._farthest = ''
        self._max_gap = -1.0

    def add(self, tick: int, one: Simulation, other: Simulation) -> None:
        """Compare both after the same tick."""
        gaps = np.linalg.norm(one.state.positions - other.state.positions, axis=1)
        index = int(gaps.argmax())
        gap = float(gaps[index])
        bone = one.scene.bone_names[index]
        self._last = f'{gap:.3g} m ({bone}) at tick {tick}'
        while len(self._rows) < len(THRESHOLDS) and gap > THRESHOLDS[len(self._rows)]:
            self._rows.append(f'{THRESHOLDS[len(self._rows)]:11.0e} m {tick:9d} '
                              f'{one.time / SECOND:10.2f} s  {bone}')
        if gap > self._max_gap:
            self._max_gap, self._farthest = gap, self._last

    def lines(self) -> list[str]:
        """The result as a table."""
        head = ' apart by more   at tick   simulated  bone'
        never = f'never apart by more than {THRESHOLDS[0]:.0e} m'
        rows = [head, *self._rows] if self._rows else [never]
        return [*rows, f'farthest: {self._farthest}', f'at the end: {self._last}']


class FirstSceneRecorder:
    """Records the poses of a run's first scene at each tick."""

    def __init__(self) -> None:
        self._recorder: Recorder | None = None
        self._ended = False

    def record(self, steps: Iterator[Simulation]) -> Iterator[Simulation]:
        """Pass the steps on, recording their poses."""
        for simulation in steps:
            if self._recorder is None:
                self._recorder = Recorder(simulation.scene)
            if simulation.scene is self._recorder.scene and not self._ended:
                self._recorder.take(simulation)
            elif not self._ended:
                self._ended = True
                warn(f'after {self._recorder.duration:g} s the run has another scene: '
                     'it is saved up to there')
            yield simulation

    def recording(self) -> Recording:
        """The recording. Raises OutOfRange if it is empty."""
        if self._recorder is None:
            raise errors.OutOfRange('--save', 0, 'a run with at least one state')
        return self._recorder.recording()


def save(recording: Recording, paths: list[Path]) -> None:
    """Write a recording and print the paths."""
    for path in paths:
        for written in save_recording(recording, path, warn):
            print(f'{written}: {len(recording)} instants, {recording.duration:.2f} s')


def warn(text: str) -> None:
    """Print a warning."""
    print(f'warning: {text}', file=sys.stderr)


if __name__ == '__main__':
    sys.exit(main())
