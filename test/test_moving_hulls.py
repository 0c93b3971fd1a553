"""Hulls of bodies that move: as the box that they are, driven, loose, and as links of a robot."""
from __future__ import annotations

import math

import numpy as np
import pytest
from test_robot_bodies import refusal, stl
from test_robot_bodies import scene as robot_scene

from ragdoll_ros import (
    Bone,
    Box,
    Capsule,
    Cylinder,
    Follow,
    Ground,
    HeightField,
    Hull,
    Mesh,
    Placement,
    Plane,
    Ragdoll,
    Scene,
    Simulation,
    Sphere,
    StaticBody,
    load_limits,
    load_scene,
    save_scene,
)
from ragdoll_ros.files.robots.mesh_file import convex_hull
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.model import rotation
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.scene import Material
from ragdoll_ros.model.shapes import Part
from ragdoll_ros.physics.rigid_body import GroundHeights

pytest.importorskip('numba')

SIZE = (0.3, 0.4, 0.3)
GOLDEN = (1 + math.sqrt(5)) / 2
FLOOR = Ground()
TILTED = rotation.from_rpy(0.1, 0.15, 0.05)
TURN = rotation.from_rpy(0.3, -0.5, 1.1)


def hull_of(size=SIZE):
    """The hull of the corners of a box."""
    return Hull(*Box(size).mesh())


def icosahedron():
    """One with edges of 2 m."""
    points = [np.roll((0, a, b * GOLDEN), turn) for a in (-1, 1) for b in (-1, 1)
              for turn in range(3)]
    points = np.array(points)
    near = np.isclose(np.linalg.norm(points[:, None] - points, axis=2), 2)
    faces = [(i, j, k) for i in range(12) for j in range(i) for k in range(j)
             if near[i, j] and near[j, k] and near[k, i]]
    outward = [face if np.linalg.det(points[list(face)]) > 0 else face[::-1] for face in faces]
    return points, np.array(outward)


def body(name, shape, mass=1.0, **start):
    return Placement(Ragdoll(name, (Bone(name, shape, mass, (0, 0, 0)),)), **start)


def world(*placements, bodies=(), ground=FLOOR, **material):
    law = Material(**{'friction': 0.5, 'restitution': 0.2} | material)
    return Scene('world', placements, ground, law, bodies=bodies)


def run(made, seconds, accuracy='normal', twist=None):
    """States (t, n, 13); the body `robot` is driven at ``twist``."""
    with Simulation(made, accuracy=accuracy) as simulation:
        rows = []
        for _ in range(round(seconds / simulation.step)):
            if twist:
                simulation.drive_body('robot', twist=twist)
            rows.append(simulation.advance().rows.copy())
        return np.array(rows), simulation.energy_excess, simulation.work[0]


def test_mass_properties_of_an_icosahedron():
    """Anywhere, at any turn: volume 5/12 (3 + 5^.5) a^3, moments phi^2 a^2 m / 10."""
    points, faces = icosahedron()
    assert len(faces) == 20
    hull = Hull(rotation.rotate(TURN, points) + np.array((3, -2, 1)), faces)
    assert hull.volume == pytest.approx(5 / 12 * (3 + math.sqrt(5)) * 8, rel=1e-12)
    assert hull.centroid == pytest.approx((3, -2, 1), abs=1e-12)
    moment = 5.0 * GOLDEN ** 2 * 4 / 10
    np.testing.assert_allclose(hull.turned_inertia(5.0, np.eye(3)), moment * np.eye(3), atol=1e-11)


def test_a_compound_of_hulls_is_that_of_their_boxes():
    parts = [(Box((0.2, 0.3, 0.5)), (0.1, 0.2, 0.3), TURN), (Box(SIZE), (-0.2, 0, 0), (0, 0, 0, 1))]
    boxes = Compound(tuple(Part(*part) for part in parts))
    hulls = Compound(tuple(Part(hull_of(box.size), *pose) for box, *pose in parts))
    np.testing.assert_allclose(hulls.inertia_matrix(2.0), boxes.inertia_matrix(2.0), rtol=1e-12)
    pose, same = hulls.principal_pose(), boxes.principal_pose()
    np.testing.assert_allclose(np.concatenate(pose), np.concatenate(same), atol=1e-12)


