"""All that is drawn of one scene."""
from __future__ import annotations

import viser

from ..sources.source import Frame
from .bodies import Bodies
from .ground import show_ground
from .joint_limits import Limits
from .marks import Marks
from .skin import Skins


class Stage:
    """Takes the place of the stage before it."""

    def __init__(self, server: viser.ViserServer, frame: Frame) -> None:
        self.scene = frame.scene
        server.scene.remove_by_name('/scene')
        self._server, self._dark = server, False
        show_ground(server, self.scene, dark=False)
        self.skins = Skins(server, self.scene)
        self.bodies = Bodies(server, self.scene, frame.state, self.skins.clad)
        self._marks = Marks(server)
        self._limits = Limits(server, self.scene)

    def show(self, frame: Frame) -> None:
        """Draw all where it is."""
        self.bodies.show(frame.state)
        self.skins.show(frame.state)
        self._marks.show(frame)
        self._limits.show(frame.state, frame.angles)

    def be_dark(self, wanted: bool) -> None:
        """Draw the ground for a dark page, or for a light one."""
        if wanted != self._dark:
            self._dark = wanted
            show_ground(self._server, self.scene, wanted)

    def be_visible(self, bones: bool, skins: bool) -> None:
        """Show bones and skins; bones at least where there is no skin."""
        self.bodies.be_visible(bones or not skins, glass=skins)
        self.skins.be_visible(skins)
