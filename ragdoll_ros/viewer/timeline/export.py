"""The whole timeline as files."""
from __future__ import annotations

import importlib.util
import io
import zipfile
from pathlib import Path

from ...recordings.recording import Recording
from ...recordings.save import FORMATS, encoded_files

CAN_WRITE_MCAP = importlib.util.find_spec('mcap') is not None


def export_zip(recording: Recording) -> bytes:
    """A ZIP file of a run in all formats that can be written here.

    A character whose file cannot be read is exported as its doll; the page shows the reason.
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED) as archive:
        for suffix in FORMATS:
            if suffix != '.mcap' or CAN_WRITE_MCAP:
                found = encoded_files(recording, Path('run' + suffix), lambda _: None)
                for path, content in found.items():
                    archive.writestr(str(path), content)
    return stream.getvalue()
