"""The mistakes of the article's kind are named; joints bend as a body's do."""
import dataclasses

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.fit.judging.plausibility import extent, find_implausible
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import Ragdoll, joint_axes


@pytest.fixture
def article():
    return load_doll('article_doll')


@pytest.fixture
def sound(article):
    """The article's doll with the density of water: nothing to doubt."""
    bones = tuple(dataclasses.replace(bone, mass=1000 * bone.shape.volume)
                  for bone in article.bones)
    return dataclasses.replace(article, bones=bones)


def sentences(doll):
    return [finding.sentence for finding in find_implausible(doll)]


def in_centimetres(doll):
    def shape(given):
        return type(given)(**{key: tuple(100 * v for v in value) if isinstance(value, tuple)
                              else 100 * value for key, value in vars(given).items()})

    return Ragdoll(doll.name, tuple(
        dataclasses.replace(b, shape=shape(b.shape), position=tuple(100 * v for v in b.position))
        for b in doll.bones), tuple(
        dataclasses.replace(j, anchor=tuple(100 * v for v in j.anchor)) for j in doll.joints))


def with_the_signs_of_ode(doll):
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(j, limits=tuple((-high, -low) for low, high in j.limits))
        for j in doll.joints))


def test_a_sound_doll_raises_no_doubt(sound):
    assert find_implausible(sound) == []
    # Feet at 0.40 m, head up to 1.55 m; arms out to 0.60 m on both sides.
    assert extent(sound) == pytest.approx(1.2)


def test_the_articles_arms_are_too_dense(article):
    doubts = sentences(article)
    # 5 kg in 5 x 20 x 5 cm.
    assert 'left_upper_arm: a density of 10000 kg/m^3, over 3000' in doubts
    assert not any(doubt.startswith('torso') for doubt in doubts)


def test_the_doll_in_centimetres(sound):
    assert any('may be centimetres' in doubt for doubt in sentences(in_centimetres(sound)))


def test_odes_signs_left_in(sound):
    doubts = sentences(with_the_signs_of_ode(sound))
    for bone, complaint in (('left_shin', 'knee that bends forwards'),
                            ('right_shin', 'knee that bends forwards'),
                            ('left_forearm', 'elbow that bends backwards'),
                            ('right_forearm', 'elbow that bends backwards'),
                            ('left_thigh', 'hip that lifts the knee backwards')):
        assert any(doubt.startswith(bone) and complaint in doubt for doubt in doubts), bone
    assert len(doubts) == 6


def test_a_scale_applied_twice(tmp_path):
    rig = dataclasses.replace(RIGS['two_bones'], unit=100)
    character = read_character(fit_rigs.write(rig, tmp_path), 1e-4)
    assert any('applied twice' in doubt for doubt in sentences(fit_character(character).doll))


def bent(doll, child, angle):
    """Where a bone's middle goes by a turn about its first axis, from where it was."""
    joint = next(joint for joint in doll.joints if joint.child == child)
    turn = rotation.from_axis_angle(joint_axes(joint)[0], angle)
    arm = np.subtract(doll.bone(child).position, joint.anchor)
    return rotation.rotate(turn, arm) - arm


@pytest.mark.parametrize('style', ['mixamo', 'unreal', 'vrm', 'cmu', 'makehuman'])
def test_knees_and_elbows_of_fitted_humanoids(style):
    fit = fit_rigs.fitted(style)
    joints = {joint.child: joint for joint in fit.doll.joints}
    for body in fit.bodies:
        if body.role in ('shin', 'forearm'):
            low, high = joints[body.bone.name].limits[0]
            # Straight in the bind pose: it folds one way, and hardly the other.
            assert low > -0.2
            assert high > 2
            forward = bent(fit.doll, body.bone.name, 0.5)[0]
            assert forward < 0 if body.role == 'shin' else forward > 0
        if body.role == 'thigh':
            low, high = joints[body.bone.name].angle_limits[0]
            assert bent(fit.doll, body.bone.name, low)[0] > 0.05
            assert -low > 2 * high


def test_a_bent_leg_without_names_straightens_and_folds():
    """Fox or dog: what is bent in the bind pose is a hinge about the axis of that bend."""
    fit = fit_rigs.fitted('four_legs_unnamed_centimetres')
    hinges = [joint for joint in fit.doll.joints if joint.kind == 'hinge']
    assert len(hinges) >= 4
    for joint in hinges:
        # The legs lie in planes of constant y.
        assert abs(joint.axes[0][1]) > 0.95 or abs(joint.anchor[1]) < 0.01
        assert joint.limits[0][0] <= 0 < joint.limits[0][1]


def test_left_and_right_mirror_in_their_limits():
    fit = fit_rigs.fitted('unreal')
    joints = {joint.child: joint for joint in fit.doll.joints}
    for name, joint in joints.items():
        if not name.endswith('_l'):
            continue
        other = joints[name[:-1] + 'r']
        assert other.kind == joint.kind
        if len(joint.axes) == 1 and joint.kind == 'ball':
            assert other.limits == joint.limits
            assert np.allclose(other.axes[0], np.multiply(joint.axes[0], (1, -1, 1)), atol=0.01)
            continue
        for axis, pair, mirrored, limits in zip(joint_axes(joint), joint.angle_limits,
                                                joint_axes(other), other.angle_limits,
                                                strict=True):
            # A mirrored turn is one about the mirrored axis the other way round.
            image = -np.multiply(axis, (1, -1, 1))
            assert abs(np.dot(image, mirrored)) > 0.999
            expected = pair if np.dot(image, mirrored) > 0 else (-pair[1], -pair[0])
            assert np.allclose(limits, expected, atol=0.02)


def test_the_bone_direction_is_along_the_bone():
    fit = fit_character(fit_rigs.fitted('mixamo').character, FitOptions(orientation='bone'))
    shin = fit.doll.bone('mixamorig:LeftLeg')
    z = rotation.rotate(np.array(shin.orientation), np.array([0, 0, 1.0]))
    direction = np.array([-.03, 0, -.41])
    assert np.allclose(z, direction / np.linalg.norm(direction), atol=1e-5)
