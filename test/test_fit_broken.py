"""Broken files: exit code 2, one clear sentence, no traceback, little memory."""
import copy
import functools
import json
import math
import os
import struct
import subprocess
import sys
from pathlib import Path

import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS, document

from ragdoll_ros.fit.command import main

# A warning of numpy's would be a second sentence.
pytestmark = pytest.mark.filterwarnings('error')

RIG = RIGS['two_bones']


@functools.cache
def _made():
    return document(RIG)


def good():
    made = fit_rigs.Document()
    made.data, made.blob = copy.deepcopy(_made().data), _made().blob
    return made


def changed(change):
    made = good()
    change(made.data)
    return made.glb()


def gltf(change):
    made = good()
    made.data['buffers'][0].update(byteLength=len(made.blob), uri='rig.bin')
    change(made.data)
    return json.dumps(made.data).encode()


def glb_of(text):
    text += b' ' * (-len(text) % 4)
    return struct.pack('<4sIII4s', b'glTF', 2, 20 + len(text), len(text), b'JSON') + text


def set_in(*path):
    *keys, last, value = path

    def change(data):
        for key in keys:
            data = data[key]
        data[last] = value
    return change


def set_bytes(at, kind, value):
    data = bytearray(good().glb())
    struct.pack_into(kind, data, at, value)
    return bytes(data)


def nan_positions():
    made = good()
    points = fit_rigs.skin(RIG.bones)[0]
    points[5] = np.nan
    index = made.accessor(points, 'f4', 'VEC3')
    made.data['meshes'][0]['primitives'][0]['attributes']['POSITION'] = index
    return made.glb()


NODES, MESH = ('nodes', 2), ('meshes', 0, 'primitives', 0)

