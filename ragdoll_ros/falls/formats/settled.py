"""States at rest, for controllers that learn to get up: one npz of all falls that came to rest.

Of nearly equal states only the first is kept. They are compared by joint angles and by the
direction of gravity in the root's axes, so position and heading do not matter.
"""
from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ...model import rotation
from ..fall import Fall
from ..recipe import Recipe

PART, WHOLE = 'settled/shard_{shard:06d}.npz', 'settled.npz'
ALIKE = np.radians(5.0)
"""Tolerance, rad, of joint angles and of the direction of gravity, of equal states."""


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """Final states of the shard's falls that come to rest."""
    rested = [fall for fall in falls if not fall.failure and fall.phases.rest is not None]
    return {PART.format(shard=shard): _npz(_states(rested, falls[0]))}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """All states of all shards, without duplicates."""
    parts = []
    for path in sorted(folder.glob('settled/*.npz')):
        with np.load(path) as part:
            parts.append({name: part[name] for name in part.files})
    names = {name: parts[0].pop(name) for name in ('bone_names', 'joint_names')}
    whole = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    kept = different(np.concatenate([whole['gravity'], whole['joint_positions']], axis=1))
    return {WHOLE: _npz({**names, **{key: values[kept] for key, values in whole.items()}})}


def different(rows: np.ndarray) -> list[int]:
    """Indices of rows (s, m) that differ by more than ALIKE from every earlier kept row.

    A grid of cells of that width over the first columns limits the comparisons to neighbours.
    """
    width = min(3, rows.shape[1])
    cells: dict[tuple, list[int]] = {}
    around = np.stack(np.meshgrid(*[(-1, 0, 1)] * width, indexing='ij'), -1).reshape(-1, width)
    kept = []
    for index, cell in enumerate(np.floor(rows[:, :width] / ALIKE).astype(int)):
        near = [other for place in cell + around for other in cells.get(tuple(place), ())]
        if not (np.abs(rows[near] - rows[index]).max(axis=1) <= ALIKE).any():
            cells.setdefault(tuple(cell), []).append(index)
            kept.append(index)
    return kept


def _states(falls: list[Fall], one: Fall) -> dict[str, np.ndarray]:
    """Arrays of the s final states of ``falls``; ``one`` gives the shapes if there are none."""
    doll = one.scene.dolls[0].doll
    root = one.scene.bone_names.index(doll.root.name)
    last = np.array([fall.states[-1] for fall in falls]).reshape(len(falls), *one.states.shape[1:])
    down = rotation.rotate(rotation.inverse(last[:, root, 3:7]), np.array([0.0, 0.0, -1.0]))
    return {
        'fall': np.array([fall.number for fall in falls], np.int64),
        'root_positions': last[:, root, :3], 'root_orientations': last[:, root, 3:7],
        'gravity': down,
        'joint_positions': np.array([fall.angles[-1] for fall in falls]).reshape(
            len(falls), one.angles.shape[1]),
        'bone_poses': last[:, :, :7],
        'touching': np.array([fall.touching[-1] for fall in falls], bool).reshape(
            len(falls), one.touching.shape[1]),
        'bone_names': np.array(one.scene.bone_names),
        'joint_names': np.array(one.scene.angle_names)}


def _npz(arrays: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()
