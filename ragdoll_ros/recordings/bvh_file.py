"""A doll's motion as BVH (Biovision motion capture).

By convention Y up, facing +Z, left at +X, centimetres, degrees, a fixed frame time. The rest pose
is the bind pose. The joints of a fitted character are the bones of its file. Of other dolls the
root is at the root bone's centre of mass; each further joint has its child's name. Channels are Z,
Y, X: R = Rz Ry Rx in the parent's axes. The root has position channels, and so has a bone of a file
whose position in its parent changes, such as a foot that hangs on the hips. Gaps in the joints of
other dolls are lost.
"""
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..model import rotation
from ..model.pose import Pose
from ..model.ragdoll import Ragdoll
from .file_skeleton import FileSkeleton, carrier_poses, find_file_skeleton
from .recording import Recording, orientations_y_up, points_y_up

CENTIMETRES = 100.0

TIME_TOLERANCE = 1e-7
"""s, deviation from equal times, above the rounding of stamps to ns; beyond it poses are
interpolated."""


MOVED = 1e-5
"""m, least change of a bone's place in its parent for channels of its position."""


@dataclass(frozen=True)
class _Joints:
    """n joints in the order of the file, depth first."""

    names: list[str]
    parents: list[int]
    rests: np.ndarray
    """(n, 3) m, bind pose, doll's frame."""
    tips: np.ndarray
    """(n, 3) m, from the joint to its bone's end, for those without children."""
    positions: np.ndarray
    """(k, n, 3) m, world frame."""
    turns: np.ndarray
    """(k, n, 4) rotations since the bind pose, world frame."""
    moved: list[bool]
    """(n,) whether a joint has channels of its position."""


def bvh_text(recording: Recording, doll: int = 0,
             warn: Callable[[str], None] = warnings.warn) -> str:
    """BVH of one doll of a recording, by its index in the scene.

    ``warn`` receives a sentence if its character's file can not be read: the doll's joints are
    written.
    """
    placement = recording.scene.dolls[doll]
    step, even = _resampled(recording)
    bones = carrier_poses(recording.scene, Pose(even.positions, even.orientations),
                          even.rods)[doll]
    skeleton = find_file_skeleton(placement, warn)
    joints = (_doll_joints(placement.doll, bones) if skeleton is None
              else _file_joints(skeleton, bones, placement.doll.name))
    turned = rotation.matrix(orientations_y_up(joints.turns))
    places = CENTIMETRES * points_y_up(joints.positions)
    columns = []
    for k, up in enumerate(joints.parents):
        back = turned[:, up].transpose(0, 2, 1) if up >= 0 else np.eye(3)
        if joints.moved[k]:
            shift = places[:, k] - (places[:, up] if up >= 0 else 0)
            columns.append((back @ shift[..., None])[..., 0])
        columns.append(_zyx_degrees(back @ turned[:, k]))
    rows = np.concatenate(columns, axis=1)
    return '\n'.join([
        'HIERARCHY', *_hierarchy(joints), 'MOTION',
        f'Frames: {len(rows)}', f'Frame Time: {step:.9f}',
        *(' '.join(f'{number:.7f}' for number in row) for row in rows.tolist()), ''])


def _doll_joints(doll: Ragdoll, bones: Pose) -> _Joints:
    """The joints of a doll, from the poses (k, b) of its bones."""
    joints = doll.joints_depth_first()
    names = [doll.root.name, *(joint.child for joint in joints)]
    parents = [-1, *(names.index(joint.parent) for joint in joints)]
    places = {bone.name: k for k, bone in enumerate(doll.bones)}
    order = [places[name] for name in names]
    centres = np.array([doll.bone(name).position for name in names])
    rests = np.array([doll.root.position, *(joint.anchor for joint in joints)])
    binds = np.array([doll.bone(name).orientation for name in names])
    turns = rotation.multiply(bones.orientation[:, order], rotation.inverse(binds))
    # The tip is twice as far from the joint as the centre of mass.
    return _Joints(names, parents, rests, 2 * (centres - rests), bones.position[:, order], turns,
                   [up < 0 for up in parents])


