"""Bodies that no joint connects do not overlap at the start, or pass through each other."""
import fit_rigs
import numpy as np
import pytest
import wild_rigs
from fit_rigs import RIGS

from ragdoll_ros.fit.bodies.trim import trim_overlaps
from ragdoll_ros.fit.shapes.fitting import FittedShape
from ragdoll_ros.fit.skeleton.groups import BodyGroup
from ragdoll_ros.model.ragdoll import Bone
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Sphere

SHAPES = (Sphere(0.1), Box((0.2, 0.2, 0.2)), Capsule(0.1, 0.2), Cylinder(0.1, 0.2))


def deepest(first, second):
    """How deep two bodies are in each other by their surfaces' points, m: an independent measure.

    Rays through the faces of a mesh would be another; points of both meshes do for convex bodies.
    """
    points = [bone.pose.apply(bone.shape.mesh()[0]) for bone in (first, second)]
    return max(-float(bone.shape.signed_distance(bone.pose.apply_inverse(other)).min())
               for bone, other in ((first, points[1]), (second, points[0])))


def side_by_side(shape, depth):
    """Two bodies beside each other that no joint connects, on a third."""
    groups = [BodyGroup(0, [0], np.zeros(0, int), name='root'),
              BodyGroup(1, [1], np.zeros(0, int), parent=0, name='a'),
              BodyGroup(2, [2], np.zeros(0, int), parent=0, name='b')]
    reach = shape.half_extents[1]
    fits = [FittedShape(Box((0.1, 0.1, 0.1)), np.array([0, 0, 5.0])),
            FittedShape(shape, np.array([0, reach - depth / 2, 0])),
            FittedShape(shape, np.array([0, -reach + depth / 2, 0]))]
    return groups, fits, [np.eye(3)] * 3


@pytest.mark.parametrize('shape', SHAPES, ids=lambda shape: shape.kind)
def test_a_shallow_overlap_is_cut_away_on_both_sides(shape):
    groups, fits, frames = side_by_side(shape, 0.02)
    _, a, b = trim_overlaps(groups, fits, frames)
    # What is left is within the millimetre from which on bodies count as overlapping.
    assert a.centre[1] - b.centre[1] >= a.shape.half_extents[1] + b.shape.half_extents[1] - 0.001
    # The far sides stay where they were, and no more is cut off than overlapped, 0.01 m each.
    outside = 2 * shape.half_extents[1] - 0.01
    assert a.centre[1] + a.shape.half_extents[1] == pytest.approx(outside, abs=1e-3)
    assert a.shape.half_extents[1] >= shape.half_extents[1] - 0.0055
    assert a.shape.half_extents == pytest.approx(b.shape.half_extents, abs=1e-4)


@pytest.mark.parametrize('shape', SHAPES, ids=lambda shape: shape.kind)
def test_a_deep_overlap_stays(shape):
    groups, fits, frames = side_by_side(shape, 0.08)
    assert [fit.shape for fit in trim_overlaps(groups, fits, frames)] == [fit.shape for fit in fits]


@pytest.mark.parametrize('name', RIGS)
def test_bodies_without_a_joint_are_separate_or_excluded_from_collision(name):
    doll = fit_rigs.fitted(name).doll
    for i, first in enumerate(doll.bones):
        for second in doll.bones[:i]:
            if frozenset((first.name, second.name)) not in doll.excluded_pairs:
                assert deepest(first, second) <= 0.001 + 1e-9, (first.name, second.name)


def test_two_thighs_of_a_person_meet_and_so_collide():
    doll = wild_rigs.fitted('feet_of_nothing-smooth').doll
    thighs = frozenset(f'{wild_rigs.M}{side}UpLeg' for side in ('Left', 'Right'))
    assert thighs not in doll.excluded_pairs
    assert isinstance(doll.bone(min(thighs)), Bone)
