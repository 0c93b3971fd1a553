"""Switches *Follow* on when a doll is about to leave the view of a camera that stands still."""
from __future__ import annotations

import numpy as np
import viser

from ..sources.source import Frame
from .framing import sees_all

LOOK_AHEAD = 0.3
"""s that the doll's horizontal motion is extrapolated: as long as the camera takes to follow. What
falls stays in the view, which has the ground below it."""

AHEAD = LOOK_AHEAD * np.array((1.0, 1.0, 0.0))

RADIUS = 0.3
"""m around the centre of mass that has to be in view."""

STILL = 1e-3
"""m within which a camera has not moved."""


class AutoFollow:
    """Sets the checkbox *Follow*; a reset clears it again if it was set here."""

    def __init__(self, checkbox: viser.GuiCheckboxHandle) -> None:
        self._checkbox = checkbox
        self._is_own = False
        """Whether *Follow* was switched on here."""
        self._time = 0.0
        self._seen: dict[int, tuple[np.ndarray, bool]] = {}
        """Position and target of each page's camera, (6,) m, and whether it saw the doll."""

    def update(self, clients: dict[int, viser.ClientHandle], frame: Frame, center: np.ndarray,
               velocity: np.ndarray) -> None:
        """Take note of the newest frame, with a doll at ``center`` (3,) m, ``velocity`` (3,) m/s.

        *Follow* stays off if the doll leaves the view because a user turns the camera or drags the
        doll.
        """
        self._is_own &= self._checkbox.value
        if frame.time < self._time and self._is_own:
            self._checkbox.value = self._is_own = False
        self._time = frame.time
        if self._checkbox.value or frame.grabs:
            self._seen = {}
        elif self._leaves(clients, np.stack([center, center + AHEAD * velocity])):
            self._checkbox.value = self._is_own = True

    def _leaves(self, clients: dict[int, viser.ClientHandle], places: np.ndarray) -> bool:
        """Whether a page's camera that has not moved no longer sees all ``places`` (m, 3) m."""
        before, self._seen = self._seen, {}
        result = False
        for page, client in clients.items():
            camera = client.camera
            at = np.concatenate([camera.position, camera.look_at])
            sees = sees_all(camera.position, camera.look_at, camera.fov,
                            camera.image_width / max(camera.image_height, 1),
                            places, np.full(len(places), RADIUS))
            self._seen[page] = at, sees
            last, seen = before.get(page, (at, False))
            result |= seen and not sees and bool(np.abs(at - last).max() < STILL)
        return result
