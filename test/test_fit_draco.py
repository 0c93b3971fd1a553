"""Draco-compressed characters are read as the plain ones, or refused in a sentence."""
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fit_rigs import RIGS, document, skin

from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import errors

EXTENSION = 'KHR_draco_mesh_compression'
RIG = RIGS['two_bones']
BITS = 20


def compressed(change=lambda data: data):
    """The rig's document with its mesh compressed, ``change`` made to the compressed bytes."""
    draco = pytest.importorskip('DracoPy')
    points, faces, joints, weights = skin(RIG.bones)
    made = document(RIG)
    primitive, = made.data['meshes'][0]['primitives']
    data = draco.encode(points.astype('f4'), faces.astype('u4'), quantization_bits=BITS,
                        generic_attributes={1: joints.astype('u1'), 2: weights.astype('f4')})
    known = {(each['num_components'], each['data'].dtype.kind): each['unique_id']
             for each in draco.decode(data).attributes}
    ids = {'POSITION': known[3, 'f'], 'JOINTS_0': known[4, 'u'], 'WEIGHTS_0': known[4, 'f']}
    # Nothing of the plain mesh stays in the file.
    binds = made.data['accessors'][made.data['skins'][0]['inverseBindMatrices']]
    view = made.data['bufferViews'][binds['bufferView']]
    matrices = made.blob[view['byteOffset']:][:view['byteLength']]
    made.data['bufferViews'], made.blob = [], b''
    for accessor in made.data['accessors']:
        accessor.pop('bufferView')
    binds['bufferView'] = made.view(matrices)
    primitive['extensions'] = {EXTENSION: {'bufferView': made.view(change(data)),
                                           'attributes': ids}}
    made.data['extensionsRequired'] = made.data['extensionsUsed'] = [EXTENSION]
    return made


def test_a_compressed_character_is_the_plain_one(tmp_path):
    (tmp_path / 'plain.glb').write_bytes(document(RIG).glb())
    (tmp_path / 'draco.glb').write_bytes(compressed().glb())
    plain, draco = (read_character(tmp_path / f'{name}.glb') for name in ('plain', 'draco'))
    assert draco.bone_names == plain.bone_names
    assert len(draco.triangles) == len(plain.triangles)
    # Draco orders vertices anew, and rounds them to a grid.
    step = 2 * plain.extent / 2 ** BITS
    for vertex, bones in zip(draco.vertices, draco.bones, strict=True):
        off = np.abs(plain.vertices - vertex).max(axis=1)
        assert off.min() < step
        assert set(bones) <= set(plain.bones[off < step].ravel())
    assert draco.volume() == pytest.approx(plain.volume(), rel=1e-4)


def test_without_dracopy_the_sentence_says_what_to_do(tmp_path, capsys, monkeypatch):
    (tmp_path / 'draco.glb').write_bytes(compressed().glb())
    monkeypatch.setitem(sys.modules, 'DracoPy', None)
    assert main([str(tmp_path / 'draco.glb')]) == 2
    error = capsys.readouterr().err
    assert "pip install '.[fit]', or a file exported without compression" in error
    assert error.count('\n') == 1


@pytest.mark.parametrize(('place', 'value'), [
    ('bufferView', 99), ('attributes', 5), ('attributes', {'POSITION': 77}),
    ('attributes', {'POSITION': 'x'})])
def test_a_broken_extension_is_named(tmp_path, place, value):
    made = compressed()
    made.data['meshes'][0]['primitives'][0]['extensions'][EXTENSION][place] = value
    (tmp_path / 'draco.glb').write_bytes(made.glb())
    with pytest.raises(errors.ModelErrors, match=EXTENSION):
        read_character(tmp_path / 'draco.glb')


def test_damaged_bytes_never_crash(tmp_path):
    """In a process of its own, which a crash of the library's would end."""
    paths = []
    for seed in range(20):
        random = np.random.default_rng(seed)

        def damage(data, random=random):
            data = bytearray(data)
            for at in random.integers(0, len(data), random.integers(1, 9)):
                data[at] = random.integers(0, 256)
            return bytes(data[:random.integers(len(data) // 2, 2 * len(data))])

        paths.append(tmp_path / f'{seed}.glb')
        paths[-1].write_bytes(compressed(damage).glb())
    code = ('import sys; from ragdoll_ros.fit.command import main\n'
            'for path in sys.argv[1:]: main([path])')
    done = subprocess.run([sys.executable, '-c', code, *map(str, paths)], capture_output=True,
                          text=True, cwd=Path(__file__).parent.parent, timeout=100, check=False)
    assert done.returncode == 0 and 'Traceback' not in done.stderr
    assert 'draco' in done.stderr.lower()
