"""A run in all the formats that there are, as one file to be sent to a page."""
from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

from ...fit.skin import skins_of
from ...recordings.recording import Recording
from ...recordings.save import FORMATS, encoded_files


def zipped(recording: Recording, name: str, can_write: Callable[[str], bool]) -> bytes:
    """A ZIP of ``name`` in each of the FORMATS whose suffix ``can_write``.

    Dolls whose skin fails show their bones, as on the page, which says why.
    """
    skins = skins_of(recording.scene, lambda _: None)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED) as package:
        for suffix in filter(can_write, FORMATS):
            for path, content in encoded_files(recording, Path(name + suffix), skins).items():
                package.writestr(str(path), content)
    return stream.getvalue()
