"""The editor: holds the scene and its history; panel, handles and files change it."""
from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import viser

from ...model import errors
from ...model.ragdoll import Limits
from ...model.scene import Scene
from ..browser.scripts import add_listener
from ..user_actions import UserActions
from ..viser_internals import handle_id
from ..widgets.error_text import error_text
from ..widgets.form import FormValues
from . import bone_form, changes, mirror, static_bodies
from .banner import MODES, Banner
from .edited_scene import EditedScene, Reason
from .files_panel import FilesPanel
from .handles.body_handles import BodyHandles, Mode
from .handles.joint_handles import JointHandles
from .panel import EditorPanel
from .scene_folder import SceneFolder


class Editor:
    """Edits a scene in the GUI container that is current.

    While editing, the source is paused in the bind pose, the selected body has handles, and each
    change is shown at once. Otherwise the simulation runs, and Update restarts it with the change.

    ``set_scene`` and ``pause``: see EditedScene.

    Callbacks come from many threads and are serialized. `show` and `select`, which the page calls,
    never wait for ``set_scene``.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene, set_scene: Callable[[Scene], None],
                 pause: Callable[[bool], None], banner: Banner,
                 folder: str | Path = '.') -> None:
        self._pause, self._banner = pause, banner
        self._action_lock = threading.RLock()
        self._edited = EditedScene(scene, set_scene, pause, self._on_scene)
        self._display_lock = self._edited.lock
        self._actions = UserActions()
        """Actions by keys. Apart from those of the page, as building a scene may take long."""
        self._waiting = 0
        """Number of forms that were entered and are not applied yet."""
        self._was_paused = False
        self.on_other_enter: Callable[[str], None] = lambda _: None
        """Takes the id of a field of no form here in which Enter was pressed, in viser's thread."""
        self.bones: tuple[str, ...] = ()
        """Names of the selected bones, the last one that was selected at the end."""
        self.static: str | None = None
        """Name of the static body that is selected, in place of bones."""
        self.editing = False
        """Whether the source is paused in the bind pose."""
        self.ranges = JointHandles(server, lambda limits: self._actions.run(
            self._on_limits, limits))
        self.handles = BodyHandles(server, self.ranges, self._on_pose, self._on_size)
        self.panel = EditorPanel(server.gui, self.select, self.select_static, self.suggest)
        self._connect(server.gui)
        with server.gui.add_folder('Files'):
            self.files = FilesPanel(server, lambda: self.scene, self.set_scene, SceneFolder(folder))
        self._refresh()

    @property
    def scene(self) -> Scene:
        """The current scene."""
        return self._edited.current

    def show(self, scene: Scene) -> None:
        """Take note that the page shows another scene."""
        self._edited.show(scene)

    @property
    def bone(self) -> str | None:
        """Name of the bone that was selected last."""
        return self.bones[-1] if self.bones else None

    def select(self, bone: str | None, add: bool = False) -> None:
        """Select a bone by its name in the scene; an unknown name or None deselects all.

        ``add``: keep other selected bones, and deselect this one if it is selected; an unknown name
        or None then changes nothing.
        """
        with self._display_lock:
            bones = (bone,) if bone in self.scene.bone_names else ()
            if add:
                others = tuple(each for each in self.bones if each != bone)
                bones = others if bone in self.bones else others + bones
            if bones != self.bones or (bones and self.static):
                self.bones, self.static = bones, None
                self._refresh()

    def select_static(self, body: str | None) -> None:
        """Select a static body in place of all bones; None deselects it."""
        with self._display_lock:
            if body != self.static:
                self.static = body
                self.bones = () if body else self.bones
                self._refresh()

    def toggle(self) -> None:
        """Start editing in the bind pose, or end it and run."""
        with self._reporting_errors():
            editing = not self.editing
            self._edited.restart(self.scene, editing,
                                 resume_if_refused=editing and not self._was_paused)
            if not editing:
                self._pause(False)
            self._set_editing(editing)

    def set_mode(self, mode: Mode) -> None:
        """Choose what the handles change."""
        with self._display_lock:
            self.handles.mode = mode
            self._show_mode()

    def update_paused(self, paused: bool, was_editing: bool = True) -> None:
        """Take note whether the source is paused: if it was resumed elsewhere, editing ends.

        ``was_editing``: whether editing had begun before ``paused`` was read; if not, ``paused`` is
        the state before editing, and does not end it.
        """
        if self._was_paused and not paused and was_editing and self.editing:
            self._set_editing(False)
        self._was_paused = paused

    def leave(self) -> None:
        """End editing before the doll leaves its bind pose; the source stays paused."""
        with self._action_lock:
            if self.editing:
                self._set_editing(False)

    def update(self) -> None:
        """Apply the values of the form, or show errors below them and change nothing."""
        self._apply(*self._typed())

    def undo(self) -> None:
        """Go one step back."""
        with self._reporting_errors():
            self._edited.undo(self.editing)

    def redo(self) -> None:
        """Go one step forward."""
        with self._reporting_errors():
            self._edited.redo(self.editing)

    def set_scene(self, scene: Scene, name: str) -> None:
        """Make a scene current, as a change called ``name``; RagdollError if it is refused."""
        with self._action_lock:
            self._edited.set(scene, name, self.editing)

    def suggest(self, key: str, kind: str) -> None:
        """Fill the form with values for another kind of shape or joint, to be edited further."""
        with self._reporting_errors():
            change = changes.set_shape if key == 'shape' else changes.set_joint_kind
            form = self.panel.body if key == 'shape' else self.panel.joint
            if self.static:
                scene = static_bodies.change_body(
                    self.scene, self.static, lambda scene, name: change(scene, name, kind))
                form.fill(static_bodies.read_body(scene, self.static), changed=True)
                return
            name = _existing(self.bone)
            form.fill(bone_form.read_bone(change(self.scene, name, kind), name), changed=True)

    def show_handles(self) -> None:
        """While editing, show handles on the selected bone or static body, or outlines of several
        bones; otherwise none.
        """
        with self._display_lock:
            if self.editing and self.static:
                self.handles.show(static_bodies.stand_in(self.scene, self.static),
                                  static_bodies.BONE, limb=False)
            elif self.editing and len(self.bones) == 1:
                self.handles.show(self.scene, self.bones[0], self.panel.limb.value)
            elif self.editing and self.bones:
                self.handles.show_outlines(self.scene, self.bones)
            else:
                self.handles.hide()

    def add_bone(self, name: str) -> None:
        """Add a bone at the end of the selected one, or of the root, and select it."""
        with self._reporting_errors():
            parent, name = self.panel.parent, name.strip()
            self.set_scene(changes.add_bone(self.scene, parent, name), f'add {name}')
            placement, _ = changes.find(self.scene, parent)
            self.select(self.scene.qualified(placement, name))

    def remove_limb(self) -> None:
        """Remove the selected bone and its subtree."""
        with self._reporting_errors():
            name = _existing(self.bone)
            self.set_scene(changes.remove_limb(self.scene, name), f'remove {name}')

    def add_static(self, name: str) -> None:
        """Add a static body and select it."""
        with self._reporting_errors():
            self.set_scene(static_bodies.add_body(self.scene, name.strip()), f'add {name.strip()}')
            self.select_static(name.strip())

    def add_mesh(self, file: str, content: bytes) -> None:
        """Add an uploaded mesh as a static body and select it."""
        with self._reporting_errors():
            mesh = self.files.folder.mesh(file, content)
            scene, name = static_bodies.add_mesh(self.scene, Path(mesh.source[0]).stem, mesh)
            self.set_scene(scene, f'add {name}')
            self.select_static(name)

    def remove_static(self) -> None:
        """Remove the selected static body."""
        with self._reporting_errors():
            if self.static:
                self.set_scene(static_bodies.remove_body(self.scene, self.static),
                               f'remove {self.static}')

    def _connect(self, gui: viser.GuiApi) -> None:
        """Connect the panel's buttons, and hotkeys."""
        panel = self.panel
        self._banner.on_action = self._on_action
        panel.limb.on_update(lambda _: self.show_handles())
        panel.snap.on_update(lambda _: self._set_snap(panel.snap.value))
        panel.update.on_click(lambda _: self._enter_form())
        panel.add.on_click(lambda _: self.add_bone(panel.name.value))
        panel.remove.on_click(lambda _: self.remove_limb())
        panel.add_static.on_click(lambda _: self.add_static(panel.static_name.value))
        panel.add_mesh.on_upload(
            lambda event: self.files.take_upload(event.target, self.add_mesh))
        panel.remove_static.on_click(lambda _: self.remove_static())
        for button, label, key, modifier, action in (
                (panel.edit, 'Edit or run', None, None, self.toggle),
                (panel.undo, 'Undo', 'Z', 'cmd/ctrl', self.undo),
                (panel.redo, 'Redo', 'Z', 'cmd/ctrl+shift', self.redo)):
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            for trigger in (button.on_click, command.on_trigger):
                trigger(lambda _, action=action: action())

        add_listener(gui, 'enter', 'enter_key.js', lambda _, field: self._on_enter(field))

    def _on_action(self, action: str) -> None:
        """Start or end editing, or choose what the handles change; see Banner."""
        if action in MODES:
            self._actions.run(self.set_mode, action)
        elif (action == 'edit') != self.editing:
            self._actions.run(self.toggle)

    def _on_enter(self, field: str) -> None:
        """Apply the form of a field in which Enter was pressed, or add what the field names."""
        if self.panel.has(field):
            self._enter_form()
        elif field == handle_id(self.panel.name):
            self._actions.run(self.add_bone, self.panel.name.value)
        elif field == handle_id(self.panel.static_name):
            self._actions.run(self.add_static, self.panel.static_name.value)
        else:
            self.on_other_enter(field)

    def _enter_form(self) -> None:
        """Apply the current content of the form in another thread, while a user may type on."""
        with self._display_lock:
            self._waiting += 1
            self._actions.run(self._apply_next, *self._typed())

    def _typed(self) -> tuple[tuple[str, ...], FormValues, list[errors.ModelError]]:
        """The selected bones, the values of the form, and errors of those that cannot be read."""
        with self._display_lock:
            return self.bones, *self.panel.values()

    def _apply_next(self, *typed: Any) -> None:
        """Apply a form that was entered."""
        with self._display_lock:
            self._waiting -= 1
        self._apply(*typed)

    def _apply(self, bones: tuple[str, ...], values: FormValues,
               found: list[errors.ModelError]) -> None:
        self._change(lambda scene, name: bone_form.apply_values(
            scene, name, values, self.panel.limb.value, found), 'numbers of', bones)

    def _on_pose(self, position: np.ndarray, orientation: np.ndarray) -> None:
        self._change(lambda scene, name: changes.set_pose(
            scene, name, position, orientation, self.panel.limb.value), 'move', self.bones)

    def _on_size(self, half_extents: np.ndarray) -> None:
        self._change(lambda scene, name: changes.set_size(scene, name, half_extents), 'size of',
                     self.bones)

    def _on_limits(self, limits: tuple[Limits | None, ...]) -> None:
        self._change(lambda scene, name: changes.change_joint(scene, name, limits=limits),
                     'range of', self.bones)

    def _set_snap(self, snap: bool) -> None:
        self.handles.snap = self.ranges.snap = snap

    def _change(self, change: Callable[[Scene, str], Scene], action: str,
                bones: tuple[str, ...]) -> None:
        """Change bones, on both sides if so chosen, as one step; if refused, reset the handles.

        Without bones, change the selected static body.
        """
        with self._reporting_errors():
            scene = self.scene
            try:
                if self.static and not bones:
                    self.set_scene(static_bodies.change_body(scene, self.static, change),
                                   f'{action} {self.static}')
                    return
                last = _existing(bones[-1] if bones else None)
                for name in bones:
                    scene = change(scene, name)
                    if self.panel.both.value:
                        scene = mirror.mirrored(scene, name, self.panel.limb.value)
                self.set_scene(scene, f'{action} ' + (
                    last if len(bones) == 1 else f'{len(bones)} bones'))
            except errors.RagdollError:
                self.handles.reset()
                raise

    def _on_scene(self, reason: Reason) -> None:
        """Show a scene that has become current."""
        if reason == 'other':
            self.files.forget()
        self._refresh(keep_typed=reason == 'change')

    def _set_editing(self, editing: bool) -> None:
        with self._display_lock:
            self.editing = editing
            self.panel.show_editing(editing)
            self._show_mode()

    def _show_mode(self) -> None:
        self._banner.show(self.handles.mode if self.editing else None)
        self.show_handles()

    def _refresh(self, keep_typed: bool = False) -> None:
        """Show the current scene and the selected bone; ``keep_typed``: see Form.fill."""
        scene = self.scene
        bones = tuple(bone for bone in self.bones if bone in scene.bone_names)
        keep_typed = keep_typed and bones == self.bones
        self.bones = bones
        if self.static not in {body.name for body in scene.bodies}:
            self.static = None
        self.panel.show_bones(scene, bones)
        self.panel.show_static(scene, self.static)
        self.panel.show_history(self._edited.history)
        self.show_handles()
        if keep_typed and self._waiting:
            return  # The form has what will be applied next.
        joints = [changes.joint_of(scene, bone) for bone in bones]
        values = bone_form.read_bones(scene, bones) if bones else (
            static_bodies.read_body(scene, self.static) if self.static else {})
        self.panel.show_values(values, [joint.parent for joint in joints if joint], keep_typed)

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


def _existing(bone: str | None) -> str:
    if bone is None:
        raise errors.UnknownBone('bone', None, 'a bone of the list, or a click on one')
    return bone
