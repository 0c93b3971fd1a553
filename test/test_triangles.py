"""Narrow phase of triangles: distances and normals against minimization of the distance."""
from __future__ import annotations

import numpy as np
import pytest
from kept_code import kept
from scipy.optimize import minimize
from test_collision import HULLS, ROWS, TABLES

from ragdoll_ros.model import rotation
from ragdoll_ros.model.mesh import Mesh
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.physics.engine.rigid.triangle_geoms import triangle_geoms
from ragdoll_ros.physics.kernels.collision.narrow_phase import collide, separation
from ragdoll_ros.physics.kernels.collision.shapes import (
    BOX,
    CAPSULE,
    CYLINDER,
    HULL,
    SPHERE,
    TRIANGLE,
    Shape,
)
from ragdoll_ros.physics.kernels.system import CONTACT_POINT, MAX_MANIFOLD_POINTS

STONE = 3
"""Of HULLS, one of 14 vertices."""

VERTICES = HULLS[STONE].vertices - HULLS[STONE].centroid
SIZES = {SPHERE: (0.2, 0.0, 0.0), CAPSULE: (0.1, 0.3, 0.0), BOX: (0.2, 0.3, 0.1),
         CYLINDER: (0.2, 0.3, 0.0), HULL: (float(TABLES.hulls['size'][STONE]), 0.0, 0.0)}


FACES = slice(TABLES.hulls['first_face'][STONE],
              TABLES.hulls['first_face'][STONE] + TABLES.hulls['face_count'][STONE])


@kept(error_model='numpy')
def measure(a, b, margin, out):
    return separation(a, b, 3.0), collide(a, b, margin, out)


def placed(kind, position, turn):
    return Shape(kind, SIZES[kind], tuple(map(float, position)), rotation.matrix(turn),
                 (0.0, 0.0, 0.0), int(ROWS[0].ctypes.data), STONE)


def geoms(vertices, faces, pose=None):
    """The triangles of a mesh as shapes."""
    found, _, _ = triangle_geoms(Mesh(vertices, faces).triangles, pose or Pose())
    return [Shape(TRIANGLE, tuple(each['size'].tolist()), tuple(each['position'].tolist()),
                  rotation.matrix(each['orientation']), tuple(each['edges'].tolist()))
            for each in found]


def least_distance(shape, corners):
    """Distance, m, of a shape from a triangle, by sequential quadratic programming."""
    size, best = shape.size, np.inf
    count = {SPHERE: 0, CAPSULE: 1, BOX: 3, CYLINDER: 3, HULL: 3}[shape.kind]
    box = {SPHERE: [], CAPSULE: [size[1]], BOX: list(size), CYLINDER: [size[0], size[0], size[1]],
           HULL: [size[0]] * 3}

    def point(x):
        local = np.zeros(3)
        local[3 - count:] = x[2:]
        return np.array(shape.position) + shape.rotation @ local

    def square(x):
        on = corners[0] + x[0] * (corners[1] - corners[0]) + x[1] * (corners[2] - corners[0])
        return float(((point(x) - on) ** 2).sum())
    limits = [{'type': 'ineq', 'fun': lambda x: 1 - x[0] - x[1]}]
    if shape.kind == CYLINDER:
        limits.append({'type': 'ineq', 'fun': lambda x: size[0] ** 2 - x[2] ** 2 - x[3] ** 2})
    if shape.kind == HULL:
        planes = TABLES.hull_faces[FACES]
        limits.append({'type': 'ineq', 'fun': lambda x: (
            planes['offset'] - planes['normal'] @ x[2:])})
    bounds = [(0, 1)] * 2 + [(-half, half) for half in box[shape.kind]]
    for start in np.random.default_rng(3).uniform(0, 0.3, (3, 2 + count)):
        found = minimize(square, start, method='SLSQP', bounds=bounds, constraints=limits,
                         options={'ftol': 1e-15, 'maxiter': 300})
        best = min(best, found.fun)
    return np.sqrt(max(best, 0.0)) - (size[0] if shape.kind <= CAPSULE else 0.0)


