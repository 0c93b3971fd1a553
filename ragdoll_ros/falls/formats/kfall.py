"""CSV in the layout of KFall (Yu, Jang, Xiong, Front Aging Neurosci 2021,
10.3389/fnagi.2021.692865): per fall a file with the samples of the recipe's first IMU, per shard a
table of labels.

Columns: time s, sample number, acceleration g, rate deg/s, Euler angles deg (roll, pitch and yaw of
the sensor in the world). A shard stands for a subject, a fall for a trial of its task. Labels are
sample numbers of Phases.onset and Phases.impact, the first contact. The sensor's axes are the
recipe's.
"""
import csv
import io
from collections import Counter

import numpy as np

from ...model import rotation
from ...model.errors import WrongForm
from ...physics.sensors.head_injury import STANDARD_GRAVITY
from ..fall import Fall, fall_samples, sensor_orientations
from ..recipe import Recipe
from .tasks import description_of, task_of

SENSOR = 'sensor_data/SA{shard:06d}/S{shard:06d}T{task:02d}R{trial:02d}.csv'
LABELS = 'label_data/SA{shard:06d}_label.csv'
COLUMNS = ('TimeStamp(s)', 'FrameCounter', 'AccX', 'AccY', 'AccZ', 'GyrX', 'GyrY', 'GyrZ',
           'EulerX', 'EulerY', 'EulerZ')
FALLS_FROM = 19
"""Task of the fall F01, less one."""

LABEL_COLUMNS = ('Task Code (Task ID)', 'Description', 'Trial ID', 'Fall_onset_frame',
                 'Fall_impact_frame', 'Fall', 'Failure')


def check(recipe: Recipe) -> None:
    """WrongForm for a recipe without an IMU."""
    if not recipe.imus:
        raise WrongForm('record.imus', [], 'an IMU for the format kfall')


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """One file per fall, and the shard's labels."""
    files, labels, trials = {}, [], Counter()
    for fall in falls:
        task = task_of(recipe, fall)
        trials[task.kfall] += 1
        trial = trials[task.kfall]
        files[SENSOR.format(shard=shard, task=task.kfall, trial=trial)] = table(
            COLUMNS, _rows(recipe, fall))
        code = task.kfall - FALLS_FROM if task.kfall else 0
        labels.append((f'{task.letter}{code:02d} ({task.kfall})', description_of(recipe, task),
                       trial, *('' if frame is None else frame * fall.samples_per_frame
                                for frame in (fall.phases.onset, fall.phases.impact)),
                       fall.number, fall.failure))
    return {**files, LABELS.format(shard=shard): table(LABEL_COLUMNS, labels)}


def valid_samples(fall: Fall) -> int:
    """Number of a sensor's samples before a failure."""
    return (fall.valid - 1) * fall.samples_per_frame + 1 if fall.valid else 0


def _rows(recipe: Recipe, fall: Fall) -> list[list[float]]:
    count = valid_samples(fall)
    samples = fall_samples(fall, 0)[:count]
    angles = [rotation.to_rpy(turn) for turn in sensor_orientations(fall, 0)[:count]]
    times = np.arange(count) / (recipe.rate * fall.samples_per_frame)
    numbers = np.concatenate([samples[:, :3] / STANDARD_GRAVITY, np.degrees(samples[:, 3:]),
                              np.degrees(np.array(angles).reshape(-1, 3))], axis=1)
    return [[f'{time:.6f}', place, *(f'{number:.6f}' for number in row)]
            for place, (time, row) in enumerate(zip(times, numbers.tolist(), strict=True))]


def table(header: tuple[str, ...], rows: list) -> bytes:
    """A CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerows([header, *rows])
    return text.getvalue().encode()