BROKEN = {
    'empty.glb': b'',
    'magic.glb': b'GLTF' + good().glb()[4:],
    'version.glb': set_bytes(4, '<I', 1),
    'truncated_header.glb': good().glb()[:10],
    'truncated_json.glb': good().glb()[:200],
    'truncated_binary.glb': good().glb()[:-500],
    'length_10_gb.glb': set_bytes(8, '<I', 0xFFFFFFFF),
    'chunk_4_gb.glb': set_bytes(12, '<I', 0xFFFFFFF0),
    'no_json_first.glb': set_bytes(16, '<4s', b'BIN\0'),
    'garbage.glb': b'glTF' + os.urandom(5000),
    'not_json.glb': glb_of(b'{"nodes": [}'),
    'list.glb': glb_of(b'[1, 2]'),
    'number.glb': glb_of(b'7'),
    'deep.glb': glb_of(b'[' * 100_000),
    'deep_objects.glb': glb_of(b'{"a":' * 90_000),
    'wide.glb': glb_of(b'[' + b'[],' * 2_000_000 + b'[]]'),
    'wrong_utf8.glb': glb_of(b'{"asset": "\xff\xfe"}'),
    'no_skin.glb': changed(lambda data: data['nodes'][1].pop('skin')),
    'no_mesh.glb': changed(set_in('meshes', [])),
    'empty_document.glb': glb_of(b'{}'),
    'nodes_no_list.glb': changed(set_in('nodes', 5)),
    'nodes_of_numbers.glb': changed(set_in('nodes', [1, 2])),
    'self_cycle.glb': changed(set_in(*NODES, 'children', [2])),
    'cycle.glb': changed(lambda data: (set_in('nodes', 3, 'children', [2])(data),
                                       set_in('nodes', 0, 'children', [1])(data))),
    'two_parents.glb': changed(set_in('nodes', 1, 'children', [3])),
    'child_outside.glb': changed(set_in(*NODES, 'children', [99])),
    'child_text.glb': changed(set_in(*NODES, 'children', ['x'])),
    'child_negative.glb': changed(set_in(*NODES, 'children', [-1])),
    'matrix_short.glb': changed(set_in(*NODES, 'matrix', [1, 2, 3])),
    'matrix_text.glb': changed(set_in(*NODES, 'matrix', ['a'] * 16)),
    'matrix_huge.glb': changed(set_in(*NODES, 'matrix', [1e300] * 16)),
    'matrix_1e400.glb': glb_of(json.dumps(good().data).replace(
        '"nodes": [{', '"nodes": [{"matrix": [' + ', '.join(['1e400'] * 16) + '], ').encode()),
    'matrix_digits.glb': changed(set_in(*NODES, 'matrix', [10 ** 400] * 16)),
    'matrix_more_digits.glb': glb_of(b'{"nodes": [' + b'9' * 10_000 + b']}'),
    'matrix_nan.glb': changed(set_in(*NODES, 'matrix', [math.nan] * 16)),
    'count_digits.glb': changed(set_in('accessors', 1, 'count', 10 ** 400)),
    'offset_digits.glb': changed(set_in('bufferViews', 1, 'byteOffset', 10 ** 400)),
    'utf_16.glb': glb_of('{"asset": {"version": "2.0"}}'.encode('utf-16')),
    'matrix_zero.glb': changed(set_in('nodes', 0, 'matrix', [0] * 16)),
    'joints_outside.glb': changed(set_in('skins', 0, 'joints', [2, 99])),
    'joints_none.glb': changed(set_in('skins', 0, 'joints', [])),
    'joints_text.glb': changed(set_in('skins', 0, 'joints', 'all')),
    'skin_outside.glb': changed(set_in('nodes', 1, 'skin', 7)),
    'mesh_outside.glb': changed(set_in('nodes', 1, 'mesh', 7)),
    'binds_outside.glb': changed(set_in('skins', 0, 'inverseBindMatrices', 77)),
    'binds_of_another_type.glb': changed(set_in('skins', 0, 'inverseBindMatrices', 1)),
    'binds_too_few.glb': changed(set_in('accessors', 0, 'count', 1)),
    'position_outside.glb': changed(set_in(*MESH, 'attributes', 'POSITION', 50)),
    'position_missing.glb': changed(lambda data: data['meshes'][0]['primitives'][0][
        'attributes'].pop('POSITION')),
    'position_nan.glb': nan_positions(),
    'weights_missing.glb': changed(lambda data: data['meshes'][0]['primitives'][0][
        'attributes'].pop('WEIGHTS_0')),
    'attributes_list.glb': changed(set_in(*MESH, 'attributes', [1])),
    'primitives_number.glb': changed(set_in('meshes', 0, 'primitives', 3)),
    'joint_index_outside.glb': changed(set_in('skins', 0, 'joints', [2])),
    'indices_as_floats.glb': changed(set_in('accessors', 4, 'componentType', 5126)),
    'index_outside.glb': changed(set_in('accessors', 1, 'count', 3)),
    'count_huge.glb': changed(set_in('accessors', 1, 'count', 10 ** 15)),
    'count_negative.glb': changed(set_in('accessors', 1, 'count', -5)),
    'count_float.glb': changed(set_in('accessors', 1, 'count', 2.5)),
    'type_unknown.glb': changed(set_in('accessors', 1, 'type', 'VEC7')),
    'component_unknown.glb': changed(set_in('accessors', 1, 'componentType', 1)),
    'component_list.glb': changed(set_in('accessors', 1, 'componentType', [5126])),
    'zeros_huge.glb': changed(lambda data: (data['accessors'][1].pop('bufferView'),
                                            set_in('accessors', 1, 'count', 10 ** 9)(data))),
    'view_outside.glb': changed(set_in('bufferViews', 1, 'byteOffset', 10 ** 9)),
    'view_long.glb': changed(set_in('bufferViews', 1, 'byteLength', 10 ** 12)),
    'view_negative.glb': changed(set_in('bufferViews', 1, 'byteOffset', -4)),
    'view_stride.glb': changed(set_in('bufferViews', 1, 'byteStride', 2)),
    'view_stride_huge.glb': changed(set_in('bufferViews', 1, 'byteStride', 10 ** 9)),
    'buffer_outside.glb': changed(set_in('bufferViews', 1, 'buffer', 3)),
    'sparse_broken.glb': changed(set_in('accessors', 1, 'sparse', {'count': 4})),
    'sparse_outside.glb': changed(set_in('accessors', 1, 'sparse', {
        'count': 2, 'indices': {'bufferView': 1, 'componentType': 5125},
        'values': {'bufferView': 1}})),
    'compressed.glb': changed(set_in('extensionsRequired', ['EXT_meshopt_compression'])),
    'uri_up.gltf': gltf(set_in('buffers', 0, 'uri', '../outside.bin')),
    'uri_up_escaped.gltf': gltf(set_in('buffers', 0, 'uri', '%2e%2e/outside.bin')),
    'uri_absolute.gltf': gltf(set_in('buffers', 0, 'uri', '/etc/passwd')),
    'uri_scheme.gltf': gltf(set_in('buffers', 0, 'uri', 'file:///etc/passwd')),
    'uri_link.gltf': gltf(set_in('buffers', 0, 'uri', 'link.bin')),
    'uri_missing.gltf': gltf(set_in('buffers', 0, 'uri', 'none.bin')),
    'uri_folder.gltf': gltf(set_in('buffers', 0, 'uri', '.')),
    'uri_null.gltf': gltf(set_in('buffers', 0, 'uri', 'a\0b')),
    'uri_number.gltf': gltf(set_in('buffers', 0, 'uri', 4)),
    'uri_base64.gltf': gltf(set_in('buffers', 0, 'uri', 'data:x;base64,%%%')),
    'buffer_longer_than_file.gltf': gltf(set_in('buffers', 0, 'byteLength', 10 ** 10)),
    'text.gltf': b'no glTF at all',
    'robot.urdf': b'<robot name="x"><link name="a"/></robot>',
    'entities.urdf': b'<!DOCTYPE x [<!ENTITY a "aaaa">]><robot name="&a;"/>',
    'xml.urdf': b'<robot><link></robot>',
    'doll.yaml': b'bones: []'}


