"""A scene's swings on the bones of its simulation."""
from __future__ import annotations

import dataclasses

import numpy as np

from ...model.scene import SECOND, Scene
from ...model.state import State
from .mount import mounts
from .pose import SwingState
from .swings import Swings
from .track import Track


class SwingSimulation:
    """Follows the states of a scene, tick by tick, with all its swings."""

    def __init__(self, scene: Scene) -> None:
        mounted = mounts(scene)
        self._bones = np.unique([mount.bone for mount in mounted])
        mounted = [dataclasses.replace(mount, bone=int(np.searchsorted(self._bones, mount.bone)))
                   for mount in mounted]
        self._track = Track()
        self._swings = Swings(mounted, scene.gravity, self._track)
        self.names = self._swings.names
        """Name of each mass, in the order of the state's arrays."""
        self.state: SwingState | None = None
        """All masses at the last tick; None before begin()."""

    def begin(self, time: int, state: State) -> None:
        """Start from rest at ``time`` ns."""
        self._track = self._swings.motion = Track()
        self._tell(time, state)
        self._swings.begin(time / SECOND)
        self.state = self._swings.evaluate(time / SECOND)

    def follow(self, time: int, state: State) -> None:
        """Go on to ``time`` ns, where the bones are in ``state``."""
        self._tell(time, state)
        self.state = self._swings.evaluate(time / SECOND)

    def _tell(self, time: int, state: State) -> None:
        self._track.tell(time / SECOND, State.of(state.rows[self._bones]))

