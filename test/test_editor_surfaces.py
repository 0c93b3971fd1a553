"""Edit: meshes, hulls, height fields and planes of a scene are moved, turned, sized and added."""
from __future__ import annotations

import dataclasses
import html
import struct

import numpy as np
import pytest

pytest.importorskip('viser')
from scipy.spatial.transform import Rotation
from test_editor import DROP, Desk, drag, server  # noqa: F401

from ragdoll_ros import Plane, StaticBody
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.mesh import HeightField, Hull, Mesh

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0.3, 0.2, 3]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]

SURFACES = {'mesh': Mesh(TETRAHEDRON, FACES), 'hull': Hull(TETRAHEDRON, FACES),
            'height_field': HeightField([[0, 0.5], [1, 0.2], [0.1, 3]], size=(1, 2))}
TURN = Rotation.from_euler('xyz', (0.3, -0.8, 2.0))


def corners(body):
    """Vertices (v, 3) m of a body, world frame."""
    return Rotation.from_quat(body.orientation).apply(body.shape.mesh()[0].copy()) + body.position


def middle(body):
    """Middle (3,) m of the bounding box along the body's own axes, world frame."""
    vertices = body.shape.mesh()[0]
    centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return Rotation.from_quat(body.orientation).apply(centre) + body.position


@pytest.fixture(params=SURFACES)
def desk(request, server, tmp_path):  # noqa: F811
    body = StaticBody('rock', SURFACES[request.param], (3, 1, 0.5), tuple(TURN.as_quat()),
                      friction=0.4)
    desk = Desk(server, tmp_path, dataclasses.replace(DROP, bodies=(body,)))
    desk.editor.select_static('rock')
    desk.before = body
    return desk


def rock(desk):
    return desk.editor.scene.bodies[0]


def shown(desk, key):
    return np.array([float(part) for part in desk.panel.body[key].value.split(',')])


def test_the_form_has_its_box(desk):
    fields = {key for key in ('shape', 'size', 'mass', 'position', 'rotation', 'friction', 'color')
              if desk.panel.body[key].visible}
    assert fields == {'size', 'position', 'rotation', 'friction', 'color'}
    # As many digits as the form shows.
    assert shown(desk, 'position') == pytest.approx(middle(desk.before), abs=1e-6)
    assert shown(desk, 'size') == pytest.approx(np.ptp(desk.before.shape.mesh()[0], axis=0))


def test_friction_alone_leaves_the_rest_to_the_bit(desk):
    desk.panel.body['friction'].value = '0.7'
    desk.editor.update()
    assert rock(desk) == dataclasses.replace(desk.before, friction=0.7)


def test_it_is_moved_by_numbers(desk):
    desk.panel.body['position'].value = '1 2 3'
    desk.editor.update()
    # Rounding: coordinates of some metres.
    assert middle(rock(desk)) == pytest.approx((1, 2, 3), abs=1e-12)
    assert corners(rock(desk)) - corners(desk.before) == pytest.approx(
        np.tile((1, 2, 3) - middle(desk.before), (len(corners(desk.before)), 1)), abs=1e-12)
    assert rock(desk).shape == desk.before.shape
    desk.editor.undo()
    assert rock(desk) == desk.before


def test_it_is_turned_about_its_middle(desk):
    desk.panel.body['rotation'].value = '0 0 90'
    desk.editor.update()
    expected = Rotation.from_euler('z', np.pi / 2).apply(
        TURN.inv().apply(corners(desk.before) - middle(desk.before))) + middle(desk.before)
    assert corners(rock(desk)) == pytest.approx(expected, abs=1e-12)


def test_it_is_scaled_about_its_middle_by_numbers_and_by_the_handle(desk):
    desk.panel.body['size'].value = '2 1 6'
    desk.editor.update()
    once = TURN.inv().apply(corners(desk.before) - middle(desk.before))
    factors = np.divide((2, 1, 6), np.ptp(desk.before.shape.mesh()[0], axis=0))
    assert corners(rock(desk)) == pytest.approx(
        TURN.apply(factors * once) + middle(desk.before), abs=1e-12)
    desk.editor.toggle()
    desk.editor.set_mode('size')
    drag(desk.editor.handles.size, (0.5, 1, 1.5))
    assert corners(rock(desk)) == pytest.approx(
        TURN.apply(factors * (0.5, 2, 0.5) * once) + middle(desk.before), abs=1e-12)


