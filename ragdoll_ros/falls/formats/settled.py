"""States at rest, from which controllers learn to get up: one npz of all falls that came to rest.

Of states that are nearly the same only the first is kept: those whose root is turned and whose
joint angles are alike, wherever they lie and face.
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
"""Largest difference of any joint angle, and of the direction in which gravity pulls as the root
sees it, in rad, up to which two states are one."""


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """Last states of a shard's falls that rest."""
    rested = [fall for fall in falls if not fall.failure and fall.phases.rest is not None]
    return {PART.format(shard=shard): _npz(_states(rested, falls[0]))}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """All of them, but for those that are alike."""
    parts = []
    for path in sorted(folder.glob('settled/*.npz')):
        with np.load(path) as part:
            parts.append({name: part[name] for name in part.files})
    names = {name: parts[0].pop(name) for name in ('bone_names', 'joint_names')}
    whole = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    kept = different(np.concatenate([whole['gravity'], whole['joint_positions']], axis=1))
    return {WHOLE: _npz({**names, **{key: values[kept] for key, values in whole.items()}})}


def different(rows: np.ndarray) -> list[int]:
    """Indices of rows (s, m), none within ALIKE of one before it in all m numbers.

    Rows are sorted into cells as wide as that by their first numbers, so that each is compared
    with those of its own and of neighbouring cells alone.
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
    """What is known of s states; ``one`` fall gives the shapes where there is none."""
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
