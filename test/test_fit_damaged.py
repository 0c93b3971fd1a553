"""Files damaged at random: fitted, or refused in one sentence; no traceback, little memory."""
import base64
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fit_rigs import RIGS, document

from ragdoll_ros.files.doll import load_doll, save_doll
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.fit.command import main

pytestmark = pytest.mark.filterwarnings('error')

KINDS = ('glb', 'gltf', 'urdf', 'yaml')

MOST_MORE = 200_000
"""kB that a damaged file may take beyond what whole ones do."""

CHILD = """
import re, sys
from pathlib import Path
from ragdoll_ros.fit.command import main
print(*(main([path]) for path in sys.argv[1:]), file=sys.stderr)
print(re.search(r'VmHWM:\\s*(\\d+) kB', Path('/proc/self/status').read_text())[1], file=sys.stderr)
"""


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Bytes of a sound file of each kind."""
    made = document(RIGS['two_bones'])
    buffer = base64.b64encode(made.blob).decode()
    made.data['buffers'][0].update(byteLength=len(made.blob),
                                   uri=f'data:application/octet-stream;base64,{buffer}')
    doll, path = load_doll('doll'), tmp_path_factory.mktemp('whole') / 'doll.yaml'
    save_doll(doll, path)
    return {'glb': document(RIGS['two_bones']).glb(), 'gltf': json.dumps(made.data).encode(),
            'urdf': to_urdf(doll).encode(), 'yaml': path.read_bytes()}


def damaged(data, seed):
    """Up to 20 bytes changed, a piece cut out, or one repeated; in turn, and all three."""
    random = np.random.default_rng(seed)
    data = bytearray(data)
    # Half of the damage near the front, which is where the structure is.
    reach = len(data) if seed % 2 else min(len(data), 3000)
    start, end = sorted(random.integers(0, reach, 2))
    if seed % 4 in (0, 3):
        for at in random.integers(0, reach, random.integers(1, 21)):
            data[at] = random.integers(0, 256)
    if seed % 4 in (1, 3):
        del data[start:end + 1]
    if seed % 4 in (2, 3):
        data[start:start] = data[start:end + 1] * random.integers(1, 4)
    return bytes(data)


def write(folder, whole, seeds):
    """Paths of one damaged file for each seed, the kinds in turn."""
    paths = []
    for seed in seeds:
        kind = KINDS[seed // 4 % 4]
        paths.append(folder / f'seed_{seed}.{kind}')
        paths[-1].write_bytes(damaged(whole[kind], seed))
    return paths


def is_one_sentence(error, path):
    """Whether it is one; of a doll's YAML, all errors at once, one a line."""
    first, *more = error.splitlines()
    return (first.startswith('ragdoll_fit: ') and path.name in first and 'Traceback' not in error
            and (not more or path.suffix == '.yaml'))


@pytest.mark.parametrize('seed', range(48))
def test_a_damaged_file_is_fitted_or_refused_in_one_sentence(tmp_path, whole, capsys, seed):
    path, = write(tmp_path, whole, [seed])
    code = main([str(path), '-o', str(tmp_path / 'out.yaml')])
    error = capsys.readouterr().err
    assert code in (0, 2)
    assert error == '' if code == 0 else is_one_sentence(error, path)
    assert (tmp_path / 'out.yaml').exists() == (code == 0)


def run(paths):
    """Exit codes and the peak of memory, kB, of a process that fits all of them."""
    done = subprocess.run([sys.executable, '-c', CHILD, *map(str, paths)], capture_output=True,
                          text=True, cwd=Path(__file__).parent.parent, timeout=500, check=True)
    *said, codes, peak = done.stderr.splitlines()
    assert 'Traceback' not in done.stderr
    return said, [int(code) for code in codes.split()], int(peak)


def test_two_hundred_of_them_in_little_memory(tmp_path, whole):
    sound = [tmp_path / f'sound.{kind}' for kind in KINDS]
    for path in sound:
        path.write_bytes(whole[path.suffix[1:]])
    paths = write(tmp_path, whole, range(1000, 1200))
    said, codes, least = run(sound)
    assert (said, codes) == ([], [0] * 4)
    said, codes, peak = run(paths)
    assert set(codes) == {0, 2}
    # Most damage is such that nothing can be made of the file.
    assert codes.count(2) > 100
    assert sum(line.startswith('ragdoll_fit: ') for line in said) == codes.count(2)
    assert peak - least < MOST_MORE


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_weights_that_are_no_numbers_are_taken_as_zero_and_counted(tmp_path, capsys, bad):
    """Of every tenth vertex the first weight: the doll is that of a file with zeros there."""
    from ragdoll_ros.fit.reading.character import read_character
    read = []
    for name, value in (('zero', 0.0), ('bad', bad)):
        made = document(RIGS['mixamo'])
        primitive = made.data['meshes'][0]['primitives'][0]
        accessor = made.data['accessors'][primitive['attributes']['WEIGHTS_0']]
        view = made.data['bufferViews'][accessor['bufferView']]
        start = view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
        blob = bytearray(made.blob)
        weights = np.frombuffer(blob, '<f4', 4 * accessor['count'], start).reshape(-1, 4)
        weights[::10, 0] = value
        made.blob = bytes(blob)
        (tmp_path / f'{name}.glb').write_bytes(made.glb())
        read.append(read_character(tmp_path / f'{name}.glb'))
        assert main([str(tmp_path / f'{name}.glb')]) == 0
    zero, repaired = read
    assert np.array_equal(zero.weights, repaired.weights)
    assert np.array_equal(zero.vertices, repaired.vertices)
    count = len(zero.vertices)
    assert (f'weights of {-(-count // 10)} of {count} vertices are no numbers: taken as 0'
            in capsys.readouterr().out)
