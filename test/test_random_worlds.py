"""The doll falls over random scenes of boxes, spheres, cylinders, capsules, planes, hulls, meshes
and height fields: no energy from nothing, nothing passed.
"""
from __future__ import annotations

import numpy as np
import pytest
from random_worlds import DEEPEST, EXCESS, distance, fall, world

pytest.importorskip('numba')

from ragdoll_ros import Box, HeightField, Hull, Plane, StaticBody

STARTS, CHUNK = 1000, 50


@pytest.mark.parametrize(('accuracy', 'first'), [('draft', 1), ('normal', 2), ('exact', 3)])
def test_a_few_falls_over_random_worlds_are_good(accuracy, first):
    for number in range(first, first + 3):
        found = fall(world(number), accuracy)
        assert not found.is_bad, (number, found)


@pytest.mark.slow
@pytest.mark.parametrize('first', range(0, STARTS, CHUNK))
def test_none_of_a_thousand_falls_over_random_worlds_is_bad(first):
    """Energy to EXCESS of that of the fall, depth to DEEPEST."""
    found = {number: fall(world(number)) for number in range(first, first + CHUNK)}
    assert {number: one for number, one in found.items() if one.is_bad} == {}
    assert sum(one.overlaps for one in found.values()) < CHUNK / 5, 'most of them are falls'


def test_the_worlds_have_bodies_of_all_kinds():
    kinds = {body.shape.kind for number in range(20) for body in world(number).bodies}
    assert kinds == {'box', 'sphere', 'cylinder', 'capsule', 'plane', 'hull', 'mesh',
                     'height_field'}


def test_depths_are_those_of_closed_forms():
    """What finds nothing bad would find a point that is 2 mm deep."""
    assert DEEPEST < 2e-3 and EXCESS < 1e-4
    points = np.array([[0.1, 0.2, 0.498], [0.1, 0.2, 0.502]])
    cube = Box((1, 1, 1))
    corners, faces = cube.mesh()
    for shape in (cube, Hull(corners, faces)):
        np.testing.assert_allclose(distance(StaticBody('it', shape), points), (-2e-3, 2e-3),
                                   atol=1e-12)
    level = StaticBody('it', Plane(), (0.0, 0.0, 0.5))
    np.testing.assert_allclose(distance(level, points), (-2e-3, 2e-3), atol=1e-12)
    x = np.linspace(-1, 1, 5)
    slope = StaticBody('it', HeightField(np.tile(0.498 + 0.1 * (x - 0.1), (4, 1)), (2.0, 2.0)))
    np.testing.assert_allclose(distance(slope, points), (0.0, 4e-3), atol=1e-12)