@pytest.mark.parametrize('kind', SIZES)
def test_the_gap_of_an_open_triangle_is_the_distance(kind):
    """In random poses, apart. That of a box or hull is its largest separation along an axis: above
    zero where it is apart, and no more than the distance. The rim of a cylinder may be taken for 1
    cm nearer.
    """
    early = 0.01 if kind == CYLINDER else 0.0
    random = np.random.default_rng(kind)
    out, checked = np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT), 0
    while checked < 60:
        corners = random.uniform(-0.6, 0.6, (3, 3))
        turn = rotation.normalized(random.normal(size=4))
        shape = placed(kind, random.uniform(-0.8, 0.8, 3), turn)
        triangle, = geoms(corners, [[0, 1, 2]])
        gap, count = measure(shape, triangle, 3.0, out)
        true = least_distance(shape, corners)
        if true < 1e-3:
            continue
        checked += 1
        assert gap < true + 1e-6
        assert gap > 0 or true < early
        if kind <= CAPSULE:
            assert gap == pytest.approx(true, abs=1e-6)
            assert count and out[:count]['gap'].min() == pytest.approx(true, abs=1e-6)
            np.testing.assert_allclose(np.linalg.norm(out[:count]['normal'], axis=1), 1)


@pytest.mark.parametrize('kind', SIZES)
@pytest.mark.parametrize('bend', [-0.3, 0.0, 0.3])
def test_normals_at_an_edge_lie_between_those_of_the_faces(kind, bend):
    """Over two triangles with a common edge along y, whatever is near it and above both."""
    vertices = [[0, -2, 0], [0, 2, 0], [2, 0, -2 * np.tan(bend / 2)],
                [-2, 0, -2 * np.tan(bend / 2)]]
    pair = geoms(vertices, [[0, 2, 1], [0, 1, 3]])
    random, found = np.random.default_rng(5), 0
    out = np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT)
    for _ in range(200):
        turn = rotation.normalized(random.normal(size=4))
        x, y = random.uniform(-0.2, 0.2), random.uniform(-1, 1)
        low = max(_support(kind, turn, pair_normal(t)) - np.dot(pair_normal(t), (x, y, 0))
                  for t in pair)
        shape = placed(kind, (x, y, low / np.cos(bend / 2) + 1e-3), turn)
        for triangle in pair:
            _, count = measure(shape, triangle, 0.05, out)
            for normal in out[:count]['normal']:
                found += 1
                assert abs(normal[1]) < 1e-9
                assert abs(np.arctan2(normal[0], normal[2])) < abs(bend) / 2 + 1e-9
                if bend <= 0:
                    np.testing.assert_allclose(normal, pair_normal(triangle), atol=1e-12)
    assert found > 100


def test_a_face_is_stopped_by_the_corner_of_a_tetrahedron():
    """The face of a box is 0.1 mm deep on a corner, anywhere on it: the box's center may be on
    either side of each triangle. One triangle at least has the corner, along the face's normal.
    """
    rng, depth, below = np.random.default_rng(5), 1e-4, 0
    out = np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    for _ in range(1000):
        corners = np.zeros((4, 3))
        corners[1:] = 0.3 * rng.normal(size=(3, 3))
        if np.linalg.det(corners[1:]) > 0:
            corners[[1, 2]] = corners[[2, 1]]
        normals = np.cross(corners[faces[:3, 1]], corners[faces[:3, 2]])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        n = rotation.normalized(rng.uniform(0.02, 1, 3) @ normals)
        if (corners[1:] @ n).max() > -0.03:
            continue
        turn = rotation.shortest_arc(np.array((0.0, 0.0, 1.0)), n)
        center = rotation.rotate(turn, np.array((*rng.uniform(-1, 1, 2) * (0.15, 0.25),
                                                 SIZES[BOX][2] - depth)))
        box = placed(BOX, center, turn)
        below += (normals @ center).min() < 0
        gaps, held = [], False
        for triangle in geoms(corners, faces):
            gap, count = measure(box, triangle, 0.0, out)
            gaps.append(gap)
            held |= any(abs(at['gap'] + depth) < 1e-9 and at['normal'] @ n > 1 - 1e-9
                        for at in out[:count])
        assert held
        assert min(gaps) == pytest.approx(-depth, abs=1e-9)
    assert below > 50


