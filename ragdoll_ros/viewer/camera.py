"""A camera that goes where the doll goes, as far as it is asked to."""
from __future__ import annotations

import numpy as np
import viser

from .source import Frame

PERIOD = 1 / 30
"""s between two moves."""

CAMERA = ((3.2, -0.9, 1.3), (0.0, 0.0, 0.7))
"""Where it stands at first and what it looks at, m: in front of the doll, as the arrow keys have
it, and a little aside."""

FIELD = 0.8
"""rad, from top to bottom."""


class Follower:
    """Moves the cameras of all pages by as much as the first doll's centre of mass moves."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._last: np.ndarray | None = None
        self._next = 0.0
        server.initial_camera.position, server.initial_camera.look_at = CAMERA
        server.initial_camera.fov = FIELD

    def follow(self, frame: Frame, now: float, wanted: bool) -> None:
        """Take a frame at ``now`` s of any steady clock."""
        if not wanted:
            self._last = None
        elif now >= self._next:
            self._next = now + PERIOD
            bones = frame.scene.dolls[0].doll.bones
            centre = np.average(frame.state.positions[:len(bones)], axis=0,
                                weights=[bone.mass for bone in bones])
            if self._last is not None:
                self._move(centre - self._last)
            self._last = centre

    def _move(self, way: np.ndarray) -> None:
        for client in self._server.get_clients().values():
            client.camera.position = client.camera.position + way
