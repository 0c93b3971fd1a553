"""Undo and redo: scenes are immutable, so the history is a list of them."""
from __future__ import annotations

from collections import deque

from ...model.scene import Scene

MAX_STEPS = 500
"""Kept for undo. Successive scenes share all unchanged parts."""

Step = tuple[Scene, str]
"""A scene, and the name of the change that led to it."""


class UndoHistory:
    """Scenes in order of creation, one of which is current."""

    def __init__(self, scene: Scene, max_steps: int = MAX_STEPS) -> None:
        self._past: deque[Step] = deque([(scene, '')], maxlen=max_steps + 1)
        self._future: list[Step] = []

    @property
    def scene(self) -> Scene:
        """The current scene."""
        return self._past[-1][0]

    @property
    def undo_name(self) -> str:
        """Name of the change that undo would revert; empty if there is none."""
        return self._past[-1][1] if len(self._past) > 1 else ''

    @property
    def redo_name(self) -> str:
        """Name of the change that redo would restore; empty if there is none."""
        return self._future[-1][1] if self._future else ''

    def push(self, scene: Scene, name: str) -> None:
        """Add a change unless the scene is equal; drops undone changes."""
        if scene != self.scene:
            self._past.append((scene, name))
            self._future.clear()

    def undo(self) -> Scene:
        """Go one step back, if possible; returns the current scene."""
        if len(self._past) > 1:
            self._future.append(self._past.pop())
        return self.scene

    def redo(self) -> Scene:
        """Go one step forward, if possible; returns the current scene."""
        if self._future:
            self._past.append(self._future.pop())
        return self.scene
