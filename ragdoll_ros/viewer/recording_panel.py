"""Buttons that record the run, save the view, and export what is on the timeline."""
from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable

import imageio.v3 as iio
import numpy as np
import viser

from ..recordings.mcap_file import recording_bytes
from ..recordings.recording import RecordedPose, Recorder
from .sources.source import Frame
from .timeline.export import ExportPanel
from .timeline.frame_buffer import Clip

MAX_NUMBERS = 5_000_000
"""In one recording: 40 MB as MCAP; 20 minutes of ten bones at 60 Hz, half a minute of 500."""

CAN_WRITE = importlib.util.find_spec('mcap') is not None

RENDER_TIMEOUT = 20.0
"""s that a page may take to render an image."""

RECORD, STOP = 'Record', 'Stop and download'
SCENE_CHANGED, FULL = 'Download (scene has changed)', 'Download (recording is full)'
"""Labels of the button; the last two after a recording has ended by itself."""


class RecordingPanel:
    """Three buttons in the panel, which record the run, save the view, and export parts of the
    ``clip``; `add` takes the frames and may be called from any thread.

    All pages share one recording; the page that stops it gets the file.
    """

    def __init__(self, server: viser.ViserServer, clip: Callable[[], Clip | None]) -> None:
        self.recorder: Recorder | None = None
        """Frames recorded so far; None if there is no recording."""
        self._ended = False
        self._lock = threading.RLock()
        with server.gui.add_folder('Recording', expand_by_default=False):
            self.button = server.gui.add_button(
                RECORD, icon=viser.Icon.PLAYER_RECORD, disabled=not CAN_WRITE,
                hint='Poses of all bones as run.mcap; play it by ragdoll_viewer --play run.mcap'
                if CAN_WRITE else 'Requires mcap: pip install mcap')
            screenshot = server.gui.add_button('Screenshot', icon=viser.Icon.CAMERA,
                                               hint='This view as ragdoll.png')
            self.export = ExportPanel(server.gui, clip)
        self._frame: Frame | None = None
        self.button.on_click(lambda event: self.toggle(event.client))
        screenshot.on_click(_send_screenshot)

    @property
    def recording(self) -> bool:
        """Whether frames are being recorded."""
        return self.recorder is not None and not self._ended

    def add(self, frame: Frame) -> None:
        """Record a frame if recording is on; another scene or MAX_NUMBERS ends the recording."""
        with self._lock:
            self._frame, recorder = frame, self.recorder
            if not self.recording:
                return
            if recorder.scene is not frame.scene:
                self._end(SCENE_CHANGED)
                return
            pose = RecordedPose(frame.state.positions, frame.state.orientations, frame.rods)
            numbers = pose.positions.size + pose.orientations.size + np.size(pose.rods)
            recorder.add(frame.time, pose)
            if (len(recorder) + 1) * numbers > MAX_NUMBERS:
                self._end(FULL)

    def _end(self, label: str) -> None:
        """End the recording, with the reason as label of the button."""
        self._ended = True
        self.button.label = label

    def toggle(self, client: viser.ClientHandle | None) -> None:
        """Start recording; or end the recording and send it to the page that asked."""
        with self._lock:
            recorder, self.recorder = self.recorder, None
            self._ended = False
            if recorder is None and self._frame is not None:
                self.recorder = Recorder(self._frame.scene)
                self.button.label = STOP
                self.add(self._frame)
            else:
                self.button.label = RECORD
        if recorder is not None and client is not None:
            content = recording_bytes(recorder.recording())
            client.send_file_download('run.mcap', content, save_immediately=True)


def _send_screenshot(event: viser.GuiEvent) -> None:
    client = event.client
    if client is None:
        return
    size = client.camera.image_height, client.camera.image_width
    try:
        image = client.get_render(*size, transport_format='png', timeout=RENDER_TIMEOUT)
    except TimeoutError:
        client.add_notification('No screenshot', f'No image within {RENDER_TIMEOUT:g} s.')
        return
    content = iio.imwrite('<bytes>', _on_white(image), extension='.png')
    client.send_file_download('ragdoll.png', content, save_immediately=True)


def _on_white(image: np.ndarray) -> np.ndarray:
    """Blend an RGBA image (h, w, 4) uint8 with white: (h, w, 3) uint8."""
    alpha = image[..., 3:] / 255
    return np.rint(image[..., :3] * alpha + 255 * (1 - alpha)).astype(np.uint8)
