"""Surfaces of triangles as static bodies: height fields and meshes."""
from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from test_static_bodies import ACCURACIES, G, inclined, loose, scene, states

from ragdoll_ros import (
    Box,
    Capsule,
    Cylinder,
    HeightField,
    Hull,
    Mesh,
    Placement,
    RagdollError,
    Scene,
    Simulation,
    Sphere,
    StaticBody,
    load_scene,
)
from ragdoll_ros.files.scene import save_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.mesh import OPEN

pytest.importorskip('numba')

BOX = Box((0.2, 0.2, 0.2))
CUBE = (np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2,
        Box((1, 1, 1)).mesh()[1])


def flat(cells, size):
    """A body, level at height 0, of square cells."""
    return StaticBody('flat', HeightField(np.zeros((cells + 1, cells + 1)), (size, size)))


def triangle(*corners):
    return StaticBody('triangle', Mesh(np.array(corners, float), [[0, 1, 2]]))


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('angle', [0.0, 0.6])
@pytest.mark.parametrize('shape, turn, tolerance', [
    (Sphere(0.1), (0, 0, 0, 1), 1e-6), (BOX, (0, 0, 0, 1), 1e-6), (BOX, (0, 0, 0.3, 1), 1e-6),
    (Capsule(0.1, 0.3), (1, 0, 0, 1), 1e-6)])