def test_its_height_is_that_of_its_lowest_vertex():
    """So that a tilted one above the ground does not count as one that begins within it."""
    hull = Hull(*icosahedron())
    stone = body('stone', hull, position=(0, 0, 1.91), orientation=TILTED)
    vertices = rotation.rotate(TILTED, hull.vertices) + stone.position
    made = world(stone)
    with Simulation(made) as simulation:
        heights = GroundHeights(made)(simulation.state)
        assert heights[0] == pytest.approx(vertices[:, 2].min(), abs=1e-12)
        assert heights[0] > 0 and not simulation.initial_overlaps


@pytest.mark.parametrize('accuracy', ('draft', 'normal', 'exact'))
@pytest.mark.parametrize('floor', ('ground', 'plane'))
def test_a_loose_hull_falls_tips_and_slides_as_a_box_does(accuracy, floor):
    """Its corners are the box's, and so is its patch of friction: to rounding, which one second of
    tumbling multiplies by some 1e4.
    """
    on = {'ground': Ground()} if floor == 'ground' else {
        'ground': None, 'bodies': (StaticBody('floor', Plane()),)}
    for start in ({'position': (0, 0, 0.6), 'orientation': TURN, 'velocity': (1, 0.3, 0),
                   'spin': (1, 2, 0.5)},
                  {'position': (0, 0, 0.15), 'velocity': (2, 0.5, 0), 'spin': (0, 0, 3)}):
        hull, box = (run(world(body('stone', shape, 2.0, **start), **on), 1.0, accuracy)[0]
                     for shape in (hull_of(), Box(SIZE)))
        np.testing.assert_allclose(hull[..., :3], box[..., :3], atol=1e-10)


def test_a_loose_hull_rests_on_a_static_box_as_a_box_does():
    """Two triangles have each face, and their common corners' friction may turn it a little."""
    table = StaticBody('table', Box((1, 1, 0.5)), position=(0, 0, 0.25))
    hull, box = (run(world(body('stone', shape, 2.0, position=(0.1, 0, 0.72), velocity=(1, 0, 0)),
                           bodies=(table,)), 1.0)[0] for shape in (hull_of(), Box(SIZE)))
    assert abs(box[-1, 0, 2] - 0.65) < 1e-4
    np.testing.assert_allclose(hull[..., :3], box[..., :3], atol=5e-5)


SHAPES = {'ball': (Sphere(0.1), 0.3), 'capsule': (Capsule(0.1, 0.3), 0.25),
          'cylinder': (Cylinder(0.1, 0.3), 0.15), 'box': (Box((0.2, 0.3, 0.4)), 0.2)}
APART = {'draft': 3e-3, 'normal': 1e-3, 'exact': 1e-4}
"""m: how far a body may be that tumbles for half a second after a blow whose instant is known to
1e-7 m, where it lands on other steps."""


@pytest.mark.parametrize('accuracy', APART)
@pytest.mark.parametrize('kind', SHAPES)
def test_a_driven_hull_pushes_as_a_box_does(kind, accuracy):
    """It is tilted, so that a corner or an edge meets at one point: where a line touches, the
    place of the impulse on it is not unique.
    """
    shape, height = SHAPES[kind]
    twist = (2, 0, 0, 0, 0, 0.3)
    (hull, _, work), (box, _, same) = (run(world(
        body('thing', shape, position=(0, 0.03, height)),
        body('robot', robot, position=(-0.5, 0.1, 0.32), orientation=TILTED, follow=Follow())),
        0.6, accuracy, twist) for robot in (hull_of(), Box(SIZE)))
    assert box[-1, 0, 0] > 0.2 and same > 0.5
    np.testing.assert_allclose(hull[..., :3], box[..., :3], atol=APART[accuracy])
    assert work == pytest.approx(same, rel=0.1)


