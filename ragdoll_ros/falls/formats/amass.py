"""npz in AMASS's names, one file a fall.

trans (t, 3) m is where the root's centre of mass is, poses (t, 3 j) are rotation vectors, rad: the
root's turn from its bind pose in the world, then of each other bone its turn relative to its
parent, both from their bind poses. joint_names says whose; they are this doll's bones, not SMPL's.
"""
from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from ...model import rotation
from ..fall import Fall
from ..recipe import Recipe

NAME = 'amass/fall_{number:07d}.npz'


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """A file for each fall."""
    return {NAME.format(number=fall.number): _written(recipe, fall) for fall in falls}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """None: each fall is whole by itself."""
    return {}


def _written(recipe: Recipe, fall: Fall) -> bytes:
    names, trans, poses = _motion(fall)
    frames = {key: -1 if frame is None else frame for key, frame in vars(fall.phases).items()}
    stream = io.BytesIO()
    np.savez_compressed(
        stream, trans=trans, poses=poses, mocap_framerate=float(recipe.rate), gender='neutral',
        betas=np.zeros(0), joint_names=np.array(names), failure=fall.failure,
        drawn=json.dumps(fall.drawn, sort_keys=True), **frames)
    return stream.getvalue()


def _motion(fall: Fall) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names (j,), places (t, 3) of the root and rotation vectors (t, 3 j)."""
    doll, states = fall.scene.dolls[0].doll, fall.states[:fall.valid]
    index = {bone.name: place for place, bone in enumerate(doll.bones)}
    turns = {bone.name: rotation.multiply(states[:, place, 3:7],
                                          rotation.inverse(bone.orientation))
             for place, bone in enumerate(doll.bones)}
    names, vectors = [doll.root.name], [rotation.rotation_vector(turns[doll.root.name])]
    for joint in doll.joints_from_root():
        relative = rotation.multiply(rotation.inverse(turns[joint.parent]), turns[joint.child])
        names.append(joint.child)
        vectors.append(rotation.rotation_vector(relative))
    return names, states[:, index[doll.root.name], :3], np.concatenate(vectors, axis=1)
