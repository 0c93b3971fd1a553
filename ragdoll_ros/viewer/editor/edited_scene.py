"""The edited scene: its history, and its way to the source and back to the page."""
from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Literal

from ...model import errors
from ...model.scene import Scene
from .undo_history import UndoHistory

MAX_PENDING = 20
"""Scenes sent to the source that the page has not shown yet."""

Reason = Literal['change', 'step', 'other']
"""Why another scene is current: a change, a step in the history, or another scene's name."""


class EditedScene:
    """The current scene, which the source runs, and those before and after it.

    ``set_scene`` restarts the source with a scene, or raises RagdollError: then the change is
    refused and the scene stays. ``pause`` pauses or resumes the source. ``refresh`` is called with
    ``lock`` held when another scene has become current. ``lock`` is not held during ``set_scene``.
    """

    def __init__(self, scene: Scene, set_scene: Callable[[Scene], None],
                 pause: Callable[[bool], None], refresh: Callable[[Reason], None]) -> None:
        self._set_source_scene, self._pause, self._refresh = set_scene, pause, refresh
        self.lock = threading.RLock()
        self.history = UndoHistory(scene)
        self._pending: deque[Scene] = deque(maxlen=MAX_PENDING)
        self._is_setting = False
        """Whether a scene has been sent that is not current yet."""

    @property
    def current(self) -> Scene:
        """The current scene."""
        return self.history.scene

    def show(self, scene: Scene) -> None:
        """Take note that the page shows another scene."""
        with self.lock:
            if scene in self._pending:
                # Sent from here; the page draws late, and may have skipped some before it.
                while self._pending.popleft() != scene:
                    pass
                if self._pending or self._is_setting:
                    return
                # Where another one that was loaded was drawn in between, that is current now.
            if scene != self.current:
                is_same = (scene.name, scene.dolls) == (self.current.name, self.current.dolls)
                self._push(scene, 'settings' if is_same else f'scene {scene.name}')

    def set(self, scene: Scene, name: str, pause: bool) -> None:
        """Make a scene current, as a change called ``name``; RagdollError if it is refused."""
        self._is_setting = True
        try:
            self.restart(scene, pause)
            with self.lock:
                self._push(scene, name)
        finally:
            self._is_setting = False

    def undo(self, pause: bool) -> None:
        """Go one step back."""
        self._step(self.history.undo, self.history.redo, pause)

    def redo(self, pause: bool) -> None:
        """Go one step forward."""
        self._step(self.history.redo, self.history.undo, pause)

    def restart(self, scene: Scene, pause: bool, resume_if_refused: bool = False) -> None:
        """Restart the source with a scene, paused if ``pause``, else as it was.

        A refused scene is not pending; the source then resumes if ``resume_if_refused``.
        """
        with self.lock:
            self._pending.append(scene)
        if pause:
            # Before the scene is set, so that no tick is made with it.
            self._pause(True)
        try:
            self._set_source_scene(scene)
        except errors.RagdollError:
            with self.lock, suppress(ValueError):
                self._pending.remove(scene)
            if resume_if_refused:
                self._pause(False)
            raise

    def _push(self, scene: Scene, name: str) -> None:
        """Add a scene to the history; one with another name starts a new history."""
        if scene.name == self.current.name:
            self.history.push(scene, name)
            self._refresh('change')
        else:
            self.history = UndoHistory(scene)
            self._refresh('other')

    def _step(self, step: Callable[[], Scene], revert: Callable[[], Scene], pause: bool) -> None:
        """Go a step in the history; revert it if the source refuses the scene."""
        before = self.current
        scene = step()
        if scene is before:
            return
        try:
            self.restart(scene, pause)
        except errors.RagdollError:
            revert()
            raise
        with self.lock:
            self._refresh('step')