def test_contacts_of_a_driven_hull_are_those_of_a_box():
    """What it carries at rest: the same corners of the patch, and in sum the weight."""
    def found(shape):
        made = world(body('thing', Box((0.2, 0.2, 0.1)), position=(0.01, 0.02, 0.2)),
                     body('robot', shape, position=(0, 0, 0), follow=Follow()), ground=None)
        with Simulation(made) as simulation:
            simulation.run(50)
            contacts = simulation.contacts
        points, place = np.unique(contacts.positions.round(5), axis=0, return_inverse=True)
        return points, np.bincount(place.ravel(), contacts.forces), contacts.b
    hull, box = found(hull_of()), found(Box(SIZE))
    np.testing.assert_allclose(hull[0], box[0], atol=1e-5)
    assert set(hull[2]) == set(box[2]) == {1}
    assert hull[1].sum() == pytest.approx(9.8, rel=1e-6)


@pytest.mark.parametrize('accuracy', ('draft', 'normal', 'exact'))
def test_a_doll_that_is_hit_moves_as_by_a_box_and_gains_no_more_than_the_work(accuracy):
    """Of the ten bones, over the first .15 s from the blow on; later the fall is another one."""
    doll = load_scene('drop').dolls[0].doll
    (hull, excess, work), (box, _, same) = (run(world(
        Placement(doll, position=(0, 0, 0.02)),
        body('robot', robot, position=(-0.6, 0.1, 0.4), follow=Follow())), 1.0, accuracy,
        (2, 0, 0, 0, 0, 0)) for robot in (hull_of(), Box(SIZE)))
    first = int(np.argmax(np.abs(box[:, :-1, 7]).max(axis=1) > 1.0))
    assert 10 < first < 60 and work > 50
    np.testing.assert_allclose(hull[:first + 15, :-1, :3], box[:first + 15, :-1, :3], atol=1e-3)
    assert work == pytest.approx(same, rel=0.1)
    # The account's own errors are 1e-5 of the energy: docs/accuracy.md.
    assert excess < 1e-3 * work


@pytest.mark.parametrize('accuracy', ('draft', 'normal', 'exact'))
def test_nothing_passes_a_thin_hull_at_20_m_s(accuracy):
    """A plate of 1 cm is driven into a ball and a doll at rest, and a doll is thrown at one."""
    plate, doll = hull_of((0.01, 2, 2)), load_scene('drop').dolls[0].doll
    rows, _, _ = run(world(
        Placement(doll, position=(0, 0, 0)), body('ball', Sphere(0.03), position=(0.4, 0.3, 0.5)),
        body('robot', plate, position=(-0.5, 0, 0.5), follow=Follow()), ground=None), 0.2, accuracy,
        (20, 0, 0, 0, 0, 0))
    assert rows[-1, -1, 0] == pytest.approx(3.5, abs=0.01)
    assert (rows[-1, :-1, 0] > rows[-1, -1, 0]).all()
    rows, _, _ = run(world(
        Placement(doll, position=(-1, 0, 0), velocity=(20, 0, 0), spin=(1, 5, 3)),
        body('robot', plate, position=(0, 0, 0.5), follow=Follow()), ground=None), 0.3, accuracy)
    assert (rows[-1, :-1, 0] < 0).all()


