"""Machine code of what tests compile around kernels, kept for the next run as that of kernels is.

A file's name has a digest of all kernels, of the test's file and of the types of the arguments.
"""
from __future__ import annotations

import contextlib
import functools
import hashlib
from pathlib import Path

import numba
from conftest import ROOT

from ragdoll_ros.physics.kernels.compiling.cache import KEY, KernelCache, _keep, machine_code

FOLDER = ROOT / '.pytest_cache' / 'machine_code'


class KeptCode(KernelCache):
    """What numba asks for the code of one function, each signature in a file of its own."""

    def __init__(self, function):
        self._name = f'{function.__module__}.{function.__qualname__}'
        self._source = Path(function.__code__.co_filename).read_bytes()

    def _path_for(self, sig):
        known = hashlib.sha256(self._source + repr(sig).encode()).hexdigest()[:16]
        return FOLDER / f'{self._name}.{known}-{KEY}.nbc'

    def load_overload(self, sig, target_context):
        self._path = self._path_for(sig)
        return super().load_overload(sig, target_context)

    def save_overload(self, sig, data):
        if not data.library.has_dynamic_globals:
            with contextlib.suppress(OSError):
                _keep(self._path_for(sig), machine_code(data._reduce()))


def kept(function=None, **options):
    """As numba.njit, of a module's function; a later process loads what the first has compiled."""
    if function is None:
        return functools.partial(kept, **options)
    dispatcher = numba.njit(function, **options)
    dispatcher._cache = KeptCode(function)
    return dispatcher
