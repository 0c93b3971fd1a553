"""Meshes that one hull fits badly become several hulls, by V-HACD: brackets, channels, links."""
from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from test_robot_bodies import refusal
from test_robot_bodies import scene as robot_scene

from ragdoll_ros import RagdollError, Simulation, Sphere, load_scene, save_scene
from ragdoll_ros.files.robots.hull_decomposition import read_hulls
from ragdoll_ros.files.robots.mesh_file import convex_hull
from ragdoll_ros.model import rotation

trimesh = pytest.importorskip('trimesh')
pytest.importorskip('scipy')
pytest.importorskip('vhacdx')

VOXELS = 66
"""Along the longest edge of a mesh: int(1.5 * 100000 ** 0.33) - 1, as V-HACD has it."""

L_BOXES = [((0, 0, 0), (0.1, 0.2, 0.5)), ((0, 0, 0.4), (0.4, 0.2, 0.5))]
U_BOXES = [((-0.25, -0.15, 0), (0.25, 0.15, 0.1)), ((-0.25, -0.15, 0), (-0.15, 0.15, 0.4)),
           ((0.15, -0.15, 0), (0.25, 0.15, 0.4))]
"""Lower and upper corners, m. The L stands on its stem, so that its arm is at the top."""


def prism(outline, triangles, width, start=0.0):
    """Of an outline (n, 2) in x and z, counter-clockwise, from y = start; split into triangles."""
    count = len(outline)
    points = np.array([(x, start + y, z) for y in (0, width) for x, z in outline], float)
    faces = [tuple(triangle) for triangle in triangles]
    faces += [(c + count, b + count, a + count) for a, b, c in triangles]
    for here in range(count):
        there = (here + 1) % count
        faces += [(there, here, here + count), (there, here + count, there + count)]
    made = trimesh.Trimesh(points, faces, process=False)
    assert made.is_volume
    return made


def bracket(arm=0.4):
    return prism([(0, 0), (0.1, 0), (0.1, 0.4), (arm, 0.4), (arm, 0.5), (0, 0.5)],
                 [(0, 1, 2), (0, 2, 5), (2, 3, 4), (2, 4, 5)], 0.2)


def channel():
    return prism([(-0.25, 0), (0.25, 0), (0.25, 0.4), (0.15, 0.4), (0.15, 0.1), (-0.15, 0.1),
                  (-0.15, 0.4), (-0.25, 0.4)],
                 [(0, 1, 4), (1, 2, 3), (1, 3, 4), (0, 4, 5), (0, 5, 6), (0, 6, 7)], 0.3, -0.15)


def bucket():
    """A box without a lid and without thickness, 1 m of edge, on z = 0."""
    box = trimesh.creation.box((1, 1, 1))
    box.apply_translation((0, 0, 0.5))
    return trimesh.Trimesh(box.vertices, box.faces[box.face_normals[:, 2] < 0.5], process=False)


def written(mesh, folder, name='part.stl'):
    path = Path(folder) / name
    mesh.export(path)
    return path


def inside(points, hulls, margin=0.0):
    """Mask (p,) of points (p, 3) in one of the hulls, or beyond its faces by less than a margin."""
    found = np.zeros(len(points), bool)
    for hull in hulls:
        faces = hull.triangles
        offsets = np.einsum('ti,ti->t', faces.normals, faces.corners[:, 0])
        found |= (points @ faces.normals.T <= offsets + margin).all(axis=1)
    return found


def depth(points, boxes):
    """(p,) m: how deep points are in the one of the boxes in which they are deepest, or the
    distance from the nearest, negative.
    """
    def of(lower, upper):
        beyond = np.maximum(np.array(lower) - points, points - np.array(upper))
        return -np.where(beyond.max(axis=1) < 0, beyond.max(axis=1),
                         np.linalg.norm(np.maximum(beyond, 0), axis=1))
    return np.max([of(*box) for box in boxes], axis=0)


def state(file, seconds):
    """Rows (n, 13) of the bones at the end."""
    with Simulation(load_scene(file)) as simulation:
        for _ in range(round(seconds / simulation.step)):
            rows = simulation.advance().rows
        return rows.copy()


@pytest.mark.parametrize(('mesh', 'boxes', 'cuts'), [
    (bracket(), L_BOXES, 2 * 0.1 * 0.2), (channel(), U_BOXES, 4 * 0.1 * 0.3)], ids=['L', 'U'])