ARM = """<robot name="arm"><link name="foot"/>
<link name="upper"><collision><origin xyz="0.4 0 0" rpy="0 0 0.2"/>
  <geometry><mesh filename="link.stl" scale="1 1 0.5"/></geometry></collision>
  <collision><geometry><sphere radius="0.08"/></geometry></collision></link>
<link name="hand"><collision><geometry><mesh filename="link.stl" scale="0.3 0.3 0.3"/></geometry>
  </collision></link>
<joint name="shoulder" type="continuous"><parent link="foot"/><child link="upper"/>
  <axis xyz="0 0 1"/></joint>
<joint name="wrist" type="fixed"><parent link="upper"/><child link="hand"/>
  <origin xyz="0.8 0 0"/></joint></robot>"""
ENTRY = '{name: arm, urdf: r.urdf, meshes: hull, follow: exact, position: [-0.2, -0.8, 1.2]}'


@pytest.fixture
def arm(tmp_path):
    """Writes the mesh of the arm's links, a double wedge; returns its six points."""
    pytest.importorskip('trimesh')
    pytest.importorskip('scipy')
    points = np.concatenate([np.eye(3), -np.eye(3)]) * (0.4, 0.1, 0.12)
    faces = [(a, b, c)[::x * y * z] for a, x in ((0, 1), (3, -1)) for b, y in ((1, 1), (4, -1))
             for c, z in ((2, 1), (5, -1))]
    (tmp_path / 'link.stl').write_bytes(stl(points[np.array(faces)]))
    return points


def test_links_of_a_robot_have_hulls(tmp_path, arm):
    made = robot_scene(tmp_path, ENTRY, r_urdf=ARM)
    upper, hand = (made.dolls[-2].doll.root, made.dolls[-1].doll.root)
    assert [part.kind for part in upper.shape.parts] == ['sphere', 'hull']
    part = upper.shape.parts[1]
    assert part.position == pytest.approx((0.4, 0, 0))
    assert part.shape.volume == pytest.approx(4 / 3 * 0.4 * 0.1 * 0.06, rel=1e-6)
    assert sorted(map(tuple, hand.shape.parts[0].shape.vertices.round(6))) == sorted(
        map(tuple, (0.3 * arm).round(6)))
    save_scene(made, tmp_path / 'copy.yaml')
    assert load_scene(tmp_path / 'copy.yaml') == made


def test_a_robot_of_meshes_hits_a_person_and_the_blow_is_reported(tmp_path, arm):
    """Its arm turns at 4 rad/s towards the chest, which it meets at 0.8 m from its axis."""
    (tmp_path / 'r.urdf').write_text(ARM)
    (tmp_path / 'world.yaml').write_text(
        'ground: {}\nmaterial: {friction: 0.6, restitution: 0}\n'
        f'dolls: [{{doll: man, position: [0.45, 0, 0]}}]\nbodies: [{ENTRY}]\n')
    speed, blows = 4.0, []
    with Simulation(load_scene(tmp_path / 'world.yaml')) as simulation:
        simulation.record_impacts(load_limits())
        for tick in range(50):
            simulation.drive_body('arm', joint_angles={'shoulder': 0.01 * speed * tick},
                                  rates={'shoulder': speed})
            simulation.advance()
            blows += simulation.impacts
        (work, _), pressed = simulation.work, simulation.contact_impulses[-2:]
    hits = [blow for blow in blows if blow.against.startswith('arm_')]
    assert hits and work > 10
    # What moves by y is pushed by y, by more than the first blow.
    assert -pressed[:, 1].sum() > hits[0].impulse > 5
    # The first blow is on one at rest; no point of the arm is farther than 0.92 m from the axis.
    assert 0.5 * speed * 0.8 < hits[0].speed < speed * 0.92


