"""Recordings as CSV tables, a row for each instant: world frame, m, quaternions x, y, z, w."""
from __future__ import annotations

import csv
import io

import numpy as np

from .recording import Recording

COLUMNS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
"""Columns of a bone, after its name and a dot: centre of mass, m; orientation."""


def csv_text(recording: Recording) -> str:
    """CSV (RFC 4180, Unix line ends): ``time`` in s, then COLUMNS of each bone. Exact."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator='\n')
    writer.writerow(['time', *(f'{name}.{part}' for name in recording.scene.bone_names
                               for part in COLUMNS)])
    poses = np.concatenate([recording.positions, recording.orientations], axis=2)
    writer.writerows([time, *row] for time, row in zip(
        recording.times.tolist(), poses.reshape(len(poses), -1).tolist(), strict=True))
    return stream.getvalue()
