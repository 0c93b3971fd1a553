"""Undo and redo: scenes are immutable, so the past is a list of them."""
from __future__ import annotations

from collections import deque

from ...model.scene import Scene

MOST = 500
"""Steps back that are kept. A step shares all that it did not change with the one before."""


Step = tuple[Scene, str]
"""A scene, and what made it of the one before."""


class History:
    """Scenes in the order they were made, and which of them is now."""

    def __init__(self, scene: Scene, most: int = MOST) -> None:
        self._past: deque[Step] = deque([(scene, '')], maxlen=most + 1)
        self._future: list[Step] = []

    @property
    def scene(self) -> Scene:
        """The scene as it is now."""
        return self._past[-1][0]

    @property
    def undoes(self) -> str:
        """What undo would take back; empty if there is nothing."""
        return self._past[-1][1] if len(self._past) > 1 else ''

    @property
    def redoes(self) -> str:
        """What redo would bring again; empty if there is nothing."""
        return self._future[-1][1] if self._future else ''

    def push(self, scene: Scene, what: str) -> None:
        """Go on to another scene; what was undone is gone. The same scene again is no step."""
        if scene != self.scene:
            self._past.append((scene, what))
            self._future.clear()

    def undo(self) -> Scene:
        """Go back a step, if there is one; gives the scene that is now."""
        if len(self._past) > 1:
            self._future.append(self._past.pop())
        return self.scene

    def redo(self) -> Scene:
        """Go a step forward again, if there is one; gives the scene that is now."""
        if self._future:
            self._past.append(self._future.pop())
        return self.scene
