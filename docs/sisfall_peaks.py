"""Peaks of the acceleration at the waist in the files of SisFall, by kind of fall.

python docs/sisfall_peaks.py FOLDER

FOLDER is SisFall as published, with files such as SA01/F06_SA01_R01.txt (Sucerquia, Lopez,
Vargas-Bonilla 2017, Sensors 17:198).
"""
from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np

RANGE, BITS = 16.0, 13
"""g and bits of the ADXL345, in the first three columns."""


def peak(path: Path) -> float:
    """Largest acceleration, g, of means of two samples: 100 Hz."""
    lines = path.read_text(encoding='latin-1').replace(';', '').splitlines()
    counts = np.array([line.split(',')[:3] for line in lines if line.count(',') == 8], float)
    pairs = counts[:len(counts) // 2 * 2].reshape(-1, 2, 3).mean(axis=1)
    return float(np.linalg.norm(pairs, axis=1).max() * 2 * RANGE / 2 ** BITS)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=Path)
    found = defaultdict(list)
    for path in sorted(parser.parse_args().folder.rglob('F??_S???_R??.txt')):
        found[path.name[:3]].append(peak(path))
    found['all'] = [peak for peaks in found.values() for peak in peaks]
    print('| kind | falls | median, g | 5 % below | 5 % above |')
    print('| --- | --- | --- | --- | --- |')
    for kind, peaks in found.items():
        low, middle, high = np.percentile(peaks, [5, 50, 95])
        print(f'| {kind} | {len(peaks)} | {middle:.1f} | {low:.1f} | {high:.1f} |')


if __name__ == '__main__':
    main()
