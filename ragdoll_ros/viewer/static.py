"""A run as one HTML file without a server, which can be viewed, paused and scrubbed."""
from __future__ import annotations

import contextlib
import html
import io
import sys
from pathlib import Path

import numpy as np
import viser

from ..model import errors
from ..model.scene import Scene
from ..physics.simulation import Simulation
from ..recordings.recording import Recorder, Recording
from .browser.scripts import source
from .drawing.camera import FIELD_OF_VIEW, INITIAL_CAMERA
from .drawing.stage import Stage, configure_lights
from .sources.playback import PlaybackSource

RATE = 60.0
"""Hz: frames of the file."""

MAX_DURATION = 10.0
"""s of a fall that does not come to rest."""

INDEX = 'index.html'


def static_html(recording: Recording) -> str:
    """HTML of viser's page that plays a recording without server or network.

    Space pauses, a slider scrubs. A recording of one instant is a still scene.
    """
    playback = PlaybackSource(recording)
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    try:
        server.initial_camera.position, server.initial_camera.look_at = INITIAL_CAMERA
        server.initial_camera.fov = FIELD_OF_VIEW
        configure_lights(server)
        frame = playback.frame_at(0.0)
        stage = Stage(server, frame)
        stage.show(frame)
        stage.set_visible(bones=False, skins=True)
        serializer = server.get_scene_serializer()
        for time in np.arange(1, int(recording.duration * RATE) + 1) / RATE:
            serializer.insert_sleep(1 / RATE)
            stage.show(playback.frame_at(float(time)))
        head, end, tail = serializer.as_html().rpartition('</body>')
        scripts = ''.join(f'<script>{source(name)}</script>'
                          for name in ('look.js', 'materials.js'))
        return f'{head}{scripts}{end}{tail}'
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


class Embedded:
    """A recording for display in a notebook, ``height`` pixels high; see static_html."""

    def __init__(self, recording: Recording, height: int = 400) -> None:
        page = html.escape(static_html(recording))
        self._html = (f'<iframe srcdoc="{page}" width="100%" height="{height}" '
                      'style="border:none;display:block"></iframe>')

    def _repr_html_(self) -> str:
        return self._html


def save_static(recording: Recording, folder: str | Path) -> Path:
    """Write static_html to ``folder``/index.html and return that path; Unreadable if that fails."""
    path = Path(folder) / INDEX
    content = static_html(recording)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding='utf-8')
    except OSError as error:
        raise errors.Unreadable('--static', str(folder),
                                f'a folder that can be written to: {error}') from None
    return path


def fall(scene: Scene, engine: str = 'auto') -> Recording:
    """Simulate a scene until it rests, at most MAX_DURATION, with progress on standard error."""
    recorder = Recorder(scene)
    with Simulation(scene, engine=engine, workers='auto') as simulation:
        recorder.take(simulation)
        while not simulation.asleep and recorder.duration < MAX_DURATION:
            simulation.advance()
            recorder.take(simulation)
            if simulation.time % 10 ** 9 < simulation.tick:
                print(f'{recorder.duration:.0f} s simulated', file=sys.stderr)
    return recorder.recording()
