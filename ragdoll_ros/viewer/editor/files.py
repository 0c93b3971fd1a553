"""The panel's files: save, load, download, upload, and a character that becomes a doll."""
from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import viser

from ...model import errors
from ...model.scene import Scene
from ..widgets.error_text import in_words
from ..widgets.form import GREEN, GREY, RED, colored
from .folder import CHARACTERS, DOLLS, LARGEST_UPLOAD, Folder

NONE = '(choose one)'

TIME = '%Y-%m-%d %H:%M'

MOST_TOLD = 3
"""Reasons of each verdict that the page tells."""


class Files:
    """Widgets for files in the GUI container that is current. Callbacks run in viser's threads.

    ``scene()`` is the one to save; ``take(scene, what)`` goes on with one that is loaded, or raises
    RagdollError.
    """

    def __init__(self, server: viser.ViserServer, scene: Callable[[], Scene],
                 take: Callable[[Scene, str], None], folder: Folder) -> None:
        self._server, self._scene, self._go_on_with, self._folder = server, scene, take, folder
        self._fitting = threading.Lock()
        self._at_hand = ''
        """Name of the file that the scene was saved in or loaded from: Save writes over it."""
        self._asked = ''
        """Name of the file of which Save has asked whether to write over it."""
        gui = server.gui
        self.place = gui.add_html(colored(f'Files are kept in {folder.path}', GREY))
        self.saved = gui.add_dropdown('saved', (NONE,), hint='newest first; loads it')
        self.name = gui.add_text('file', 'scene.yaml', hint=f'in {folder.path}')
        self.save_button = gui.add_button('Save', icon='device-floppy',
                                          hint='the whole scene, its dolls in it')
        self.load_button = gui.add_button('Load', icon='folder-open',
                                          hint='from that folder, or one of the shipped scenes')
        self.download_button = gui.add_button('Download', icon='download')
        self.upload_button = gui.add_upload_button(
            'Upload a scene or doll', icon='upload', mime_type=','.join(DOLLS))
        self.fit_button = gui.add_upload_button(
            'Fit a character', icon='man', mime_type=','.join(CHARACTERS),
            hint=f'a skinned .glb, .gltf or .vrm, or a .urdf; up to {LARGEST_UPLOAD // 10**6} MB')
        self.progress = gui.add_progress_bar(0.0, animated=True, visible=False)
        self.said = gui.add_html('')
        self.saved.on_update(lambda event: event.client and self._choose(event.target.value))
        self._list()
        self.save_button.on_click(lambda _: self.save())
        self.load_button.on_click(lambda _: self.load())
        self.download_button.on_click(lambda event: self.download(event.client))
        self.upload_button.on_upload(lambda event: self._received(event.target, self.upload))
        self.fit_button.on_upload(lambda event: self._received(event.target, self.fit))

    def forget(self) -> None:
        """Take note that another scene is at hand, which is none of the files here."""
        self._at_hand = self._asked = ''

    def save(self) -> None:
        """Write the scene to the file that is typed; over another one at the second asking."""
        self._try(self._save)
        self._list()

    def load(self) -> None:
        """Take the scene of the file that is typed."""
        self._try(self._load)

    def download(self, client: viser.ClientHandle | None) -> None:
        """Send the scene's file to the page that asked for it, or to all."""
        name = Path(self.name.value.strip() or 'scene').stem + '.yaml'
        to = client or self._server
        to.send_file_download(name, self._folder.text(self._scene()), save_immediately=True)

    def upload(self, name: str, content: bytes) -> None:
        """Take the scene, or the doll, of a YAML file that was sent."""
        self._try(lambda: self._take(self._folder.read(name, content), 'load', name))

    def fit(self, name: str, content: bytes) -> None:
        """Make a doll of a character that was sent; one at a time."""
        if not self._fitting.acquire(blocking=False):
            self._say('another character is being fitted: try again when it is done', RED)
            return
        try:
            self.progress.visible = True
            self._try(lambda: self._fitted(name, content))
        finally:
            self.progress.visible = False
            self._fitting.release()

    def _save(self) -> str:
        name = self._folder.find(self.name.value).name
        there = dict(self._folder.saved()).get(name)
        if there is not None and name not in (self._at_hand, self._asked):
            self._asked = name
            return f'{name} of {there:{TIME}} is there already: press Save again to write over it'
        name = self._at_hand = self._folder.save(self._scene(), self.name.value).name
        self._asked = ''
        return f'saved {name}'

    def _load(self) -> str:
        said = self._take(self._folder.load(self.name.value), 'load', self.name.value.strip())
        self._at_hand = self._folder.find(self.name.value).name
        return said

    def _choose(self, shown: str) -> None:
        """Load a file of the list."""
        if shown != NONE:
            self.name.value = shown.split(' · ')[0]
            self.load()

    def _list(self) -> None:
        """Offer the files that are there now."""
        found = [f'{name} · {changed:{TIME}}' for name, changed in self._folder.saved()]
        self.saved.options = (NONE, *found)
        self.saved.value = NONE

    def _fitted(self, name: str, content: bytes) -> str:
        scene, verdicts = self._folder.fit(name, content, self._show_progress)
        told = [self._take(scene, 'fit', name)]
        for placement, verdict in zip(scene.dolls, verdicts, strict=True):
            whose = f'{placement.name}: ' if len(verdicts) > 1 else ''
            told.append(f'{whose}verdict: {verdict.word}')
            told += [finding.sentence for finding in verdict.findings[:MOST_TOLD]]
            if len(verdict.findings) > MOST_TOLD:
                told.append(f'{len(verdict.findings) - MOST_TOLD} more, which ragdoll_fit lists')
        return '; '.join(told)

    def _take(self, scene: Scene, what: str, name: str) -> str:
        self._go_on_with(scene, f'{what} {name}')
        self.forget()
        return f'{"fitted" if what == "fit" else "loaded"} {name}: {len(scene.bones)} bones'

    def _show_progress(self, part: float, what: str) -> None:
        self.progress.value = 100 * part
        self._say(what + ' ...', GREEN)

    def _try(self, action: Callable[[], str]) -> None:
        """Do it and say so, or say in words why not."""
        try:
            self._say(action(), GREEN)
        except errors.RagdollError as error:
            self._say(in_words(error), RED)
        except OSError as error:
            self._say(f'{error.filename or "file"}: {error.strerror or error}', RED)

    def _say(self, text: str, color: str) -> None:
        self.said.content = colored(text, color)

    def _received(self, button: viser.GuiUploadButtonHandle,
                  action: Callable[[str, bytes], None]) -> None:
        file = button.value
        content = file.content
        # The button keeps its last file: let go of what may be 100 MB.
        file.content = b''
        action(file.name, content)
