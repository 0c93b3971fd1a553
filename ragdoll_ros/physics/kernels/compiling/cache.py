"""Cache of machine code on disk, one file for each function that Python calls.

Numba's own cache notices changes of the file of the called function, but not of the files of those
that it calls, and fails where it cannot write. Here a file's name has a digest of all kernels;
without a folder to write to, all is compiled at every start.
"""
from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import os
import pickle
import re
import sysconfig
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import numba
import numpy as np
from llvmlite import binding
from numba.core import caching, compiler, event, registry, serialize
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.misc.appdirs import AppDirs

from . import notices

PATIENCE = 1.0
"""s to wait for another process without a message: it may only be loading its cache."""

KERNELS, SOURCES = __package__.rpartition('.')[0], Path(__file__).parent.parent
"""The package of all kernels, and its folder."""

OURS = re.compile(r'[\w.]+-[0-9a-f]{16}-[0-9a-f]{8}\.nbc(\.\d+)?'  # path.pid while written
                  r'|[\w.]+-\d+\.py\d+\w*(\.\d+)?\.nb[ic]')  # as numba itself names them


def digest(folder: Path) -> str:
    """Digest, 16 hex digits, of the names and contents of all Python files below a folder."""
    found = hashlib.sha256()
    for path in sorted(folder.rglob('*.py')):
        content = path.read_bytes()
        found.update(f'{path.relative_to(folder)} {len(content)} '.encode() + content)
    return found.hexdigest()[:16]


def _machine() -> str:
    """Digest, 8 hex digits, of what machine code depends on beside the kernels: the Python ABI, the
    versions of numba and NumPy, and the processor.
    """
    processor = registry.cpu_target.target_context.codegen().magic_tuple()
    known = sysconfig.get_config_var('SOABI'), numba.__version__, np.__version__, processor
    return hashlib.sha256(repr(known).encode()).hexdigest()[:8]


DIGEST = digest(SOURCES)
KEY = f'{DIGEST}-{_machine()}'


def _places() -> list[Path]:
    """Folders for the cache, the preferred one first: those that numba would choose from."""
    if not any(SOURCES.glob('*.py')):  # in an archive: no telling when the sources change
        return []
    own = caching._CacheLocator.get_suitable_cache_subpath(__file__)
    if numba.config.CACHE_DIR:
        return [Path(numba.config.CACHE_DIR, own)]
    return [SOURCES / '__pycache__', Path(AppDirs('numba', False).user_cache_dir, own)]


def _serves(place: Path) -> bool:
    """Whether a folder has this version's code already, even if read-only, or can be written to. It
    is created if there is none.
    """
    try:
        if any(place.glob(f'*-{KEY}.nbc')):
            return True
        place.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=place).close()
    except OSError:
        return False
    return True


FOLDER = next(filter(_serves, _places()), None)
KEPT = FOLDER is not None
"""Whether there is a folder for the cache."""


class KernelCache(caching._Cache):
    """Numba's cache interface, for one function of a module, compiled for one signature."""

    failure: ClassVar[OSError | None] = None
    """The first error of saving; nothing is saved after it."""

    def __init__(self, function: Callable) -> None:
        module = function.__module__.removeprefix(f'{KERNELS}.')
        self._path = FOLDER / f'{module}.{function.__qualname__}-{KEY}.nbc'

    @property
    def cache_path(self) -> str:
        """The cache's folder."""
        return str(FOLDER)

    def load_overload(self, sig: tuple, target_context: object) -> compiler.CompileResult | None:
        """The compiled function from the cache; None if it is missing or damaged.

        Only the runtime of arrays is set up first. Numba's own cache sets up all that it compiles
        with, and SciPy, which takes twice as long as the rest; the compiler does so when it begins.
        """
        rtsys.initialize(target_context)
        try:
            kept, called_code = pickle.loads(self._path.read_bytes())
            loaded = compiler.CompileResult._rebuild(target_context, *kept)
        except Exception:  # a pickle that was damaged may raise anything
            return None
        loaded.library._get_module_for_linking = functools.partial(
            binding.parse_bitcode, called_code)
        return loaded

    def save_overload(self, sig: tuple, data: compiler.CompileResult) -> None:
        """Save the compiled function, unless it contains addresses of this process."""
        if KernelCache.failure is None and not data.library.has_dynamic_globals:
            try:
                _keep(self._path, machine_code(data._reduce()))
            except OSError as error:
                KernelCache.failure = error
                notices.say(notices.NOT_KEPT.format(error))

    def enable(self) -> None:
        """Do nothing, as disable() and flush(): the cache is always used, and never emptied."""

    def disable(self) -> None:
        """See enable."""

    def flush(self) -> None:
        """See enable."""


def machine_code(kept: tuple) -> bytes:
    """Serialize ``kept``, what numba keeps of a compiled function, to the content of a cache file
    that loads fast.

    Two things take most of numba's time to load. It parses the LLVM IR for the names that it
    defines, though only compiled callers link it in: the file has a short IR that defines the one
    name that numba looks up, and the whole IR apart, for callers. It imports the module of each
    function that was linked in, SciPy for one, with that function's environment: environments
    without constants, which nothing reads, are left out.
    """
    (name, kind, (code, called_code)), described, *rest, environments = kept
    entry = binding.parse_assembly(
        f'define void @"{described.llvm_cpython_wrapper_name}"() {{ ret void }}')
    short = ((name, kind, (code, entry.as_bitcode())), described, *rest,
             tuple(environment for environment in environments if environment.consts))
    return serialize.dumps((short, called_code))


def _keep(path: Path, content: bytes) -> None:
    """Write a file atomically, after deleting this package's files of other digests beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    for other in path.parent.iterdir():
        if OURS.fullmatch(other.name) and f'-{DIGEST}-' not in other.name:
            other.unlink(missing_ok=True)
    temporary = path.with_name(f'{path.name}.{os.getpid()}')
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def keep(dispatcher: Dispatcher) -> None:
    """Make numba look for a function's code in the cache, and save it there."""
    if KEPT:
        dispatcher._cache = KernelCache(dispatcher.py_func)


@contextlib.contextmanager
def compile_lock(group: str) -> Iterator[None]:
    """Hold the lock of a ``group`` of kernels: one process at a time compiles it, and those that
    wait load what it saved. Where files cannot be locked, go on without a lock. Garbage collection
    is off within, which saves a seventh of the time. Ctrl-C raises KeyboardInterrupt as usual,
    after printing notices.INTERRUPTED if this process has begun to compile kernels.
    """
    with contextlib.ExitStack() as stack:
        if gc.isenabled():
            gc.disable()
            stack.callback(gc.enable)
        if FOLDER is not None:
            with contextlib.suppress(OSError, ImportError):  # a system without such locks
                lock = os.open(FOLDER / f'{group}.lock', os.O_RDONLY | os.O_CREAT, 0o666)
                stack.callback(os.close, lock)
                _lock_file(lock)
        try:
            yield
        except KeyboardInterrupt:
            if TELLER.told:
                notices.say(notices.INTERRUPTED)
            raise


def _lock_file(lock: int) -> None:
    """Take the exclusive lock of an open file, however long it takes; after PATIENCE s, say why."""
    import fcntl
    word = threading.Timer(PATIENCE, notices.say, (notices.WAITING,))
    word.start()
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
    finally:
        word.cancel()


TELLER = notices.Teller(notices.ONCE if KEPT else notices.EVERY_TIME)
event.register('numba:compile', TELLER)
