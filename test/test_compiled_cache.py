"""Where machine code is kept, what is said about it, and what goes without."""
import os
import subprocess
import sys
import threading
import zipfile
from pathlib import Path

import pytest

pytest.importorskip('numba')

from ragdoll_ros.physics.kernels.compiling import cache, notices

ROOT = Path(cache.__file__).resolve().parents[4]
"""Where the package is that is tested: here or installed."""

USE = """
from ragdoll_ros import Simulation, load_scene
for name, accuracy in (('article', 'draft'), ('flight', 'exact'), ('crowd', 'normal')):
    with Simulation(load_scene(name), accuracy=accuracy) as simulation:
        simulation.grab('hand', simulation.scene.bone_names[0])
        for _ in range(100 if name == 'article' else 20):
            simulation.advance()
"""
AGAIN = 'from ragdoll_ros.physics.kernels.__main__ import main; main([])'
READY = 'from ragdoll_ros.physics.kernels import ready; print(ready())'
SAMPLE = """
from ragdoll_ros.physics.kernels.compiling.decorators import REAL, entry

@entry(REAL)
def double(x):
    return 2 * x

print(double(3.0))
"""


def run(*arguments, **variables):
    """Run Python; give the exit code, what it prints, and the lines it says beside that."""
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, cwd='/',
        timeout=120,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join([str(ROOT), *sys.path[1:]]),
             **{name: str(value) for name, value in variables.items()}})
    return done.returncode, done.stdout.strip(), done.stderr.splitlines()


@pytest.fixture
def sample(tmp_path):
    """A program that imports a function to compile as if it were the package's."""
    (tmp_path / 'sample.py').write_text(SAMPLE)
    return (f'import ragdoll_ros.physics.kernels as k; k.__path__.append({str(tmp_path)!r}); '
            'import ragdoll_ros.physics.kernels.sample')


@pytest.fixture
def archive(tmp_path):
    """Paths to import by, the package from an archive: nothing tells when its sources change."""
    archive = tmp_path / 'archive'
    with zipfile.ZipFile(archive, 'w') as files:
        for path in ROOT.glob('ragdoll_ros/**/*.py'):
            files.write(path, path.relative_to(ROOT))
    return os.pathsep.join([str(archive), *sys.path[1:]])


def test_where_nothing_can_be_kept_it_compiles_all_the_same_and_says_so(sample, archive):
    """The whole, moving, is in test_without_numba.py, slow."""
    code, printed, said = run('-c', sample, PYTHONPATH=archive)
    assert (code, printed) == (0, '6.0')
    assert said == [notices.COMPILING.format(notices.EVERY_TIME)]


def test_one_process_loads_or_compiles_at_a_time(monkeypatch):
    """The other one waits, says so, and goes on when the first has done."""
    monkeypatch.setattr(cache, 'PATIENCE', 0.05)
    told, entered = [threading.Event() for _ in range(2)]
    said = []
    monkeypatch.setattr(notices, 'say', lambda words: said.append(words) or told.set())

    def enter():
        with cache.compile_lock('rigid'):
            entered.set()

    other = threading.Thread(target=enter)
    with cache.compile_lock('rigid'):
        other.start()
        assert told.wait(10) and not entered.is_set()
    assert entered.wait(10)
    other.join()
    assert said == [notices.WAITING]


def test_it_is_told_where_nothing_can_be_compiled():
    off = {'NUMBA_DISABLE_JIT': '1'}
    assert run('-c', READY, **off) == (0, 'False', [])
    code, _, said = run('-m', 'ragdoll_ros.physics.kernels', **off)
    assert code == 2 and 'NUMBA_DISABLE_JIT' in said[-1]


def test_compiling_beforehand_leaves_nothing_to_compile():
    """What `make` does after it has installed all; the second time it has nothing to do."""
    assert run('-m', 'ragdoll_ros.physics.kernels')[0] == 0
    code, printed, said = run('-c', AGAIN + USE)
    assert code == 0 and not any('ompil' in line for line in said), said
    assert str(cache.FOLDER) in printed