def test_hulls_are_the_mesh_to_a_voxel(tmp_path, mesh, boxes, cuts):
    """In place everywhere; in volume, where two of them meet: there may be a slit, or they overlap,
    by less than a voxel over the area of the ``cuts``, m^2.
    """
    hulls = read_hulls(written(mesh, tmp_path))
    voxel = np.ptp(mesh.vertices, axis=0).max() / VOXELS
    lower, upper = mesh.bounds
    points = np.random.default_rng(1).uniform(lower - 0.1, upper + 0.1, (50_000, 3))
    deep = depth(points, boxes)
    assert inside(points, hulls, voxel)[deep > 0].all() and (deep > 0).sum() > 1000
    assert not inside(points, hulls)[deep < -voxel].any()
    missing = np.prod(upper - lower + 0.2) * (inside(points, hulls) != (deep > 0)).mean()
    assert missing <= cuts * voxel
    assert sum(hull.volume for hull in hulls) == pytest.approx(mesh.volume, abs=cuts * voxel)
    assert 2 <= len(hulls) <= 5 and max(len(hull.vertices) for hull in hulls) <= 32


@pytest.mark.parametrize(('kind', 'height'), [('hulls', 0.1), ('hull', 0.4)])
def test_a_ball_falls_through_the_gap_of_a_channel(tmp_path, kind, height):
    """Onto the floor within; over one hull there is no gap. What is saved is the same scene."""
    written(channel(), tmp_path)
    file = tmp_path / 'world.yaml'
    file.write_text(f"""ground: {{}}
material: {{friction: 0.6, restitution: 0}}
dolls: [{{doll: doll, position: [5, 0, 0.05]}}]
bodies:
  - {{name: ball, mass: 1, shape: {{sphere: {{radius: 0.05}}}}, position: [0.03, 0.02, 0.8]}}
  - {{name: channel, shape: {{{kind}: {{file: part.stl}}}}}}
""")
    made = load_scene(file)
    save_scene(made, tmp_path / 'copy.yaml')
    assert load_scene(tmp_path / 'copy.yaml') == made
    ball = state(file, 2.0)[-1]
    # Contacts are known to 1e-7 m; the file has floats of 32 bits.
    assert ball[:3] == pytest.approx((0.03, 0.02, height + 0.05), abs=1e-6)
    assert np.abs(ball[7:]).max() < 1e-6


@pytest.mark.parametrize(('arm', 'kind', 'falls'), [
    (0.3, 'hulls', False), (0.3, 'hull', True), (0.4, 'hulls', True), (0.4, 'hull', True)])
def test_a_loose_bracket_stands_or_falls_by_its_own_centre_of_mass(tmp_path, arm, kind, falls):
    """It is put on its stem. Where its centre of mass is beyond it falls, onto the edges at the end
    of the stem and of the arm. One hull has its mass in the corner as well.
    """
    # Area, x and z of the stem, the arm and the triangle that one hull adds.
    pieces = np.array([(0.04, 0.05, 0.2), (0.1 * arm, arm / 2, 0.45),
                       (0.2 * (arm - 0.1), 0.1 + (arm - 0.1) / 3, 0.8 / 3)])
    if kind == 'hulls':
        pieces = pieces[:2]
    x, z = pieces[:, 0] @ pieces[:, 1:] / pieces[:, 0].sum()
    assert (x > 0.1) == falls
    height = z
    if falls:
        along = np.array((arm - 0.1, 0.4)) / np.hypot(arm - 0.1, 0.4)
        height = abs((x - 0.1) * along[1] - z * along[0])
    written(bracket(arm), tmp_path)
    (tmp_path / 'world.yaml').write_text(f"""ground: {{}}
material: {{friction: 0.6, restitution: 0}}
dolls: [{{doll: doll, position: [5, 0, 0.05]}}]
bodies: [{{name: bracket, mass: 2, shape: {{{kind}: {{file: part.stl}}}}, position: [0, 0, 1e-4]}}]
""")
    # A slit at a cut, of less than a voxel, 7.6 mm, shifts the centre of mass by some .2 mm.
    assert state(tmp_path / 'world.yaml', 3.0)[-1, 2] == pytest.approx(height, abs=1e-3)


URDF = """<robot name="r"><link name="base"><collision><geometry><sphere radius="0.3"/></geometry>
  </collision></link>
<link name="hand"><collision><origin xyz="0 0 0.1" rpy="0 0 0.5"/><geometry>
  <mesh filename="part.stl" scale="2 -2 2"/></geometry></collision>
  <collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="wrist" type="revolute"><parent link="base"/><child link="hand"/>
  <origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>"""


