"""Dolls that start at joint angles and rates: in every engine they are where they should be."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ragdoll_ros import (
    Bone,
    Box,
    Joint,
    Placement,
    Ragdoll,
    Scene,
    Simulation,
    Sphere,
    load_doll,
    load_scene,
    save_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelErrors

FREE = Ragdoll('free', (
    Bone('base', Box((0.3, 0.2, 0.1)), 2.0, (0, 0, 0)), Bone('arm', Box((0.1, 0.1, 0.4)), 1.0,
                                                           (0, 0.1, 0.3), (0.1, 0, 0.2, 0.9)),
    Bone('hand', Sphere(0.1), 0.5, (0, 0.1, 0.7))), (
    Joint('base', 'arm', 'ball', (0, 0, 0.1), ((0, 0.6, 0.8),)),
    Joint('arm', 'hand', 'hinge', (0, 0.1, 0.55), ((1, 0, 0),))))

DOLLS = {**{name: load_doll(name) for name in ('doll', 'woman', 'character')}, 'free': FREE}
"""With hinges, universal and ball joints, free ones and such with two and three limits."""


def placed(name, rates=False, share=0.7):
    """A doll amid the ranges of its joints, turned, moving and spinning, high above nothing."""
    doll, angles, speeds = DOLLS[name], {}, {}
    names = [angle for joint in doll.joints for angle in joint.angle_names]
    limits = [pair for joint in doll.joints for pair in joint.angle_limits]
    for index, (angle, pair) in enumerate(zip(names, limits, strict=True)):
        lower, upper = pair or (-1.0, 1.0)
        angles[angle] = lower + share * (upper - lower) * ((index % 3) + 1) / 3
        speeds[angle] = (-1) ** index * (0.5 + 0.1 * (index % 4))
    return Placement(doll, 'placed', (1, 2, 3), tuple(rotation.normalized((0.1, 0.5, -0.2, 0.8))),
                     (0.4, -0.3, 0.2), (0.5, 1.0, -0.7), angles, speeds if rates else {})


def started(placement, engine):
    """State, joint angles and joint rates at the start of a scene of one doll in free fall."""
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    scene = Scene('start', (placement,))
    with Simulation(scene, engine=engine) as simulation:
        start = simulation.state, simulation.joint_angles, simulation.joint_rates
        simulation.advance()
        again = simulation.reset()
        np.testing.assert_array_equal(again.rows, start[0].rows)
    return scene, *start


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
@pytest.mark.parametrize('name', DOLLS)
def test_angles_and_rates_are_those_that_were_given(name, engine):
    """And bones are where the placement says: three engines with kinematics of their own."""
    placement = placed(name, rates=True)
    scene, state, angles, rates = started(placement, engine)
    # PyBullet takes joints' axes with a few digits less.
    tolerance = 1e-6 if engine == 'bullet' else 1e-9
    assert angles == pytest.approx([placement.angles[each] for each in scene.angle_names],
                                   abs=tolerance)
    assert rates == pytest.approx([placement.rates[each] for each in scene.angle_names],
                                  abs=10 * tolerance)
    for index, bone in enumerate(placement.doll.bones):
        pose = placement.bone_pose(bone)
        assert state.positions[index] == pytest.approx(pose.position, abs=tolerance)
        assert rotation.angle_between(
            state.orientations[index], pose.orientation) < 10 * tolerance + 1e-7


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
@pytest.mark.parametrize('name', DOLLS)
def test_velocities_are_the_derivatives_of_poses(name, engine):
    """Centred differences of positions as the joints go on, of order 2, and the root's motion; the
    centre of mass moves as the placement says.
    """
    placement, h = placed(name, rates=True, share=0.5), 1e-5
    scene, state, _, _ = started(placement, engine)
    later, earlier = (dataclasses.replace(placement, angles={
        each: angle + side * h * placement.rates[each]
        for each, angle in placement.angles.items()}) for side in (1, -1))
    change = np.array([later.bone_pose(bone).position - earlier.bone_pose(bone).position
                       for bone in placement.doll.bones]) / (2 * h)
    root = scene.bone_index(placement.doll.root.name)
    arms = state.positions - state.positions[root]
    due = state.linear_velocities[root] + np.cross(placement.spin, arms) + change
    # Angles are rounded to 1e-9 degrees, a difference of two to 2e-6 of the rate.
    np.testing.assert_allclose(state.linear_velocities, due, atol=1e-5)
    masses = np.array([bone.mass for bone in placement.doll.bones])
    np.testing.assert_allclose(masses @ state.linear_velocities / masses.sum(), placement.velocity,
                               atol=1e-6)


def test_a_mirrored_pose_is_a_mirrored_doll():
    """The woman with bent left limbs, and with bent right ones."""
    doll = load_doll('woman')
    bent = {'left': {}, 'right': {}}
    for side, angles in bent.items():
        angles |= {f'{side[0]}_knee': 1.0, f'{side[0]}_p_hip': -0.5}
    left, right = (Placement(doll, angles=angles) for angles in bent.values())
    for bone in doll.bones:
        twin = bone.name.replace('left', 'LEFT').replace('right', 'left').replace('LEFT', 'right')
        assert left.bone_pose(bone).position * (1, -1, 1) == pytest.approx(
            right.bone_pose(doll.bone(twin)).position, abs=1e-6)


def test_a_scene_with_angles_is_written_and_read(tmp_path):
    scene = Scene('posed', (placed('woman', rates=True),))
    save_scene(scene, tmp_path / 'posed.yaml')
    assert load_scene(str(tmp_path / 'posed.yaml')) == scene


@pytest.mark.parametrize('entry, told', [
    ('angles_deg: {nose: 3}', 'dolls[0].angles_deg.nose: UnknownJoint'),
    ('angles_deg: {left_shin: 500}', 'dolls[0].angles_deg.left_shin: OutOfRange: 500; expected'),
    ('angles_deg: {left_shin: .nan}', 'dolls[0].angles_deg.left_shin: NotFinite'),
    ('rates_deg_s: {left_shin: fast}', 'dolls[0].rates_deg_s.left_shin'),
    ('angles_deg: 5', 'dolls[0].angles_deg')])
def test_what_is_wrong_with_an_angle_is_named_in_degrees(tmp_path, entry, told):
    (tmp_path / 'posed.yaml').write_text(f'dolls: [{{doll: doll, {entry}}}]')
    with pytest.raises(ModelErrors) as caught:
        load_scene(str(tmp_path / 'posed.yaml'))
    assert told in str(caught.value)


def test_an_angle_at_its_limit_may_be_given():
    doll = load_doll('doll')
    for joint in doll.joints:
        for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True):
            for limit in pair or ():
                degrees = math.degrees(limit)
                assert Placement(doll, angles={name: math.radians(degrees)}).angles
