"""Where numba keeps machine code for the next process, and what is said while there is none yet.

Numba keeps it beside the source, or in the user's cache folder where that is not writable.
"""
from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numba
from numba.core import event

COMPILING = 'Compiling the dynamics: 15 s or more, {}'
ONCE = 'once'
EVERY_TIME = ('at every start, as no folder to keep the result in can be written to; the variable '
              'NUMBA_CACHE_DIR may name one')
WAITING = 'Another process compiles the dynamics: waiting for it'

PATIENCE = 1.0
"""s to wait for another process without a word: it may just be loading what was kept."""


def _folder() -> Path | None:
    """Where code of this folder's files is kept; None where there is no such place."""
    try:
        return Path(numba.njit(cache=True)(_folder).stats.cache_path)
    except RuntimeError:
        return None


FOLDER = _folder()
KEPT = FOLDER is not None
"""Whether code can be kept: what numba's ``cache`` must be, which else refuses to compile."""


def say(words: str) -> None:
    """Tell who started the program, whose own output is not for this."""
    print(words, file=sys.stderr, flush=True)


class Teller(event.Listener):
    """Says once what takes so long; code that is loaded is no news."""

    def __init__(self) -> None:
        self.told = False

    def on_start(self, event: event.Event) -> None:
        """Numba begins to compile a function."""
        module = event.data['dispatcher'].py_func.__module__ or ''
        if not self.told and module.startswith(__package__):
            self.told = True
            say(COMPILING.format(ONCE if KEPT else EVERY_TIME))

    def on_end(self, event: event.Event) -> None:
        """Nothing to say: others follow."""


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Let processes compile one after another: the next one finds what the first has kept.

    At once, all would do the same work; and the files of a function's variants are numbered in
    the order in which a process meets them, so that two may take the same name for different code.
    """
    with contextlib.ExitStack() as stack:
        if FOLDER is not None:
            with contextlib.suppress(OSError, ImportError):  # a system without such locks
                lock = os.open(FOLDER / 'ragdoll_ros.lock', os.O_RDONLY | os.O_CREAT, 0o666)
                stack.callback(os.close, lock)
                _wait_for(lock)
        yield


def _wait_for(lock: int) -> None:
    import fcntl
    word = threading.Timer(PATIENCE, say, (WAITING,))
    word.start()
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
    finally:
        word.cancel()


event.register('numba:compile', Teller())
