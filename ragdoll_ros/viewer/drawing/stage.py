"""All that is drawn of one scene."""
from __future__ import annotations

import viser

from ..sources.source import Frame
from .bodies import Bodies
from .ground import draw_ground
from .joint_limits import JointLimits
from .overlays import Overlays
from .skin_meshes import SkinMeshes


class Stage:
    """Draws one scene, in place of the stage before."""

    def __init__(self, server: viser.ViserServer, frame: Frame) -> None:
        self.scene = frame.scene
        server.scene.remove_by_name('/scene')
        self._server, self._dark = server, False
        draw_ground(server, self.scene, dark=False)
        self.skins = SkinMeshes(server, self.scene)
        self.bodies = Bodies(server, self.scene, frame.state, self.skins.skinned)
        self._overlays = Overlays(server)
        self._limits = JointLimits(server, self.scene)

    def show(self, frame: Frame) -> None:
        """Draw a frame of the scene."""
        self.bodies.show(frame.state)
        self.skins.show(frame.state)
        self._overlays.show(frame)
        self._limits.show(frame.state, frame.angles)

    def set_dark(self, dark: bool) -> None:
        """Draw the ground for a dark page or a light one."""
        if dark != self._dark:
            self._dark = dark
            draw_ground(self._server, self.scene, dark)

    def set_visible(self, bones: bool, skins: bool) -> None:
        """Show or hide bones and skins; bones are shown at least where skins are hidden."""
        self.bodies.set_visible(bones or not skins, translucent=skins)
        self.skins.set_visible(skins)
