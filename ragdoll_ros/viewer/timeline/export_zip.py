"""Exports a run in all available formats as one ZIP file."""
from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

from ...fit.skin import skins_of
from ...recordings.recording import Recording
from ...recordings.save import FORMATS, encoded_files


def export_zip(recording: Recording, name: str, can_write: Callable[[str], bool]) -> bytes:
    """A ZIP file of ``name`` in each of the FORMATS whose suffix satisfies ``can_write``.

    A doll whose skin cannot be loaded is exported with its bones; the page shows the reason.
    """
    skins = skins_of(recording.scene, lambda _: None)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED) as archive:
        for suffix in filter(can_write, FORMATS):
            for path, content in encoded_files(recording, Path(name + suffix), skins).items():
                archive.writestr(str(path), content)
    return stream.getvalue()
