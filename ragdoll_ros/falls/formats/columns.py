"""The recorded quantities of a fall's frames as named columns of numbers."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fall import Fall
from ..imu_samples import NAMES, samples_by_frame
from ..recipe import Recipe

POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
VELOCITY = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')


@dataclass(frozen=True)
class Column:
    """One quantity in t frames: ``values`` (t, m), float or bool, with ``names`` of m numbers."""

    name: str
    values: np.ndarray
    names: tuple[str, ...]


def columns(recipe: Recipe, fall: Fall) -> list[Column]:
    """Columns that the recipe records of a fall, without those that its doll lacks."""
    bones, angles = fall.scene.bone_names, fall.scene.angle_names
    frames = len(fall.times)
    made = {
        'poses': (fall.states[:, :, :7], _each(bones, POSE)),
        'velocities': (fall.states[:, :, 7:], _each(bones, VELOCITY)),
        'angles': (fall.angles, angles), 'rates': (fall.rates, angles),
        'touching': (fall.touching, bones)}
    return [Column(name, made[name][0].reshape(frames, -1), tuple(made[name][1]))
            for name in recipe.recorded if made[name][1]] + [
                Column(f'imu.{mount["name"]}', samples_by_frame(fall, imu).reshape(frames, -1),
                       _sample_names(recipe))
                for imu, mount in enumerate(recipe.imus)]


def _each(bones: tuple[str, ...], parts: tuple[str, ...]) -> list[str]:
    return [f'{bone}.{part}' for bone in bones for part in parts]


def _sample_names(recipe: Recipe) -> tuple[str, ...]:
    """Names of a sensor's numbers in a frame, numbered if it has several samples."""
    if recipe.samples_per_frame == 1:
        return NAMES
    return tuple(f'{name}_{sample}' for sample in range(recipe.samples_per_frame) for name in NAMES)