def _file_joints(skeleton: FileSkeleton, bones: Pose, name: str) -> _Joints:
    """Return the bones of a doll's file, from the poses (k, b + l) of the doll's bones and links.

    Several bones without a parent hang on a joint called ``name`` at the origin, as BVH has one
    root.
    """
    order = _depth_first(skeleton.parents)
    poses = skeleton.poses(bones)
    rests, positions = skeleton.binds.position[order], poses.position[:, order]
    turns = rotation.multiply(poses.orientation,
                              rotation.inverse(skeleton.binds.orientation))[:, order]
    names = [skeleton.names[bone] for bone in order]
    parents = [order.index(skeleton.parents[bone]) if skeleton.parents[bone] >= 0 else -1
               for bone in order]
    if parents.count(-1) > 1:
        names, parents = [name, *names], [-1, *(up + 1 for up in parents)]
        rests, positions = np.insert(rests, 0, 0, axis=0), np.insert(positions, 0, 0, axis=1)
        turns = np.concatenate([np.tile(rotation.IDENTITY, (len(turns), 1, 1)), turns], axis=1)
    above = np.maximum(parents, 0)
    local = rotation.rotate(rotation.inverse(turns[:, above]), positions - positions[:, above])
    moved = np.abs(local - (rests - rests[above])).max(axis=(0, 2)) > MOVED
    moved[0] = True
    # A bone without a child is taken to be as long as the one above.
    return _Joints(names, parents, rests, rests - rests[above], positions, turns, moved.tolist())


def _depth_first(parents: tuple[int, ...]) -> list[int]:
    below: dict[int, list[int]] = {}
    for bone, up in enumerate(parents):
        below.setdefault(up, []).append(bone)
    found, left = [], below[-1][::-1]
    while left:
        found.append(left.pop())
        left += below.get(found[-1], [])[::-1]
    return found


def _hierarchy(joints: _Joints) -> Iterator[str]:
    """Lines of the joints, each within its parent's braces."""
    depths: list[int] = []
    for up in joints.parents:
        depths.append(0 if up < 0 else depths[up] + 1)
    for k, (up, depth, after) in enumerate(zip(joints.parents, depths, [*depths[1:], 0],
                                               strict=True)):
        indent, inner = '\t' * depth, '\t' * (depth + 1)
        places = 'Xposition Yposition Zposition ' if joints.moved[k] else ''
        # BVH does not allow white space in names.
        yield f'{indent}{"ROOT" if up < 0 else "JOINT"} {"_".join(joints.names[k].split())}'
        yield indent + '{'
        # The root's position is in its channels; readers differ in whether they add its offset.
        yield inner + _offset(joints.rests[k] - joints.rests[max(up, 0)])
        yield f'{inner}CHANNELS {6 if places else 3} {places}Zrotation Yrotation Xrotation'
        if after <= depth:
            yield from (f'{inner}End Site', inner + '{', f'{inner}\t{_offset(joints.tips[k])}',
                        inner + '}')
        yield from ('\t' * closed + '}' for closed in range(depth, after - 1, -1))


def _offset(vector: np.ndarray) -> str:
    return 'OFFSET ' + ' '.join(f'{value:.7f}' for value in CENTIMETRES * points_y_up(vector))


def _resampled(recording: Recording) -> tuple[float, Recording]:
    """Frame time, s, and the recording at equal times: itself, or interpolated."""
    count = len(recording)
    if count == 1:
        return 1.0, recording
    step = recording.duration / (count - 1)
    times = step * np.arange(count)
    if abs(recording.times - times).max() < TIME_TOLERANCE:
        return step, recording
    poses = [recording.at(time) for time in times]
    return step, Recording(
        recording.scene, times, np.array([pose.positions for pose in poses]),
        np.array([pose.orientations for pose in poses]),
        None if recording.rods is None else np.array([pose.rods for pose in poses]))


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
