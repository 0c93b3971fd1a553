"""Meshes of robots: where they lie, how they are read, and the shapes that are put around them."""
import struct

import numpy as np
import pytest

from ragdoll_ros.files.robots.mesh_file import find_file
from ragdoll_ros.fit.robots.mesh_shapes import fit_mesh
from ragdoll_ros.fit.robots.robot import read_urdf
from ragdoll_ros.model import rotation
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Part, Sphere

HERE, TURN = Pose(), rotation.from_rpy(0.3, -0.4, 0.5)

NEAR = 0.03
"""A shape need hold only 95 % of the surface, of which it knows 2000 points."""


def triangles_of(shape, pose=HERE):
    corners, triangles = shape.mesh()
    return pose.apply(corners)[triangles]


def stl(triangles):
    body = b''.join(struct.pack('<12fH', *np.zeros(3), *np.ravel(each), 0) for each in triangles)
    return b'\0' * 80 + struct.pack('<I', len(triangles)) + body


def obj(triangles):
    lines = [f'v {x} {y} {z}' for x, y, z in triangles.reshape(-1, 3)]
    lines += [f'f {k} {k + 1} {k + 2}' for k in range(1, 3 * len(triangles), 3)]
    return ('mtllib none.mtl\n' + '\n'.join(lines)).encode()


def dae(triangles, unit='0.01'):
    """Collada 1.4.1, in centimetres."""
    points = ' '.join(map(str, 100 * triangles.ravel()))
    indices = ' '.join(map(str, range(3 * len(triangles))))
    count = 3 * len(triangles)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="{unit}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="s">
