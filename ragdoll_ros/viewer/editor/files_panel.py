"""The files panel: save, load, download and upload scenes, and fit characters."""
from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import viser

from ...model import errors
from ...model.scene import Scene
from ..widgets.error_text import error_text
from ..widgets.form import AMBER, GREEN, GREY, RED, colored
from .scene_folder import CHARACTERS, DOLLS, LARGEST_UPLOAD, SceneFolder

NONE = '(choose one)'

TIME = '%Y-%m-%d %H:%M'

VERDICT_COLORS = {'good': GREEN, 'doubtful': AMBER, 'wrong': RED}

Line = tuple[str, str]
"""A text and its colour."""

MAX_FINDINGS = 3
"""Findings of each verdict that the page shows."""


class FilesPanel:
    """Widgets for files in the GUI container that is current. Callbacks run in viser's threads.

    ``scene()`` is the scene to save; ``set_scene(scene, change)`` takes a loaded one and a name of
    the change, or raises RagdollError.
    """

    def __init__(self, server: viser.ViserServer, scene: Callable[[], Scene],
                 set_scene: Callable[[Scene, str], None], folder: SceneFolder) -> None:
        self._server, self._scene, self._set_scene = server, scene, set_scene
        self.folder = folder
        self._fitting = threading.Lock()
        self._current = ''
        """Name of the scene's file, saved or loaded: Save overwrites it."""
        self._to_confirm = ''
        """Name of another file that a second Save overwrites."""
        gui = server.gui
        self.place = gui.add_html(colored(f'Files are kept in {folder.path}', GREY))
        self.saved = gui.add_dropdown('Saved', (NONE,), hint='Newest first; loads it')
        self.name = gui.add_text('File', 'scene.yaml', hint=f'In {folder.path}')
        self.actions = gui.add_button_group(
            'Action', ('Save', 'Load', 'Download'), hint='Save and Download write the '
            'whole scene with its dolls; Load reads a file of the folder above, or a shipped scene')
        self.upload_button = gui.add_upload_button(
            'Upload a scene or doll', icon='upload', mime_type=','.join(DOLLS))
        self.fit_button = gui.add_upload_button(
            'Fit a character', icon='man', mime_type=','.join(CHARACTERS),
            hint=f'A skinned .glb, .gltf or .vrm, or a .urdf or .sdf; up to '
            f'{LARGEST_UPLOAD // 10**6} MB')
        self.progress = gui.add_progress_bar(0.0, animated=True, visible=False)
        self.message = gui.add_html('')
        self.saved.on_update(lambda event: event.client and self._load_listed(event.target.value))
        self._update_list()
        self.actions.on_click(self._on_action)
        self.upload_button.on_upload(lambda event: self.take_upload(event.target, self.upload))
        self.fit_button.on_upload(lambda event: self.take_upload(event.target, self.fit))

    def _on_action(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        if event.target.value == 'Save':
            self.save()
        elif event.target.value == 'Load':
            self.load()
        else:
            self.download(event.client)

    def forget(self) -> None:
        """Take note that the current scene is not from a file here."""
        self._current = self._to_confirm = ''

    def save(self) -> None:
        """Save the scene to the typed file; overwrite another file only at the second press."""
        self._try(self._save)
        self._update_list()

    def load(self) -> None:
        """Load the scene of the typed file."""
        self._try(self._load)

    def download(self, client: viser.ClientHandle | None) -> None:
        """Send the scene as a file to the page that asked for it, or to all."""
        name = Path(self.name.value.strip() or 'scene').stem + '.yaml'
        to = client or self._server
        to.send_file_download(name, self.folder.text(self._scene()), save_immediately=True)

    def upload(self, name: str, content: bytes) -> None:
        """Load the scene or doll of an uploaded YAML file."""
        self._try(lambda: self._take(self.folder.read(name, content), 'load', name))

    def fit(self, name: str, content: bytes) -> None:
        """Fit a doll to an uploaded character; one at a time."""
        if not self._fitting.acquire(blocking=False):
            self._show('another character is being fitted: try again when that has finished', RED)
            return
        try:
            self.progress.visible = True
            self._try(lambda: self._fitted(name, content))
        finally:
            self.progress.visible = False
            self._fitting.release()

    def take_upload(self, button: viser.GuiUploadButtonHandle,
                    action: Callable[[str, bytes], None]) -> None:
        """Hand the name and the content of an upload to ``action``."""
        file = button.value
        content = file.content
        # The button keeps its last file: release up to 100 MB.
        file.content = b''
        action(file.name, content)

    def _save(self) -> str:
        name = self.folder.find(self.name.value).name
        changed = dict(self.folder.saved()).get(name)
        if changed is not None and name not in (self._current, self._to_confirm):
            self._to_confirm = name
            return f'{name} of {changed:{TIME}} exists: press Save again to overwrite it'
        name = self._current = self.folder.save(self._scene(), self.name.value).name
        self._to_confirm = ''
        return f'saved {name}'

    def _load(self) -> str:
        message = self._take(self.folder.load(self.name.value), 'load', self.name.value.strip())
        self._current = self.folder.find(self.name.value).name
        return message

    def _load_listed(self, entry: str) -> None:
        """Load the file of an entry of the list."""
        if entry != NONE:
            self.name.value = entry.split(' · ')[0]
            self.load()

    def _update_list(self) -> None:
        """List the files in the folder."""
        entries = [f'{name} · {changed:%Y-%m-%d}' for name, changed in self.folder.saved()]
        self.saved.options = (NONE, *entries)
        self.saved.value = NONE

    def _fitted(self, name: str, content: bytes) -> list[Line]:
        scene, verdicts = self.folder.fit(name, content, self._show_progress)
        lines: list[Line] = [(self._take(scene, 'fit', name), GREEN)]
        for placement, verdict in zip(scene.dolls, verdicts, strict=True):
            whose = f'{placement.name}: ' if len(verdicts) > 1 else ''
            lines.append((f'{whose}verdict: {verdict.word}', VERDICT_COLORS[verdict.word]))
            lines += [(finding.sentence, VERDICT_COLORS[finding.word])
                      for finding in verdict.findings[:MAX_FINDINGS]]
            if len(verdict.findings) > MAX_FINDINGS:
                lines.append((f'{len(verdict.findings) - MAX_FINDINGS} more, listed by '
                              'ragdoll_fit', GREY))
        return lines

    def _take(self, scene: Scene, action: str, name: str) -> str:
        self._set_scene(scene, f'{action} {name}')
        self.forget()
        return f'{"fitted" if action == "fit" else "loaded"} {name}: {len(scene.bones)} bones'

    def _show_progress(self, fraction: float, step: str) -> None:
        self.progress.value = 100 * fraction
        self._show(step + ' ...', GREEN)

    def _try(self, action: Callable[[], str | list[Line]]) -> None:
        """Run an action and show its message, or its error."""
        try:
            said = action()
            self._show_lines([(said, GREEN)] if isinstance(said, str) else said)
        except errors.RagdollError as error:
            self._show(error_text(error), RED)
        except OSError as error:
            self._show(f'{error.filename or "file"}: {error.strerror or error}', RED)

    def _show(self, text: str, color: str) -> None:
        self._show_lines([(text, color)])

    def _show_lines(self, lines: list[Line]) -> None:
        self.message.content = ''.join(colored(text, color) for text, color in lines)
