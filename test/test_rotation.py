"""Rotations against closed forms and against each other."""
import math

import numpy as np
import pytest

from ragdoll_ros.model import rotation

RANDOM = rotation.normalized(np.random.default_rng(1).normal(size=(50, 4)))


def test_matrix_and_quaternion_go_round():
    for q in RANDOM:
        back = rotation.from_matrix(rotation.matrix(q))
        assert rotation.angle_between(q, back) < 1e-14


def test_products_are_products_of_matrices():
    a, b = RANDOM[:25], RANDOM[25:]
    assert rotation.matrix(rotation.multiply(a, b)) == pytest.approx(
        rotation.matrix(a) @ rotation.matrix(b), abs=1e-14)


@pytest.mark.parametrize('pitch', [0.3, math.pi / 2, math.pi / 2 - 1e-9, -math.pi / 2, -1.2])
def test_rpy_goes_round_even_where_pitch_is_straight_up(pitch):
    q = rotation.from_rpy(0.3, pitch, -2.0)
    assert rotation.angle_between(q, rotation.from_rpy(*rotation.to_rpy(q))) < 1e-14


def test_rpy_is_about_fixed_axes_x_then_y_then_z():
    turns = [rotation.matrix(rotation.from_axis_angle(np.eye(3)[i], angle))
             for i, angle in enumerate((0.1, 0.2, 0.3))]
    expected = turns[2] @ turns[1] @ turns[0]
    assert rotation.matrix(rotation.from_rpy(0.1, 0.2, 0.3)) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize('vector', [(0, 0, 0), (1e-12, 0, 0), (0.3, -0.2, 0.1), (0, 3.1, 0)])
def test_rotation_vectors_go_round(vector):
    assert rotation.rotation_vector(rotation.from_rotation_vector(vector)) == pytest.approx(
        vector, abs=1e-14)


def test_shortest_arc_turns_one_direction_into_the_other():
    for a, b in [((1, 0, 0), (0, 1, 0)), ((0, 0, 1), (0, 0, -1)), ((1, 2, 3), (-3, 1, 2))]:
        turned = rotation.rotate(rotation.shortest_arc(np.array(a), np.array(b)), a)
        assert rotation.normalized(turned) == pytest.approx(rotation.normalized(b), abs=1e-12)
