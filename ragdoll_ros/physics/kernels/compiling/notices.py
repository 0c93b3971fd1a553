"""Messages about compiling, on standard error: standard output is the program's own."""
from __future__ import annotations

import sys

from numba.core import event

COMPILING = 'Compiling the dynamics: a minute or two, {}'
ONCE = 'once'
EVERY_TIME = ('at every start, as no folder to keep the result in can be written to; the variable '
              'NUMBA_CACHE_DIR may name one')
NOT_KEPT = 'The compiled dynamics are not kept, the next start compiles them again: {}'
INTERRUPTED = 'Ending: the next start compiles what is missing'
WAITING = 'Another process compiles the dynamics: waiting for it'


def say(words: str) -> None:
    """Print a message to standard error."""
    print(words, file=sys.stderr, flush=True)


class Teller(event.Listener):
    """Prints once that kernels are compiled; nothing for code from the cache."""

    def __init__(self, often: str) -> None:
        self._often = often
        self.told = False
        """Whether a kernel has been compiled."""

    def on_start(self, event: event.Event) -> None:
        """Print the message if numba begins to compile a kernel."""
        module = event.data['dispatcher'].py_func.__module__ or ''
        if not self.told and module.startswith(__package__.rpartition('.')[0]):
            self.told = True
            say(COMPILING.format(self._often))

    def on_end(self, event: event.Event) -> None:
        """Do nothing: other functions follow."""
