"""The whole timeline as files."""
from __future__ import annotations

import importlib.util
import io
import zipfile
from pathlib import Path

from ...fit.skin import skins_of
from ...recordings.recording import Recording
from ...recordings.save import FORMATS, encoded_files

CAN_WRITE_MCAP = importlib.util.find_spec('mcap') is not None


def export_zip(recording: Recording) -> bytes:
    """A ZIP file of a run in all formats that can be written here.

    A doll whose skin cannot be loaded is exported with its bones; the page shows the reason.
    """
    skins = skins_of(recording.scene, lambda _: None)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED) as archive:
        for suffix in FORMATS:
            if suffix != '.mcap' or CAN_WRITE_MCAP:
                for path, content in encoded_files(recording, Path('run' + suffix), skins).items():
                    archive.writestr(str(path), content)
    return stream.getvalue()
