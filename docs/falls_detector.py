"""A small fall detector, trained on simulated falls: an example, not a product.

python docs/falls_detector.py --train faint shove sit_down --test trip slip chair lie_down

Each folder is a data set that `ragdoll_falls` wrote in the format lerobot, read with pandas alone.
A random forest classifies windows of 0.5 s of the sensor low_back; those that end within 0.3 s
after an impact are falls. Needs scikit-learn.
"""
from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas
from sklearn.ensemble import RandomForestClassifier

SENSOR, RATE = 'observation.imu.low_back', 100
WINDOW, STRIDE, AFTER = 50, 10, 30
"""Frames of a window, between windows, and after an impact within which to detect a fall."""


def read(folder: Path) -> list[tuple[np.ndarray, float]]:
    """Of each episode the samples (t, 6), m/s^2 and rad/s at 100 Hz, and the frame of its impact;
    NaN where nobody falls.
    """
    frames = pandas.concat(map(pandas.read_parquet, sorted(folder.glob('data/*/*.parquet'))))
    labels = pandas.concat(map(pandas.read_parquet,
                               sorted(folder.glob('meta/episodes/*/*.parquet'))))
    impacts = labels.set_index('episode_index')['impact'].astype(float)
    # Of several samples in a frame the mean: each is a mean over its interval.
    return [(np.stack(rows[SENSOR].to_numpy()).reshape(len(rows), -1, 6).mean(axis=1),
             impacts[episode]) for episode, rows in frames.groupby('episode_index')]


def windows(samples: np.ndarray, impact: float) -> tuple[np.ndarray, np.ndarray]:
    """Features (w, 8) of an episode's windows, and which of them (w,) are falls. Windows that end
    later than AFTER an impact are left out.
    """
    sizes = np.linalg.norm(samples.reshape(-1, 2, 3), axis=2)
    ends = np.arange(WINDOW, len(sizes) + 1, STRIDE)
    ends = ends[~(ends > impact + AFTER)]
    views = np.stack([sizes[end - WINDOW:end] for end in ends])
    return np.concatenate([getattr(views, name)(axis=1) for name in ('min', 'max', 'mean', 'std')],
                          axis=1), ends > impact


def train(folders: list[Path]) -> RandomForestClassifier:
    """A forest, trained on all windows of these data sets."""
    found = [windows(*episode) for folder in folders for episode in read(folder)]
    features, labels = (np.concatenate(part) for part in zip(*found, strict=True))
    forest = RandomForestClassifier(100, random_state=0, class_weight='balanced')
    return forest.fit(features, labels)


def alarms(forest: RandomForestClassifier, samples: np.ndarray, impact: float,
           ) -> tuple[bool, bool]:
    """Whether a window is classified as a fall: after the impact, and before it or without one."""
    features, falls = windows(samples, impact)
    said = forest.predict(features)
    return bool(said[falls].any()), bool(said[~falls].any())


def main() -> None:
    """Train on some data sets, test on others, print the scores."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--train', type=Path, nargs='+', required=True, metavar='FOLDER')
    parser.add_argument('--test', type=Path, nargs='+', required=True, metavar='FOLDER')
    options = parser.parse_args()
    forest = train(options.train)
    print('| data set | detected after the impact | alarms before it, or without one | '
          'more than 3 g before it, or without one |')
    print('| --- | --- | --- | --- |')
    for folder in options.test:
        episodes = read(folder)
        after, before = np.array([alarms(forest, *episode) for episode in episodes]).T
        falls = np.array([np.isfinite(impact) for _, impact in episodes])
        jolts = [np.linalg.norm(samples[:int(impact) if impact == impact else None, :3],
                                axis=1).max() > 3 * 9.81 for samples, impact in episodes]
        detected = f'{after[falls].mean():.0%}' if falls.any() else 'no falls'
        print(f'| {folder.name}, {len(episodes)} | {detected} | {before.mean():.0%} | '
              f'{np.mean(jolts):.0%} |')


if __name__ == '__main__':
    main()
