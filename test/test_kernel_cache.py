"""Machine code of a small package is kept, found again, thrown away, and done without."""
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('numba')

from numba.core import caching

from ragdoll_ros.physics.kernels.compiling import cache, notices

FRAME = Path(cache.__file__).parent
INNER = """
from .compiling.decorators import compiled

@compiled
def doubled(x):
    return 2 * x
"""
OUTER = """
from .inner import doubled
from .compiling.decorators import REAL, entry

@entry(REAL)
def more(x):
    return doubled(x) + 1

@entry(REAL)
def yet_more(x):
    return more(x) + 10
"""
USE = """
from tiny.compiling.cache import compile_lock
with compile_lock('tiny'):
    from tiny.outer import more, yet_more
print(more(3.0), yet_more(3.0))
"""
ONCE = notices.COMPILING.format(notices.ONCE)
EVERY_TIME = notices.COMPILING.format(notices.EVERY_TIME)

NO_RIGHTS = """
import ctypes
assert ctypes.CDLL(None).capset((ctypes.c_uint32 * 2)(0x20080522), (ctypes.c_uint32 * 6)()) == 0
"""
"""Root gives up its capabilities, so that it may write no more than a file's mode says: capset(2)
with _LINUX_CAPABILITY_VERSION_3 and empty sets."""

SMALL_FILES = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
"""
"""Writing a kernel fails after 1000 bytes, as on a disk that is full by then."""


FORKS = """
import json, os, pathlib, sys, traceback
import numba

