"""What is recorded of a fall's frames, as columns of numbers with names."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fall import Fall
from ..imu_samples import NAMES, by_frames
from ..recipe import Recipe

POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
VELOCITY = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')


@dataclass(frozen=True)
class Column:
    """One quantity of all frames: ``values`` (t, m), float or bool, ``names`` of its m numbers."""

    name: str
    values: np.ndarray
    names: tuple[str, ...]


def columns(recipe: Recipe, fall: Fall) -> list[Column]:
    """What the recipe records of a fall; nothing of what its doll has not, such as joints."""
    bones, angles = fall.scene.bone_names, fall.scene.angle_names
    frames = len(fall.times)
    made = {
        'poses': (fall.states[:, :, :7], _each(bones, POSE)),
        'velocities': (fall.states[:, :, 7:], _each(bones, VELOCITY)),
        'angles': (fall.angles, angles), 'rates': (fall.rates, angles),
        'touching': (fall.touching, bones)}
    return [Column(what, made[what][0].reshape(frames, -1), tuple(made[what][1]))
            for what in recipe.what if made[what][1]] + [
                Column(f'imu.{mount["name"]}', by_frames(fall, imu).reshape(frames, -1),
                       _samples(recipe))
                for imu, mount in enumerate(recipe.imus)]


def _each(bones: tuple[str, ...], parts: tuple[str, ...]) -> list[str]:
    return [f'{bone}.{part}' for bone in bones for part in parts]


def _samples(recipe: Recipe) -> tuple[str, ...]:
    """Names of a sensor's numbers in a frame, with their places where it has several samples."""
    if recipe.parts == 1:
        return NAMES
    return tuple(f'{name}_{part}' for part in range(recipe.parts) for name in NAMES)
