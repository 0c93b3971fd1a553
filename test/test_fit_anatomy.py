"""Shoulders and hips have a person's ranges in the world, whatever pose the skin was made in."""
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
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation

FORWARD, LEFT, UP = np.eye(3)
DOWN = -UP


def person(folder, arms=0.0, legs=0.0, forward=0.0):
    """A person whose arms are ``arms`` degrees below level, legs ``legs`` degrees apart each.

    ``forward``: degrees that the arms are ahead of the trunk.
    """
    def turned(bone):
        side = np.sign(bone.head[0]) or np.sign(bone.tail[0])
        if any(part in bone.name for part in ('Arm', 'Hand')):
            pivot, angles = np.array((side * .18, 1.42, 0)), (-side * arms, -side * forward)
        elif any(part in bone.name for part in ('Leg', 'Foot', 'Toe')):
            pivot, angles = np.array((side * .1, .92, 0)), (side * legs, 0.0)
        else:
            return bone
        turn = rotation.multiply(rotation.from_axis_angle((0, 1, 0), np.radians(angles[1])),
                                 rotation.from_axis_angle((0, 0, 1), np.radians(angles[0])))
        return dataclasses.replace(bone, **{
            end: tuple(pivot + rotation.rotate(turn, np.subtract(getattr(bone, end), pivot)))
            for end in ('head', 'tail')})

    rig = Rig('person', [turned(bone) for bone in RIGS['cmu'].bones])
    return fit_character(read_character(fit_rigs.write(rig, folder))).doll


def joint_of(doll, child):
    return next(joint for joint in doll.joints if joint.child == child)


def turn_by(joint, angles):
    """Rotation of a joint with three angles, each about the axis that those before have turned."""
    result = rotation.IDENTITY
    for axis, angle in zip(joint_axes(joint), angles, strict=True):
        result = rotation.multiply(result, rotation.from_axis_angle(axis, angle))
    return np.array(result)


def reached(joint, bound, angles):
    """Where a limb that hung down in the anatomical pose points, as directions of its three axes.

    ``bound``: the rotation that took it from there to the bind pose.
    """
    turn = rotation.multiply(turn_by(joint, angles), bound)
    return rotation.rotate(turn, np.eye(3))


def degrees(joint):
    return np.degrees(joint.angle_limits)


@pytest.mark.parametrize(('arms', 'forward'), [(0, 0), (45, 0), (80, 0), (-30, 0)])
def test_arms_of_any_bind_pose_reach_the_same(tmp_path, arms, forward):
    """T-pose, A-pose, arms down and half up: at every corner of its range, to a rounding."""
    for side, name in ((1, 'LeftArm'), (-1, 'RightArm')):
        joint = joint_of(person(tmp_path, arms, forward=forward), name)
        straight = joint_of(person(tmp_path), name)
        for corner in itertools.product((0, 1), repeat=3):
            found, expected = (
                reached(each, rotation.from_axis_angle(FORWARD, side * np.radians(90 - below)),
                        [pair[end] for pair, end in zip(each.angle_limits, corner, strict=True)])
                for each, below in ((joint, arms), (straight, 0)))
            # Positions are 32-bit floats: 1e-7 of a metre over an arm of 0.3 m.
            assert np.allclose(found, expected, atol=1e-5)


def test_an_arm_reaches_what_a_persons_does(tmp_path):
    """Abduction 180 and 30 across, 60 back, 85 ahead: by where the arm then points."""
    for side, name in ((1, 'LeftArm'), (-1, 'RightArm')):
        joint = joint_of(person(tmp_path, arms=40), name)
        bound = rotation.from_axis_angle(FORWARD, side * np.radians(50))
        low, high = joint.angle_limits[0]
        raised, across = (high, low) if side > 0 else (low, high)
        hanging = -side * np.radians(50)

        def points(first, second, joint=joint, bound=bound):
            return reached(joint, bound, (first, second, 0))[2] * -1

        assert np.allclose(points(raised, 0), UP, atol=1e-5)
        assert np.allclose(points(across, 0), (0, -side * np.sin(np.radians(30)),
                                               -np.cos(np.radians(30))), atol=1e-5)
        back, ahead = joint.angle_limits[1]
        assert np.allclose(points(hanging, ahead), (np.sin(np.radians(85)), 0,
                                                    -np.cos(np.radians(85))), atol=1e-5)
        assert np.allclose(points(hanging, back), (-np.sin(np.radians(60)), 0,
                                                   -np.cos(np.radians(60))), atol=1e-5)


@pytest.mark.parametrize('legs', [0, 20])
def test_a_leg_lifts_parts_and_turns_about_itself(tmp_path, legs):
    for side, name in ((1, 'LeftUpLeg'), (-1, 'RightUpLeg')):
        joint = joint_of(person(tmp_path, legs=legs), name)
        flexion, apart, axial = degrees(joint)
        # The thigh of the rig leans 1.4 degrees forward.
        assert flexion == pytest.approx((-120 + 1.4, 30 + 1.4), abs=0.1)
        assert apart == pytest.approx(np.sort(side * np.array((-30 - legs, 45 - legs))), abs=0.1)
        assert axial == pytest.approx((-45, 45), abs=1e-6)
        lifted = rotation.rotate(turn_by(joint, (joint.angle_limits[0][0], 0, 0)), DOWN)
        assert lifted[0] > 0.8 and lifted[2] > 0.4
        outward = joint.angle_limits[1][1 if side > 0 else 0]
        assert rotation.rotate(turn_by(joint, (0, outward, 0)), DOWN)[1] * side > 0.3


def test_arms_bound_forward_are_counted_from_there(tmp_path):
    """20 degrees ahead of the trunk: what is left ahead is less by that, behind more."""
    back, ahead = degrees(joint_of(person(tmp_path, forward=20), 'LeftArm'))[1]
    assert (back, ahead) == pytest.approx((-80, 65), abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize('arms', [0, 45])
def test_a_fall_keeps_the_ranges(tmp_path, arms):
    """Three ranges that are not about zero: no angle leaves its own, by more than half a degree."""
    with Simulation(above_ground(person(tmp_path, arms))) as simulation:
        past = 0.0
        while simulation.time < 2_000_000_000:
            simulation.advance()
            past = max(past, simulation.measures()['limit_overshoot_rad'])
    assert np.degrees(past) < 0.5


def test_what_is_no_person_keeps_ranges_about_its_bind_pose():
    for joint in fit_rigs.fitted('four_legs').doll.joints:
        assert len(joint.limits) < 3