numba.njit('f8(f8)')(lambda x: x + 1)
sys.dont_write_bytecode = True
for line in sys.stdin:
    piece = json.loads(line)
    places = [pathlib.Path(piece['folder'], name) for name in ('printed', 'said')]
    if not (child := os.fork()):
        status = 1
        try:
            for number, place in enumerate(places, 1):
                os.dup2(os.open(place, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            sys.path[:] = piece['paths']
            os.environ.update(piece['variables'])
            numba.config.reload_config()
            exec(piece['code'], {'__name__': '__main__'})
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(json.dumps([status, *(place.read_text() for place in places)]), flush=True)
"""
"""For each line on stdin one of a process's forks: what it ends with, prints and says."""

PATIENCE = 60.0
"""s that the end of a process may take."""


@pytest.fixture
def tiny(tmp_path):
    """A package of two kernels, one of which calls the other, in two files."""
    return made(tmp_path)


@pytest.fixture(scope='module')
def compiled(tmp_path_factory):
    """Such a package that has run."""
    package = made(tmp_path_factory.mktemp('compiled'))
    run(package)
    return package


@pytest.fixture
def ran(tiny, compiled):
    """Such a package with the code that the other has kept, as if it had run itself."""
    own = caching._CacheLocator.get_suitable_cache_subpath(str(tiny / FRAME.name / 'cache.py'))
    shutil.copytree(folder(compiled), tiny.parent / 'kept' / own)
    return tiny


def made(place):
    """Write the package."""
    package = place / 'tiny'
    shutil.copytree(FRAME, package / FRAME.name, ignore=shutil.ignore_patterns('__pycache__'))
    (package / '__init__.py').touch()
    (package / 'inner.py').write_text(INNER)
    (package / 'outer.py').write_text(OUTER)
    return package


class Numba:
    """A process that has imported numba and forks for each piece of Python.

    What numba's import and the making of its first function take, each piece would take anew.
    """

    def __init__(self):
        self._process = subprocess.Popen([sys.executable, '-c', FORKS], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, cwd='/', text=True)

    def run(self, **piece):
        """Run code with paths and variables of its own; exit code, stdout, stderr."""
        print(json.dumps(piece), file=self._process.stdin, flush=True)
        return json.loads(self._process.stdout.readline())

    def close(self):
        self._process.stdin.close()
        assert self._process.wait(PATIENCE) == 0
        self._process.stdout.close()


@pytest.fixture(scope='module', autouse=True)
def numba_process():
    Numba.only = Numba()
    yield
    Numba.only.close()


def run(tiny, code=USE):
    """Run Python; give what it prints, and the lines it says beside that."""
    status, printed, said = Numba.only.run(
        code=code, paths=[str(tiny.parent), *sys.path[1:]],
        variables={'NUMBA_CACHE_DIR': str(tiny.parent / 'kept')}, folder=str(tiny.parent))
    assert status == 0, said
    return printed.strip(), said.splitlines()


def folder(tiny):
    """Where the code is kept."""
    found, = (tiny.parent / 'kept').iterdir()
    return found


def kept(tiny):
    """The files of kernels that are kept."""
    return sorted(folder(tiny).glob('*.nb*'))


def test_code_is_compiled_once(tiny):
    assert run(tiny) == ('7.0 17.0', [ONCE])
    assert run(tiny) == ('7.0 17.0', [])
    assert [path.name.partition('-')[0] for path in kept(tiny)] == ['outer.more', 'outer.yet_more']


def test_a_change_of_any_file_is_noticed(ran):
    tiny = ran
    before = kept(tiny)
    (tiny / 'inner.py').write_text(INNER.replace('2 * x', '5 * x'))
    assert run(tiny) == ('16.0 26.0', [ONCE])
    assert len(kept(tiny)) == 2 and not set(before) & set(kept(tiny)), 'the old ones are gone'
    (tiny / 'inner.py').rename(tiny / 'other.py')
    (tiny / 'outer.py').write_text(OUTER.replace('.inner', '.other'))
    assert run(tiny) == ('16.0 26.0', [ONCE])


def test_what_others_keep_there_stays(ran):
    tiny = ran
    notes, old, foreign = (folder(tiny) / name for name in (
        'notes.txt', 'kernels.step-413.py311.1.nbc', 'kernels.nbc'))
    for path in (notes, old, foreign):
        path.touch()
    (tiny / 'inner.py').write_text(INNER.replace('2 * x', '5 * x'))
    run(tiny)
    assert notes.exists() and foreign.exists() and not old.exists()


def test_what_is_missing_or_damaged_is_compiled_again(ran):
    tiny = ran
    first, second = kept(tiny)
    whole = second.read_bytes()
    second.write_bytes(whole[:len(whole) // 2])
    assert run(tiny) == ('7.0 17.0', [ONCE])
    first.unlink()
    assert run(tiny) == ('7.0 17.0', [ONCE])
    assert run(tiny) == ('7.0 17.0', [])


def test_a_folder_that_is_read_only_is_done_without(tiny):
    empty = tiny.parent / 'kept'
    empty.mkdir(mode=0o555)
    assert run(tiny, NO_RIGHTS + USE) == ('7.0 17.0', [EVERY_TIME])
    assert not list(empty.iterdir())


def test_what_is_kept_in_a_read_only_folder_is_used(ran):
    """As in an image that was made with other rights than those it is run with."""
    tiny = ran
    folder(tiny).chmod(0o555)
    assert run(tiny, NO_RIGHTS + USE) == ('7.0 17.0', [])
    kept(tiny)[0].chmod(0)
    printed, said = run(tiny, NO_RIGHTS + USE)
    assert printed == '7.0 17.0' and said[0] == ONCE and len(said) == 2
    assert 'Permission denied' in said[1]


def test_a_disk_that_is_full_is_told_once(tiny):
    printed, (compiling, lost) = run(tiny, SMALL_FILES + USE)
    assert (printed, compiling) == ('7.0 17.0', ONCE)
    assert lost.startswith(notices.NOT_KEPT.partition('{')[0]) and 'File too large' in lost
    assert not kept(tiny), 'nothing half-written stays'
    assert run(tiny) == ('7.0 17.0', [ONCE]), 'and it is kept when there is room again'
    assert run(tiny) == ('7.0 17.0', [])


@pytest.mark.parametrize('file_instead', [False, True])
def test_a_folder_may_go_while_it_runs(tiny, file_instead):
    """It is made anew; where that is impossible nothing is kept."""
    gone = 'import shutil, tiny.compiling.cache\nshutil.rmtree(tiny.compiling.cache.FOLDER)\n'
    if file_instead:
        gone += 'tiny.compiling.cache.FOLDER.touch()\n'
    printed, said = run(tiny, gone + USE)
    assert printed == '7.0 17.0' and said[0] == ONCE and len(said) == 1 + file_instead
    assert len(list(folder(tiny).glob('*.nbc'))) == (0 if file_instead else 2)


def test_other_functions_are_kept_as_numba_does(tiny):
    (tiny.parent / 'alien.py').write_text(
        'import numba\n\n@numba.njit(cache=True)\ndef half(x):\n    return x / 2\n')
    run(tiny, USE + 'import alien\nalien.half(3.0)')
    assert [path.name.partition('-')[0] for path in (tiny.parent / 'kept').rglob('*.nbi')] == [
        'alien.half']


def test_ctrl_c_ends_compilation_without_a_traceback(tmp_path):
    """Of the command, as it begins to compile all kernels."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'ragdoll_ros.physics.kernels'], stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)})
    said = process.stdout.readline()
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=60)
    assert notices.COMPILING.partition(',')[0] in said and not rest
    assert process.returncode == -signal.SIGINT