@pytest.mark.parametrize('follow', ['', ', follow: exact'])
def test_a_link_of_a_robot_is_one_body_of_hulls(tmp_path, follow):
    """Mirrored and of twice the size; it is saved and read again."""
    mesh = channel()
    written(mesh, tmp_path)
    made = robot_scene(tmp_path, f'{{name: a, urdf: r.urdf, meshes: hulls{follow}}}', r_urdf=URDF)
    shapes = ({placed.name: placed.doll.root.shape for placed in made.dolls[1:]} if follow else
              {body.name: body.shape for body in made.bodies})
    assert list(shapes) == ['a_base', 'a_hand']
    ball, *hulls = shapes['a_hand'].parts
    assert ball.shape == Sphere(0.05) and 2 <= len(hulls) <= 8
    cuts, voxel = 4 * 0.1 * 0.3, np.ptp(mesh.vertices, axis=0).max() / VOXELS
    assert sum(part.shape.volume for part in hulls) == pytest.approx(
        8 * mesh.volume, abs=8 * cuts * voxel)
    assert hulls[0].position == pytest.approx((0, 0, 0.1))
    assert rotation.angle_between(hulls[0].orientation, rotation.from_rpy(0, 0, 0.5)) < 1e-9
    save_scene(made, tmp_path / 'copy.yaml')
    assert load_scene(tmp_path / 'copy.yaml') == made


def digest(hulls):
    return hashlib.sha256(b''.join(hull.vertices.tobytes() + hull.faces.tobytes()
                                   for hull in hulls)).hexdigest()


DIGEST = """import sys
from test_hull_decomposition import Path, digest, read_hulls
print(digest(read_hulls(Path(sys.argv[1]))))"""


def test_hulls_are_the_same_bits_in_every_process(tmp_path):
    """Of a turned ring, which makes the most pieces that are merged again."""
    ring = trimesh.creation.torus(0.3, 0.08)
    ring.apply_transform(trimesh.transformations.euler_matrix(0.4, 0.7, 0.2))
    path = written(ring, tmp_path)
    found = read_hulls(path)
    assert len(found) == 16 and max(len(hull.vertices) for hull in found) == 32
    done = subprocess.run([sys.executable, '-c', DIGEST, path], capture_output=True, text=True,
                          check=True, env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    assert done.stdout.strip() == digest(found)


def test_a_convex_mesh_is_one_hull_with_its_vertices(tmp_path):
    """And a ball with a dent of 1 % of its volume."""
    ball = trimesh.creation.icosphere(2)
    dented = ball.copy()
    dented.vertices[np.abs(dented.vertices[:, 2] - 1) < 1e-6, 2] = 0.8
    assert dented.is_volume and dented.volume < ball.volume
    for mesh in (ball, dented):
        hull, = read_hulls(written(mesh, tmp_path))
        expected = mesh.vertices if mesh is ball else mesh.vertices[mesh.vertices[:, 2] != 0.8]
        expected = expected.astype(np.float32).astype(float)
        np.testing.assert_array_equal(np.unique(hull.vertices, axis=0),
                                      np.unique(expected, axis=0))


def test_a_mesh_of_overlapping_boxes_is_split(tmp_path):
    """The sum of their volumes, 4, is more than that of the hull, 3.5; their union has 3."""
    parts = [trimesh.creation.box((2, 1, 1)), trimesh.creation.box((1, 1, 2))]
    parts[0].apply_translation((0.5, 0, 0))
    parts[1].apply_translation((0, 0, 0.5))
    hulls = read_hulls(written(trimesh.util.concatenate(parts), tmp_path))
    assert sum(hull.volume for hull in hulls) == pytest.approx(3, abs=3 * 2 / VOXELS)


def test_surfaces_that_touch_are_a_hull_each(tmp_path):
    """A table of five boxes: exactly they, without V-HACD."""
    boxes = [((-.5, -.3, .7), (.5, .3, .75)), *(((x, y, 0), (x + .05, y + .05, .7))
                                                for x in (-.5, .45) for y in (-.3, .25))]
    parts = []
    for lower, upper in boxes:
        parts.append(trimesh.creation.box(np.subtract(upper, lower)))
        parts[-1].apply_translation(np.add(lower, upper) / 2)
    hulls = read_hulls(written(trimesh.util.concatenate(parts), tmp_path))
    assert len(hulls) == 5
    found = sorted(np.concatenate([hull.vertices.min(axis=0), hull.vertices.max(axis=0)]).tolist()
                   for hull in hulls)
    np.testing.assert_allclose(found, sorted(np.ravel(box).tolist() for box in boxes), atol=1e-7)
    assert sum(hull.volume for hull in hulls) == pytest.approx(.03 + 4 * .7 * .05 ** 2, rel=1e-6)


def test_an_open_mesh_is_its_walls(tmp_path):
    """Which get the thickness of a voxel: a ball lies on the floor of a bucket."""
    written(bucket(), tmp_path)
    (tmp_path / 'world.yaml').write_text("""material: {friction: 0.6, restitution: 0}
dolls: [{doll: doll, position: [5, 0, 0.05]}]
bodies:
  - {name: ball, mass: 1, shape: {sphere: {radius: 0.2}}, position: [0.05, 0, 1.5]}
  - {name: bucket, shape: {hulls: {file: part.stl}}}
""")
    hulls = read_hulls(tmp_path / 'part.stl')
    rng = np.random.default_rng(2)
    for axis, at in ((0, -0.5), (0, 0.5), (1, -0.5), (1, 0.5), (2, 0.0)):
        wall = rng.uniform((-0.45, -0.45, 0.05), (0.45, 0.45, 0.95), (1000, 3))
        wall[:, axis] = at
        assert inside(wall, hulls).all(), (axis, at)
    ball = state(tmp_path / 'world.yaml', 2.0)[-1]
    assert 0.2 <= ball[2] <= 0.2 + 1 / VOXELS


def test_what_has_no_volume_is_refused_by_the_name_of_its_file(tmp_path):
    written(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), tmp_path)
    entry = '{name: a, shape: {hulls: {file: part.stl}}}'
    assert ("bodies[0].shape.hulls.file.(part.stl): Unreadable: '3 points'; expected points around"
            in refusal(tmp_path, entry))
    said = refusal(tmp_path, '{name: a, urdf: r.urdf, meshes: hulls}', r_urdf=URDF)
    assert "link hand.mesh.(part.stl): Unreadable: '3 points'" in said
    assert ".shape.hulls.file: Unreadable: 'none.stl'" in refusal(
        tmp_path, entry.replace('part', 'none'))