def test_a_slope_of_triangles_is_a_plane(shape, turn, tolerance, angle, accuracy):
    """What rolls or slides over thirty of their edges at 3 m/s and more ends where it does on a
    plane.
    """
    start = loose(shape, position=(-2, 0.0537, 0.1), velocity=(3, 0, 0), orientation=turn)
    placement, body, ground = inclined(start, flat(80, 12.0), angle)
    on_triangles, _ = states(scene(placement, [body], restitution=0.0), 1.0, accuracy)
    on_plane, _ = states(scene(placement, ground=ground, restitution=0.0), 1.0, accuracy)
    np.testing.assert_allclose(on_triangles[:, 0, :3], on_plane[:, 0, :3], atol=tolerance)


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('faces', [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
def test_what_is_larger_than_a_flat_face_stands_on_all_its_corners(faces, accuracy):
    """Those at both ends of the diagonal too, which two triangles have: over any of the corners."""
    square = Mesh([[-.2, -.2, 0], [.2, -.2, 0], [.2, .2, 0], [-.2, .2, 0]], faces)
    table = StaticBody('table', square)
    for x, y in ((0, 0), (.15, .15), (-.15, .15), (.15, -.15), (-.15, -.15)):
        board = loose(Box((1, 1, 0.1)), position=(x, y, 0.05))
        on_table, _ = states(scene(board, [table], restitution=0.0), 0.5, accuracy)
        np.testing.assert_allclose(on_table[-1, 0, :3], (x, y, 0.05), atol=2e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('shape', [Sphere(0.1), BOX, Capsule(0.1, 0.3), Cylinder(0.1, 0.2)])
def test_what_falls_on_flat_triangles_rests_at_its_height(shape, accuracy):
    start = loose(shape, position=(0.013, 0.0537, 0.5), velocity=(0.3, 0.1, 0),
                  orientation=(0.3, 0.2, 0.1, 1))
    rows, measures = states(scene(start, [flat(20, 4.0)], restitution=0.3), 6.0, accuracy)
    heights = {'sphere': (0.1,), 'box': (0.1,), 'capsule': (0.1, 0.25), 'cylinder': (0.1,)}
    assert min(abs(rows[-1, 0, 2] - each) for each in heights[shape.kind]) < 1e-4
    assert measures['energy_excess_J'] < 1e-3 * G * 0.5


def valley(columns):
    """A parabolic valley along x, sampled at so many columns over 4 m."""
    x = np.linspace(-2, 2, columns)
    return StaticBody('valley', HeightField(np.tile(0.15 * x ** 2, (3, 1)), (4, 2)))


def rolled(x, radius, seconds):
    """X of a ball that rolls in z = 0.15 x^2 from rest with its centre at ``x``: its centre follows
    the parallel curve, with the inertia of 7/5 of its mass.
    """
    foot = np.linspace(-2, 2, 20001)
    slope = 0.3 * foot
    normal = np.stack([-slope, np.ones_like(slope)]) / np.hypot(1, slope)
    place, height = foot + radius * normal[0], 0.15 * foot ** 2 + radius * normal[1]
    way = np.concatenate([[0], np.cumsum(np.hypot(np.diff(place), np.diff(height)))])
    along, up = CubicSpline(way, place), CubicSpline(way, height)
    begin = float(CubicSpline(place, way)(x))
    motion = solve_ivp(lambda _, y: (y[1], -G * up(y[0], 1) * 5 / 7), (0, seconds), (begin, 0.0),
                       rtol=1e-11, atol=1e-12)
    return float(along(motion.y[0, -1])), float(up(begin))


def test_a_ball_in_a_sampled_valley_converges_to_the_smooth_one():
    """The error falls at least in proportion to the spacing of the grid."""
    radius, seconds = 0.1, 1.0
    smooth, height = rolled(-1.0, radius, seconds)
    found = []
    for columns in (21, 41, 81, 161):
        start = loose(Sphere(radius), position=(-1.0, 0.0137, height + 1e-4))
        rows, _ = states(scene(start, [valley(columns)], friction=5.0, restitution=0.0), seconds,
                         'exact')
        found.append(abs(rows[-1, 0, 0] - smooth))
    orders = np.log2(np.array(found[:-1]) / found[1:])
    assert found[-1] < 5e-3, found
    assert np.log2(found[0] / found[-1]) / 3 > 0.9, (found, orders)


@pytest.mark.parametrize('side', [1, -1])
@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('shape', [Sphere(0.05), Box((0.1, 0.1, 0.1)), Capsule(0.03, 0.2),
                                   Cylinder(0.05, 0.1)])
def test_nothing_passes_a_triangle_at_20_m_s(shape, accuracy, side):
    """From either side, spinning, in the middle and near an edge."""
    body = triangle((-1, -1, 0), (1, -1, 0), (0, 1, 0))
    for place in ((0, -0.2), (0.3, -0.9), (-0.4, -0.1)):
        start = loose(shape, position=(*place, side * 1.0), velocity=(0, 0, -20 * side),
                      spin=(7, 3, 5))
        free = dataclasses.replace(scene(start, [body], restitution=0.5), gravity=(0, 0, 0))
        rows, _ = states(free, 0.15, accuracy)
        assert (side * rows[:, 0, 2]).min() > 0.02
        assert side * rows[-1, 0, 9] > 0


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_cube_of_triangles_is_a_box(accuracy):
    """A ball that falls beside the middle of its top, over its edge and on, as over a box."""
    cube = StaticBody('cube', Mesh(*CUBE), position=(0, 0, 0.5))
    box = StaticBody('cube', Box((1, 1, 1)), position=(0, 0, 0.5))
    for start in ({'position': (0.1, 0.05, 1.1), 'velocity': (1, 0.2, 0)},
                  {'position': (0.52, 0.11, 1.3)}, {'position': (0.53, 0.52, 1.3)}):
        ball = loose(Sphere(0.1), **start)
        law = {'restitution': 0.3, 'friction': 0.3}
        on_mesh, _ = states(scene(ball, [cube], **law), 0.8, accuracy)
        on_box, _ = states(scene(ball, [box], **law), 0.8, accuracy)
        np.testing.assert_allclose(on_mesh[:, 0, :3], on_box[:, 0, :3],
                                   atol=1e-6 if accuracy == 'exact' else 1e-5)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_box_that_slides_into_a_wall_of_triangles_is_stopped(accuracy):
    """A concave edge is no contact of its own, and the wall behind it is one."""
    vertices = [[-3, -1, 0], [0, -1, 0], [0, -1, 1], [-3, 1, 0], [0, 1, 0], [0, 1, 1]]
    faces = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    body = StaticBody('corner', Mesh(vertices, faces))
    start = loose(BOX, position=(-1, 0.05, 0.1), velocity=(3, 0, 0))
    rows, _ = states(scene(start, [body], friction=0.0, restitution=0.0), 1.0, accuracy)
    assert rows[-1, 0, 0] == pytest.approx(-0.1, abs=1e-5)
    assert rows[-1, 0, 2] == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_doll_falls_on_terrain(accuracy):
    """No energy from nothing, at most 1 mm deep, and at rest at the end."""
    placed = load_scene('terrain')
    deepest = 0.0
    with Simulation(placed, accuracy=accuracy) as simulation:
        for _ in range(1500):
            state = simulation.advance()
            deepest = max(deepest, depth(placed, state))
            if simulation.asleep:
                break
        measures = simulation.measures()
        assert np.isfinite(state.rows).all()
        fallen = G * placed.dolls[0].doll.mass * placed.dolls[0].position[2]
        assert measures['energy_excess_J'] < 1e-3 * fallen
        assert deepest < 1e-3
        assert simulation.asleep


def depth(placed, state):
    """Depth, m, of the corners of the bones' boxes below the triangles, and of their vertices in
    the bones.
    """
    surface = placed.bodies[0].shape.triangles
    vertices, _ = placed.bodies[0].shape.mesh()
    deepest, corners = 0.0, []
    for bone, row in zip(placed.bones, state.rows, strict=True):
        for part in bone.shape.parts:
            position = row[:3] + rotation.rotate(row[3:7], np.array(part.position))
            turn = rotation.multiply(row[3:7], np.array(part.orientation))
            local = rotation.rotate(rotation.inverse(turn), vertices - position)
            deepest = max(deepest, -part.shape.signed_distance(local).min())
            if part.kind == 'box':
                corners.append(position + rotation.rotate(turn, part.shape.mesh()[0]))
    return max(deepest, below(surface, np.concatenate(corners)))


def below(surface, points):
    """Depth, m, of the deepest of points (p, 3) m below the triangles over or under them."""
    a, b, c = np.moveaxis(surface.corners, 1, 0)
    x, y, _ = points.T[:, :, None]

    def turned(u, v):
        along = v - u
        return along[:, 0] * (y - u[:, 1]) - along[:, 1] * (x - u[:, 0]) >= 0
    point, face = np.nonzero(turned(a, b) & turned(b, c) & turned(c, a))
    heights = np.einsum('ij,ij->i', points[point] - a[face], surface.normals[face])
    return -heights.min(initial=0.0)


def test_edges_know_by_how_much_the_surface_bends():
    """Of a cube 90 degrees down, none across a side's diagonal; inside out, as much up."""
    edges = Mesh(*CUBE).triangles.edges
    assert sorted(np.round(edges, 12).ravel().tolist()) == [0.0] * 12 + [1.0] * 24
    inside_out = Mesh(CUBE[0], CUBE[1][:, ::-1]).triangles.edges
    assert sorted(np.round(inside_out, 12).ravel().tolist()) == [-1.0] * 24 + [0.0] * 12
    assert (triangle((0, 0, 0), (1, 0, 0), (0, 1, 0)).shape.triangles.edges == OPEN).all()


def test_triangles_far_away_cost_nothing():
    """A tick over a quarter of a million triangles costs at most 1.2 of one over eighteen."""
    def make(cells):
        start = loose(BOX, position=(0.1, 0.2, 0.1), spin=(0, 0, 0.5))
        placed = scene(start, [flat(cells, 1.0 * cells)], friction=0.0, restitution=0.0)
        return Simulation(placed)

    with make(3) as few, make(355) as many:
        assert len(many.scene.bodies[0].shape.triangles.corners) > 250_000
        costs = np.zeros((2, 400))
        for tick in range(400):  # in turn, so that both meet the same load
            for number, simulation in enumerate((few, many)):
                began = time.perf_counter()
                simulation.advance()
                costs[number, tick] = time.perf_counter() - began
        np.testing.assert_allclose(few.state.rows, many.state.rows, atol=1e-9)
    one, other = np.median(costs, axis=1)
    assert other < 1.2 * one


@pytest.mark.parametrize('text, path, told', [
    ('height_field: {size: [1, 1], heights: [[0, 1]]}', 'bodies[0].shape.height_field.heights',
     'at least 2'),
    ('height_field: {size: [1, 0], heights: [[0, 1], [0, 1]]}',
     'bodies[0].shape.height_field.size[1]', 'above 0'),
    ('height_field: {size: [1, 1], heights: [[0, 1], [0, 1, 2]]}',
     'bodies[0].shape.height_field.heights', 'rows of heights'),
    ('height_field: {size: [1, 1], heights: [[0, 1], [0, .nan]]}',
     'bodies[0].shape.height_field.heights[1][1]', 'finite'),
    ('height_field: {size: [1, 1], heights: none.npy}', 'bodies[0].shape.height_field.heights',
     'a file'),
    ('height_field: {size: [1, 1], heights: flat.npy}',
     'bodies[0].shape.height_field.heights', 'rows of heights'),
    ('mesh: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces: [[0, 1, 3]]}',
     'bodies[0].shape.mesh.faces[0]', 'from 0 to 2'),
    ('mesh: {vertices: [[0, 0, 0], [1, 0, 0], [2, 0, 0]], faces: [[0, 1, 2]]}',
     'bodies[0].shape.mesh', 'area'),
    ('mesh: {file: none.stl}', 'bodies[0].shape.mesh.file', 'a file')])
def test_what_is_wrong_is_told_with_its_place(tmp_path, text, path, told):
    np.save(tmp_path / 'flat.npy', np.zeros(7))
    file = tmp_path / 'wrong.yaml'
    file.write_text(f'dolls: [{{doll: doll}}]\nbodies: [{{name: hill, shape: {{{text}}}}}]\n')
    with pytest.raises(RagdollError) as caught:
        load_scene(file)
    assert path in str(caught.value) and told in str(caught.value)


def test_surfaces_come_from_files_and_are_written_back(tmp_path):
    """A .npy, a greyscale picture and an STL; the file that is written names them."""
    imageio = pytest.importorskip('imageio.v3')
    trimesh = pytest.importorskip('trimesh')
    heights = np.random.default_rng(1).random((5, 7))
    np.save(tmp_path / 'hills.npy', heights)
    imageio.imwrite(tmp_path / 'hills.png', np.round(heights[::-1] * 255).astype(np.uint8))
    trimesh.Trimesh(*CUBE).export(tmp_path / 'cube.stl')
    file = tmp_path / 'world.yaml'
    file.write_text("""dolls: [{doll: doll, position: [0, 0, 3]}]
bodies:
  - {name: array, shape: {height_field: {size: [6, 4], heights: hills.npy, scale: 0.5}}}
  - {name: picture, shape: {height_field: {size: [6, 4], heights: hills.png, scale: 0.5}}}
  - {name: cube, shape: {mesh: {file: cube.stl, scale: [2, 2, 2]}}}
""")
    world = load_scene(file)
    array, picture, cube = (body.shape for body in world.bodies)
    np.testing.assert_array_equal(array.heights, 0.5 * heights)
    np.testing.assert_allclose(picture.heights, 0.5 * heights, atol=0.51 / 255)
    np.testing.assert_allclose(np.abs(cube.mesh()[0]), 1.0)
    assert (np.round(cube.triangles.edges, 6) >= 0).all()
    (tmp_path / 'other').mkdir()
    save_scene(world, tmp_path / 'other' / 'copy.yaml')
    assert load_scene(tmp_path / 'other' / 'copy.yaml') == world


@pytest.mark.parametrize('kind', ['glb', 'gltf'])
def test_gltf_is_turned_to_z_up(tmp_path, kind):
    """A box of 1 x 2 x 3 along glTF's axes, moved by its node by 5 m up, glTF's y; as in RViz its z
    is backwards then, our -y.
    """
    trimesh = pytest.importorskip('trimesh')
    made = trimesh.Scene()
    made.add_geometry(trimesh.creation.box((1, 2, 3)),
                      transform=trimesh.transformations.translation_matrix((0, 5, 1)))
    export = made.export(file_type=kind, **({'embed_buffers': True} if kind == 'gltf' else {}))
    (tmp_path / f'box.{kind}').write_bytes(export['model.gltf'] if kind == 'gltf' else export)
    (tmp_path / 'world.yaml').write_text(f"""dolls: [{{doll: doll, position: [0, 0, 9]}}]
bodies: [{{name: box, shape: {{mesh: {{file: box.{kind}, scale: [1, 1, 2]}}}}}}]
""")
    body, = load_scene(tmp_path / 'world.yaml').bodies
    vertices, _ = body.shape.mesh()
    np.testing.assert_allclose(vertices.min(axis=0), (-0.5, -2.5, 8), atol=1e-6)
    np.testing.assert_allclose(vertices.max(axis=0), (0.5, 0.5, 12), atol=1e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_hull_is_the_box_around_its_points(tmp_path, accuracy):
    """Of the corners of a box and of points within; a ball falls on it as on the box."""
    pytest.importorskip('trimesh')
    pytest.importorskip('scipy')
    rng = np.random.default_rng(3)
    points = np.concatenate([CUBE[0], rng.uniform(-0.45, 0.45, (20, 3))])
    file = tmp_path / 'stone.yaml'
    file.write_text(f"""dolls: [{{doll: doll}}]
bodies:
  - {{name: stone, shape: {{hull: {{vertices: {points.tolist()}}}}}, position: [0, 0, 0.5]}}
""")
    world = load_scene(file)
    stone, = world.bodies
    assert len(stone.shape.vertices) == 8
    save_scene(world, tmp_path / 'again.yaml')
    assert load_scene(tmp_path / 'again.yaml') == world
    ball = loose(Sphere(0.1), position=(0.52, 0.11, 1.3))
    law = {'restitution': 0.3, 'friction': 0.3}
    on_hull, _ = states(scene(ball, [stone], **law), 0.8, accuracy)
    box = StaticBody('box', Box((1, 1, 1)), position=(0, 0, 0.5))
    on_box, _ = states(scene(ball, [box], **law), 0.8, accuracy)
    np.testing.assert_allclose(on_hull[:, 0, :3], on_box[:, 0, :3],
                               atol=1e-6 if accuracy == 'exact' else 1e-5)


def test_a_hull_is_convex_and_closed():
    vertices, faces = CUBE
    for wrong, told in ((faces[:, ::-1], 'outside a face'), (faces[:-1], 'without a second')):
        with pytest.raises(RagdollError, match=told):
            Hull(vertices, wrong)


@pytest.mark.parametrize('text, told', [
    ('{hull: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}}', 'around a volume'),
    ('{mesh: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces: [[0, 1, 2]]}}, mass: 3',
     'a mesh never moves'),
    ('{plane: {}}, follow: exact', 'a plane never moves')])
def test_what_is_no_hull_or_may_not_move_is_refused(tmp_path, text, told):
    pytest.importorskip('trimesh')
    file = tmp_path / 'wrong.yaml'
    file.write_text(f'dolls: [{{doll: doll}}]\nbodies: [{{name: stone, shape: {text}}}]\n')
    with pytest.raises(RagdollError, match=told):
        load_scene(file)


def test_other_engines_refuse_surfaces():
    pytest.importorskip('mujoco')
    placed = Scene('s', (Placement(load_scene('drop').dolls[0].doll),), bodies=(flat(2, 2.0),))
    with pytest.raises(RagdollError, match='which has meshes and height fields'):
        Simulation(placed, engine='mujoco')


def test_a_surface_is_driven_by_nobody(tmp_path):
    file = tmp_path / 'wrong.yaml'
    file.write_text('dolls: [{doll: doll}]\nbodies: [{name: hill, mass: 3, shape: {height_field: '
                    '{size: [1, 1], heights: [[0, 1], [0, 1]]}}}]\n')
    with pytest.raises(RagdollError, match=r'bodies\[0\].mass.*a height_field never moves'):
        load_scene(file)
