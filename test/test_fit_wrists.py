"""Wrists, ankles and the neck have a person's ranges, whatever pose the skin was made in."""
import dataclasses
import itertools

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS, Rig

from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import joint_axes

FORWARD, LEFT, UP = np.eye(3)
STRAIGHT = rotation.IDENTITY

WITHIN = 0.03
"""Of unit vectors: a tube's rings stand otherwise when it is turned, which moves the middle of a
foot's farthest skin by some millimetres of its 0.2 m."""


def about(axis, degrees):
    return np.array(rotation.from_axis_angle(axis, np.radians(degrees)))


def turned(bones, name, turn):
    """Bones of a rig with one and what hangs on it turned about its head, in the doll's axes."""
    # The files' axes: x left, y up, z forward.
    to_file = np.array([LEFT, UP, FORWARD])
    index = next(k for k, bone in enumerate(bones) if bone.name == name)
    below = {index}
    for k, bone in enumerate(bones):
        if bone.parent in below:
            below.add(k)
    pivot = np.array(bones[index].head)

    def moved(point):
        return tuple(pivot + to_file @ rotation.rotate(turn, to_file.T @ np.subtract(point, pivot)))

    return [dataclasses.replace(bone, head=moved(bone.head), tail=moved(bone.tail))
            if k in below else bone for k, bone in enumerate(bones)]


def joint_of(folder, child, *turns, style='cmu'):
    bones = RIGS[style].bones
    for name, turn in turns:
        bones = turned(bones, name, turn)
    doll = fit_character(read_character(fit_rigs.write(Rig('person', bones), folder))).doll
    return next(joint for joint in doll.joints if joint.child == child)


def turn_by(joint, angles):
    """Rotation of the child: about each axis as those before have turned it."""
    result = STRAIGHT
    for axis, angle in zip(joint_axes(joint), angles, strict=True):
        result = rotation.multiply(result, rotation.from_axis_angle(axis, angle))
    return np.array(result)


def corners(joint, parent=STRAIGHT, bound=STRAIGHT):
    """Axes (corners, 3, 3) of the child at each corner of its range, in the parent's frame.

    ``parent``: the rotation that took the parent to the bind pose from where it is in the straight
    twin; ``bound``: that of the child relative to it.
    """
    back = np.array(parent) * (-1, -1, -1, 1)
    found = []
    for angles in itertools.product(*joint.angle_limits):
        turn = rotation.multiply(back, rotation.multiply(
            turn_by(joint, angles), rotation.multiply(parent, bound)))
        found.append(rotation.rotate(turn, np.eye(3)))
    return np.array(found)


LOWERED = about(FORWARD, -45)
APART = about(FORWARD, 15)

TWINS = [
    ('LeftHand', 'LeftArm', LOWERED, STRAIGHT),
    ('LeftHand', 'LeftArm', about(FORWARD, -80), STRAIGHT),
    ('LeftHand', None, STRAIGHT, about(FORWARD, -25)),
    ('LeftHand', None, STRAIGHT, rotation.multiply(about(FORWARD, -20), about(UP, 10))),
    ('LeftHand', 'LeftArm', LOWERED, about(FORWARD, 30)),
    ('LeftFoot', 'LeftUpLeg', APART, STRAIGHT),
    ('LeftFoot', None, STRAIGHT, about(LEFT, 30)),
    ('LeftFoot', 'LeftUpLeg', APART, about(LEFT, -15)),
    ('Neck1', None, STRAIGHT, about(LEFT, 20)),
    ('Head', 'Neck1', about(LEFT, 20), STRAIGHT),
    ('Head', 'Neck1', about(LEFT, 15), about(LEFT, -15))]


@pytest.mark.parametrize(('child', 'above', 'parent', 'bound'), TWINS)
def test_a_twin_in_another_bind_pose_reaches_the_same(tmp_path, child, above, parent, bound):
    """T and A pose, legs apart, toes down, wrists and neck bent: at every corner of the range."""
    turns = [(above, parent)] if above else []
    # A bend is given in the straight twin's axes, which the parent has taken along.
    back = np.array(parent) * (-1, -1, -1, 1)
    own = rotation.multiply(parent, rotation.multiply(bound, back))
    straight = joint_of(tmp_path, child)
    twin = joint_of(tmp_path, child, *turns, (child, own))
    assert corners(twin, parent, bound) == pytest.approx(corners(straight), abs=WITHIN)