WITHOUT = """import sys
sys.modules['vhacdx'] = None
from ragdoll_ros import load_scene
load_scene(sys.argv[1])"""


def test_without_vhacdx_a_mesh_is_refused_that_one_hull_fits_badly(tmp_path):
    (tmp_path / 'world.yaml').write_text('dolls: [{doll: doll}]\n'
                                         'bodies: [{name: a, shape: {hulls: {file: part.stl}}}]\n')

    def load():
        return subprocess.run([sys.executable, '-c', WITHOUT, tmp_path / 'world.yaml'],
                              capture_output=True, text=True, check=False)

    written(trimesh.creation.box((1, 2, 3)), tmp_path)
    assert load().returncode == 0
    written(bracket(), tmp_path)
    said = load().stderr
    assert "bodies[0].shape.hulls.file.(part.stl): Unreadable: 'a mesh that one hull" in said
    assert "pip install '.[fit]'" in said


def test_points_that_rounding_has_moved_off_lines_have_a_hull():
    """Of a turned box with points along its edges, as in STL: floats of 32 bits."""
    grid = np.linspace(-0.5, 0.5, 41)
    edges = [np.roll(np.stack([grid, np.full(41, a), np.full(41, b)], axis=1), turn, axis=1)
             for a in (-0.5, 0.5) for b in (-0.5, 0.5) for turn in range(3)]
    for seed in range(20):
        turn = rotation.from_rpy(*np.random.default_rng(seed).uniform(-3, 3, 3))
        points = rotation.rotate(turn, np.concatenate(edges)).astype(np.float32).astype(float)
        hull = convex_hull(points)
        # The coordinates are rounded by up to 3e-8 m.
        assert hull.volume == pytest.approx(1, abs=1e-6)
        assert np.abs(hull.support(points / np.linalg.norm(points, axis=1)[:, None])
                      >= np.linalg.norm(points, axis=1) - 2e-6).all()


def test_hulls_are_no_shape_of_a_bone(tmp_path):
    file = tmp_path / 'doll.yaml'
    file.write_text('joints: []\nbones: [{name: a, mass: 1, position: [0, 0, 0], '
                    'shape: {hulls: {file: x.stl}}}]\n')
    with pytest.raises(RagdollError, match=r'bones\[0\].shape: .*hulls'):
        load_scene(file)


def test_a_driven_channel_takes_along_what_lies_in_it(tmp_path):
    """A ball, between its walls, 0.3 m apart, and on its floor, when it has moved by 2 m."""
    written(channel(), tmp_path)
    made = robot_scene(tmp_path, '{name: u, shape: {hulls: {file: part.stl}}, follow: exact}',
                       '{name: ball, mass: 1, shape: {sphere: {radius: 0.05}}, '
                       'position: [0, 0, 0.16]}', doll='{doll: doll, position: [5, 0, 0.05]}')
    with Simulation(made) as simulation:
        for _ in range(400):
            simulation.drive_body('u', twist=(0.5, 0, 0, 0, 0, 0))
            ball = simulation.advance().positions[-1]
    # The slope of a face at a cut is less than a voxel, 7.6 mm.
    assert abs(ball[0] - 2.0) <= 0.1 + 0.0076 and ball[2] == pytest.approx(0.15, abs=0.0076)