PLACES = {
    'nodes_no_list': 'nodes', 'nodes_of_numbers': 'nodes[0]', 'child_text': 'nodes[2].children',
    'matrix_text': 'nodes[2].matrix', 'matrix_digits': 'nodes[2].matrix',
    'joints_text': 'skins[0].joints', 'skin_outside': 'nodes[1].skin',
    'attributes_list': 'meshes[0].primitives[0].attributes',
    'primitives_number': 'meshes[0].primitives', 'count_float': 'accessors[1].count',
    'component_list': 'accessors[1].componentType', 'view_negative': 'bufferViews[1].byteOffset',
    'sparse_broken': 'accessors[1].sparse.indices.componentType'}
"""The field that the sentence names, where the JSON has a value of the wrong type."""


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    outer = tmp_path_factory.mktemp('broken')
    inner = outer / 'inner'
    inner.mkdir()
    (outer / 'outside.bin').write_bytes(good().blob)
    (inner / 'link.bin').symlink_to(outer / 'outside.bin')
    (inner / 'rig.bin').write_bytes(good().blob)
    for name, data in BROKEN.items():
        (inner / name).write_bytes(data)
    return inner


def test_the_rig_itself_is_sound(folder, capsys):
    (folder / 'sound.glb').write_bytes(good().glb())
    (folder / 'sound.gltf').write_bytes(gltf(lambda data: None))
    for name in ('sound.glb', 'sound.gltf'):
        assert main([str(folder / name)]) == 0, capsys.readouterr().err


@pytest.mark.parametrize('name', BROKEN)
def test_one_clear_sentence_and_exit_code_2(folder, capsys, name):
    assert main([str(folder / name), '-o', str(folder / 'out.yaml')]) == 2
    error = capsys.readouterr().err
    assert error.startswith('ragdoll_fit: ')
    assert f'{name}: {PLACES.get(Path(name).stem, "")}' in error
    assert 'expected' in error
    assert error.count('\n') == 1 or name == 'doll.yaml'
    assert not (folder / 'out.yaml').exists()


def test_all_of_them_in_little_memory(folder):
    """In a process of its own; the peak is what the system counted, not what Python says."""
    # Not getrusage: its peak counts the process that this one was forked from, too.
    code = ('import re, sys\n'
            'from pathlib import Path\n'
            'from ragdoll_ros.fit.command import main\n'
            'codes = {main([path]) for path in sys.argv[1:]}\n'
            'peak = re.search(r"VmHWM:\\s*(\\d+) kB", Path("/proc/self/status").read_text())\n'
            'print(codes, peak[1])\n')
    paths = [str(folder / name) for name in BROKEN]
    done = subprocess.run([sys.executable, '-c', code, *paths], capture_output=True, text=True,
                          cwd=Path(__file__).parent.parent, timeout=60, check=False,
                          env={**os.environ, 'PYTHONPATH': str(Path(__file__).parent.parent)})
    assert 'Traceback' not in done.stderr
    codes, kilobytes = done.stdout.rsplit(maxsplit=1)
    assert codes == '{2}'
    assert int(kilobytes) < 200_000


def test_a_file_of_ten_gigabytes_is_not_read(folder, capsys):
    """Its own chunks are sound, so it is fitted; the rest is never touched."""
    with (folder / 'sparse.glb').open('wb') as file:
        file.write(good().glb())
        # They take no room on the disk.
        file.truncate(10 * 2 ** 30)
    assert main([str(folder / 'sparse.glb')]) == 0


@pytest.mark.parametrize('seed', range(60))
def test_flipped_bytes_never_crash(tmp_path, capsys, seed):
    """Whatever 20 wrong bytes do, the command ends with 0 or 2."""
    random = np.random.default_rng(seed)
    data = bytearray(good().glb())
    # Most of the damage to the JSON, which is where the structure is.
    text = struct.unpack_from('<I', data, 12)[0]
    for at in random.integers(0, 20 + text if seed % 2 else len(data), 20):
        data[at] = random.integers(0, 256)
    (tmp_path / 'x.glb').write_bytes(data)
    assert main([str(tmp_path / 'x.glb')]) in (0, 2)


@pytest.mark.parametrize('seed', range(60))
def test_wrong_values_in_the_json_never_crash(tmp_path, capsys, seed):
    random = np.random.default_rng(seed)
    made = good()
    wrong = [None, -1, 0, 1e308, 2.5, 'x', [], {}, True, 10 ** 20, [[]], float('nan')]
    for _ in range(3):
        place, path = made.data, []
        while isinstance(place, (dict, list)) and place:
            keys = list(place) if isinstance(place, dict) else range(len(place))
            path.append((place, keys[random.integers(len(keys))]))
            place = place[path[-1][1]]
            if random.random() < 0.15:
                break
        holder, key = path[-1]
        holder[key] = wrong[random.integers(len(wrong))]
        if not isinstance(made.data['buffers'], list) or not made.data['buffers']:
            break
    try:
        data = made.glb()
    except (TypeError, KeyError, IndexError):
        data = glb_of(json.dumps(made.data).encode())
    (tmp_path / 'x.glb').write_bytes(data)
    assert main([str(tmp_path / 'x.glb')]) in (0, 2)
