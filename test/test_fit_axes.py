"""Axes of clusters: against a solver of another kind, and where there is nothing to solve."""
import numpy as np
import pytest
from specimens import SPECIMENS

from ragdoll_ros.fit.bodies.overlap import interior_points
from ragdoll_ros.fit.shapes.axes import MIN_ELONGATION, fit_axes, principal_components
from ragdoll_ros.fit.shapes.fitting import CANDIDATES, fit_best, fit_shape
from ragdoll_ros.model.shapes import SHAPES

UP = np.array([0.0, 0.0, 1.0])


def jacobi(matrix, rounds=60):
    """Eigenvalues and vectors by Jacobi's rotations: another method than LAPACK's."""
    a, v = matrix.copy(), np.eye(3)
    for _ in range(rounds):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if a[p, q] == 0:
                continue
            angle = np.arctan2(2 * a[p, q], a[q, q] - a[p, p]) / 2
            r = np.eye(3)
            r[p, p] = r[q, q] = np.cos(angle)
            r[p, q], r[q, p] = np.sin(angle), -np.sin(angle)
            a, v = r.T @ a @ r, v @ r
    return np.diag(a), v


def cloud(seed, spreads=(0.3, 0.12, 0.05), count=400):
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return random.normal(size=(count, 3)) * spreads @ turn.T, random.uniform(0.1, 2, count)


@pytest.mark.parametrize('seed', range(8))
def test_the_principal_axis_agrees_with_an_independent_solver(seed):
    points, areas = cloud(seed)
    mean = np.average(points, axis=0, weights=areas)
    covariance = sum(area * np.outer(p, p) for area, p in zip(areas, points - mean, strict=True))
    values, vectors = jacobi(covariance / areas.sum())
    axis = vectors[:, np.argmax(values)]
    axes = fit_axes(points, areas, UP)
    angle = np.arcsin(min(1.0, np.linalg.norm(np.cross(axes.frame[:, 2], axis))))
    assert axes.principal
    assert angle < 1e-6
    assert axes.frame[:, 2] @ UP >= 0
    ordered = np.sort(np.sqrt(values))[::-1]
    assert axes.elongation == pytest.approx(1 - ordered[1] / ordered[0], abs=1e-9)
    assert np.allclose(axes.frame.T @ axes.frame, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes.frame) == pytest.approx(1)


def test_a_sign_toward_the_child():
    points, areas = cloud(3)
    one, other = (fit_axes(points, areas, sign * UP).frame[:, 2] for sign in (1, -1))
    assert np.allclose(one, -other)


def test_area_counts_not_the_density_of_vertices():
    """A face full of tiny triangles does not turn the axis of the head."""
    points, areas = cloud(5)
    dense = np.repeat(points[:1], 1000, axis=0)
    plain = fit_axes(points, areas, UP).frame[:, 2]
    crowded = fit_axes(np.concatenate([points, dense]),
                       np.concatenate([areas, np.zeros(1000)]), UP).frame[:, 2]
    assert np.allclose(plain, crowded, atol=1e-9)


def test_a_ball_falls_back_to_the_bone():
    points, areas = cloud(1, spreads=(0.1, 0.099, 0.098))
    direction = np.array([0.6, 0.0, 0.8])
    axes = fit_axes(points, areas, direction)
    assert not axes.principal
    assert axes.elongation < MIN_ELONGATION
    assert np.allclose(axes.frame[:, 2], direction)


DEGENERATE = {
    'none': np.zeros((0, 3)), 'one': np.ones((1, 3)), 'two': np.array([[0, 0, 0], [1.0, 0, 0]]),
    'three': np.eye(3), 'line': np.outer(np.linspace(0, 1, 20), [0.3, 0.4, 0.5]),
    'plane': np.array([[x, y, 0] for x in range(5) for y in range(5)]) * 0.1,
    'one point': np.tile([0.1, 0.2, 0.3], (30, 1))}


@pytest.mark.parametrize('orientation', ['principal', 'bone'])
@pytest.mark.parametrize('weights', ['zero', 'even'])
@pytest.mark.parametrize('name', DEGENERATE)
def test_degenerate_clusters_have_axes_and_every_shape(name, weights, orientation):
    points = DEGENERATE[name]
    areas = np.zeros(len(points)) if weights == 'zero' else np.ones(len(points))
    axes = fit_axes(points, areas, UP, orientation)
    assert np.allclose(axes.frame.T @ axes.frame, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes.frame) == pytest.approx(1)
    for kind in CANDIDATES:
        fitted = fit_shape(points @ axes.frame, kind, 0.01, 0.01)
        assert min(fitted.shape.half_extents) >= 0.005 - 1e-12
        # In the middle of the points, which are their own mirror image or few; none are at 0.
        box = points if len(points) else np.zeros((1, 3))
        centre = axes.frame @ fitted.centre
        assert (centre >= box.min(axis=0) - 1e-12).all()
        assert (centre <= box.max(axis=0) + 1e-12).all()


def test_no_points_have_no_spread():
    deviations, vectors = principal_components(np.zeros((0, 3)), np.zeros(0))
    assert (deviations == 0).all()
    assert (vectors == np.eye(3)).all()


@pytest.mark.parametrize('solid', SPECIMENS.values(), ids=lambda solid: solid.kind)
def test_distance_against_the_nearest_of_many_surface_points(solid):
    corners, triangles = solid.mesh()
    random = np.random.default_rng(0)
    weights = random.dirichlet((1, 1, 1), size=(len(triangles), 60))
    skin = np.einsum('tsk,tkd->tsd', weights, corners[triangles]).reshape(-1, 3)
    points = random.uniform(-0.5, 0.5, (40, 3))
    nearest = np.linalg.norm(points[:, None] - skin[None], axis=2).min(axis=1)
    # The mesh of 20 corners a circle cuts 1.2 % off the radius; between samples lie 2 cm.
    assert np.abs(np.abs(solid.signed_distance(points)) - nearest).max() < 0.025
    assert (solid.signed_distance(interior_points(solid)) <= 0).all()
    assert np.abs(solid.signed_distance(corners)).max() < 1e-9


@pytest.mark.parametrize('solid', [SPECIMENS[kind] for kind in SHAPES], ids=SHAPES)
def test_a_solid_is_recognised_by_its_skin(solid):
    corners, triangles = solid.mesh()
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), size=(len(triangles), 12))
    points = np.einsum('tsk,tkd->tsd', weights, corners[triangles]).reshape(-1, 3)
    points += (1, 2, 3)
    fitted, = fit_best([points], 0.01, 0.001)
    assert fitted.shape.kind == solid.kind
    assert np.allclose(fitted.centre, (1, 2, 3), atol=0.02)
    # Up to a twentieth of the skin may stay outside, so the fit may be a little smaller.
    assert fitted.shape.volume == pytest.approx(solid.volume, rel=0.15)
    assert fitted.coverage >= 0.95
