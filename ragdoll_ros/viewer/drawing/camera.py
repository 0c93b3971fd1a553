"""Cameras of the pages: the home view, which shows the whole scene, and following a doll."""
from __future__ import annotations

from collections import deque

import numpy as np
import viser

from ..browser.scripts import script
from ..pushing.motion import doll_mean
from ..sources.source import Frame
from .framing import bounding_spheres, box_center, home_position, sees_all

PERIOD = 1 / 30
"""s between two moves of a camera, and of the node of the pushed doll."""

INITIAL_CAMERA = ((3.2, -0.9, 1.3), (0.0, 0.0, 0.7))
"""Position and target before the first frame, m: from the front, a little aside."""

FIELD_OF_VIEW = 0.7
"""rad, vertical: that of a lens of 33 mm on 35 mm film, which enlarges nothing that is near."""

FAR = 1000.0
"""m: smallest far plane."""

MAX_DISTANCE_RATIO = 4
"""A camera farther away than this times the distance of the home view is moved to that."""

MOST_HOMES = 32
"""Home views of a page that are remembered: a window changes its size in several steps, and a slow
page still tells of the first when the last is computed."""

TOLERANCE = 1e-3
"""m within which a camera counts as being in the home view."""

ASPECT = 1.2
"""Width to height of the canvas while that is unknown."""

FOLLOWED_NODE = '/followed'

DOLL_NODE = '/doll'
"""At the centre of mass of the pushed doll, for edge_arrow.js."""


class Cameras:
    """Moves the cameras of all pages to the home view, or with the pushed doll.

    They stop while a hand holds something: the drag target moves with the camera.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._frame: Frame | None = None
        self._node: viser.FrameHandle | None = None
        self._doll = server.scene.add_frame(DOLL_NODE, show_axes=False)
        self._bone = 0
        """Index of the pushed bone."""
        self._homes: dict[int, deque[tuple[np.ndarray, float]]] = {}
        """Each page's last home views, position and the aspect that it was computed for: a page
        may still tell of its place before the last."""
        self._before_follow: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        """Position and target of each page's camera before it followed."""
        self._next_move = 0.0
        server.initial_camera.position, server.initial_camera.look_at = INITIAL_CAMERA
        server.initial_camera.fov = FIELD_OF_VIEW
        server.gui.add_html(script('camera_follow.js', NODE=FOLLOWED_NODE))
        server.gui.add_html(script('picture_size.js'))
        server.gui.add_html(script('edge_arrow.js', NODE=DOLL_NODE))
        server.on_client_connect(self._on_connect)

    def show(self, frame: Frame) -> None:
        """Take note of a drawn frame: show the home view of another scene, or of a start that is
        out of view.
        """
        before, self._frame = self._frame, frame
        if before is None or _scene_key(before) != _scene_key(frame):
            spheres = bounding_spheres(frame.scene, frame.state)
            first, look_at = self._server.initial_camera, box_center(*spheres)
            first.look_at = look_at
            first.position = home_position(*spheres, look_at, FIELD_OF_VIEW, ASPECT)
            self._before_follow.clear()  # views of the scene before
            for client in self._server.get_clients().values():
                self.go_home(client)
        elif frame.scene is not before.scene or frame.time < before.time:
            for client in self._server.get_clients().values():
                self._ensure_visible(client)

    def go_home(self, client: viser.ClientHandle) -> None:
        """Move a page's camera to the home view: the whole scene from the front."""
        if self._frame is None:
            return
        spheres = bounding_spheres(self._frame.scene, self._frame.state)
        camera = client.camera
        look_at = box_center(*spheres)
        if self._node is not None:  # its position may be of the scene before
            self._node.position = look_at = self._center(self._frame)
        aspect = _aspect(camera)  # once: the page may tell of another size at any time
        position = home_position(*spheres, look_at, camera.fov, aspect)
        homes = self._homes.setdefault(client.client_id, deque(maxlen=MOST_HOMES))
        homes.append((position, aspect))
        camera.up_direction = (0.0, 0.0, 1.0)
        self._move(client, position, look_at)
        camera.far = max(FAR, 3 * float(np.linalg.norm(position - look_at)))

    def follow(self, frame: Frame, bone: int, now: float, follow: bool) -> None:
        """Follow the doll of a bone if ``follow``, else return to the views before following.

        ``now``: s of a steady clock.
        """
        self._bone = bone
        is_due = now >= self._next_move
        if is_due:
            self._next_move = now + PERIOD
            center = self._center(frame)
            if np.abs(center - self._doll.position).max() > TOLERANCE:
                self._doll.position = center
        if not follow and self._node is not None:
            self._node.remove()
            self._node = None
            for client_id, client in self._server.get_clients().items():
                if client_id in self._before_follow:
                    self._move(client, *self._before_follow.pop(client_id))
        elif follow and is_due and not frame.grabs:
            if self._node is None:
                self._before_follow = {client_id: (client.camera.position, client.camera.look_at)
                              for client_id, client in self._server.get_clients().items()}
                self._node = self._server.scene.add_frame(FOLLOWED_NODE, show_axes=False)
            self._node.position = center

    def _center(self, frame: Frame) -> np.ndarray:
        """Centre of mass (3,) m of the pushed doll, world frame."""
        bone = self._bone if self._bone < len(frame.scene.bones) else 0
        return doll_mean(frame.scene, bone, frame.state.positions)

    def _on_connect(self, client: viser.ClientHandle) -> None:
        """Show the home view to a new page, and again when its window is resized while in it.

        Viser may apply its initial camera later; then the home view is shown again, too.
        """
        @client.camera.on_update
        def _(camera: viser.CameraHandle) -> None:
            if _is_at(camera, self._server.initial_camera.position) or (
                    self._is_at_home_of_another_size(client)):
                self.go_home(client)

        self.go_home(client)

    def _is_at_home_of_another_size(self, client: viser.ClientHandle) -> bool:
        """Whether a page is at a home view, but at none that was computed for its aspect."""
        now = _aspect(client.camera)
        aspects = [aspect for position, aspect in tuple(self._homes.get(client.client_id, ()))
                   if _is_at(client.camera, position)]
        return bool(aspects) and all(abs(now / aspect - 1) > 0.01 for aspect in aspects)

    def _ensure_visible(self, client: viser.ClientHandle) -> None:
        """Show the home view where a camera does not see all or is too far away."""
        camera, spheres = client.camera, bounding_spheres(self._frame.scene, self._frame.state)
        look_at = box_center(*spheres)
        home = home_position(*spheres, look_at, camera.fov, _aspect(camera))
        is_far = (np.linalg.norm(camera.position - look_at)
                  > MAX_DISTANCE_RATIO * np.linalg.norm(home - look_at))
        if is_far or not sees_all(camera.position, camera.look_at, camera.fov, _aspect(camera),
                                  *spheres):
            self.go_home(client)

    def _move(self, client: viser.ClientHandle, position: np.ndarray, look_at: np.ndarray) -> None:
        with client.atomic():
            client.camera.position = position
            client.camera.look_at = look_at


def _scene_key(frame: Frame) -> tuple[str, int]:
    """Identifies a scene, also after edits."""
    return frame.scene.name, len(frame.scene.dolls)


def _is_at(camera: viser.CameraHandle, position: np.ndarray) -> bool:
    return bool(np.abs(camera.position - position).max() < TOLERANCE)


def _aspect(camera: viser.CameraHandle) -> float:
    return camera.image_width / max(camera.image_height, 1)
