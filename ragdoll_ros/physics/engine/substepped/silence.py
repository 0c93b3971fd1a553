"""Keeps what a library prints by C's own means, on its import say, from being seen."""
from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

STREAMS = (1, 2)
"""Standard output and standard error."""


@contextmanager
def hushed() -> Iterator[None]:
    """Let standard output and standard error lead nowhere meanwhile, for all of the process."""
    with ExitStack() as streams:
        for stream in STREAMS:
            streams.enter_context(_hushed(stream))
        yield


@contextmanager
def _hushed(stream: int) -> Iterator[None]:
    try:
        kept = os.dup(stream)
    except OSError:  # it is closed: nothing is seen anyway
        yield
        return
    _flush()
    with open(os.devnull, 'wb') as nowhere:
        os.dup2(nowhere.fileno(), stream)
    try:
        yield
    finally:
        _flush()  # what is held back would come out later
        os.dup2(kept, stream)
        os.close(kept)


def _flush() -> None:
    ctypes.CDLL(None).fflush(None)
    for stream in (sys.stdout, sys.stderr):
        if stream is not None and not stream.closed:
            stream.flush()
