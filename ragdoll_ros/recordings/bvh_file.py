"""A doll's motion as BVH (Biovision's motion capture), which animators' programs read.

As is usual there: Y up, facing +Z, the left at +X, centimetres, degrees, at equal times. The rest
pose is the doll's bind pose. The first joint is the root bone, at its centre of mass; each further
one has the name of the bone that moves about it. Channels are Z, Y, X: a rotation about x, then y,
then z of the parent's axes. Only the root has a place, so that a joint's gap is not in it.
"""
from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..model import rotation
from ..model.ragdoll import Ragdoll
from .recording import Recording
from .y_up import orientations_y_up, points_y_up

CENTIMETRES = 100.0

TIME_TOLERANCE = 1e-7
"""s by which times may be off from equal ones: the nanoseconds of a file's stamps add up to less.
What is off by more is taken between poses."""


def bvh_text(recording: Recording, doll: int = 0) -> str:
    """The motion of one doll of a recording, by its index in the scene, as a BVH file."""
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
    """Lines of a bone's joint and of all below it."""
    below = [joint.child for joint in doll.joints if joint.parent == name]
    above = next((joint.parent for joint in doll.joints if joint.child == name), None)
    at = _joint_place(doll, name)
    indent, inner = '\t' * depth, '\t' * (depth + 1)
    places = 'Xposition Yposition Zposition ' if above is None else ''
    yield f'{indent}{"ROOT" if above is None else "JOINT"} {_without_spaces(name)}'
    yield indent + '{'
    # A root's place is in its channels, to which some readers add its offset, and others do not.
    yield inner + _offset(at - (at if above is None else _joint_place(doll, above)))
    yield f'{inner}CHANNELS {6 if places else 3} {places}Zrotation Yrotation Xrotation'
    for child in below:
        yield from _hierarchy(doll, child, depth + 1)
    if not below:
        yield from (f'{inner}End Site', inner + '{', f'{inner}\t{_offset(_to_tip(doll, name))}',
                    inner + '}')
    yield indent + '}'


def _joint_place(doll: Ragdoll, name: str) -> np.ndarray:
    """Where a bone is tied to the one above, (3,) m, doll's frame; the root: its centre of mass."""
    return np.array(next((joint.anchor for joint in doll.joints if joint.child == name),
                         doll.bone(name).position))


def _to_tip(doll: Ragdoll, name: str) -> np.ndarray:
    """From a bone's joint as far beyond its centre of mass as that is from the joint, (3,) m."""
    return 2 * (np.array(doll.bone(name).position) - _joint_place(doll, name))


def _offset(vector: np.ndarray) -> str:
    return 'OFFSET ' + ' '.join(f'{value:.7f}' for value in CENTIMETRES * points_y_up(vector))


def _without_spaces(name: str) -> str:
    """A name without white space, which ends names in BVH."""
    return '_'.join(name.split())


def _resampled(recording: Recording) -> tuple[float, np.ndarray, np.ndarray]:
    """Time from pose to pose, s, and poses at such times: the recording's own if they are."""
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

    As rotation.to_rpy, exact at a y of 90 degrees too; without jumps by a whole turn.
    """
    r = matrices
    z = np.arctan2(r[:, 1, 0], r[:, 0, 0])
    y = np.arctan2(-r[:, 2, 0], np.hypot(r[:, 0, 0], r[:, 1, 0]))
    sin, cos = np.sin(z), np.cos(z)
    x = np.arctan2(sin * r[:, 0, 2] - cos * r[:, 1, 2], cos * r[:, 1, 1] - sin * r[:, 0, 1])
    return np.degrees(np.unwrap(np.stack([z, y, x], axis=1), axis=0))
