"""Joint angles and rates from the motions of bones: the inverse of the forward kinematics."""
from __future__ import annotations

import math

import numpy as np
import pytest
from test_placed_angles import DOLLS, placed

from ragdoll_ros import Bone, Box, Joint, Placement, Ragdoll, Scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import placed_coordinates
from ragdoll_ros.model.forward_kinematics import BoneMotion, bone_motions
from ragdoll_ros.model.inverse_kinematics import follow_motions


def world_motions(placement):
    """Motions of the bones of a placed doll in the world: velocities as of rigid bodies, by the
    motion of the root.
    """
    root_pose, root_velocity = placement.root_motion
    spin, found = np.array(placement.spin), {}
    for name, own in bone_motions(placement.doll, placement.angles, placement.rates).items():
        position = placement.bone_pose(placement.doll.bone(name)).position
        found[name] = BoneMotion(
            rotation.multiply(placement.orientation, own.turn), position,
            root_velocity + np.cross(spin, position - root_pose.position)
            + rotation.rotate(placement.orientation, own.velocity),
            spin + rotation.rotate(placement.orientation, own.spin))
    return found


@pytest.mark.parametrize('name', DOLLS)
def test_a_doll_follows_its_own_motion(name):
    """Of all kinds of joints, free ones too: angles, rates, frame and centre of mass are found."""
    placement = placed(name, rates=True)
    found = follow_motions(placement.doll, world_motions(placement))
    # Angles of a placement are rounded to 1e-9 degrees.
    assert found.angles == pytest.approx(placement.angles, abs=1e-9)
    assert found.rates == pytest.approx(placement.rates, abs=1e-9)
    assert found.pose.position == pytest.approx(placement.position, abs=1e-12)
    assert found.pose.orientation == pytest.approx(placement.orientation, abs=1e-12)
    assert found.velocity == pytest.approx(placement.velocity, abs=1e-9)
    assert found.spin == pytest.approx(placement.spin, abs=1e-12)
    assert max(found.distances.values()) < 1e-9
    assert found.clipped == ()


@pytest.mark.parametrize('name', DOLLS)
def test_what_it_finds_can_be_placed(name):
    """Of any rotations: the angles are within the limits, and all numbers are finite."""
    doll, rng = DOLLS[name], np.random.default_rng(5)
    for _ in range(5):
        wild = {bone.name: BoneMotion(rotation.normalized(rng.normal(size=4)), rng.normal(size=3),
                                      rng.normal(size=3), rng.normal(size=3))
                for bone in doll.bones}
        found = follow_motions(doll, wild)
        placement = Placement(doll, '', found.pose.position, found.pose.orientation,
                              found.velocity, found.spin, found.angles, found.rates)
        state = placed_coordinates(Scene('wild', (placement,)).dolls)
        assert np.isfinite(state.q).all() and np.isfinite(state.v).all()
        assert name == 'free' or found.clipped


def arm_with(kind, axes, limits):
    return Ragdoll('arm', (Bone('base', Box((0.2, 0.2, 0.2)), 1.0, (0, 0, 0)),
                           Bone('arm', Box((0.1, 0.1, 0.4)), 1.0, (0, 0, 0.4))),
                   (Joint('base', 'arm', kind, (0, 0, 0.2), axes, limits),))


def moved(turn, spin):
    """Motions of the arm at a turn about the joint's anchor, and of its base at rest."""
    zero, half = np.zeros(3), np.array((0, 0, 0.2))
    arm = rotation.rotate(turn, half)
    return {'base': BoneMotion(np.array(rotation.IDENTITY), zero, zero, zero),
            'arm': BoneMotion(turn, arm + half, np.cross(spin, arm), np.array(spin))}


@pytest.mark.parametrize(('angle', 'due', 'clipped'), [(0.5, 0.5, ()), (1.2, 1.0, ('arm',)),
                                                       (-0.4, 0.0, ('arm',))])
def test_an_angle_stops_at_its_limit(angle, due, clipped):
    doll = arm_with('hinge', ((1, 0, 0),), ((0.0, 1.0),))
    found = follow_motions(doll, moved(rotation.from_axis_angle((1, 0, 0), angle), (2.0, 0, 0)))
    assert found.angles == pytest.approx({'arm': due}, abs=1e-9)
    assert found.rates == {'arm': pytest.approx(0.0 if clipped else 2.0)}
    assert found.clipped == clipped
    # A chord of the circle about the anchor.
    assert found.distances['arm'] == pytest.approx(0.4 * math.sin(abs(angle - due) / 2), abs=1e-9)


def test_a_hinge_takes_what_turns_about_its_axis():
    """With its rate, by centred differences while the arm swings askew."""
    doll = arm_with('hinge', ((0, 0.6, 0.8),), ((-3.0, 3.0),))
    start, spin = rotation.from_rotation_vector((0.3, 0.8, 0.5)), np.array((0.7, -1.1, 0.4))
    h = 1e-6

    def at(time):
        turn = rotation.multiply(rotation.from_rotation_vector(spin * time), start)
        return follow_motions(doll, moved(turn, spin))

    change = (at(h).angles['arm'] - at(-h).angles['arm']) / (2 * h)
    assert at(0.0).rates['arm'] == pytest.approx(change, abs=1e-8)


def test_a_limit_beyond_half_a_turn_is_reached():
    doll = arm_with('hinge', ((1, 0, 0),), ((0.0, 5.0),))
    found = follow_motions(doll, moved(rotation.from_axis_angle((1, 0, 0), 4.0), (0.0, 0, 0)))
    assert found.angles == pytest.approx({'arm': 4.0}, abs=1e-9)
    assert found.clipped == ()
