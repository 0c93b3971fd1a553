"""The page: takes a source's newest frame and shows it to all who have it open."""
from __future__ import annotations

import threading
from collections.abc import Callable

import viser

from .bodies import Bodies
from .controls import Controls
from .ground import light, show_ground
from .source import Frame, Source, Wanted

PERIOD = 1 / 60
"""s between two drawings at the least."""

IDLE = 0.2
"""s between two looks for a page that is open."""

CAMERA = ((4.2, -1.2, 1.5), (0.0, 0.0, 0.8))
"""Where the camera stands at first and what it looks at, m: in front of the doll, as the arrows
have it, and a little aside."""


class Page:
    """What viser serves. `update` is called again and again by one thread, which alone draws."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.server = server
        self.source = source
        self.listeners: list[Callable[[Frame], None]] = []
        """Called with each frame that is drawn, in the drawing thread: a recorder, say."""
        self._frame: Frame | None = None
        server.initial_camera.position, server.initial_camera.look_at = CAMERA
        server.initial_camera.fov = 0.8
        light(server)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._problem = server.gui.add_markdown('')
        self.controls = Controls(server, source)

    def play(self, source: Source) -> None:
        """Show another source from now on; the last one is left open."""
        self.source.want(Wanted())
        self.source = self.controls.source = source

    def run(self, stop: threading.Event) -> None:
        """Draw until told to stop."""
        while not stop.wait(PERIOD if self.update() else IDLE):
            pass
        self.source.want(Wanted())

    def update(self) -> bool:
        """Draw what has changed; tell whether any page is open."""
        is_open = bool(self.server.get_clients())
        self.source.want(Wanted(frames=is_open))
        if is_open:
            frame = self.source.frame
            if frame is not None and frame is not self._frame:
                self._draw(frame)
            report = self.source.report
            self._problem.content = report.problem or report.note
            self.controls.show(report)
        return is_open

    def _draw(self, frame: Frame) -> None:
        if self._frame is None or frame.scene is not self._frame.scene:
            self._set_stage(frame)
        self._frame = frame
        with self.server.atomic():
            self._bodies.show(frame.state)
        for listener in self.listeners:
            listener(frame)

    def _set_stage(self, frame: Frame) -> None:
        """Put up what a new scene needs."""
        self.server.scene.remove_by_name('/scene')
        self._bodies = Bodies(self.server, frame.scene, frame.state)
        show_ground(self.server, frame.scene)
        self.controls.show_scene(frame.scene.name)
