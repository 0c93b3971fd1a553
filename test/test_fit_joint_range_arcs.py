"""Sectors of the picture: from the anchor, between the limits of an angle."""
import numpy as np
import pytest

from ragdoll_ros.fit.picture import joint_range_arcs
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.shapes import Box


def doll(kind, axes, limits):
    box = Box((0.1, 0.1, 1.0))
    return Ragdoll('d', (Bone('a', box, 1, (0, 0, 1.5)), Bone('b', box, 1, (0, 0, 0.5))),
                   (Joint('a', 'b', kind, (0, 0, 1), axes, limits),))


def test_a_hinges_sector_goes_from_limit_to_limit():
    (number, points), = joint_range_arcs(doll('hinge', ((0, 1, 0),), ((0, np.pi / 2),)))
    assert number == 0
    for end in (0, -1):
        assert points[end] == pytest.approx((0, 0, 1))
    arms = points[1:-1] - (0, 0, 1)
    lengths = np.linalg.norm(arms, axis=1)
    assert np.ptp(lengths) < 1e-12 and 0.02 < lengths[0] < 0.5
    # Hanging down at zero; a quarter turn about left takes it backwards.
    assert arms[0] / lengths[0] == pytest.approx((0, 0, -1))
    assert arms[-1] / lengths[0] == pytest.approx((-1, 0, 0))


def test_free_and_fixed_angles_have_no_sector():
    assert joint_range_arcs(doll('fixed', (), ())) == []
    assert joint_range_arcs(doll('ball', ((0, 0, 1),), ())) == []
    partly_free = doll('ball', ((0, 0, 1),), ((-1, 1), None))
    assert [number for number, _ in joint_range_arcs(partly_free)] == [0, 1]
