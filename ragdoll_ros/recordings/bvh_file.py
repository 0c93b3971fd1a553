"""A doll's motion as BVH (Biovision motion capture).

By convention Y up, facing +Z, left at +X, centimetres, degrees, a fixed frame time. Rest pose:
the bind pose. The root is at the root bone's centre of mass; each further joint has its
child's name. Channels are Z, Y, X: R = Rz Ry Rx in the parent's axes. Only the root has a position,
so that gaps of joints are lost.
"""
from collections.abc import Iterator

import numpy as np

from ..model import rotation
from ..model.ragdoll import Ragdoll
from .recording import Recording, orientations_y_up, points_y_up

CENTIMETRES = 100.0

TIME_TOLERANCE = 1e-7
"""s, deviation from equal times, above the rounding of stamps to ns; beyond it poses are
interpolated."""


def bvh_text(recording: Recording, doll: int = 0) -> str:
    """BVH of one doll of a recording, by its index in the scene."""
    ragdoll, part = recording.scene.dolls[doll].doll, recording.scene.bone_slices[doll]
    step, positions, orientations = _resampled(recording)
    joints = ragdoll.joints_depth_first()
    place = {bone.name: k for k, bone in enumerate(ragdoll.bones)}
    names = [ragdoll.root.name, *(joint.child for joint in joints)]
    rest = np.array([bone.orientation for bone in ragdoll.bones])
    turned = rotation.matrix(orientations_y_up(rotation.multiply(
        orientations[:, part], rotation.inverse(rest))))
    back = {joint.child: turned[:, place[joint.parent]].transpose(0, 2, 1) for joint in joints}
    angles = [_zyx_degrees(back[name] @ turned[:, place[name]] if name in back
                           else turned[:, place[name]]) for name in names]
    root = CENTIMETRES * points_y_up(positions[:, part][:, place[ragdoll.root.name]])
    rows = np.concatenate([root, *angles], axis=1)
    return '\n'.join([
        'HIERARCHY', *_hierarchy(ragdoll, ragdoll.root.name, 0), 'MOTION',
        f'Frames: {len(rows)}', f'Frame Time: {step:.9f}',
        *(' '.join(f'{number:.7f}' for number in row) for row in rows.tolist()), ''])


def _hierarchy(doll: Ragdoll, name: str, depth: int) -> Iterator[str]:
    """Lines of a bone's joint and of its subtree."""
    below = [joint.child for joint in doll.joints if joint.parent == name]
    above = next((joint.parent for joint in doll.joints if joint.child == name), None)
    at = _anchor(doll, name)
    indent, inner = '\t' * depth, '\t' * (depth + 1)
    places = 'Xposition Yposition Zposition ' if above is None else ''
    # BVH does not allow white space in names.
    yield f'{indent}{"ROOT" if above is None else "JOINT"} {"_".join(name.split())}'
    yield indent + '{'
    # The root's position is in its channels; readers differ in whether they add its offset.
    yield inner + _offset(at - (at if above is None else _anchor(doll, above)))
    yield f'{inner}CHANNELS {6 if places else 3} {places}Zrotation Yrotation Xrotation'
    for child in below:
        yield from _hierarchy(doll, child, depth + 1)
    if not below:
        # The tip is twice as far from the joint as the centre of mass.
        tip = 2 * (np.array(doll.bone(name).position) - at)
        yield from (f'{inner}End Site', inner + '{', f'{inner}\t{_offset(tip)}', inner + '}')
    yield indent + '}'


def _anchor(doll: Ragdoll, name: str) -> np.ndarray:
    """Anchor of a bone's joint (3,) m, doll's frame; the root's is its centre of mass."""
    return np.array(next((joint.anchor for joint in doll.joints if joint.child == name),
                         doll.bone(name).position))


def _offset(vector: np.ndarray) -> str:
    return 'OFFSET ' + ' '.join(f'{value:.7f}' for value in CENTIMETRES * points_y_up(vector))


def _resampled(recording: Recording) -> tuple[float, np.ndarray, np.ndarray]:
    """Frame time, s, and poses at equal times: the recording's own, or interpolated."""
    count = len(recording)
    if count == 1:
        return 1.0, recording.positions, recording.orientations
    step = recording.duration / (count - 1)
    times = step * np.arange(count)
    if abs(recording.times - times).max() < TIME_TOLERANCE:
        return step, recording.positions, recording.orientations
    poses = [recording.at(time) for time in times]
    return (step, np.array([pose.positions for pose in poses]),
            np.array([pose.orientations for pose in poses]))


def _zyx_degrees(matrices: np.ndarray) -> np.ndarray:
    """Angles (k, 3) z, y, x in degrees with R = Rz Ry Rx, of rotation matrices (k, 3, 3).

    As rotation.to_rpy, exact at y = 90 degrees too; unwrapped.
    """
    r = matrices
    z = np.arctan2(r[:, 1, 0], r[:, 0, 0])
    y = np.arctan2(-r[:, 2, 0], np.hypot(r[:, 0, 0], r[:, 1, 0]))
    sin, cos = np.sin(z), np.cos(z)
    x = np.arctan2(sin * r[:, 0, 2] - cos * r[:, 1, 2], cos * r[:, 1, 1] - sin * r[:, 0, 1])
    return np.degrees(np.unwrap(np.stack([z, y, x], axis=1), axis=0))
