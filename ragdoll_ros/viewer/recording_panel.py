"""Buttons that take what the page shows with them: the run as MCAP, the view as PNG."""
from __future__ import annotations

import importlib.util
import threading

import imageio.v3 as iio
import numpy as np
import viser

from ..recordings.mcap_file import recording_bytes
from ..recordings.recording import RecordedPose, Recorder
from .sources.source import Frame

MOST_NUMBERS = 5_000_000
"""In one recording: 40 MB as MCAP; 20 minutes of ten bones at 60 Hz, half a minute of 500."""

CAN_WRITE = importlib.util.find_spec('mcap') is not None

RENDER_TIMEOUT = 20.0
"""s that a page may take for its picture."""

RECORD, STOP = 'Record', 'Stop and download'
ELSEWHERE, FULL = 'Download (scene has changed)', 'Download (recording is full)'
"""Labels of the button; the last two once a recording has ended by itself."""


class RecordingPanel:
    """Two buttons in the page's panel; take() is told what is shown, from any thread.

    All pages share one recording: whoever stops it gets it.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self.recorder: Recorder | None = None
        """What has been taken; None before a recording begins."""
        self._ended = False
        self._lock = threading.Lock()
        with server.gui.add_folder('Recording', expand_by_default=False):
            self.button = server.gui.add_button(
                RECORD, icon=viser.Icon.PLAYER_RECORD, disabled=not CAN_WRITE,
                hint='Poses of all bones as run.mcap; ragdoll_viewer --play run.mcap shows them'
                if CAN_WRITE else 'It needs mcap: pip install mcap')
            picture = server.gui.add_button('Picture', icon=viser.Icon.CAMERA,
                                            hint='This view as ragdoll.png')
        self._frame: Frame | None = None
        self.button.on_click(lambda event: self.toggle(event.client))
        picture.on_click(_send_picture)

    @property
    def recording(self) -> bool:
        """Whether poses are being taken."""
        return self.recorder is not None and not self._ended

    def take(self, frame: Frame) -> None:
        """Take note of what is shown.

        Another scene, or as much as one recording may hold, ends what is being taken; it waits
        for its download.
        """
        with self._lock:
            self._frame = frame
            self._record(frame)

    def _record(self, frame: Frame) -> None:
        recorder = self.recorder
        if not self.recording:
            return
        if recorder.scene is not frame.scene:
            self._end(ELSEWHERE)
            return
        pose = RecordedPose(frame.state.positions, frame.state.orientations, frame.rods)
        numbers = pose.positions.size + pose.orientations.size + np.size(pose.rods)
        recorder.add(frame.time, pose)
        if (len(recorder) + 1) * numbers > MOST_NUMBERS:
            self._end(FULL)

    def _end(self, label: str) -> None:
        """Take no more; the button says why."""
        self._ended = True
        self.button.label = label

    def toggle(self, client: viser.ClientHandle | None) -> None:
        """Begin to record; else end the recording and send it to the page that asked."""
        with self._lock:
            recorder, self.recorder = self.recorder, None
            self._ended = False
            if recorder is None and self._frame is not None:
                self.recorder = Recorder(self._frame.scene)
                self.button.label = STOP
                self._record(self._frame)
            else:
                self.button.label = RECORD
        if recorder is not None and client is not None:
            content = recording_bytes(recorder.recording())
            client.send_file_download('run.mcap', content, save_immediately=True)


def _send_picture(event: viser.GuiEvent) -> None:
    client = event.client
    if client is None:
        return
    size = client.camera.image_height, client.camera.image_width
    try:
        picture = client.get_render(*size, transport_format='png', timeout=RENDER_TIMEOUT)
    except TimeoutError:
        client.add_notification('No picture', f'The page drew none within {RENDER_TIMEOUT:g} s.')
        return
    content = iio.imwrite('<bytes>', _on_white(picture), extension='.png')
    client.send_file_download('ragdoll.png', content, save_immediately=True)


def _on_white(picture: np.ndarray) -> np.ndarray:
    """Lay a picture (h, w, 4) uint8 with transparent parts on white: (h, w, 3) uint8."""
    share = picture[..., 3:] / 255
    return np.rint(picture[..., :3] * share + 255 * (1 - share)).astype(np.uint8)
