"""Where a camera stands that sees all: against a projection by matrices."""
from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip('viser')

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.viewer.drawing.framing import (
    MARGIN,
    bounding_spheres,
    box_center,
    home_position,
    sees_all,
)

FOV = 0.8


def projected(position, look_at, aspect, points):
    """Points (n, 3) m in the picture, (n, 2): within -1 and 1 is seen; behind is infinite.

    By the matrices of OpenGL's gluLookAt and gluPerspective.
    """
    z = (position - look_at) / np.linalg.norm(position - look_at)
    x = np.cross((0.0, 0.0, 1.0), z)
    x /= np.linalg.norm(x)
    view = np.stack((x, np.cross(z, x), z))
    eye = (points - position) @ view.T
    scale = 1 / math.tan(FOV / 2)
    drawn = eye[:, :2] * (scale / aspect, scale) / -eye[:, 2:]
    return np.where(eye[:, 2:] < 0, drawn, np.inf)


def outsides(centres, radii):
    """Points (m, 3) m all over balls."""
    random = np.random.default_rng(1).normal(size=(300, 3))
    random /= np.linalg.norm(random, axis=1)[:, None]
    return (centres[:, None] + radii[:, None, None] * random).reshape(-1, 3)


@pytest.mark.parametrize('aspect', [1.2, 390 / 464, 3.0])
@pytest.mark.parametrize('spread', [0.1, 3.0, 500.0])
def test_all_is_seen_and_large(aspect, spread):
    random = np.random.default_rng(7)
    centres = random.normal(size=(20, 3)) * spread + (1e3, -2e3, 5.0)
    radii = random.uniform(0.05, 0.3, 20)
    look_at = box_center(centres, radii)
    position = home_position(centres, radii, look_at, FOV, aspect)
    drawn = abs(projected(position, look_at, aspect, outsides(centres, radii)))
    assert drawn.max() < 1
    assert sees_all(position, look_at, FOV, aspect, centres, radii)
    # The least distance is a MARGIN of this one: there, some ball is at an edge.
    near = look_at + (position - look_at) / (1.1 * MARGIN)
    if spread > 1:
        assert abs(projected(near, look_at, aspect, outsides(centres, radii))).max() > 1
        assert not sees_all(near, look_at, FOV, aspect, centres, radii)


def test_what_is_behind_is_not_seen():
    centre, radius = np.zeros((1, 3)), np.array([0.1])
    assert not sees_all(np.array((3.0, 0, 0)), np.array((4.0, 0, 0)), FOV, 1.0, centre, radius)
    assert not sees_all(np.zeros(3), np.zeros(3), FOV, 1.0, centre, radius)


def test_a_doll_that_hangs_is_framed_with_the_ground_it_will_fall_on():
    with Simulation(load_scene('drop')) as simulation:
        centres, radii = bounding_spheres(simulation.scene, simulation.state)
    lowest = (centres[:, 2] - radii).min()
    assert len(centres) == 20 and lowest == pytest.approx(0.0, abs=1e-9)