@pytest.mark.parametrize('kind', [BOX, HULL])
def test_a_corner_in_a_valley_is_stopped(kind):
    """It is below both faces, and seen along the normal of each above the other one: between them
    is what its depth times the slope is wide.
    """
    rng, out = np.random.default_rng(8), np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT)
    corners = {HULL: VERTICES, BOX: np.array(SIZES[BOX]) * np.array(
        [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])}[kind]
    for _ in range(300):
        slope, depth = rng.uniform(0.05, 0.6), 10 ** rng.uniform(-6, -3.5)
        pair = geoms([[0, -2, 0], [0, 2, 0], [2, 0, 2 * slope], [-2, 0, 2 * slope]],
                     [[0, 2, 1], [0, 1, 3]])
        while True:
            turn = rotation.normalized(rng.normal(size=4))
            turned = rotation.rotate(turn, corners)
            lowest = turned[turned[:, 2].argmin()]
            arms = np.delete(turned, turned[:, 2].argmin(), axis=0) - lowest
            # The others are above both faces.
            if (arms[:, 2] > slope * np.abs(arms[:, 0]) + 0.01).all():
                break
        place = np.array((rng.uniform(-1, 1) * depth * slope, rng.uniform(-0.5, 0.5), -depth))
        shape = placed(kind, place - lowest, turn)
        found = []
        for triangle in pair:
            _, count = measure(shape, triangle, 0.0, out)
            found += out[:count]['gap'].tolist()
        # By the nearer plane it is at least as deep as straight down over their common slope.
        assert found and min(found) <= -depth / np.sqrt(1 + slope ** 2) + 1e-12


def test_an_edge_in_a_notch_is_stopped():
    """Two walls meet in a valley; a box's edge leans into its end, on both borders at once: past
    the end of each by its depth times a slope.
    """
    rng, out = np.random.default_rng(11), np.zeros(MAX_MANIFOLD_POINTS, CONTACT_POINT)
    for _ in range(300):
        slope, lean, depth = rng.uniform(1.2, 3), rng.uniform(0.1, 0.6), 10 ** rng.uniform(-6, -3.5)
        walls = geoms([[0, 0, 0], [0, 0, -1], [1, slope, 0], [1, slope, -1], [1, -slope, 0],
                       [1, -slope, -1]], [[0, 1, 2], [1, 3, 2], [0, 4, 1], [1, 4, 5]])
        into = np.array((-np.cos(lean), 0.0, -np.sin(lean)))
        turn = rotation.multiply(rotation.from_axis_angle((0.0, 1.0, 0.0), -lean),
                                 rotation.from_axis_angle((0.0, 0.0, 1.0), np.pi / 4))
        half = np.array((0.2, 0.2, 0.4))
        aside = rng.uniform(-0.3, 0.3) * depth
        center = into * (depth - half[0] * np.sqrt(2)) + (0, aside, 0)
        box = Shape(BOX, tuple(half), tuple(map(float, center)), rotation.matrix(turn))
        gaps, found = [], []
        for wall in walls:
            gap, count = measure(box, wall, 0.0, out)
            gaps.append(gap)
            found += [(at['gap'], at['normal'] @ into) for at in out[:count]]
        assert found and all(against < 0 for _, against in found)
        # Along a normal between those of the box's faces, at 45 degrees.
        assert min(gap for gap, _ in found) < -0.3 * depth and min(gaps) < -0.3 * depth


def pair_normal(triangle):
    return triangle.rotation[:, 2]


def _support(kind, turn, normal):
    """Extent, m, of a shape against a normal."""
    x, y, z = rotation.rotate(rotation.inverse(turn), normal)
    size = SIZES[kind]
    return {SPHERE: size[0], CAPSULE: size[0] + size[1] * abs(z),
            BOX: size[0] * abs(x) + size[1] * abs(y) + size[2] * abs(z),
            CYLINDER: size[0] * np.hypot(x, y) + size[1] * abs(z),
            HULL: (VERTICES @ (-x, -y, -z)).max()}[kind]
