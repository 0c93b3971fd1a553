"""Clamping: forces on bones that last, apart from impacts.

ISO/TS 15066 calls a contact quasi-static that lasts for more than 0.5 s. The force of a pair is the
mean over that time of the normal forces between the two, summed over their contact points. What
rests is clamped by its weight; what is held from two sides has a force from each.
"""
from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...model.biomechanical_limits import BiomechanicalLimits
from ...model.scene import SECOND, Scene
from ..engine.protocol import Contacts

LASTING = SECOND // 2
"""ns from which on a contact is quasi-static."""

Pair = tuple[int, int, int]
"""Of a bone, the bone that it touches or GROUND, and the static body or GROUND."""


@dataclass(frozen=True)
class Clamping:
    """A force on a bone that has lasted; of two bones each has its own."""

    doll: str
    bone: str
    """As in Scene.bone_names."""
    region: str
    """Of the body, by the limits; '' if the bone has none."""
    against: str
    """'ground', or the name of the body or bone that it touches."""
    force: float
    """N: mean normal force over the last 0.5 s."""
    limit: float
    """N: of a lasting force on the region; NaN without one."""

    @property
    def ratio(self) -> float:
        """Force over the region's limit."""
        return self.force / self.limit


class ClampingMonitor:
    """Forces that last, from the contacts of every tick, with any engine.

    Example:
        >>> monitor = ClampingMonitor(scene, load_limits())
        >>> state = simulation.advance()
        >>> monitor.add(simulation.contacts, simulation.time)
        >>> monitor.clamped
        ()
    """

    def __init__(self, scene: Scene, limits: BiomechanicalLimits) -> None:
        self._scene, self._limits = scene, limits
        self._regions = [limits.region_of(bone.name) for bone in scene.bones]
        self._forces: dict[Pair, deque[tuple[int, float]]] = {}
        """Of each pair that touches, times, ns, and forces, N, since it does, at most LASTING."""

    def add(self, contacts: Contacts, time: int) -> None:
        """Add the contacts at the end of a tick, at ``time``, ns. Pairs without a contact
        then end.
        """
        now = _forces(contacts)
        self._forces = {pair: self._forces.get(pair, deque()) for pair in now}
        for pair, force in now.items():
            samples = self._forces[pair]
            if samples and samples[-1][0] >= time:  # after a reset
                samples.clear()
            samples.append((time, force))
            while len(samples) > 1 and samples[1][0] <= time - LASTING:
                samples.popleft()

    @property
    def clamped(self) -> tuple[Clamping, ...]:
        """Forces that have lasted for 0.5 s, in the order of bones."""
        return tuple(self._clamping(pair, samples) for pair, samples in sorted(
            self._forces.items()) if samples[-1][0] - samples[0][0] >= LASTING)

    def _clamping(self, pair: Pair, samples: deque[tuple[int, float]]) -> Clamping:
        """Clamping of a pair's first bone; each sample counts for the time since the last one."""
        scene, (bone, other, body) = self._scene, pair
        times, forces = np.array(samples).T
        region = self._limits.regions.get(self._regions[bone])
        return Clamping(scene.dolls[scene.doll_of_bone[bone]].name, scene.bone_names[bone],
                        self._regions[bone], scene.touched_name(other, body),
                        float(np.average(forces[1:], weights=np.diff(times))),
                        region.force if region else math.nan)


def _forces(contacts: Contacts) -> dict[Pair, float]:
    """Sum of the normal forces of each pair that touches; of two bones both ways."""
    found: dict[Pair, float] = {}
    for a, b, body, force in zip(contacts.a.tolist(), contacts.b.tolist(),
                                 contacts.bodies.tolist(), contacts.forces.tolist(), strict=True):
        for pair in ((a, b, body), (b, a, body)):
            if pair[0] >= 0:
                found[pair] = found.get(pair, 0.0) + force
    return found
