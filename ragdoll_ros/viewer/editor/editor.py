"""The editor: keeps the scene and its history, and lets panel, handles and files change it."""
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
from ..widgets.error_text import in_words
from . import changes, growth, mirror, sheet
from .files import Files
from .folder import Folder
from .handles import Handles
from .history import History
from .panel import Panel

UNSEEN = 20
"""Scenes given to the page that it has not shown yet."""


class Editor:
    """Edits a scene in the GUI container that is current.

    Two states. Editing: the page stands paused in the bind pose, the chosen body has handles, and
    each change is seen at once. Else the doll lives; an Update starts it anew with the change.

    ``use(scene)`` makes the page's source start anew with a scene, or raises RagdollError: then
    the change is refused and the scene stays. ``pause`` holds the source's time.

    Callbacks come from many threads. They act one after another; `show` and `select`, which the
    page calls, never wait for `use`.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene, use: Callable[[Scene], None],
                 pause: Callable[[bool], None], folder: str | Path = '.') -> None:
        self._use, self._pause = use, pause
        self._acting = threading.RLock()
        self._showing = threading.RLock()
        self._history = History(scene)
        self._given: deque[Scene] = deque(maxlen=UNSEEN)
        self._stood = False
        self.bone: str | None = None
        """Name of the chosen bone."""
        self.editing = False
        """Whether the page stands in the bind pose."""
        self.handles = Handles(server, self._pose_dragged, self._size_dragged)
        self.panel = Panel(server.gui, self.select, self.suggest)
        self._connect(server.gui)
        with server.gui.add_folder('Files'):
            self.files = Files(server, lambda: self.scene, self.take, Folder(folder))
        self._refresh()

    @property
    def scene(self) -> Scene:
        """The scene as it is now."""
        return self._history.scene

    def show(self, scene: Scene) -> None:
        """Take note that the page shows another scene now."""
        with self._showing:
            if scene in self._given:
                # One of ours; the page draws late, and may have left out some before it.
                while self._given.popleft() != scene:
                    pass
            elif scene != self.scene:
                self._enter(scene, f'scene {scene.name}')

    def select(self, bone: str | None) -> None:
        """Choose a bone by its name in the scene; one that is not there, or None: none."""
        with self._showing:
            bone = bone if bone in self.scene.bone_names else None
            if bone != self.bone:
                self.bone = bone
                self._refresh()

    def toggle(self) -> None:
        """Go to the bind pose to edit, or drop the doll."""
        with self._telling():
            wanted = not self.editing
            self._run(self.scene, wanted)
            if not wanted:
                self._pause(False)
            self._set_editing(wanted)

    def take_note(self, paused: bool) -> None:
        """Learn from the page whether time stands: where it goes on by itself, editing ends."""
        if self._stood and not paused and self.editing:
            self._set_editing(False)
        self._stood = paused

    def leave(self) -> None:
        """End editing where the doll is about to leave its bind pose; time stays as it is."""
        with self._acting:
            if self.editing:
                self._set_editing(False)

    def update(self) -> None:
        """Apply what stands in the fields; where that is wrong, say so there and change nothing."""
        with self._telling():
            name, limb = self._chosen(), self.panel.limb.value
            values, unread = self.panel.values()
            self._change(lambda: sheet.apply(self.scene, name, values, limb, unread),
                         f'numbers of {name}')

    def undo(self) -> None:
        """Go back a step."""
        self._go(self._history.undo, self._history.redo)

    def redo(self) -> None:
        """Go a step forward again."""
        self._go(self._history.redo, self._history.undo)

    def take(self, scene: Scene, what: str) -> None:
        """Go on with a changed scene, or with another one; RagdollError if it cannot run."""
        with self._acting:
            self._run(scene, self.editing)
            with self._showing:
                self._enter(scene, what)

    def suggest(self, key: str, kind: str) -> None:
        """Fill in numbers that fit another kind of shape or joint, for the user to go on from."""
        with self._telling():
            name = self._chosen()
            change = changes.set_shape if key == 'shape' else changes.set_joint_kind
            form = self.panel.body if key == 'shape' else self.panel.joint
            form.fill(sheet.read(change(self.scene, name, kind), name))

    def show_handles(self) -> None:
        """Put handles on the chosen bone while editing, else take them away."""
        with self._showing:
            if self.editing and self.bone is not None:
                self.handles.show(self.scene, self.bone, self.panel.limb.value)
            else:
                self.handles.hide()

    def add_bone(self, name: str) -> None:
        """Add a bone at the end of the chosen one, and choose it."""
        with self._telling():
            above, name = self._chosen(), name.strip()
            self.take(growth.add_bone(self.scene, above, name), f'add {name}')
            placement, _ = changes.find(self.scene, above)
            self.select(self.scene.qualified(placement, name))

    def remove_limb(self) -> None:
        """Take the chosen bone off, with all that hangs from it."""
        with self._telling():
            name = self._chosen()
            self.take(growth.remove_limb(self.scene, name), f'remove {name}')

    def _connect(self, gui: viser.GuiApi) -> None:
        """Have the panel's buttons, and keys, do what they say."""
        panel = self.panel
        panel.limb.on_update(lambda _: self.show_handles())
        panel.update.on_click(lambda _: self.update())
        panel.add.on_click(lambda _: self.add_bone(panel.name.value))
        panel.remove.on_click(lambda _: self.remove_limb())
        for button, label, key, modifier, action in (
                (panel.edit, 'Edit, or drop it', 'E', None, self.toggle),
                (panel.undo, 'Undo', 'Z', 'cmd/ctrl', self.undo),
                (panel.redo, 'Redo', 'Z', 'cmd/ctrl+shift', self.redo)):
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            for trigger in (button.on_click, command.on_trigger):
                trigger(lambda _, action=action: action())

    def _pose_dragged(self, position: np.ndarray, orientation: np.ndarray) -> None:
        with self._telling():
            name, limb = self._chosen(), self.panel.limb.value
            self._change(lambda: changes.set_pose(self.scene, name, position, orientation, limb),
                         f'move {name}')

    def _size_dragged(self, half_extents: np.ndarray) -> None:
        with self._telling():
            name = self._chosen()
            self._change(lambda: changes.set_size(self.scene, name, half_extents),
                         f'size of {name}')

    def _change(self, made: Callable[[], Scene], what: str) -> None:
        """Take a changed scene, on both sides if so wished; put back what is refused."""
        try:
            scene = made()
            if self.panel.both.value:
                scene = mirror.mirrored(scene, self._chosen(), self.panel.limb.value)
            self.take(scene, what)
        except errors.RagdollError:
            self.show_handles()
            raise

    def _enter(self, scene: Scene, what: str) -> None:
        """Have a scene from now on: a step, but for one of another name, which has its own past."""
        if scene.name == self.scene.name:
            self._history.push(scene, what)
        else:
            self._history = History(scene)
            self.files.forget()
        self._refresh()

    def _go(self, there: Callable[[], Scene], back: Callable[[], Scene]) -> None:
        with self._telling():
            before = self.scene
            scene = there()
            if scene is before:
                return
            try:
                self._run(scene, self.editing)
            except errors.RagdollError:
                back()
                raise
            with self._showing:
                self._refresh()

    def _set_editing(self, wanted: bool) -> None:
        with self._showing:
            self.editing = wanted
            self.panel.show_editing(wanted)
            self.show_handles()

    def _run(self, scene: Scene, hold: bool) -> None:
        """Have the page start anew with a scene; one that it refuses was never shown."""
        with self._showing:
            self._given.append(scene)
        stood = self._stood
        if hold:
            # First, so that not one tick is made before it stands.
            self._pause(True)
        try:
            self._use(scene)
        except errors.RagdollError:
            with self._showing, suppress(ValueError):
                self._given.remove(scene)
            if hold and not (stood or self.editing):
                self._pause(False)
            raise

    def _chosen(self) -> str:
        if self.bone is None:
            raise errors.UnknownBone('bone', None, 'a bone of the list, or a click on one')
        return self.bone

    def _refresh(self) -> None:
        """Show the scene and the chosen bone as they are now."""
        scene = self.scene
        if self.bone not in scene.bone_names:
            self.bone = None
        self.panel.show_bones(scene, self.bone)
        self.panel.show_history(self._history)
        joint = None if self.bone is None else changes.joint_of(scene, self.bone)
        self.panel.show_sheet(None if self.bone is None else sheet.read(scene, self.bone),
                              joint and joint.parent)
        self.show_handles()

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """One action at a time; what is wrong is said in the panel."""
        with self._acting:
            self.panel.tell(())
            try:
                yield
            except errors.ModelErrors as error:
                self.panel.tell(error.errors)
            except errors.ModelError as error:
                self.panel.tell([error])
            except errors.RagdollError as error:
                self.panel.say(in_words(error))
