"""Recordings as tables: one row to an instant, for pandas, Excel and R.

World frame, x forward, y left, z up, metres; quaternions x, y, z, w.
"""
from __future__ import annotations

import csv
import io

import numpy as np

from .recording import Recording

PARTS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
"""Of a bone, after its name and a dot: place of its centre of mass, m; orientation."""


def csv_text(recording: Recording) -> str:
    """A recording as CSV (RFC 4180, lines as in Unix): ``time`` in s, then PARTS of each bone.

    Numbers read back to the same bits.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator='\n')
    writer.writerow(['time', *(f'{name}.{part}' for name in recording.scene.bone_names
                               for part in PARTS)])
    poses = np.concatenate([recording.positions, recording.orientations], axis=2)
    writer.writerows([time, *row] for time, row in zip(
        recording.times.tolist(), poses.reshape(len(poses), -1).tolist(), strict=True))
    return stream.getvalue()
