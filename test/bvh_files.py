"""BVH files as other programs write them: skeletons with common names, angles as functions say."""
from __future__ import annotations

import numpy as np
import pytest

CMU = {  # joint: its parent and its offset, in units of 5.6 cm, in a T-pose
    'Hips': ('', (0, 0, 0)), 'LHipJoint': ('Hips', (0, 0, 0)),
    'LeftUpLeg': ('LHipJoint', (1.6, -1.5, 0.4)), 'LeftLeg': ('LeftUpLeg', (0, -7.2, 0)),
    'LeftFoot': ('LeftLeg', (0, -7.6, 0)), 'LeftToeBase': ('LeftFoot', (0, -0.6, 2.1)),
    'RHipJoint': ('Hips', (0, 0, 0)), 'RightUpLeg': ('RHipJoint', (-1.6, -1.5, 0.4)),
    'RightLeg': ('RightUpLeg', (0, -7.2, 0)), 'RightFoot': ('RightLeg', (0, -7.6, 0)),
    'RightToeBase': ('RightFoot', (0, -0.6, 2.1)), 'LowerBack': ('Hips', (0, 0, 0)),
    'Spine': ('LowerBack', (0, 2.0, 0)), 'Spine1': ('Spine', (0, 2.0, 0)),
    'Neck': ('Spine1', (0, 0.1, 0)), 'Neck1': ('Neck', (0, 1.7, 0)), 'Head': ('Neck1', (0, 1.8, 0)),
    'LeftShoulder': ('Spine1', (0, 0.1, 0)), 'LeftArm': ('LeftShoulder', (3.4, 0.6, 0)),
    'LeftForeArm': ('LeftArm', (5.0, 0, 0)), 'LeftHand': ('LeftForeArm', (3.6, 0, 0)),
    'LeftFingerBase': ('LeftHand', (0.8, 0, 0)), 'LThumb': ('LeftHand', (0.5, 0, 0.5)),
    'RightShoulder': ('Spine1', (0, 0.1, 0)), 'RightArm': ('RightShoulder', (-3.4, 0.6, 0)),
    'RightForeArm': ('RightArm', (-5.0, 0, 0)), 'RightHand': ('RightForeArm', (-3.6, 0, 0)),
    'RightFingerBase': ('RightHand', (-0.8, 0, 0)), 'RThumb': ('RightHand', (-0.5, 0, 0.5))}

ARMS_DOWN = {**CMU, **{
    f'{side}{part}': (f'{side}{above}', (0, -length, 0))
    for side in ('Left', 'Right') for part, above, length in (
        ('ForeArm', 'Arm', 5.0), ('Hand', 'ForeArm', 3.6), ('FingerBase', 'Hand', 0.8))}}
"""The same skeleton with arms that hang."""

FRAME_TIME = 1 / 120


def bvh(skeleton, turns=None, places=None, count=2, order='ZYX', moved=()):
    """Text of a file of ``count`` frames.

    ``turns``: by joints, functions of time to a scipy Rotation in the parent's axes; ``places``:
    function of time to the root's place; ``moved``: joints with channels of positions, which are
    their offsets.
    """
    rotations = pytest.importorskip('scipy.spatial.transform').Rotation
    turns, root = turns or {}, next(iter(skeleton))
    places = places or (lambda time: (0, 0, 0))

    def joint(name, depth):
        below = [each for each, (up, _) in skeleton.items() if up == name]
        offset, inner = ' '.join(map(str, skeleton[name][1])), '  ' * (depth + 1)
        shifts = 'Xposition Yposition Zposition ' if name == root or name in moved else ''
        angles = ' '.join(f'{axis}rotation' for axis in order)
        yield '  ' * depth + ('ROOT ' if name == root else 'JOINT ') + name
        yield '  ' * depth + '{'
        yield f'{inner}OFFSET {offset}'
        yield f'{inner}CHANNELS {6 if shifts else 3} {shifts}{angles}'
        for each in below:
            yield from joint(each, depth + 1)
        if not below:
            yield from (f'{inner}End Site', inner + '{', f'{inner}  OFFSET {offset}', inner + '}')
        yield '  ' * depth + '}'

    head = ['HIERARCHY', *joint(root, 0)]
    order_of_joints = [line.split()[1] for line in head if 'JOINT' in line or 'ROOT' in line]
    rows = []
    for time in FRAME_TIME * np.arange(count):
        row = list(places(time))
        for name in order_of_joints:
            row += skeleton[name][1] if name in moved else ()
            turn = turns[name](time) if name in turns else rotations.identity()
            row += turn.as_euler(order, degrees=True).tolist()
        rows.append(' '.join(f'{number:.9f}' for number in row))
    return '\n'.join([*head, 'MOTION', f'Frames: {count}', f'Frame Time: {FRAME_TIME:.12f}',
                      *rows, ''])
