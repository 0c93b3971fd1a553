"""How deep bones are in each other, against overlaps that are known."""
import dataclasses

import numpy as np
import pytest

pytest.importorskip('mujoco')

from ragdoll_ros import Bone, Box, Capsule, Cylinder, Placement, Ragdoll, Scene, Sphere
from ragdoll_ros.accuracy.crowds.depth import BoneDepth
from ragdoll_ros.accuracy.trajectory import Trajectory
from ragdoll_ros.model import rotation

QUARTER = rotation.from_axis_angle((1, 0, 0), np.pi / 2)


def pair(first, second):
    """Two bodies in a scene of their own."""
    return Scene('pair', tuple(Placement(Ragdoll(name, (Bone('bone', shape, 1.0, (0, 0, 0)),)))
                               for name, shape in (('a', first), ('b', second))))


@pytest.mark.parametrize(('first', 'second', 'offset', 'turn', 'depth'), [
    (Sphere(0.1), Sphere(0.2), (0.29, 0, 0), rotation.IDENTITY, 0.01),
    (Box((0.2, 0.4, 0.6)), Box((0.2, 0.2, 0.2)), (0, 0.28, 0.1), rotation.IDENTITY, 0.02),
    (Box((0.2, 0.4, 0.6)), Capsule(0.05, 0.2), (0, 0.345, 0), QUARTER, 0.005),
    (Cylinder(0.1, 0.4), Cylinder(0.1, 0.4), (0, 0.195, 0), rotation.IDENTITY, 0.005),
    (Sphere(0.1), Sphere(0.2), (0.31, 0, 0), rotation.IDENTITY, 0.0)])
def test_depth_of_two_shapes(first, second, offset, turn, depth):
    """The judge stops searching at 1e-6 m."""
    scales = BoneDepth(pair(first, second))
    found = scales.depths(np.array([(0, 0, 0), offset]), np.array([rotation.IDENTITY, turn]))
    assert found == pytest.approx([depth], abs=2e-6)


def test_what_starts_in_each_other_counts_from_when_it_is_apart():
    scales = BoneDepth(pair(Sphere(0.1), Sphere(0.1)))
    places = np.zeros((4, 2, 3))
    places[:, 1, 0] = (0.15, 0.18, 0.21, 0.19)
    moved = Trajectory.of_poses(np.arange(4.0), places)
    assert scales.deepest(moved) == pytest.approx(0.01, abs=2e-6)
    assert scales.deepest(moved.part(slice(0, 3))) == 0


def test_what_may_pass_through_each_other_has_no_depth():
    scene = dataclasses.replace(pair(Sphere(0.1), Sphere(0.2)), self_collision=False)
    places = np.zeros((1, 2, 3)), np.tile(rotation.IDENTITY, (1, 2, 1))
    assert BoneDepth(scene).deepest(Trajectory.of_poses(np.zeros(1), *places)) == 0


def test_neighbours_do_not_count():
    from ragdoll_ros import load_scene
    scene = load_scene('drop')
    placement = scene.dolls[0]
    poses = [placement.bone_pose(bone) for bone in scene.bones]
    moved = Trajectory.of_poses(np.zeros(1), np.array([[pose.position for pose in poses]]),
                                np.array([[pose.orientation for pose in poses]]))
    assert BoneDepth(scene).deepest(moved) < 1e-3
