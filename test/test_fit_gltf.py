"""Reading glTF: every way the specification lets a skin be written gives the same character."""
import base64
import functools
import json

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS, document

from ragdoll_ros.files.gltf.gltf_file import GltfFile
from ragdoll_ros.files.gltf.nodes import read_nodes
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character

RIG = RIGS['cmu']


def read(made, folder, name='rig'):
    path = folder / f'{name}.glb'
    path.write_bytes(made.glb())
    return read_character(path)


@functools.cache
def raw():
    return fit_rigs.skin(RIG.bones)


def whole():
    return document(RIG, raw())


@pytest.fixture(scope='module')
def plain(tmp_path_factory):
    return read(whole(), tmp_path_factory.mktemp('plain'), 'plain')


def same(character, other, tolerance=1e-6):
    """Two characters with equal bones, skin and weights; 1e-6 m is what 32 bits give."""
    assert character.bone_names == other.bone_names
    assert character.parents == other.parents
    assert np.abs(character.positions - other.positions).max() < tolerance
    assert np.abs(character.vertices - other.vertices).max() < tolerance
    assert (character.triangles == other.triangles).all()
    assert np.abs(dense(character) - dense(other)).max() < 0.005


def dense(character):
    """Weights as a full table (v, bones)."""
    table = np.zeros((len(character.vertices), len(character.bone_names)))
    for bone, weight in zip(character.bones.T, character.weights.T, strict=True):
        np.add.at(table, (np.arange(len(table)), bone), weight)
    return table


def attributes(made):
    return made.data['meshes'][0]['primitives'][0]['attributes']


def test_the_skin_is_where_it_was_drawn(plain):
    points = raw()[0]
    assert np.abs(plain.vertices - points[:, [2, 0, 1]]).max() < 1e-6
    assert plain.volume() == pytest.approx(signed_volume(*raw()[:2]), rel=1e-5)


def signed_volume(points, faces):
    return sum(np.dot(a, np.cross(b, c)) for a, b, c in points[faces]) / 6


@pytest.mark.parametrize(('dtype', 'top'), [('u1', 255), ('u2', 65535)])
def test_normalised_weights(tmp_path, plain, dtype, top):
    made = whole()
    attributes(made)['WEIGHTS_0'] = made.accessor(np.round(raw()[3] * top), dtype, 'VEC4',
                                                  normalized=True)
    same(read(made, tmp_path), plain)


def test_wide_joint_indices_and_a_second_set(tmp_path, plain):
    made = whole()
    _, _, joints, weights = raw()
    halves = np.concatenate([weights[:, :1] / 2, np.zeros((len(weights), 3))], axis=1)
    first = weights.copy()
    first[:, 0] /= 2
    attributes(made).update(
        JOINTS_0=made.accessor(joints, 'u2', 'VEC4'), WEIGHTS_0=made.accessor(first, 'f4', 'VEC4'),
        JOINTS_1=made.accessor(joints, 'u1', 'VEC4'), WEIGHTS_1=made.accessor(halves, 'f4', 'VEC4'))
    same(read(made, tmp_path), plain)


def test_interleaved_with_a_stride(tmp_path, plain):
    made = whole()
    points, _, _, weights = raw()
    both = np.concatenate([points, weights], axis=1).astype('<f4')
    view = made.view(both.tobytes(), byteStride=28)
    for key, offset, kind in (('POSITION', 0, 'VEC3'), ('WEIGHTS_0', 12, 'VEC4')):
        made.data['accessors'].append({'bufferView': view, 'byteOffset': offset, 'type': kind,
                                       'componentType': 5126, 'count': len(points)})
        attributes(made)[key] = len(made.data['accessors']) - 1
    same(read(made, tmp_path), plain)


@pytest.mark.parametrize('base_view', [True, False])
def test_sparse_positions(tmp_path, plain, base_view):
    """Some or, without a view, all of the values come from the sparse part."""
    made = whole()
    points = raw()[0]
    wrong = points.copy()
    chosen = np.arange(3, len(points), 5) if base_view else np.arange(len(points))
    wrong[chosen] = 99
    index = made.accessor(wrong, 'f4', 'VEC3')
    accessor = made.data['accessors'][index]
    if not base_view:
        del accessor['bufferView']
    accessor['sparse'] = {
        'count': len(chosen),
        'indices': {'bufferView': made.view(chosen.astype('<u2').tobytes()), 'componentType': 5123},
        'values': {'bufferView': made.view(points[chosen].astype('<f4').tobytes())}}
    attributes(made)['POSITION'] = index
    same(read(made, tmp_path), plain)


def test_several_primitives_and_no_indices(tmp_path, plain):
    made = whole()
    points, faces, joints, weights = raw()
    cut = len(faces) // 2
    primitives = []
    for part in (faces[:cut], faces[cut:]):
        flat = part.ravel()
        primitives.append({'attributes': {
            'POSITION': made.accessor(points[flat], 'f4', 'VEC3'),
            'JOINTS_0': made.accessor(joints[flat], 'u1', 'VEC4'),
            'WEIGHTS_0': made.accessor(weights[flat], 'f4', 'VEC4')}})
    made.data['meshes'][0]['primitives'] = primitives
    character = read(made, tmp_path)
    assert len(character.triangles) == len(faces)
    assert character.volume() == pytest.approx(plain.volume(), rel=1e-6)
    assert len(fit_character(character).doll.bones) == len(fit_character(plain).doll.bones)