<float_array id="a" count="{3 * count}">{points}</float_array><technique_common>
<accessor source="#a" count="{count}" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles count="{len(triangles)}"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{indices}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>
""".encode()


def robot(tmp_path, *meshes, mass=2.0, inertia=''):
    parts = ''.join(f'<collision><origin xyz="0 0 1"/><geometry><mesh filename="{name}" {more}/>'
                    '</geometry></collision>' for name, more in meshes)
    path = tmp_path / 'robot.urdf'
    path.write_text(f'<robot name="r"><link name="a"><inertial><mass value="{mass}"/>{inertia}'
                    f'</inertial>{parts}</link></robot>')
    return read_urdf(path)


@pytest.mark.parametrize(('suffix', 'write'), [('stl', stl), ('STL', stl), ('obj', obj),
                                               ('dae', dae)])
def test_each_format_is_read(tmp_path, suffix, write):
    pytest.importorskip('trimesh')
    (tmp_path / f'part.{suffix}').write_bytes(write(triangles_of(Box((0.1, 0.2, 0.4)))))
    doll, notes = robot(tmp_path, (f'part.{suffix}', 'scale="1 2 -1"'))
    assert notes == ()
    assert sorted(doll.root.shape.size) == pytest.approx([0.1, 0.4, 0.4], rel=NEAR)
    assert doll.root.position == pytest.approx((0, 0, 1), abs=0.4 * NEAR)


def test_shapes_are_a_meshs_and_the_inertia_the_links(tmp_path):
    pytest.importorskip('trimesh')
    (tmp_path / 'part.stl').write_bytes(stl(triangles_of(Cylinder(0.1, 0.5))))
    doll, _ = robot(tmp_path, ('part.stl', ''), ('part.stl', 'scale="2 2 2"'),
                    inertia='<inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0" ixz="0" iyz="0"/>')
    assert sorted(doll.root.inertia) == pytest.approx([0.1, 0.15, 0.2])
    assert np.allclose(doll.root.position, 0)
    small, large = doll.root.shape.parts
    assert small.shape.length == pytest.approx(0.5, rel=NEAR)
    assert large.shape.length == pytest.approx(1, rel=NEAR)


@pytest.mark.parametrize('shape', [Box((0.1, 0.2, 0.4)), Sphere(0.2), Cylinder(0.1, 0.5),
                                   Capsule(0.1, 0.4)])
@pytest.mark.parametrize('turn', [rotation.IDENTITY, rotation.from_rpy(0, np.pi / 2, 0), TURN])
def test_a_shape_is_found_again(shape, turn):
    pose = Pose(np.array([0.3, -0.2, 0.1]), np.array(turn))
    (found, place), = fit_mesh(triangles_of(shape, pose))
    assert found.kind == shape.kind
    assert sorted(found.half_extents) == pytest.approx(sorted(shape.half_extents), rel=NEAR)
    assert np.allclose(place.position, pose.position, atol=NEAR * max(shape.half_extents))


@pytest.mark.parametrize('pose', [HERE, Pose(np.ones(3), TURN)])
def test_what_one_shape_would_fill_badly_becomes_several(pose):
    """An angle of two boards: one box around it would be five times as large."""
    boards = Compound((Part(Box((1, 0.5, 0.1)), (0.5, 0, 0.05)),
                       Part(Box((0.1, 0.5, 1)), (0.05, 0, 0.6))))
    shapes = fit_mesh(triangles_of(boards, pose))
    whole = Compound(tuple(Part(shape, *pose.relative(place)) for shape, place in shapes))
    # The cut may be a mitre, so that each board keeps the corner.
    assert whole.volume == pytest.approx(0.1, rel=0.2)
    inside = np.array([[0.9, 0, 0.05], [0.05, 0, 1.0], [0.05, 0.2, 0.3], [0.4, -0.2, 0.05]])
    assert (whole.signed_distance(inside) < 0).all()
    assert (whole.signed_distance(np.array([[0.5, 0, 0.5], [0.9, 0, 0.3]])) > 0.1).all()


@pytest.mark.parametrize('triangles', [
    np.zeros((1, 3, 3)), np.eye(3)[None], np.tile(np.linspace(0, 1, 3)[:, None], (4, 1, 3))])
def test_a_mesh_without_volume_has_a_shape_too(triangles):
    assert all(shape.volume > 0 for shape, _ in fit_mesh(triangles))


BROKEN = {'cut.stl': stl(triangles_of(Sphere(1)))[:-700], 'empty.stl': b'', 'text.obj': b'nothing',
          'nan.stl': stl(np.full((2, 3, 3), np.nan)), 'far.stl': stl(np.full((1, 3, 3), 1e30)),
          'count.stl': b'\0' * 80 + b'\xff' * 54, 'xml.dae': b'<COLLADA', 'no_more.dae': b'<a/>',
          'index.obj': b'v 0 0 0\nf 1 2 3\n', 'other.step': b'', 'missing': None}


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('name', BROKEN)
def test_a_mesh_that_cannot_be_read_is_named_and_the_inertia_counts(tmp_path, capfd, name):
    if BROKEN[name] is not None:
        (tmp_path / name).write_bytes(BROKEN[name])
    inertia = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
    doll, notes = robot(tmp_path, (name, ''), inertia=inertia)
    assert notes[0].startswith(f'a: the mesh {name} is ignored: ')
    assert doll.root.inertia == pytest.approx((0.1, 0.1, 0.1))
    assert capfd.readouterr() == ('', '')


@pytest.mark.parametrize('seed', range(20))
def test_damaged_meshes_never_crash(tmp_path, seed):
    random = np.random.default_rng(seed)
    whole = triangles_of(Capsule(0.1, 0.4))
    for name, data in (('a.stl', stl(whole)), ('b.obj', obj(whole)), ('c.dae', dae(whole))):
        data = bytearray(data)
        for at in random.integers(0, len(data), 5):
            data[at] = random.integers(0, 256)
        (tmp_path / name).write_bytes(data[:random.integers(1, 2 * len(data))])
    doll, _ = robot(tmp_path, ('a.stl', ''), ('b.obj', ''), ('c.dae', ''))
    assert doll.mass == 2


def test_packages_are_found_where_ros_looks_and_beside_the_robot(tmp_path, monkeypatch):
    for variable in ('ROS_PACKAGE_PATH', 'AMENT_PREFIX_PATH'):
        monkeypatch.delenv(variable, raising=False)
    made = [tmp_path / place for place in ('src/bot/meshes/a.stl', 'bot/meshes/b.stl',
                                           'ws/share/bot/meshes/c.stl', 'kit/bot/meshes/d e.stl')]
    for path in made:
        path.parent.mkdir(parents=True)
        path.touch()
    urdfs = tmp_path / 'src/bot/urdf/arm'

    def found(name, folder=urdfs):
        return find_file(name, folder)

    assert found('package://bot/meshes/a.stl') == made[0]
    # The same package, whatever its folder is called.
    assert found('package://other/meshes/a.stl') == made[0]
    urdfs.mkdir(parents=True)
    assert found('../../meshes/a.stl').samefile(made[0])
    assert found('meshes/a.stl') == made[0]
    assert found(f'file://{made[1]}') == found(str(made[1])) == made[1]
    assert found('package://bot/meshes/b.stl') == made[1]
    assert found('package://bot/meshes/c.stl') is None
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}/none:{tmp_path}/ws')
    assert found('package://bot/meshes/c.stl') == made[2]
    assert found('model://bot/meshes/c.stl', None) == made[2]
    monkeypatch.setenv('ROS_PACKAGE_PATH', f'{tmp_path}/kit')
    assert found('package://bot/meshes/d%20e.stl', None) == made[3]
    monkeypatch.setenv('ROS_PACKAGE_PATH', f'{tmp_path}/kit/bot')
    assert found('package://bot/meshes/d%20e.stl', None) == made[3]
    for name in ('http://a.b/c.stl', 'package://bot', '', 'x' * 5000, 'a\0b', 'package://bot/'):
        assert found(name) is None
