"""The editor: holds the scene and its history; panel, handles and files change it."""
from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import viser

from ...model import errors
from ...model.scene import Scene
from ..widgets.error_text import error_text
from . import bone_form, changes, mirror
from .files_panel import FilesPanel
from .handles import Handles
from .panel import EditorPanel
from .scene_folder import SceneFolder
from .undo_history import UndoHistory

MAX_PENDING = 20
"""Scenes sent to the source that the page has not shown yet."""


class Editor:
    """Edits a scene in the GUI container that is current.

    While editing, the source is paused in the bind pose, the selected body has handles, and each
    change is shown at once. Otherwise the simulation runs, and Update restarts it with the change.

    ``set_scene`` restarts the source with a scene, or raises RagdollError: then the change is
    refused and the scene stays. ``pause`` pauses or resumes the source.

    Callbacks come from many threads and are serialized. `show` and `select`, which the page calls,
    never wait for ``set_scene``.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene, set_scene: Callable[[Scene], None],
                 pause: Callable[[bool], None], folder: str | Path = '.') -> None:
        self._set_source_scene, self._pause = set_scene, pause
        self._action_lock = threading.RLock()
        self._display_lock = threading.RLock()
        self._history = UndoHistory(scene)
        self._pending: deque[Scene] = deque(maxlen=MAX_PENDING)
        self._was_paused = False
        self.bone: str | None = None
        """Name of the selected bone."""
        self.editing = False
        """Whether the source is paused in the bind pose."""
        self.handles = Handles(server, self._on_pose, self._on_size)
        self.panel = EditorPanel(server.gui, self.select, self.suggest)
        self._connect(server.gui)
        with server.gui.add_folder('Files'):
            self.files = FilesPanel(server, lambda: self.scene, self.set_scene,
                                    SceneFolder(folder))
        self._refresh()

    @property
    def scene(self) -> Scene:
        """The current scene."""
        return self._history.scene

    def show(self, scene: Scene) -> None:
        """Take note that the page shows another scene."""
        with self._display_lock:
            if scene in self._pending:
                # Sent by the editor; the page draws late, and may have skipped some before it.
                while self._pending.popleft() != scene:
                    pass
            elif scene != self.scene:
                self._push(scene, f'scene {scene.name}')

    def select(self, bone: str | None) -> None:
        """Select a bone by its name in the scene; an unknown name or None deselects."""
        with self._display_lock:
            bone = bone if bone in self.scene.bone_names else None
            if bone != self.bone:
                self.bone = bone
                self._refresh()

    def toggle(self) -> None:
        """Start editing in the bind pose, or end it and run."""
        with self._reporting_errors():
            editing = not self.editing
            self._restart(self.scene, editing)
            if not editing:
                self._pause(False)
            self._set_editing(editing)

    def update_paused(self, paused: bool) -> None:
        """Take note whether the source is paused: if it was resumed elsewhere, editing ends."""
        if self._was_paused and not paused and self.editing:
            self._set_editing(False)
        self._was_paused = paused

    def leave(self) -> None:
        """End editing before the doll leaves its bind pose; the source stays paused."""
        with self._action_lock:
            if self.editing:
                self._set_editing(False)

    def update(self) -> None:
        """Apply the values of the form, or show errors below them and change nothing."""
        with self._reporting_errors():
            name, limb = self._selected(), self.panel.limb.value
            values, found = self.panel.values()
            self._change(lambda: bone_form.apply_values(self.scene, name, values, limb, found),
                         f'numbers of {name}')

    def undo(self) -> None:
        """Go one step back."""
        self._step(self._history.undo, self._history.redo)

    def redo(self) -> None:
        """Go one step forward."""
        self._step(self._history.redo, self._history.undo)

    def set_scene(self, scene: Scene, name: str) -> None:
        """Make a scene current, as a change called ``name``; RagdollError if it is refused."""
        with self._action_lock:
            self._restart(scene, self.editing)
            with self._display_lock:
                self._push(scene, name)

    def suggest(self, key: str, kind: str) -> None:
        """Fill the form with values for another kind of shape or joint, to be edited further."""
        with self._reporting_errors():
            name = self._selected()
            change = changes.set_shape if key == 'shape' else changes.set_joint_kind
            form = self.panel.body if key == 'shape' else self.panel.joint
            form.fill(bone_form.read_bone(change(self.scene, name, kind), name))

    def show_handles(self) -> None:
        """Show handles on the selected bone while editing, otherwise none."""
        with self._display_lock:
            if self.editing and self.bone is not None:
                self.handles.show(self.scene, self.bone, self.panel.limb.value)
            else:
                self.handles.hide()

    def add_bone(self, name: str) -> None:
        """Add a bone at the end of the selected one, and select it."""
        with self._reporting_errors():
            parent, name = self._selected(), name.strip()
            self.set_scene(changes.add_bone(self.scene, parent, name), f'add {name}')
            placement, _ = changes.find(self.scene, parent)
            self.select(self.scene.qualified(placement, name))

    def remove_limb(self) -> None:
        """Remove the selected bone and its subtree."""
        with self._reporting_errors():
            name = self._selected()
            self.set_scene(changes.remove_limb(self.scene, name), f'remove {name}')

    def _connect(self, gui: viser.GuiApi) -> None:
        """Connect the panel's buttons, and hotkeys."""
        panel = self.panel
        panel.limb.on_update(lambda _: self.show_handles())
        panel.update.on_click(lambda _: self.update())
        panel.add.on_click(lambda _: self.add_bone(panel.name.value))
        panel.remove.on_click(lambda _: self.remove_limb())
        for button, label, key, modifier, action in (
                (panel.edit, 'Edit or run', 'E', None, self.toggle),
                (panel.undo, 'Undo', 'Z', 'cmd/ctrl', self.undo),
                (panel.redo, 'Redo', 'Z', 'cmd/ctrl+shift', self.redo)):
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            for trigger in (button.on_click, command.on_trigger):
                trigger(lambda _, action=action: action())

    def _on_pose(self, position: np.ndarray, orientation: np.ndarray) -> None:
        with self._reporting_errors():
            name, limb = self._selected(), self.panel.limb.value
            self._change(lambda: changes.set_pose(self.scene, name, position, orientation, limb),
                         f'move {name}')

    def _on_size(self, half_extents: np.ndarray) -> None:
        with self._reporting_errors():
            name = self._selected()
            self._change(lambda: changes.set_size(self.scene, name, half_extents),
                         f'size of {name}')

    def _change(self, change: Callable[[], Scene], name: str) -> None:
        """Make a change, on both sides if selected; reset the handles if it is refused."""
        try:
            scene = change()
            if self.panel.both.value:
                scene = mirror.mirrored(scene, self._selected(), self.panel.limb.value)
            self.set_scene(scene, name)
        except errors.RagdollError:
            self.show_handles()
            raise

    def _push(self, scene: Scene, name: str) -> None:
        """Add a scene to the history; one with another name starts a new history."""
        if scene.name == self.scene.name:
            self._history.push(scene, name)
        else:
            self._history = UndoHistory(scene)
            self.files.forget()
        self._refresh()

    def _step(self, step: Callable[[], Scene], revert: Callable[[], Scene]) -> None:
        """Go a step in the history; revert it if the source refuses the scene."""
        with self._reporting_errors():
            before = self.scene
            scene = step()
            if scene is before:
                return
            try:
                self._restart(scene, self.editing)
            except errors.RagdollError:
                revert()
                raise
            with self._display_lock:
                self._refresh()

    def _set_editing(self, editing: bool) -> None:
        with self._display_lock:
            self.editing = editing
            self.panel.show_editing(editing)
            self.show_handles()

    def _restart(self, scene: Scene, pause: bool) -> None:
        """Restart the source with a scene; a refused one is not pending."""
        with self._display_lock:
            self._pending.append(scene)
        was_paused = self._was_paused
        if pause:
            # Before the scene is set, so that no tick is made with it.
            self._pause(True)
        try:
            self._set_source_scene(scene)
        except errors.RagdollError:
            with self._display_lock, suppress(ValueError):
                self._pending.remove(scene)
            if pause and not (was_paused or self.editing):
                self._pause(False)
            raise

    def _selected(self) -> str:
        if self.bone is None:
            raise errors.UnknownBone('bone', None, 'a bone of the list, or a click on one')
        return self.bone

    def _refresh(self) -> None:
        """Show the current scene and the selected bone."""
        scene = self.scene
        if self.bone not in scene.bone_names:
            self.bone = None
        self.panel.show_bones(scene, self.bone)
        self.panel.show_history(self._history)
        joint = None if self.bone is None else changes.joint_of(scene, self.bone)
        self.panel.show_values(
            None if self.bone is None else bone_form.read_bone(scene, self.bone),
            joint and joint.parent)
        self.show_handles()

    @contextmanager
    def _reporting_errors(self) -> Iterator[None]:
        """Run one action at a time, and show its errors in the panel."""
        with self._action_lock:
            self.panel.show_errors(())
            try:
                yield
            except errors.ModelErrors as error:
                self.panel.show_errors(error.errors)
            except errors.ModelError as error:
                self.panel.show_errors([error])
            except errors.RagdollError as error:
                self.panel.show_message(error_text(error))
