"""The page: takes a source's newest frame and shows it to all who have it open."""
from __future__ import annotations

import threading
import time
from pathlib import Path

import viser

from ..model.scene import Scene
from .browser.disconnected_banner import LOST
from .browser.hide_drag_arrow import NO_ARROW
from .browser.hint import OF_DOLL, OF_RECORDING, hint
from .browser.materials import PAINT
from .browser.panel_layout import FREE
from .browser.upload_notices import OWN_UPLOADS
from .controls import Controls
from .drawing.camera import Cameras
from .drawing.ground import light
from .drawing.plots import Plots
from .drawing.skin import KEEP_PAGE
from .drawing.stage import Stage
from .drawing.view import View, theme
from .editor.editor import Editor
from .editor.on_top import ON_TOP
from .pointer import Pointer
from .recording_panel import RecordingPanel
from .rest_detector import Rest
from .settings import Settings
from .sources.source import Frame, Report, Source, Wanted
from .start_when_visible import Opening
from .timeline.timeline import Timeline
from .widgets.form import GREY, RED, colored

PERIOD = 1 / 60
"""s between two drawings at the least."""

IDLE = 0.1
"""s between two looks for a page that is open."""


class Page:
    """What viser serves. `update` is called again and again by one thread, which alone draws.

    The editor, which comes with the first scene, keeps its files in ``folder``.
    """

    def __init__(self, server: viser.ViserServer, source: Source, folder: str | Path = '.') -> None:
        self.server = server
        self.source = source
        self.editor: Editor | None = None
        self.frame: Frame | None = None
        """What is shown; None before the first."""
        self.stage: Stage | None = None
        """All that is drawn of the scene that is shown; None before the first frame."""
        self.opening: Opening | None = None
        """Lets a source go that waits to be seen; None where none does."""
        self._live: Frame | None = None
        self._folder = folder
        light(server)
        theme(server, dark=False)
        server.gui.main_panel.dock_right()
        said = (hint(OF_DOLL, 'ragdollHint') if source.recording is None
                else hint(OF_RECORDING, 'ragdollRecordingHint'))
        for html in (FREE, said, LOST, KEEP_PAGE, PAINT, NO_ARROW, ON_TOP, OWN_UPLOADS):
            server.gui.add_html(html)
        self.problem = server.gui.add_html('')
        self.tabs = server.gui.add_tab_group()
        with self.tabs.add_tab('Play'):
            self.controls = Controls(server, source)
            self.view = View(server)
            self.settings = Settings(server, source)
            self.view.on_home(lambda client: self.cameras.go_home(client))
            self.timeline = Timeline(server, source)
            self._recording = RecordingPanel(server)
        self._edit_tab = self.tabs.add_tab('Edit')
        with self.tabs.add_tab('Plots'):
            self.plots = Plots(server)
        self.cameras = Cameras(server)
        self._rest = Rest()
        self._pointer = Pointer(source, self._at_hand, self._select)

    def run(self, stop: threading.Event) -> None:
        """Draw until told to stop."""
        next_time = time.monotonic()
        while not stop.is_set():
            is_open = self.update()
            next_time = max(next_time + (PERIOD if is_open else IDLE), time.monotonic())
            stop.wait(next_time - time.monotonic())
        self.source.want(Wanted())

    def update(self) -> bool:
        """Draw what has changed; returns whether any page is open."""
        clients = list(self.server.get_clients().values())
        is_open = bool(clients)
        self.source.want(self.view.wanted if is_open else Wanted())
        self.controls.pushes.keep(time.monotonic())
        if is_open:
            frame, report = self.source.frame, self.source.report
            if frame is not None:
                self._show(frame, report, time.monotonic())
            if self.stage is not None:
                self.stage.be_visible(bones=self.view.bones.value, skins=self.view.skin.value)
                self.stage.be_dark(self.view.dark.value)
            if self.editor is not None:
                self.editor.take_note(report.paused)
            self._tell(report.problem, report.note)
            self.controls.show(report)
        if self.opening is not None:
            self.opening.look(clients, self.frame is not None, time.monotonic())
        return is_open

    def _show(self, live: Frame, report: Report, now: float) -> None:
        """Draw the source's newest frame, or the one on the timeline that is looked at."""
        if live is not self._live:
            self._live = live
            self._recording.take(live)
            self.timeline.take(live)
        self.plots.take(live, self.timeline.instant(live), report, now)
        self.plots.show(self.timeline.looked_at(now))
        frame = self.timeline.shown(live, now)
        if frame is not self.frame:
            self._draw(frame)
            if self.timeline.is_live:
                self.cameras.show(frame)
        self.cameras.follow(frame, now, self.view.follow.value)
        self.controls.show_rest(self._rest.lies(live, report.paused, now))
        self.settings.show(report, live.scene, now)

    def _at_hand(self) -> Frame | None:
        """What a pointer may take hold of: nothing of what is over."""
        return self.frame if self.timeline.is_live else None

    def _draw(self, frame: Frame) -> None:
        new = self.stage is None or frame.scene is not self.stage.scene
        if new:
            self.stage = Stage(self.server, frame)
            self._pointer.attach(self.stage.bodies, self.stage.skins)
            self.controls.show_scene(frame.scene.name)
            self.controls.pushes.show_scene(frame.scene)
            self.view.show_scene(has_skin=bool(self.stage.skins.handles))
            self._edit(frame.scene)
        self.frame = frame
        with self.server.atomic():
            self.stage.show(frame)
        # Else viser waits for more to send along, up to its own 60th of a second.
        self.server.flush()

    def _edit(self, scene: Scene) -> None:
        """Hand the scene to the editor, which the first one makes."""
        if self.editor is not None:
            self.editor.show(scene)
            return
        with self._edit_tab:
            self.editor = Editor(self.server, scene, self.source.use, self.source.pause,
                                 self._folder)
        self.controls.before_step = self.editor.leave

    def _select(self, bone: str) -> None:
        if self.editor is not None:
            self.editor.select(bone)

    def _tell(self, problem: str, note: str) -> None:
        notes = [note, *(self.stage.skins.notes if self.stage is not None else ())]
        self.problem.content = colored(problem, RED) + ''.join(colored(each, GREY)
                                                                for each in notes)
