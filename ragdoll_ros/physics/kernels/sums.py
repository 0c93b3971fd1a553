"""Sums over each doll's bones, and the momentum that is due to a doll in the air."""
from __future__ import annotations

import numpy as np

from .cholesky import solve
from .machine import COUNTS, FLAGS, REAL, ROW, TABLE, YES, entry
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


@entry(ROW, COUNTS, ROW, REAL, TABLE, YES, FLAGS, TABLE, TABLE, TABLE)
def keep_momentum(masses: np.ndarray, doll_of: np.ndarray, gravity: np.ndarray, duration: float,
                  given: np.ndarray, spun: bool, touched: np.ndarray, before: np.ndarray,
                  sums: np.ndarray, rows: np.ndarray) -> None:
    """Project each doll that is not ``touched`` onto its due momentum and displacement, as one
    rigid body; see ConservationProjection.momentum_due. Changes its ``sums`` (d, 20) and ``rows``
    (n, 13).

    ``given`` (d, 6) are impulse and moment of pushes; not ``spun``: the angular momentum stays.
    """
    change, inertia, spin = np.empty(9), np.empty((3, 3)), np.empty(3)
    for d in range(len(sums)):
        if touched[d]:
            continue
        now, old, mass = sums[d], before[d], masses[d]
        gained = 0.0
        for k in range(3):
            due = old[5 + k] + given[d, k] + mass * gravity[k] * duration
            centre = old[2 + k] + (old[5 + k] + due) * (duration / 2 / mass)
            change[k] = centre - now[2 + k]
            change[3 + k] = (due - now[5 + k]) / mass
            gained += (due + now[5 + k]) * change[3 + k]
            now[5 + k] = due
            spin[k] = old[8 + k] + given[d, 3 + k] - now[8 + k] if spun else 0.0
            change[6 + k] = spin[k]
            for j in range(3):
                inertia[j, k] = now[11 + 3 * j + k]
        if spun:
            solve(inertia, change[6:9])
            for k in range(3):
                gained += (2 * now[8 + k] + spin[k]) * change[6 + k]
                now[8 + k] += spin[k]
        for i in range(len(rows)):
            if doll_of[i] == d:
                row = rows[i]
                x, y, z = cross(change[6], change[7], change[8], row[0] - now[2], row[1] - now[3],
                                row[2] - now[4])
                row[7] += change[3] + x
                row[8] += change[4] + y
                row[9] += change[5] + z
                for k in range(3):
                    row[k] += change[k]
                    row[10 + k] += change[6 + k]
        for k in range(3):
            now[2 + k] += change[k]
        now[1] += gained / 2
        now[0] = now[1] - mass * (now[2] * gravity[0] + now[3] * gravity[1] + now[4] * gravity[2])
