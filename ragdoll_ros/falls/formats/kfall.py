"""CSV in the layout of KFall (Yu, Jang, Xiong, Front Aging Neurosci 2021,
10.3389/fnagi.2021.692865): per fall a file with the samples of the recipe's first IMU, per shard a
table of labels.

Columns: time s, frame, acceleration g, rate deg/s, Euler angles deg (roll, pitch and yaw of the
sensor in the world). A shard stands for a subject, a fall for a trial of task 1. Labels are sample
numbers of Phases.onset and Phases.impact, the first contact. The sensor's axes are the recipe's.
"""
from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from ...model import rotation
from ...model.errors import WrongForm
from ..fall import Fall
from ..imu_samples import fall_samples, sensor_orientations
from ..recipe import Recipe

SENSOR = 'sensor_data/SA{shard:06d}/S{shard:06d}T01R{trial:02d}.csv'
LABELS = 'label_data/SA{shard:06d}_label.csv'
COLUMNS = ('TimeStamp(s)', 'FrameCounter', 'AccX', 'AccY', 'AccZ', 'GyrX', 'GyrY', 'GyrZ',
           'EulerX', 'EulerY', 'EulerZ')
LABEL_COLUMNS = ('Task Code (Task ID)', 'Description', 'Trial ID', 'Fall_onset_frame',
                 'Fall_impact_frame', 'Fall', 'Failure')
G = 9.80665
"""Standard acceleration of gravity, m/s^2."""


def check(recipe: Recipe) -> None:
    """WrongForm for a recipe without an IMU."""
    if not recipe.imus:
        raise WrongForm('record.imus', [], 'an IMU for the format kfall')


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """One file per fall, and the shard's labels."""
    files = {SENSOR.format(shard=shard, trial=trial): _table(COLUMNS, _rows(recipe, fall))
             for trial, fall in enumerate(falls, 1)}
    labels = [('F01 (1)', recipe.name, trial, *_label_samples(fall), fall.number, fall.failure)
              for trial, fall in enumerate(falls, 1)]
    return {**files, LABELS.format(shard=shard): _table(LABEL_COLUMNS, labels)}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """None: each shard is complete."""
    return {}


def _rows(recipe: Recipe, fall: Fall) -> list[list[float]]:
    count = (fall.valid - 1) * fall.samples_per_frame + 1 if fall.valid else 0
    samples = fall_samples(fall, 0)[:count]
    angles = [rotation.to_rpy(turn) for turn in sensor_orientations(fall, 0)[:count]]
    times = np.arange(count) / (recipe.rate * fall.samples_per_frame)
    table = np.concatenate([samples[:, :3] / G, np.degrees(samples[:, 3:]),
                            np.degrees(np.array(angles).reshape(-1, 3))], axis=1)
    return [[f'{time:.6f}', place, *(f'{number:.6f}' for number in row)]
            for place, (time, row) in enumerate(zip(times, table.tolist(), strict=True))]


def _label_samples(fall: Fall) -> list[object]:
    """Sample numbers of onset and impact."""
    return ['' if frame is None else frame * fall.samples_per_frame
            for frame in (fall.phases.onset, fall.phases.impact)]


def _table(header: tuple[str, ...], rows: list) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerows([header, *rows])
    return text.getvalue().encode()