def test_several_hulls_make_one_body(tmp_path):
    """An L of two hulls, at a pose of its own, is that of two boxes; it is saved and read again."""
    def text(kind):
        shapes = ', '.join(f'{{{shape}, position: {place}}}' for shape, place in (
            (kind((0.4, 0.2, 0.1)), [0.1, 0, 0]), (kind((0.1, 0.2, 0.5)), [-0.05, 0, 0.3])))
        return (f'dolls: [{{doll: doll, position: [3, 0, 1]}}]\nground: {{}}\nbodies:\n'
                f'  - {{name: L, mass: 3, shapes: [{shapes}], position: [0, 0, 0.4], '
                'orientation: [0.1, 0.2, 0.3, 0.9], velocity: [1, 0, 0]}\n')

    def of_corners(size):
        vertices, faces = Box(size).mesh()
        return f'hull: {{vertices: {vertices.tolist()}, faces: {faces.tolist()}}}'
    scenes = []
    for name, kind in (('boxes', lambda size: f'box: {{size: {list(size)}}}'),
                       ('hulls', of_corners)):
        (tmp_path / f'{name}.yaml').write_text(text(kind))
        scenes.append(load_scene(tmp_path / f'{name}.yaml'))
    save_scene(scenes[1], tmp_path / 'copy.yaml')
    assert load_scene(tmp_path / 'copy.yaml') == scenes[1]
    boxes, hulls = (run(made, 0.8)[0][:, -1, :3] for made in scenes)
    np.testing.assert_allclose(hulls, boxes, atol=1e-8)
    # As URDF has no hulls, the box around each stands for it.
    assert to_urdf(scenes[1].dolls[-1].doll).count('<box ') == 4


def test_a_robot_that_moves_has_no_triangles_of_their_own(tmp_path, arm):
    entry = ENTRY.replace('meshes: hull', 'meshes: exact')
    (tmp_path / 'link.stl').write_bytes(stl(np.eye(3)[None]))
    said = refusal(tmp_path, entry, r_urdf=ARM)
    assert '`meshes: hull`, `hulls` or `box`: no other moves' in said


