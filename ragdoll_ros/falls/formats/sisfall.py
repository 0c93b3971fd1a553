"""Text in the layout of SisFall (Sucerquia, Lopez, Vargas-Bonilla, Sensors 2017,
10.3390/s17010198): a file per fall, with samples of the recipe's first IMU, at 200 Hz.

Nine integers a line, in units of the data set's chips: acceleration of an ADXL345 (16 g, 13 bits),
rate of an ITG3200 (2000 deg/s, 16 bits), acceleration of an MMA8451Q (8 g, 14 bits), each clipped
to the chip's range. Both accelerometers are the same sensor. A shard stands for a subject. SisFall
has no labels; here each subject has a table of labels, in sample numbers. The sensor's axes are the
recipe's.
"""
from collections import Counter

import numpy as np

from ...model.errors import WrongForm
from ...physics.sensors.head_injury import STANDARD_GRAVITY
from ..fall import Fall, fall_samples
from ..recipe import Recipe
from .kfall import table, valid_samples
from .tasks import description_of, task_of

RATE = 200
"""Samples per second of SisFall; its files have no times."""

FOLDER = 'SisFall_dataset/SA{shard:06d}'
NAME = '{letter}{code:02d}_SA{shard:06d}_R{trial:02d}.txt'
LABELS = 'labels/SA{shard:06d}.csv'
LABEL_COLUMNS = ('file', 'description', 'onset_sample', 'impact_sample', 'fall', 'failure')

CHIPS = ((16.0, 13), (2000.0, 16), (8.0, 14))
"""Range in g, deg/s and g, and bits, of the three chips."""


def check(recipe: Recipe) -> None:
    """WrongForm for a recipe without an IMU, or with one of another rate."""
    if not recipe.imus:
        raise WrongForm('record.imus', [], 'an IMU for the format sisfall')
    rate = recipe.rate * recipe.samples_per_frame
    if rate != RATE:
        raise WrongForm('record.imu_rate', rate, f'{RATE} for the format sisfall')


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """One file per fall, and the shard's labels."""
    files, labels, trials = {}, [], Counter()
    for fall in falls:
        task = task_of(recipe, fall)
        trials[task.sisfall] += 1
        name = NAME.format(letter=task.letter, code=task.sisfall, shard=shard,
                           trial=trials[task.sisfall])
        files[f'{FOLDER.format(shard=shard)}/{name}'] = _lines(fall)
        labels.append((name, description_of(recipe, task), *(
            '' if frame is None else frame * fall.samples_per_frame
            for frame in (fall.phases.onset, fall.phases.impact)), fall.number, fall.failure))
    return {**files, LABELS.format(shard=shard): table(LABEL_COLUMNS, labels)}


def _lines(fall: Fall) -> bytes:
    samples = fall_samples(fall, 0)[:valid_samples(fall)]
    force, rate = samples[:, :3] / STANDARD_GRAVITY, np.degrees(samples[:, 3:])
    numbers = np.concatenate([_counts(values, *chip) for values, chip in
                              zip((force, rate, force), CHIPS, strict=True)], axis=1)
    return ''.join(','.join(map(str, row)) + ';\n' for row in numbers.tolist()).encode()


def _counts(values: np.ndarray, limit: float, bits: int) -> np.ndarray:
    """Values in units of a chip whose range is -``limit`` to ``limit``."""
    half = 2 ** (bits - 1)
    return np.clip(np.round(values * half / limit), -half, half - 1).astype(int)
