"""Silence what a C library prints to standard output and standard error."""
import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager


@contextmanager
def silenced_output() -> Iterator[None]:
    """Redirect the process's standard output and standard error to the null device."""
    with ExitStack() as streams:
        for stream in (1, 2):
            streams.enter_context(_silenced(stream))
        yield


@contextmanager
def _silenced(stream: int) -> Iterator[None]:
    try:
        kept = os.dup(stream)
    except OSError:  # the stream is closed
        yield
        return
    _flush()
    with open(os.devnull, 'wb') as null:
        os.dup2(null.fileno(), stream)
    try:
        yield
    finally:
        _flush()  # buffered output would appear after the redirection
        os.dup2(kept, stream)
        os.close(kept)


def _flush() -> None:
    ctypes.CDLL(None).fflush(None)
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and not stream.closed:
            stream.flush()
