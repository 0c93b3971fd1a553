"""Rigs that move as functions of time say, written as glTF animations of the three kinds.

``moves`` gives the local transform of bones in the frame that they have in the bind pose: by the
bone's name a function of time to a translation (3,), m, and a rotation vector (3,), rad, both along
the axes of glTF's world (y up, z forward, x left). The derivatives that CUBICSPLINE keys need are
centred differences of order 4.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping

import fit_rigs
import numpy as np

from ragdoll_ros.model import rotation

Move = Callable[[float], tuple[np.ndarray, np.ndarray]]


def rate(function, time, h=1e-3):
    """Derivative of a function of time, by centred differences of order 4."""
    ends = [np.asarray(function(time + k * h), float) for k in (-2, -1, 1, 2)]
    return (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * h)


def rest(rig):
    """Local translation, quaternion and scale of each bone in the bind pose, and the linear part of
    its parent's world transform.
    """
    worlds = fit_rigs.worlds(rig)
    found = []
    for bone, world in zip(rig.bones, worlds, strict=True):
        parent = worlds[bone.parent] if bone.parent >= 0 else np.eye(4)
        local = np.linalg.inv(parent) @ world
        scale = np.linalg.norm(local[:3, :3], axis=0)
        outer = (rig.root if bone.parent < 0 else rig.root @ parent)[:3, :3]
        found.append((local[:3, 3], rotation.from_matrix(local[:3, :3] / scale), scale, outer))
    return found


def local_of(rig, part, move, time):
    """Local translation and quaternion of a bone at a time."""
    translation, quaternion, _, outer = part
    shift, turn = move(time)
    size = np.cbrt(np.linalg.det(outer))
    back = rotation.inverse(rotation.from_matrix(outer / size))
    metre = rig.unit * np.cbrt(np.linalg.det(rig.root[:3, :3]))
    return (translation + metre / size * rotation.rotate(back, shift),
            rotation.multiply(rotation.from_rotation_vector(rotation.rotate(back, turn)),
                              quaternion))


def document(rig):
    """The rig's document, whose bones have translation, rotation and scale, to be animated."""
    made = fit_rigs.document(rig)
    for node, (translation, quaternion, scale, _) in zip(made.data['nodes'][2:], rest(rig),
                                                         strict=True):
        del node['matrix']
        node.update(translation=translation.tolist(), rotation=quaternion.tolist(),
                    scale=scale.tolist())
    return made


def animate(made, rig, moves: Mapping[str, Move], times, kind='CUBICSPLINE', name='move'):
    """Add an animation to the rig's document."""
    channels, samplers = [], []
    clock = made.accessor(np.reshape(times, (-1, 1)), 'f4', 'SCALAR')
    for index, (bone, part) in enumerate(zip(rig.bones, rest(rig), strict=True)):
        for place, path in enumerate(('translation', 'rotation') if bone.name in moves else ()):
            def value(time, part=part, move=moves[bone.name], place=place):
                return local_of(rig, part, move, time)[place]

            values = np.array([value(time) for time in times])
            if kind == 'CUBICSPLINE':
                tangents = np.array([rate(value, time) for time in times])
                values = np.stack([tangents, values, tangents], axis=1).reshape(-1, 3 + place)
            channels.append({'sampler': len(samplers),
                             'target': {'node': index + 2, 'path': path}})
            samplers.append({'input': clock, 'interpolation': kind,
                             'output': made.accessor(values, 'f4', f'VEC{3 + place}')})
    made.data.setdefault('animations', []).append(
        {'name': name, 'channels': channels, 'samplers': samplers})


def worlds_at(rig, moves, time):
    """World transform (4, 4) of every bone by the functions themselves."""
    found = []
    for bone, part in zip(rig.bones, rest(rig), strict=True):
        translation, quaternion = part[:2]
        if bone.name in moves:
            translation, quaternion = local_of(rig, part, moves[bone.name], time)
        local = np.eye(4)
        local[:3, :3] = rotation.matrix(quaternion) * part[2]
        local[:3, 3] = translation
        found.append((found[bone.parent] if bone.parent >= 0 else rig.root) @ local)
    return found