def stone(seed, count=14, size=0.15):
    """A convex stone at its centre of mass and principal axes."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points *= size * rng.uniform(0.7, 1.2, 3) / np.linalg.norm(points, axis=1)[:, None]
    whole = Compound((Part(convex_hull(points)),))
    return whole.in_frame(whole.principal_pose())


FLAT = Mesh([[-6, -6, 0], [6, -6, 0], [6, 6, 0], [-6, 6, 0]], [[0, 1, 2], [0, 2, 3]])
ROWS, COLUMNS = np.mgrid[-3:3:25j, -3:3:25j]
FLOORS = {'ground': {}, 'mesh': {'ground': None, 'bodies': (StaticBody('floor', FLAT),)},
          'field': {'ground': None, 'bodies': (StaticBody(
              'floor', HeightField(0.05 * np.sin(2 * ROWS) * np.cos(3 * COLUMNS), (6, 6))),)},
          'hull': {'ground': None, 'bodies': (StaticBody(
              'floor', hull_of((12, 12, 1)), position=(0, 0, -0.5)),)}}


@pytest.mark.parametrize('accuracy', ('draft', 'normal', 'exact'))
@pytest.mark.parametrize('floor', ('mesh', 'hull'))
def test_a_loose_hull_tumbles_on_surfaces_as_a_box_does(floor, accuracy):
    """Over its first blow and tumble; on the mesh both meet the same triangles."""
    start = {'position': (0.3, -0.4, 0.5), 'orientation': TURN, 'velocity': (1, 0.3, 0),
             'spin': (1, 2, 0.5)}
    hull, box = (run(world(body('stone', shape, 2.0, **start), **FLOORS[floor]), 0.6, accuracy)[0]
                 for shape in (hull_of(), Box(SIZE)))
    assert box[-1, 0, 2] < 0.3
    np.testing.assert_allclose(hull[..., :3], box[..., :3], atol=APART[accuracy])


@pytest.mark.parametrize('accuracy', ('draft', 'normal', 'exact'))
def test_a_hull_hits_a_hull_as_a_box_does_a_box(accuracy):
    """In the air, at a corner; momentum and angular momentum stay to rounding of the solve."""
    (hulls, excess, _), (boxes, _, _) = (run(world(
        body('a', shape, 1.0, position=(0, 0, 0), orientation=TURN),
        body('b', shape, 2.0, position=(-1, 0.1, 0.12), velocity=(3, 0, 0), spin=(0.5, 1, 2)),
        ground=None), 0.6, accuracy) for shape in (hull_of(), Box(SIZE)))
    assert boxes[-1, 0, 7] > 1
    np.testing.assert_allclose(hulls[..., :3], boxes[..., :3], atol=APART[accuracy])
    momentum = hulls[:, 0, 7:10] + 2 * hulls[:, 1, 7:10]
    np.testing.assert_allclose(momentum[:, :2], np.tile((6, 0), (len(hulls), 1)), atol=1e-10)
    assert excess < 1e-6


@pytest.mark.parametrize('count', (1, 2, 3, 5, 6, 8, 12, 40))
def test_a_stack_of_hulls_stands_as_high_as_its_bodies(count):
    size = (0.3, 0.4, 0.1)
    made = world(*(body(f'brick_{k}', hull_of(size), position=(0, 0, (k + 0.5) * size[2]))
                   for k in range(count)))
    rows, excess, _ = run(made, 0.5)
    # What rests is at most 2 um in what it stands on: twice TOUCHING of the kernels.
    np.testing.assert_allclose(rows[-1, :, 2], (np.arange(count) + 0.5) * size[2],
                               atol=2e-6 * count)
    np.testing.assert_allclose(rows[-1, :, :2], 0, atol=1e-6 * count)
    assert excess < 1e-6


@pytest.mark.parametrize('floor', FLOORS)
@pytest.mark.parametrize('count', (1, 3, 8))
def test_a_pile_of_stones_comes_to_rest_without_gaining_energy(count, floor):
    rng = np.random.default_rng(count)
    made = world(*(body(f'stone_{k}', stone(k), 2.0, orientation=rotation.from_rpy(
        *rng.normal(size=3)), position=(*(0.1 * rng.normal(size=2)), 0.4 + 0.4 * k))
        for k in range(count)), **FLOORS[floor])
    with Simulation(made) as simulation:
        simulation.run(round(5 / simulation.step))
        state = simulation.state
        assert simulation.energy_excess < 1e-6
        assert simulation.asleep
    # The lowest point of the waves is at -0.05 m; the smallest stone is 0.05 m thick.
    assert state.positions[:, 2].min() > (-0.03 if floor == 'field' else 0.02)


@pytest.mark.parametrize('accuracy', ('draft', 'normal', 'exact'))
@pytest.mark.parametrize('floor', ('mesh', 'hull'))
def test_no_hull_passes_a_surface_at_20_m_s(floor, accuracy):
    """A triangle has no thickness; the plate is 1 cm thick."""
    bodies = FLOORS['mesh']['bodies'] if floor == 'mesh' else (StaticBody(
        'plate', hull_of((6, 6, 0.01))),)
    made = world(body('stone', stone(3), 2.0, position=(0.1, 0.2, 1), velocity=(1, 0, -20),
                      spin=(3, -8, 2)), ground=None, bodies=bodies)
    rows, _, _ = run(made, 0.3, accuracy)
    assert rows[-1, 0, 9] > 0 and rows[:, 0, 2].min() > 0.04


def test_what_begins_within_a_hull_is_told_and_comes_out():
    """By the shortest way, up, slowly: it gains no more than the height."""
    made = world(body('stone', hull_of(), position=(0, 0, 0.58)),
                 bodies=(StaticBody('table', hull_of((2, 2, 0.5)), position=(0, 0, 0.25)),))
    with Simulation(made) as simulation:
        overlap, = simulation.initial_overlaps
        assert overlap.depth == pytest.approx(0.07, abs=1e-6)
        simulation.run(200)
        assert simulation.state.positions[0] == pytest.approx((0, 0, 0.65), abs=2e-3)
        assert simulation.energy_excess < 1.001 * 9.81 * 0.07
