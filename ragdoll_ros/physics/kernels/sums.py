"""Sums over each doll's bones."""
from __future__ import annotations

import numpy as np

from .machine import COUNTS, ROW, TABLE, entry
from .quaternion import cross, to_matrix


@entry(ROW, TABLE, COUNTS, ROW, TABLE, TABLE)
def motion(masses: np.ndarray, inertias: np.ndarray, doll_of: np.ndarray, gravity: np.ndarray,
           rows: np.ndarray, out: np.ndarray) -> None:
    """Sums over each doll (d, 20), in the order of Motion's fields, of bones' ``rows`` (n, 13)."""
    total, matrix, spin = np.zeros(len(out)), np.empty((3, 3)), np.empty(3)
    out[:] = 0.0
    for i in range(len(rows)):
        sums, mass = out[doll_of[i]], masses[i]
        total[doll_of[i]] += mass
        for k in range(3):
            sums[2 + k] += mass * rows[i, k]
            sums[5 + k] += mass * rows[i, 7 + k]
    for d in range(len(out)):
        for k in range(3):
            out[d, 2 + k] /= total[d]
    for i in range(len(rows)):
        sums, mass, row = out[doll_of[i]], masses[i], rows[i]
        to_matrix(row[3], row[4], row[5], row[6], matrix)
        x, y, z = row[0] - sums[2], row[1] - sums[3], row[2] - sums[4]
        far = mass * (x * x + y * y + z * z)
        for j in range(3):
            spin[j] = 0.0
            for k in range(3):
                value = 0.0
                for e in range(3):
                    value += matrix[j, e] * inertias[i, e] * matrix[k, e]
                spin[j] += value * row[10 + k]
                sums[11 + 3 * j + k] += value - mass * (row[j] - sums[2 + j]) * (
                    row[k] - sums[2 + k]) + (far if j == k else 0.0)
        sums[1] += 0.5 * (mass * (row[7] ** 2 + row[8] ** 2 + row[9] ** 2)
                          + spin[0] * row[10] + spin[1] * row[11] + spin[2] * row[12])
        x, y, z = cross(x, y, z, row[7], row[8], row[9])
        sums[8] += spin[0] + mass * x
        sums[9] += spin[1] + mass * y
        sums[10] += spin[2] + mass * z
    for d in range(len(out)):
        sums = out[d]
        sums[0] = sums[1] - total[d] * (
            sums[2] * gravity[0] + sums[3] * gravity[1] + sums[4] * gravity[2])