def test_it_is_dragged(desk):
    desk.editor.toggle()
    drag(desk.editor.handles.body, (5, 4, 3))
    assert middle(rock(desk)) == pytest.approx((5, 4, 3), abs=1e-12)


def test_what_was_edited_is_saved(desk):
    desk.panel.body['size'].value = '2 1 6'
    desk.editor.update()
    desk.files.name.value = 'rocks'
    desk.files.save()
    assert load_scene(str(desk.path / 'rocks.yaml')) == desk.editor.scene


def test_a_flat_mesh_keeps_its_plane(server, tmp_path):  # noqa: F811
    sheet = StaticBody('sheet', Mesh([[0, 0, 0.1], [1, 0, 0.1], [0, 1, 0.1]], [[0, 1, 2]]))
    desk = Desk(server, tmp_path, dataclasses.replace(DROP, bodies=(sheet,)))
    desk.editor.select_static('sheet')
    desk.panel.body['size'].value = '2 3 4'
    desk.editor.update()
    assert np.ptp(corners(desk.editor.scene.bodies[0]), axis=0) == pytest.approx((2, 3, 0))
    assert corners(desk.editor.scene.bodies[0])[:, 2] == pytest.approx(0.1)


def test_a_plane_is_moved_and_turned(server, tmp_path):  # noqa: F811
    wall = StaticBody('wall', Plane(), (2, 0, 0), restitution=0.5)
    desk = Desk(server, tmp_path, dataclasses.replace(DROP, bodies=(wall,)))
    desk.editor.select_static('wall')
    assert not desk.panel.body['size'].visible and not desk.panel.body['shape'].visible
    desk.panel.body['rotation'].value = '0 -90 0'
    desk.panel.body['position'].value = '2.5 0 0'
    desk.editor.update()
    found, = desk.editor.scene.bodies
    assert found.normal == pytest.approx((-1, 0, 0), abs=1e-12)
    assert found.position == (2.5, 0, 0) and found.restitution == 0.5 and found.shape == Plane()


def stl(triangles):
    """A binary STL."""
    records = b''.join(struct.pack('<12fH', 0, 0, 0, *np.ravel(triangle), 0)
                       for triangle in triangles)
    return bytes(80) + struct.pack('<I', len(triangles)) + records


def test_an_uploaded_mesh_stands_beside_the_doll(server, tmp_path):  # noqa: F811
    desk = Desk(server, tmp_path)
    content = stl(TETRAHEDRON[FACES] - 5.0)
    for name, kept in (('my rock.stl', 'my rock'), ('../my rock.stl', 'my rock_2')):
        desk.editor.add_mesh(name, content)
        body = desk.editor.scene.bodies[-1]
        assert desk.editor.static == body.name == kept
        vertices = corners(body)
        # The file has floats of 32 bits.
        assert np.ptp(vertices, axis=0) == pytest.approx((1, 2, 3), abs=1e-6)
        assert vertices.min(axis=0)[2] == pytest.approx(0, abs=1e-12)
        assert vertices.min(axis=0)[0] > DROP.dolls[0].position[0]
    assert [path.name for path in tmp_path.iterdir()] == ['my rock.stl'], 'one file, kept once'
    desk.files.name.value = 'rocks'
    desk.files.save()
    assert load_scene(str(tmp_path / 'rocks.yaml')) == desk.editor.scene
    desk.panel.body['size'].value = '0.1 0.2 0.3'
    desk.editor.update()
    desk.files.save()
    again = load_scene(str(tmp_path / 'rocks.yaml'))
    assert corners(again.bodies[-1]) == pytest.approx(corners(desk.editor.scene.bodies[-1]))
    desk.editor.undo()
    desk.editor.undo()
    desk.editor.undo()
    assert desk.editor.scene == DROP


