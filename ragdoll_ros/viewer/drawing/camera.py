"""Cameras that see all there is, and go where the doll goes as far as they are asked to."""
from __future__ import annotations

import numpy as np
import viser

from ..sources.source import Frame
from .framing import bounds, middle, place, sees

PERIOD = 1 / 30
"""s between two moves."""

CAMERA = ((3.2, -0.9, 1.3), (0.0, 0.0, 0.7))
"""Where it stands at first and what it looks at, m: in front of the doll, as the arrow keys have
it, and a little aside."""

FIELD = 0.8
"""rad, from top to bottom."""

FAR = 1000.0
"""m to which a camera sees at least."""

FARTHEST = 4
"""Times the distance of the home view from which one sees too little of what has changed."""

STILL = 1e-3
"""m that a camera which stands at home may be off."""

ASPECT = 1.2
"""Width to height of a picture of which that is not known yet."""

NODE = '/followed'

FOLLOW = f"""<img src="data:," style="display:none" onerror="
  if (!window.ragdollFollows) (function follow(last) {{
    window.ragdollFollows = true;
    const viewer = window.__viserMutable;
    const node = viewer?.cameraControl && viewer.nodeRefFromName['{NODE}'];
    let at = null;
    if (node) {{
      node.updateWorldMatrix(true, false);
      at = viewer.camera.position.clone().setFromMatrixPosition(node.matrixWorld);
      if (!last || at.distanceTo(last) > 1e-3) viewer.cameraControl.moveTo(...at, true);
    }}
    requestAnimationFrame(() => follow(at));
  }})(null)">"""
"""Lets a page's camera look at the node, if there is one, from the side and distance it has. The
page itself does so: what the server knows of a camera is late, and would undo its rotation."""


class Cameras:
    """The cameras of all pages: at home, or where the first doll goes.

    While a hand holds something they stand: the pointer would run from itself.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._frame: Frame | None = None
        self._node: viser.FrameHandle | None = None
        self._homes: dict[int, tuple[np.ndarray, float]] = {}
        """Where each page's camera was put at home, and the picture's aspect then."""
        self._left: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        """Where each page's camera was, and what it looked at, before it followed."""
        self._next = 0.0
        server.initial_camera.position, server.initial_camera.look_at = CAMERA
        server.initial_camera.fov = FIELD
        server.gui.add_html(FOLLOW)
        server.on_client_connect(self._welcome)

    def show(self, frame: Frame) -> None:
        """Take a frame that is drawn: another scene, or a start that is out of sight, is framed."""
        before, self._frame = self._frame, frame
        if before is None or _kind(before) != _kind(frame):
            balls = bounds(frame.scene, frame.state)
            first, look_at = self._server.initial_camera, middle(*balls)
            first.position, first.look_at = place(*balls, look_at, FIELD, ASPECT), look_at
            for client in self._server.get_clients().values():
                self.go_home(client)
        elif frame.scene is not before.scene or frame.time < before.time:
            for client in self._server.get_clients().values():
                self._meet(client)

    def go_home(self, client: viser.ClientHandle) -> None:
        """Let a page's camera see all there is, from the front."""
        if self._frame is None:
            return
        balls = bounds(self._frame.scene, self._frame.state)
        camera = client.camera
        look_at = middle(*balls)
        if self._node is not None:  # where it was set may be of the scene before
            self._node.position = look_at = _centre(self._frame)
        position = place(*balls, look_at, camera.fov, _aspect(camera))
        self._homes[client.client_id] = position, _aspect(camera)
        camera.up_direction = (0.0, 0.0, 1.0)
        self._move(client, position, look_at)
        camera.far = max(FAR, 3 * float(np.linalg.norm(position - look_at)))

    def follow(self, frame: Frame, now: float, wanted: bool) -> None:
        """Take a frame at ``now`` s of any steady clock; what ends goes back to where it was."""
        if not wanted and self._node is not None:
            self._node.remove()
            self._node = None
            for client_id, client in self._server.get_clients().items():
                if client_id in self._left:
                    self._move(client, *self._left.pop(client_id))
        elif wanted and now >= self._next and not frame.held:
            self._next = now + PERIOD
            if self._node is None:
                self._left = {client_id: (client.camera.position, client.camera.look_at)
                              for client_id, client in self._server.get_clients().items()}
                self._node = self._server.scene.add_frame(NODE, show_axes=False)
            self._node.position = _centre(frame)

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Bring a new page home, and again when its window changes while it is there.

        Viser's own first camera may come after that.
        """
        self.go_home(client)

        @client.camera.on_update
        def _(camera: viser.CameraHandle) -> None:
            position, aspect = self._homes.get(client.client_id, (np.full(3, np.inf), 1.0))
            changed = abs(_aspect(camera) / aspect - 1) > 0.01
            if _near(camera, self._server.initial_camera.position) or (
                    changed and _near(camera, position)):
                self.go_home(client)

    def _meet(self, client: viser.ClientHandle) -> None:
        """Bring a page's camera home where it does not see all, or sees it from FARTHEST away."""
        if self._frame is None:
            return
        camera, balls = client.camera, bounds(self._frame.scene, self._frame.state)
        look_at = middle(*balls)
        home = place(*balls, look_at, camera.fov, _aspect(camera))
        is_far = (np.linalg.norm(camera.position - look_at)
                  > FARTHEST * np.linalg.norm(home - look_at))
        if is_far or not sees(camera.position, camera.look_at, camera.fov, _aspect(camera), *balls):
            self.go_home(client)

    def _move(self, client: viser.ClientHandle, position: np.ndarray, look_at: np.ndarray) -> None:
        with client.atomic():
            client.camera.position = position
            client.camera.look_at = look_at


def _centre(frame: Frame) -> np.ndarray:
    """Centre of mass (3,) m of the first doll."""
    part = frame.scene.bone_slices[0]
    return np.average(frame.state.positions[part], axis=0,
                      weights=[bone.mass for bone in frame.scene.bones[part]])


def _kind(frame: Frame) -> tuple[str, int]:
    """What tells a scene from another one; an edited doll is in the same."""
    return frame.scene.name, len(frame.scene.dolls)


def _near(camera: viser.CameraHandle, position: np.ndarray) -> bool:
    return bool(np.abs(camera.position - position).max() < STILL)


def _aspect(camera: viser.CameraHandle) -> float:
    return camera.image_width / max(camera.image_height, 1)