def test_a_neck_bound_to_one_side_has_less_left_there(tmp_path):
    """By as much as it leans; without its turn, which then is about upright."""
    bound = rotation.multiply(about(LEFT, 10), about(FORWARD, 15))
    found, expected = (dataclasses.replace(joint, limits=(*joint.limits[:2], (0.0, 0.0)))
                       for joint in (joint_of(tmp_path, 'Neck1', ('Neck1', bound)),
                                     joint_of(tmp_path, 'Neck1')))
    assert corners(found, bound=bound) == pytest.approx(corners(expected), abs=WITHIN)


@pytest.mark.parametrize('child', ['Hand', 'Foot'])
def test_right_is_left_mirrored(tmp_path, child):
    turns = [(f'{side}{bone}', about(axis, degrees * (s if axis is FORWARD else 1)))
             for side, s in (('Left', 1), ('Right', -1))
             for bone, axis, degrees in (('Arm', FORWARD, -40), ('Hand', FORWARD, -20),
                                         ('UpLeg', FORWARD, 10), ('Foot', LEFT, 25))]
    mirror = np.diag((1, -1, 1))
    left, right = (corners(joint_of(tmp_path, side + child, *turns)) for side in ('Left', 'Right'))
    mirrored = mirror @ right @ mirror
    for each in left:
        assert np.abs(mirrored - each).max(axis=(1, 2)).min() < WITHIN


def points(joint, along, *angles):
    return rotation.rotate(turn_by(joint, angles), np.array(along))


def test_a_hand_bends_to_where_its_palm_faces(tmp_path):
    """80 to the palm, 70 back, 20 to the thumb and 30 away: palms down, then forwards.

    The rig's hand with its fingers is flat, thumb ahead; its middle is within 3 degrees ahead of
    the forearm's line.
    """
    flat = 'mixamorig:LeftHand'
    for turn, palm, thumb in ((STRAIGHT, -UP, FORWARD), (about(LEFT, -90), FORWARD, UP)):
        joint = joint_of(tmp_path, flat, ('mixamorig:LeftForeArm', turn), style='mixamo')
        (back, flexed), (radial, ulnar) = joint.limits
        for angles, toward, degrees in (((flexed, 0), palm, 80), ((back, 0), -palm, 70),
                                        ((0, radial), thumb, 20), ((0, ulnar), -thumb, 30)):
            # From the forearm, which lies within a degree of the hand's.
            reached = points(joint, LEFT, *angles)
            assert np.degrees(np.arcsin(reached @ toward)) == pytest.approx(degrees, abs=4)


def test_a_foot_points_and_lifts_from_a_right_angle(tmp_path):
    """From flat on the ground toes go 50 degrees down and 20 up; the outer edge 15 up, 35 down.

    The rig's ankle is lower than people's, by 4 degrees as seen from its toes.
    """
    for side, name in ((1, 'LeftFoot'), (-1, 'RightFoot')):
        (up, down), tilts = joint_of(tmp_path, name).limits
        foot = joint_of(tmp_path, name)
        assert np.degrees(np.arcsin(points(foot, FORWARD, down, 0)[2])) == pytest.approx(-50, abs=6)
        assert np.degrees(np.arcsin(points(foot, FORWARD, up, 0)[2])) == pytest.approx(20, abs=6)
        outer = sorted(np.degrees(np.arcsin(points(foot, side * LEFT, 0, tilt)[2]))
                       for tilt in tilts)
        assert outer == pytest.approx([-35, 15], abs=2)


def test_neck_and_head_share_the_necks_ranges(tmp_path):
    """Together 45 ahead, back and to the sides, and 60 about."""
    limits = [np.degrees(joint_of(tmp_path, name).angle_limits) for name in ('Neck1', 'Head')]
    assert np.sum(limits, axis=0) == pytest.approx(
        np.array([(-45, 45), (-45, 45), (-60, 60)]), abs=0.5)
    joint = joint_of(tmp_path, 'Neck1')
    assert points(joint, UP, joint.angle_limits[0][1], 0, 0)[0] > 0.3


def test_what_is_no_person_keeps_its_ranges():
    """A dog's paws and neck are no man's: about the pose that they are bound in."""
    doll = fit_rigs.fitted('four_legs').doll
    neck = next(joint for joint in doll.joints if joint.child == 'Neck')
    assert np.degrees(neck.limits) == pytest.approx(np.array([(-35, 35), (-40, 40)]))
