"""SwingSimulation: advances all swings of a scene from the states of its bones."""
from __future__ import annotations

import dataclasses

import numpy as np

from ...model.scene import SECOND, Scene
from ...model.state import State
from .mount import mount_swings
from .pose import SwingState
from .swings import Swings
from .track import Track


class SwingSimulation:
    """All swings of a scene. Bones drive them; they exert no force on the bones."""

    def __init__(self, scene: Scene) -> None:
        mounted = mount_swings(scene)
        self._bones = np.unique([mount.bone for mount in mounted])
        mounted = [dataclasses.replace(mount, bone=int(np.searchsorted(self._bones, mount.bone)))
                   for mount in mounted]
        self._track = Track()
        self._swings = Swings(mounted, scene.gravity, self._track)
        self.names = self._swings.names
        """Names of the masses, in the order of the state's arrays."""
        self.state: SwingState | None = None
        """State of all masses at the last tick; None before reset()."""

    def reset(self, time: int, state: State) -> None:
        """Start at rest at ``time`` ns."""
        self._track = self._swings.motion = Track()
        self._add(time, state)
        self._swings.begin(time / SECOND)
        self.state = self._swings.evaluate(time / SECOND)

    def advance(self, time: int, state: State) -> None:
        """Advance to ``time`` ns, where the bones are in ``state``."""
        self._add(time, state)
        self.state = self._swings.evaluate(time / SECOND)

    def _add(self, time: int, state: State) -> None:
        self._track.add(time / SECOND, State.of(state.rows[self._bones]))