@pytest.mark.parametrize('mass', ['', 'mass: 2, '])
def test_a_body_of_several_hulls_is_opened_moved_and_saved(server, tmp_path, mass):  # noqa: F811
    """Two boxes, of which no hull is that of the mesh; the file is only read when it is opened."""
    trimesh = pytest.importorskip('trimesh')
    pytest.importorskip('vhacdx')
    parts = [trimesh.creation.box((0.2, 0.2, 1)), trimesh.creation.box((1, 0.2, 0.2))]
    parts[1].apply_translation((0.4, 0, -0.6))
    trimesh.util.concatenate(parts).export(tmp_path / 'rock.stl')
    desk = Desk(server, tmp_path)
    text = ('dolls: [{doll: doll}]\nbodies: [{name: rock, position: [3, 0, 2], '
            f'{mass}shape: {{hulls: {{file: rock.stl}}}}}}]')
    desk.files.upload('scene.yaml', text.encode())
    if mass:
        desk.editor.select('rock/rock')
    else:
        desk.editor.select_static('rock')
    before = desk.editor.scene
    desk.editor.toggle()
    drag(desk.editor.handles.body, (5, 4, 3))
    (tmp_path / 'rock.stl').unlink()

    old, new = (scene.dolls[1].doll.root if mass else scene.bodies[0]
                for scene in (before, desk.editor.scene))
    assert new == dataclasses.replace(old, position=new.position)
    assert new.position == pytest.approx((5, 4, 3))
    assert [part.kind for part in old.shape.parts].count('hull') == len(old.shape.parts) > 1
    desk.files.name.value = 'rocks'
    desk.files.save()
    assert load_scene(str(tmp_path / 'rocks.yaml')) == desk.editor.scene
    desk.editor.undo()
    assert desk.editor.scene == before


@pytest.mark.parametrize(('name', 'content'), [
    ('rock.stl', b'solid'), ('rock.obj', b''), ('rock.txt', b'x'),
    ('<b>.glb', b'glTF' + bytes(20))])
def test_an_upload_that_is_no_mesh_is_refused_in_words(server, tmp_path, name, content):  # noqa: F811
    desk = Desk(server, tmp_path)
    desk.editor.add_mesh(name, content)
    assert 'expected' in html.unescape(desk.panel.message.content)
    assert '<b>' not in desk.panel.message.content
    assert desk.editor.scene == DROP and not list(tmp_path.iterdir())


@pytest.mark.parametrize(('place', 'text'), [
    ('bodies[0].shape.mesh', 'dolls: [{doll: doll}]\nbodies: [{name: rock, shape: '
     '{mesh: {file: "%s"}}}]'),
    ('bodies[0].shape.hulls', 'dolls: [{doll: doll}]\nbodies: [{name: rock, shape: '
     '{hulls: {file: "%s"}}}]'),
    ('bodies[0].shapes[0].hull', 'dolls: [{doll: doll}]\nbodies: [{name: rock, shapes: '
     '[{hull: {file: "%s"}}]}]'),
    ('dolls[0].doll.bones[0].shapes[0].hull', 'dolls: [{doll: {bones: [{name: rock, mass: 1, '
     'position: [0, 0, 0], shapes: [{hull: {file: "%s"}}]}], joints: []}}]'),
    ('bones[0].shapes[0].hull', 'bones: [{name: rock, mass: 1, position: [0, 0, 0], shapes: '
     '[{hull: {file: "%s"}}]}]\njoints: []')])
def test_an_uploaded_scene_reads_no_mesh_from_outside(server, tmp_path, place, text):  # noqa: F811
    outside = tmp_path / 'secret.stl'
    outside.write_bytes(stl(TETRAHEDRON[FACES]))
    folder = tmp_path / 'folder'
    folder.mkdir()
    desk = Desk(server, folder)
    for file in (str(outside), '../secret.stl'):
        desk.files.upload('scene.yaml', (text % file).encode())
        assert f'{place}.file' in desk.said() and f'inside {folder}' in desk.said()
    assert desk.editor.scene == DROP
