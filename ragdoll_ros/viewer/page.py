"""The page: draws a source's newest frame for all who have it open."""
from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path

import viser

from ..model.scene import Scene
from .browser.scripts import script, style
from .controls import Controls
from .drawing.auto_follow import AutoFollow
from .drawing.camera import Cameras
from .drawing.display_options import DisplayOptions, configure_theme
from .drawing.plots import Plots
from .drawing.stage import Stage, configure_lights
from .editor.banner import Banner
from .editor.editor import Editor
from .editor.handles.body_handles import ROOT
from .gallery.gallery import Gallery
from .pointer import Pointer
from .pushing.hover import Hover
from .pushing.motion import doll_mean
from .recording_panel import RecordingPanel
from .settings_panel import SettingsPanel
from .sources.source import Frame, RequestedData, Source, SourceStatus
from .start_when_visible import StartWhenVisible
from .timeline.timeline import Timeline
from .timeline.transport import Transport
from .user_actions import UserActions
from .viser_internals import sent_at_once, wait_until_sent
from .widgets.form import GREY, RED, colored

PERIOD = 1 / 60
"""s between two frames at least."""

IDLE_PERIOD = 0.1
"""s between two checks for an open page."""

LOOK_PERIOD = 0.1
"""s between two looks at what a reader or a camera does not miss within: health, settings, whether
the doll leaves the view."""

SIMULATION_HINT = ('<span class="ragdoll-mouse">Drag a bone. Arrow keys push, tap or hold; a click '
                   'on a bone chooses which. T throws a ball. Space pauses, R resets, E edits, '
                   'H shows the home view.</span><span class="ragdoll-touch">Drag a bone with one '
                   'finger. The arrows below push; a tap on a bone chooses which. Two fingers move '
                   'the view.</span>')
RECORDING_HINT = ('A recorded run. Space pauses, R restarts, drag the bar below the picture '
                  'or press , and . to step, H shows the home view.')

DISCONNECTED = ('The viewer that served this page has ended, or cannot be reached: start it again '
                'at the same port, and the page will reconnect by itself.')

OWN_SCENES = 'Characters and scenes of your own: the tab Edit, below Files'


