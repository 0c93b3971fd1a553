"""What can be done on a page, said once to each that opens it."""
from __future__ import annotations

import viser

PERIOD = 20.0
"""s that it stays, unless it is closed."""

KEYS = ('Drag a bone with the mouse. Arrow keys push: tap or hold. Space pauses, R starts again, '
        'E edits.')


def hint(client: viser.ClientHandle) -> None:
    """Say it; a page that cannot be told has gone."""
    client.add_notification('Try it', KEYS, auto_close_seconds=PERIOD)
