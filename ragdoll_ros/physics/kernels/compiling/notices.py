"""What is said about compiling, on standard error: a program's own output is not for this."""
from __future__ import annotations

import sys

from numba.core import event

COMPILING = 'Compiling the dynamics: less than a minute, {}'
ONCE = 'once'
EVERY_TIME = ('at every start, as no folder to keep the result in can be written to; the variable '
              'NUMBA_CACHE_DIR may name one')
NOT_KEPT = 'The compiled dynamics are not kept, the next start compiles them again: {}'
WAITING = 'Another process compiles the dynamics: waiting for it'


def say(words: str) -> None:
    """Tell who started the program."""
    print(words, file=sys.stderr, flush=True)


class Teller(event.Listener):
    """Says once what takes so long; code that is loaded is no news."""

    def __init__(self, often: str) -> None:
        self._often = often
        self._told = False

    def on_start(self, event: event.Event) -> None:
        """Numba begins to compile a function."""
        module = event.data['dispatcher'].py_func.__module__ or ''
        if not self._told and module.startswith(__package__.rpartition('.')[0]):
            self._told = True
            say(COMPILING.format(self._often))

    def on_end(self, event: event.Event) -> None:
        """Nothing to say: others follow."""