class Page:
    """The page that viser serves. One thread calls `update`, and only that thread draws.

    ``folder``: where the page keeps its files.
    """

    def __init__(self, server: viser.ViserServer, source: Source, folder: str | Path = '.') -> None:
        self.server = server
        self.source = source
        self.editor: Editor | None = None
        self.frame: Frame | None = None
        """The frame that is shown; None before the first."""
        self.stage: Stage | None = None
        """The scene that is shown; None before the first frame."""
        self.start_when_visible: StartWhenVisible | None = None
        self._live: Frame | None = None
        self._messages: tuple[str, ...] = ()
        """A problem, or '', and notes that are shown."""
        self._drawn_data = RequestedData()
        """What is drawn of the frame beside its bones."""
        self._next_look = 0.0
        self._folder = folder
        configure_lights(server)
        configure_theme(server, dark=False)
        server.gui.main_panel.dock_right()
        is_simulated = source.recording is None
        for html in (style('panel.css'), style('controls.css'), script('panel_layout.js'),
                     script('title.js', TITLE='Ragdoll'), script('accessibility.js'),
                     hint(SIMULATION_HINT, 'ragdollHint') if is_simulated
                     else hint(RECORDING_HINT, 'ragdollRecordingHint'),
                     style('disconnected_banner.css', message=DISCONNECTED),
                     script('null_node_guard.js'), script('send_at_once.js'),
                     script('materials.js'), script('look.js'),
                     script('quality.js'), script('hide_drag_arrow.js'),
                     script('handle_picking.js', ROOT=ROOT),
                     script('upload_notices.js'), script('decimal_comma.js')):
            server.gui.add_html(html)
        self._edit_banner = Banner(server.gui)
        self.timeline, actions = Timeline(source), UserActions()
        self.transport = Transport(server, source, self.timeline, actions)
        self.problem = server.gui.add_html('')
        self.tabs = server.gui.add_tab_group()
        with self.tabs.add_tab('Play'):
            self.controls = Controls(server, source, actions)
            self.display = DisplayOptions(server)
            self.settings = SettingsPanel(server, source)
            self.display.on_home(lambda client: self.cameras.go_home(client))
            self._recording = RecordingPanel(server, lambda: self.timeline.clip)
        self.gallery: Gallery | None = None
        if is_simulated:
            with self.tabs.add_tab('Scenes'):
                server.gui.add_html(colored(OWN_SCENES, GREY))
                self.gallery = Gallery(server, self.controls.load)
        self._edit_tab = self.tabs.add_tab('Edit')
        with self.tabs.add_tab('Plots'):
            self.plots = Plots(server)
        self.controls.before_load = self._end_editing
        self.transport.loading = lambda: self.controls.loading
        self.cameras = Cameras(server)
        self._auto_follow = AutoFollow(self.display.follow)
        self._hover = Hover(server)
        self.controls.ball.frame = self._grabbable_frame
        self.controls.ball.refuse = self.transport.refuse
        self.controls.ball.is_editing = lambda: self.editor is not None and self.editor.editing
        self.controls.ball.connect(server, self._hover)
        self._pointer = Pointer(source, actions, self._grabbable_frame, self._select,
                                self.transport.refuse)
        self.controls.pushes.may_push = lambda: self.timeline.is_live
        self.controls.pushes.refuse = self.transport.refuse

    def run(self, stop: threading.Event) -> None:
        """Draw until ``stop`` is set."""
        next_time = time.monotonic()
        while not stop.is_set():
            is_open = self.update()
            next_time = max(next_time + (PERIOD if is_open else IDLE_PERIOD), time.monotonic())
            stop.wait(next_time - time.monotonic())
            wait_until_sent(self.server, PERIOD)
        self.source.request(RequestedData())

    def update(self) -> bool:
        """Draw what has changed; returns whether any page is open."""
        clients = list(self.server.get_clients().values())
        is_open = bool(clients)
        self.source.request(self._requested if is_open else RequestedData())
        self.controls.pushes.update(time.monotonic())
        start = self.start_when_visible
        waits = start is not None and not start.is_done
        frame = self.source.frame if is_open and waits else None
        if is_open:
            with sent_at_once(self.server):
                self._update_pages(time.monotonic())
        if waits:
            start.update(clients, frame, time.monotonic())
        return is_open

    @property
    def _requested(self) -> RequestedData:
        """Data that is drawn, and contacts of scenes with static bodies or robots.

        The timeline marks these contacts.
        """
        scene = self._live and self._live.scene
        has_bodies = scene is not None and bool(scene.bodies or scene.robots)
        return replace(self.display.requested,
                       contacts=has_bodies or self.display.contacts.value)

    def _update_pages(self, now: float) -> None:
        """Draw what has changed at ``now`` s of a steady clock."""
        was_editing = self.editor is not None and self.editor.editing
        frames, status = self.source.take_frames(), self.source.status
        for new in frames:
            if self.start_when_visible is None or not self.start_when_visible.hides(new):
                self._keep(new, status, now)
        if self._live is not None:
            self._show(self._live, status, now)
        if self.stage is not None:
            self.stage.set_visible(bones=self.display.bones.value, skins=self.display.skin.value)
            self.stage.set_dark(self.display.dark.value)
        if self.editor is not None:
            self.editor.update_paused(status.paused, was_editing)
        if self.gallery is not None:
            self.gallery.show(self._live and self._live.scene, self.controls.loading)
        self._show_messages(status.problem, status.note)
        self.controls.show(status)

    def _keep(self, frame: Frame, status: SourceStatus, now: float) -> None:
        """Keep a new frame of the source for recordings, timeline and plots."""
        self._live = frame
        self._recording.add(frame)
        self.timeline.add(frame)
        self.controls.add(frame)
        self.controls.pushes.add(frame)
        self.display.worst_impact.add(frame)
        self.plots.add(frame, self.timeline.live_instant(frame), status, now)

    def _show(self, live: Frame, status: SourceStatus, now: float) -> None:
        """Draw the source's newest frame, or the one that the timeline selects."""
        self.plots.show(self.timeline.shown_instant(now), now)
        frame = self.timeline.frame_to_show(live, now)
        looks = now >= self._next_look
        drawn_data = self.display.requested
        if frame is not self.frame or drawn_data != self._drawn_data:
            self._drawn_data = drawn_data
            self._draw(frame)
            if self.timeline.is_live:
                self.cameras.show(frame)
                if looks:
                    self._follow_if_it_leaves(frame)
        bone = self.controls.pushes.bone
        self.transport.update(live, frame, status, now)
        self.cameras.follow(frame, bone, now, self.display.follow.value)
        self.controls.ball.update(live, self.controls.pushes.motion)
        self._hover.show(frame, self.controls.pushes.motion, now)
        if looks:
            self._next_look = now + LOOK_PERIOD
            self.settings.show(status, live.scene, now)

    def _follow_if_it_leaves(self, frame: Frame) -> None:
        pushes = self.controls.pushes
        self._auto_follow.update(
            self.server.get_clients(), frame,
            doll_mean(frame.scene, pushes.bone, frame.state.positions),
            pushes.motion.doll_velocity(pushes.bone))

    def _select(self, bone: str, add: bool) -> None:
        """Let pushes act on a clicked bone, and select it in the editor; ``add``: besides others.

        Do nothing if clicks throw a ball.
        """
        if self.controls.ball.takes_clicks:
            return
        self.controls.pushes.choose(bone)
        if self.editor is not None:
            self.editor.select(bone, add)

    def _grabbable_frame(self) -> Frame | None:
        """The shown frame; None if it is in the past, where nothing can be grabbed."""
        return self.frame if self.timeline.is_live else None

    def _draw(self, frame: Frame) -> None:
        if self.stage is None or frame.scene is not self.stage.scene:
            self.stage = Stage(self.server, frame)
            self._pointer.attach(self.stage.bodies, self.stage.skins)
            self.controls.show_scene(frame.scene.name)
            self.controls.show_animated(frame.scene)
            self.controls.pushes.show_scene(frame.scene)
            self.display.show_scene(has_skin=bool(self.stage.skins.handles))
            self._edit(frame.scene)
        self.frame = frame
        if not self._drawn_data.contacts and frame.contacts is not None:
            frame = replace(frame, contacts=None, forces=None, pairs=None)
        if not self._drawn_data.impacts and frame.impacts:
            frame = replace(frame, impacts=())
        self.stage.show(frame)

    def _edit(self, scene: Scene) -> None:
        """Pass the scene to the editor, which is created for the first one."""
        if self.editor is not None:
            self.editor.show(scene)
            return
        with self._edit_tab:
            self.editor = Editor(self.server, scene, self.source.set_scene, self.source.pause,
                                 self._edit_banner, self._folder)
            self.editor.on_other_enter = self.settings.enter
        self.transport.before_step = self.editor.leave

    def _end_editing(self) -> None:
        """End editing before another scene is loaded, which then runs."""
        if self.editor is not None and self.editor.editing:
            self.editor.leave()
            self.source.pause(False)

    def _show_messages(self, problem: str, note: str) -> None:
        messages = problem, note, *(self.stage.skins.notes if self.stage is not None else ())
        if messages != self._messages:
            self._messages = messages
            self.problem.content = colored(problem, RED) + ''.join(
                colored(each, GREY) for each in messages[1:])


def hint(text: str, key: str) -> str:
    """HTML of a hint above the panel; once closed, a browser remembers that under ``key``."""
    return (f'<div class="ragdoll-hint"><span>{text}</span><button aria-label="Close the hint">'
            '&times;</button></div>' + script('hint.js', KEY=key))
