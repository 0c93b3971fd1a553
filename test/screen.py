"""A terminal's other side: what a program writes on it, and keys for it."""
from __future__ import annotations

import os
import re
import select
import time

from peer import PATIENCE


class Screen:
    """What a program on a terminal has written, and keys for it."""

    def __init__(self, terminal):
        self.text = ''
        self._terminal = terminal

    def type(self, keys):
        os.write(self._terminal, keys)

    def read(self, patience=0.0):
        """Take what comes within ``patience`` s; False once the program has gone."""
        if select.select([self._terminal], [], [], patience)[0]:
            try:
                self.text += os.read(self._terminal, 65536).decode('utf-8', 'replace')
            except OSError:
                return False
        return True

    def shows(self, pattern):
        """Tell whether the pattern has come up since the last match, which is then forgotten."""
        if not self.read(0.1):
            return False
        match = re.search(pattern, self.text)
        if match:
            self.text = self.text[match.end():]
        return bool(match)

    def wait(self, pattern):
        end = time.monotonic() + PATIENCE
        while not self.shows(pattern):
            assert time.monotonic() < end, f'{pattern} did not come up in {self.text[-500:]}'
