"""A camera that goes where the doll goes, as far as it is asked to."""
from __future__ import annotations

import numpy as np
import viser

from ..sources.source import Frame

PERIOD = 1 / 30
"""s between two moves."""

CAMERA = ((3.2, -0.9, 1.3), (0.0, 0.0, 0.7))
"""Where it stands at first and what it looks at, m: in front of the doll, as the arrow keys have
it, and a little aside."""

FIELD = 0.8
"""rad, from top to bottom."""

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


class Follower:
    """Has the cameras of all pages look at the first doll's centre of mass.

    While a hand holds something they stand: the pointer would run from itself.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._node: viser.FrameHandle | None = None
        self._next = 0.0
        server.initial_camera.position, server.initial_camera.look_at = CAMERA
        server.initial_camera.fov = FIELD
        server.gui.add_html(FOLLOW)

    def follow(self, frame: Frame, now: float, wanted: bool) -> None:
        """Take a frame at ``now`` s of any steady clock."""
        if not wanted and self._node is not None:
            self._node.remove()
            self._node = None
        elif wanted and now >= self._next and not frame.held:
            self._next = now + PERIOD
            part = frame.scene.bone_slices[0]
            centre = np.average(frame.state.positions[part], axis=0,
                                weights=[bone.mass for bone in frame.scene.bones[part]])
            if self._node is None:
                self._node = self._server.scene.add_frame(NODE, show_axes=False)
            self._node.position = centre
