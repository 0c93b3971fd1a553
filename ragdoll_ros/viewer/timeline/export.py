"""The timeline, or a part of it, as files."""
from __future__ import annotations

import importlib.util
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import viser

from ...recordings.recording import Recording
from ...recordings.save import FORMATS, encoded_files
from .frame_buffer import Clip

CAN_WRITE_MCAP = importlib.util.find_spec('mcap') is not None

LAST_RUN, PART, ALL = 'from the last reset', 'from ... to ...', 'the whole timeline'
"""What can be exported."""

NOTHING = 'Nothing is kept from {:g} to {:g} s: the last run is kept from {:g} to {:g} s.'


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


class ExportPanel:
    """A button that sends files, and fields for their content, in the current GUI container.

    ``clip`` gives the whole timeline, or None before the first frame. The choice is the same on all
    pages.
    """

    def __init__(self, gui: viser.GuiApi, clip: Callable[[], Clip | None]) -> None:
        self._clip = clip
        self.choice = gui.add_dropdown(
            'Export', (LAST_RUN, PART, ALL), initial_value=LAST_RUN,
            hint='Simulated time since the last reset, or all that the timeline shows')
        self.first, self.last = (gui.add_number(label, 0.0, min=0.0, visible=False)
                                 for label in ('From, s', 'To, s'))
        button = gui.add_button('Export: glTF, BVH, CSV, MCAP', icon=viser.Icon.DOWNLOAD,
                                hint='As run.zip, with times from its beginning; glTF for Blender')
        self.choice.on_update(lambda _: self._show_times())
        button.on_click(self._send)

    def chosen(self) -> Clip | None:
        """What is to be exported; None before the first frame. ValueError if none of it is kept."""
        clip = self._clip()
        if clip is None or self.choice.value == ALL:
            return clip
        run = clip.run(len(clip.times) - 1)
        if self.choice.value == LAST_RUN:
            return clip.part(run)
        times = np.array([clip.frame(index).time for index in run])
        first, last = self.first.value, self.last.value
        # Numbers of fields are rounded to decimals.
        begin = int(np.searchsorted(times, first - 5e-10))
        end = int(np.searchsorted(times, last + 5e-10, 'right'))
        if begin >= end:
            raise ValueError(NOTHING.format(first, last, times[0], times[-1]))
        return clip.part(run[begin:end])

    def _show_times(self) -> None:
        """Show the fields of times if a part is chosen, filled with the last run's times."""
        clip, is_part = self._clip(), self.choice.value == PART
        self.first.visible = self.last.visible = is_part
        if is_part and clip is not None:
            run = clip.run(len(clip.times) - 1)
            self.first.value, self.last.value = (
                round(clip.frame(index).time, 6) for index in (run[0], run[-1]))

    def _send(self, event: viser.GuiEvent) -> None:
        """Send the files to the page that asked for them, or say why there are none."""
        if event.client is None:
            return
        try:
            clip = self.chosen()
        except ValueError as error:
            event.client.add_notification('Nothing to export', str(error), color='red')
            return
        if clip is not None:
            event.client.send_file_download('run.zip', export_zip(clip.recording()),
                                            save_immediately=True)
