"""The name and speed of the bone below a page's pointer, as a label in its picture."""
from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import viser

from ...model.pose import Pose
from ..browser.scripts import add_listener
from ..sources.source import Frame
from .motion import Motion

PERIOD = 0.1
"""s between two updates of a label, so that its number can be read."""

NODE = '/hover'


class Hover:
    """Labels of all pages."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._pointers: dict[int, tuple[float, float]] = {}
        """Where each page's pointer is: from -1 to 1, to the right and up."""
        self._labels: dict[int, viser.LabelHandle] = {}
        self._next_update = 0.0
        self.on_click: Callable[[viser.ClientHandle, np.ndarray, np.ndarray], None] = (
            lambda client, origin, direction: None)
        """Called in viser's thread with a page and the line of sight of a click or a tap."""
        self.pointer_events = add_listener(server.gui, 'pointer', 'pointer.js', self._take)

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            self._pointers.pop(client.client_id, None)
            self._labels.pop(client.client_id, None)

    def _take(self, page: int, text: str) -> None:
        """Take an event of pointer.js: a pointer has moved, clicked, or left the picture."""
        try:
            numbers = list(map(float, text.removeprefix('click ').split()))
        except ValueError:
            numbers = []
        client = self._server.get_clients().get(page)
        if not text.startswith('click '):
            self._pointers.pop(page, None)
            if len(numbers) == 2:
                self._pointers[page] = numbers[0], numbers[1]
        elif client is not None and len(numbers) == 6 and all(map(math.isfinite, numbers)):
            self.on_click(client, np.array(numbers[:3]), np.array(numbers[3:]))

    def line_of_sight(self, client: viser.ClientHandle) -> tuple[np.ndarray, np.ndarray]:
        """Origin and direction (3,) through a page's pointer, or else the middle of its picture."""
        return ray(client.camera, *self._pointers.get(client.client_id, (0.0, 0.0)))

    def show(self, frame: Frame, motion: Motion, now: float) -> None:
        """Label the bones of the shown frame below the pointers, at ``now`` s of a steady clock.

        ``motion``: that of the newest frame; labels tell speeds only if this frame is shown.
        """
        if now < self._next_update or not (self._pointers or self._labels):
            return
        self._next_update = now + PERIOD
        for page, client in self._server.get_clients().items():
            pointer, label = self._pointers.get(page), self._labels.get(page)
            bone = None if pointer is None else bone_at(frame, *ray(client.camera, *pointer))
            if bone is not None:
                text, above = frame.scene.bone_names[bone], frame.state.positions[bone].copy()
                above[2] += max(frame.scene.bones[bone].shape.half_extents)
                if frame is motion.frame:
                    text += f' {np.linalg.norm(motion.velocities()[bone]):.1f} m/s'
                if label is None:
                    self._labels[page] = client.scene.add_label(
                        NODE, text, position=above, anchor='bottom-center')
                else:
                    label.text, label.position = text, above
            elif label is not None:
                self._labels.pop(page).remove()


def ray(camera: viser.CameraHandle, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    """Origin and direction (3,) of the line of sight through a point of the picture, world frame.

    ``x``, ``y``: from -1 to 1, to the right and up.
    """
    forward = camera.look_at - camera.position
    forward = forward / max(np.linalg.norm(forward), 1e-12)
    right = np.cross(forward, camera.up_direction)
    right = right / max(np.linalg.norm(right), 1e-12)
    half = math.tan(camera.fov / 2)
    aspect = camera.image_width / max(camera.image_height, 1)
    return camera.position, forward + half * (
        x * aspect * right + y * np.cross(right, forward))


def bone_at(frame: Frame, origin: np.ndarray, direction: np.ndarray,
            ignored: slice | None = None) -> int | None:
    """Index of the first bone that a ray meets, by the boxes around the bones; None if none."""
    half = np.array([bone.shape.half_extents for bone in frame.scene.bones])
    poses = Pose(frame.state.positions, frame.state.orientations)
    start = poses.apply_inverse(origin)
    step = poses.apply_inverse(origin + direction) - start
    step = np.where(np.abs(step) < 1e-12, 1e-12, step)
    sides = np.stack([(-half - start) / step, (half - start) / step])
    enters, leaves = sides.min(axis=0).max(axis=1), sides.max(axis=0).min(axis=1)
    enters = np.where((enters <= leaves) & (enters > 0), enters, np.inf)
    if ignored is not None:
        enters[ignored] = np.inf
    nearest = int(enters.argmin())
    return nearest if np.isfinite(enters[nearest]) else None
