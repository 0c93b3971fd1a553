"""A run as a recording, to be written as glTF, BVH, CSV or MCAP."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from ..fit.skin import skins_of
from ..model import errors
from ..physics.simulation import Simulation
from ..recordings.recording import Recorder, Recording
from ..recordings.save import save_recording


class Keeper:
    """Takes the poses of a run's first scene at each tick; ``warn`` is told where it ends."""

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._recorder: Recorder | None = None
        self._ended = False

    def through(self, steps: Iterator[Simulation]) -> Iterator[Simulation]:
        """The same steps, with their poses kept."""
        for simulation in steps:
            if self._recorder is None:
                self._recorder = Recorder(simulation.scene)
            if simulation.scene is self._recorder.scene and not self._ended:
                self._recorder.take(simulation)
            elif not self._ended:
                self._ended = True
                self._warn(f'after {self._recorder.duration:g} s the run has another scene: '
                           'it is saved up to there')
            yield simulation

    def recording(self) -> Recording:
        """What was kept; OutOfRange where that is nothing."""
        if self._recorder is None:
            raise errors.OutOfRange('--save', 0, 'a run with at least one state')
        return self._recorder.recording()


def save(recording: Recording, paths: list[Path], warn: Callable[[str], None]) -> None:
    """Write a recording, each doll of which has its skin if it can be read, and say where."""
    skins = skins_of(recording.scene, warn)
    for path in paths:
        for written in save_recording(recording, path, skins):
            print(f'{written}: {len(recording)} instants, {recording.duration:.2f} s')