@pytest.mark.parametrize('mode', [5, 6])
def test_strips_and_fans(tmp_path, mode):
    """A box of strips or fans has a box's volume: each triangle is wound the right way."""
    made = document(RIGS['one_bone'])
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 0.5
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    joints, weights = np.zeros((8, 4)), np.tile([1.0, 0, 0, 0], (8, 1))
    shared = {'POSITION': made.accessor(corners, 'f4', 'VEC3'),
              'JOINTS_0': made.accessor(joints, 'u1', 'VEC4'),
              'WEIGHTS_0': made.accessor(weights, 'f4', 'VEC4')}
    made.data['meshes'][0]['primitives'] = []
    for a, b, c, d in quads:
        order = np.array([a, b, d, c] if mode == 5 else [a, b, c, d]).reshape(-1, 1)
        made.data['meshes'][0]['primitives'].append({
            'attributes': shared, 'mode': mode, 'indices': made.accessor(order, 'u2', 'SCALAR')})
    assert read(made, tmp_path).volume() == pytest.approx(0.125, rel=1e-6)


def test_a_gltf_with_its_buffer_beside_it_and_inside_it(tmp_path, plain):
    made = whole()
    made.data['buffers'][0]['byteLength'] = len(made.blob)
    (tmp_path / 'a buffer.bin').write_bytes(made.blob)
    for uri in ('a%20buffer.bin',
                'data:application/octet-stream;base64,' + base64.b64encode(made.blob).decode()):
        made.data['buffers'][0]['uri'] = uri
        (tmp_path / 'rig.gltf').write_text(json.dumps(made.data))
        same(read_character(tmp_path / 'rig.gltf'), plain)


def test_nodes_in_another_pose_than_the_skin_was_bound_in(tmp_path, plain):
    """A step of a walk in the nodes: the bind pose is fitted, and that is said."""
    made = whole()
    for number in (2, 5, 9, 14):
        node = made.data['nodes'][number]
        pose = np.array(node['matrix']).reshape(4, 4).T
        pose[:3, :3] = pose[:3, :3] @ fit_rigs.matrix((0.1, 0.1, 0.05, np.sqrt(0.9775)))[:3, :3]
        node['matrix'] = pose.T.ravel().tolist()
    character = read(made, tmp_path)
    assert any('another pose' in note for note in character.notes)
    # The root's own few degrees are turned back; where it stands is taken from the nodes.
    assert np.abs(np.ptp(character.vertices, axis=0) - np.ptp(plain.vertices, axis=0)).max() < 1e-5


def test_two_meshes_with_a_skin_each(tmp_path, plain):
    """A body and its clothes share their bones, and each has inverse bind matrices of its own."""
    made = whole()
    shift = np.eye(4)
    shift[:3, 3] = (5, 0, 0)
    binds = np.stack([np.linalg.inv(m) @ shift for m in fit_rigs.worlds(RIG)])
    made.data['skins'].append({
        'joints': list(reversed(made.data['skins'][0]['joints'])),
        'inverseBindMatrices': made.accessor(binds[::-1].transpose(0, 2, 1).reshape(-1, 16), 'f4',
                                             'MAT4')})
    points, faces, joints, weights = raw()
    made.data['meshes'].append({'primitives': [{
        'attributes': {'POSITION': made.accessor(points - (5, 0, 0), 'f4', 'VEC3'),
                       'JOINTS_0': made.accessor(len(RIG.bones) - 1 - joints, 'u1', 'VEC4'),
                       'WEIGHTS_0': made.accessor(weights, 'f4', 'VEC4')},
        'indices': made.accessor(faces.reshape(-1, 1), 'u2', 'SCALAR')}]})
    made.data['nodes'].append({'mesh': 1, 'skin': 1})
    character = read(made, tmp_path)
    count = len(plain.vertices)
    assert len(character.vertices) == 2 * count
    assert np.abs(character.vertices[count:] - plain.vertices).max() < 5e-6
    assert character.bone_names == plain.bone_names


def test_names_become_fit_for_a_doll(tmp_path):
    made = document(RIGS['chain'])
    for number, name in enumerate(('a/b', 'same', 'same', '', '\ud800x', 'tab\tbed', '  ', 'ü骨',
                                   'world')):
        made.data['nodes'][number + 2]['name'] = name
    character = read(made, tmp_path)
    assert character.bone_names[:9] == (
        'a_b', 'same', 'same_2', 'bone_3', '_x', 'tab_bed', 'bone_6', 'ü骨', 'world_2')
    assert len(set(character.bone_names)) == 10


def test_scale_by_option_and_by_guess(tmp_path):
    path = fit_rigs.write(RIGS['centimetres'], tmp_path)
    assert read_character(path).extent == pytest.approx(1.784, abs=0.01)
    assert 'centimetres' in read_character(path).notes[0]
    assert read_character(path, 0.02).extent == pytest.approx(2 * 1.784, abs=0.02)
    assert read_character(path, 1.0).notes == ()


def test_a_matrix_is_the_same_as_translation_rotation_scale(tmp_path):
    """By the formula of the specification: T R S."""
    made = document(RIGS['one_bone'])
    turn, scale, move = (0.5, -0.1, 0.3, np.sqrt(0.65)), (1, 2, 3), (4, 5, 6)
    made.data['nodes'] += [
        {'translation': list(move), 'rotation': list(turn), 'scale': list(scale)},
        {'matrix': (fit_rigs.matrix(turn, move=move) @ np.diag([*scale, 1])).T.ravel().tolist()}]
    path = tmp_path / 'trs.glb'
    path.write_bytes(made.glb())
    worlds = read_nodes(GltfFile(path)).worlds
    assert np.allclose(worlds[-1], worlds[-2], atol=1e-12)
