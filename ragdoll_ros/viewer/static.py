"""A page without a server: a run that can be turned, scrubbed and stopped, in one HTML file."""
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
from .browser.materials import DRESS
from .drawing.camera import CAMERA, FIELD
from .drawing.ground import light
from .drawing.stage import Stage
from .sources.playback import Playback

RATE = 60.0
"""Pictures in each s of the run."""

LONGEST = 10.0
"""s of a fall that comes to no rest."""

INDEX = 'index.html'


def static_html(recording: Recording) -> str:
    """A page of viser's that plays a recording: no server, no network, one file.

    Space stops it; a slider scrubs. A recording of one instant is a scene that stands.
    """
    source = Playback(recording)
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    try:
        server.initial_camera.position, server.initial_camera.look_at = CAMERA
        server.initial_camera.fov = FIELD
        light(server)
        frame = source.frame_at(0.0)
        stage = Stage(server, frame)
        stage.show(frame)
        stage.be_visible(bones=False, skins=True)
        serializer = server.get_scene_serializer()
        for time in np.arange(1, int(recording.duration * RATE) + 1) / RATE:
            serializer.insert_sleep(1 / RATE)
            stage.show(source.frame_at(float(time)))
        head, end, tail = serializer.as_html().rpartition('</body>')
        return f'{head}<script>{DRESS}</script>{end}{tail}'
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


class Embedded:
    """A recording as a notebook shows it, below the cell whose last line it is.

    It is ``height`` pixels high; see static_html.
    """

    def __init__(self, recording: Recording, height: int = 400) -> None:
        page = html.escape(static_html(recording))
        self._html = (f'<iframe srcdoc="{page}" width="100%" height="{height}" '
                      'style="border:none;display:block"></iframe>')

    def _repr_html_(self) -> str:
        return self._html


def save_static(recording: Recording, folder: str | Path) -> Path:
    """Write static_html into a folder, which is made if need be; the path of the page.

    Unreadable where the disk refuses.
    """
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
    """A scene from its start until all rests, LONGEST at most; tells how far it is."""
    recorder = Recorder(scene)
    with Simulation(scene, engine=engine, workers='auto') as simulation:
        recorder.take(simulation)
        while not simulation.asleep and recorder.duration < LONGEST:
            simulation.advance()
            recorder.take(simulation)
            if simulation.time % 10 ** 9 < simulation.tick:
                print(f'{recorder.duration:.0f} s simulated', file=sys.stderr)
    return recorder.recording()
