"""npz with the keys of AMASS, one file per fall.

trans (t, 3) m is the position of the root's centre of mass. poses (t, 3 j) are rotation vectors,
rad, relative to the bind pose: of the root in the world, of every other bone relative to its
parent. joint_names are their bones, those of this doll and not of SMPL. onset, impact (first
contact) and rest are the frames of Phases, -1 if there is none.
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
    """One file per fall."""
    return {NAME.format(number=fall.number): _written(recipe, fall) for fall in falls}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """None: each file is complete."""
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
    """Names (j,), positions (t, 3) of the root and rotation vectors (t, 3 j)."""
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
