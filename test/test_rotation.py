"""Rotations against closed forms and against each other."""
import math

import numpy as np
import pytest

from ragdoll_ros.model import rotation

RANDOM = rotation.normalized(np.random.default_rng(1).normal(size=(50, 4)))


AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -2, 0.5)]
ANGLES = [0.0, 1e-9, 0.7, -2.0, math.pi - 1e-6, math.pi, 5.0]


def rodrigues(vector):
    """R = 1 + sin a [n] + (1 - cos a) [n]^2 of a rotation vector a n, [n] w = n x w."""
    angle = np.linalg.norm(vector)
    across = np.cross(np.divide(vector, angle or 1), np.eye(3)).T
    return np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across


@pytest.mark.parametrize('angle', ANGLES)
@pytest.mark.parametrize('axis', AXES)
def test_a_rotation_about_an_axis_is_rodrigues(axis, angle):
    vector = angle * rotation.normalized(axis)
    right = rodrigues(vector)
    v = np.array((0.3, -0.5, 0.7))
    for q in (rotation.from_axis_angle(axis, angle), rotation.from_rotation_vector(vector)):
        assert rotation.matrix(q) == pytest.approx(right, abs=1e-14)
        assert rotation.rotate(q, v) == pytest.approx(right @ v, abs=1e-14)
        assert rotation.rotate(rotation.inverse(q), v) == pytest.approx(right.T @ v, abs=1e-14)


@pytest.mark.parametrize('angle', ANGLES)
@pytest.mark.parametrize('axis', AXES)
def test_the_angle_between_two_is_that_of_the_shorter_way(axis, angle):
    """And a rotation vector leads that way, whichever of q and -q it is taken from."""
    by = rotation.from_axis_angle(axis, angle)
    shorter = angle - 2 * math.pi if angle > math.pi else angle
    for sign in (1, -1):
        found = rotation.angle_between(RANDOM, sign * rotation.multiply(RANDOM, by))
        assert found == pytest.approx(np.full(50, abs(shorter)), abs=1e-14)
        vector = rotation.rotation_vector(sign * by)
        assert rodrigues(vector) == pytest.approx(rodrigues(angle * rotation.normalized(axis)),
                                                  abs=1e-14)
        assert np.linalg.norm(vector) == pytest.approx(abs(shorter), abs=1e-14)


@pytest.mark.parametrize('vector', [(0, 0, 0), (1e-5, -2e-5, 3e-5), (0.1, 0, 0.2), (1, -2, 1.5)])
def test_the_mean_of_a_turn_is_that_of_its_matrices(vector):
    """By Gauss and Legendre at 20 points, exact to rounding; below 1e-4 rad, to third order."""
    points, weights = np.polynomial.legendre.leggauss(20)
    mean = sum(weight / 2 * rodrigues((1 + point) / 2 * np.array(vector))
               for point, weight in zip(points, weights, strict=True))
    assert rotation.mean_rotation_matrix(np.array(vector)) == pytest.approx(mean, abs=1e-12)


@pytest.mark.parametrize('angles', [(0.3, -0.4, 2.0), (-3.0, 1.5, 0.1), (0, 0, -0.5)])
def test_xyz_are_about_x_then_the_new_y_then_the_new_z(angles):
    """Turns about axes that turn along are multiplied in their order."""
    x, y, z = (angle * axis for angle, axis in zip(angles, np.eye(3), strict=True))
    q = rotation.from_matrix(rodrigues(x) @ rodrigues(y) @ rodrigues(z))
    assert rotation.to_euler_xyz(q) == pytest.approx(angles, abs=1e-14)


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


@pytest.mark.parametrize('stretch', [np.diag(sizes) for sizes in (
    (1.0, 1.0, 1.0), (2.0, 0.5, 1.5), (3.0, 1.0, -2.0))])
def test_the_spin_of_the_nearest_rotation_is_its_derivative(stretch):
    """Centred differences of rotations that turn while they are stretched along axes askew."""
    askew = rodrigues((0.3, -0.2, 0.9))

    def at(time):
        growth = askew @ (stretch * (1 + 0.4 * time)) @ askew.T
        return rodrigues(np.array((0.5, 1.0, -0.7)) * (1 + time)) @ growth

    h = 1e-5
    earlier, later = rotation.nearest_rotation(at(-h)), rotation.nearest_rotation(at(h))
    turned = rotation.rotation_vector(rotation.multiply(later, rotation.inverse(earlier)))
    spin = rotation.nearest_rotation_spin(at(0.0), (at(h) - at(-h)) / (2 * h))
    assert spin == pytest.approx(turned / (2 * h), abs=1e-8)
