"""Contact pulses: what a sensor on a rigid body would read if its impacts took time.

An impact changes velocities at once. By the contact law of impacts.py, a linear spring between both
sides, it lasts: the force rises as a quarter of a sine for T / 2, T = pi sqrt(mu / k), and falls as
another within e T / 2, e the restitution. That is the spring with hysteresis of Walton and Braun
(J Rheology 1986, 30:949), whose peak is that of the elastic one and whose impulse is (1 + e) mu v.

The bodies' motion stays that of the rigid impact. A sensor's velocity is that of its point minus
what the pulses have still to give; nothing is lost, and in a sample that is longer than a pulse
there is no difference.
"""
from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...model.biomechanical_limits import BiomechanicalLimits
from ...model.scene import SECOND, Scene
from .impacts import Impact


@dataclass(frozen=True)
class ContactPulse:
    """Course of the force of an impact: ``half_period`` T of the spring, s, ``restitution`` e."""

    half_period: float
    restitution: float

    @property
    def duration(self) -> float:
        """(1 + e) T / 2, s."""
        return (1 + self.restitution) * self.half_period / 2

    def given(self, times: np.ndarray) -> np.ndarray:
        """Shares of the impulse that are given ``times`` s after the impact; 1 from its end on."""
        loading, e = self.half_period / 2, self.restitution
        phase = np.pi / 2 * np.clip(times / loading, 0.0, 1.0)
        given = 1 - np.cos(phase)
        if e:
            given = given + e * np.sin(np.pi / 2 * np.clip(times / loading - 1, 0.0, e) / e)
        return given / (1 + e)


class PulseLaw:
    """Pulses of a scene's impacts, by the stiffness of the regions of ``limits``.

    A bone without a region, as a foot, has that of the next bone towards the root that has one.
    """

    def __init__(self, scene: Scene, limits: BiomechanicalLimits) -> None:
        self._stiffness: dict[str, float] = {}
        """N/m, by the bone's name in the scene."""
        for placement, bones in zip(scene.dolls, scene.bone_slices, strict=True):
            doll, names = placement.doll, dict(zip(
                (bone.name for bone in placement.doll.bones), scene.bone_names[bones], strict=True))
            parents = {joint.child: joint.parent for joint in doll.joints}
            for bone, name in names.items():
                at: str | None = bone
                while at and not limits.region_of(at):
                    at = parents.get(at)
                if at:
                    self._stiffness[name] = limits.regions[limits.region_of(at)].stiffness

    def pulse(self, impacts: Iterable[Impact]) -> ContactPulse | None:
        """The pulse of impacts that come together: the mean of theirs, each by its impulse.
        None if no region takes part.
        """
        found = [(*pulse, impact.impulse) for impact in impacts if (pulse := self._of(impact))]
        weights = np.array([row[2] for row in found])
        if not weights.sum() > 0:
            return None
        half_period, restitution = np.average(np.array(found)[:, :2], axis=0, weights=weights)
        return ContactPulse(float(half_period), float(restitution))

    def _of(self, impact: Impact) -> tuple[float, float] | None:
        """Half period, s, and restitution of an impact; friction and other impacts beside it may
        take its impulse out of mu v to 2 mu v.
        """
        springs = [self._stiffness[name] for name in (impact.bone, impact.against)
                   if name in self._stiffness]
        if not springs:
            return None
        stiffness = 1 / sum(1 / k for k in springs)
        share = impact.impulse / (impact.effective_mass * impact.speed)
        return (math.pi * math.sqrt(impact.effective_mass / stiffness),
                min(max(share - 1, 0.0), 1.0))


class PulseLog:
    """Pulses by sample, ``step`` s each, from the impacts of successive ticks."""

    def __init__(self, law: PulseLaw, count: int, step: float) -> None:
        self._law, self._step = law, step
        self.pulses: list[ContactPulse | None] = [None] * count
        """Of each sample; None where there was no impact."""

    def add(self, impacts: Iterable[Impact]) -> None:
        """Add the impacts of a tick."""
        samples: dict[int, list[Impact]] = {}
        for impact in impacts:
            samples.setdefault(int(impact.time / SECOND / self._step), []).append(impact)
        for sample, found in samples.items():
            if sample < len(self.pulses):
                self.pulses[sample] = self._law.pulse(found)


def spread(velocities: np.ndarray, step: float, gravity: np.ndarray,
           pulses: Iterable[ContactPulse | None]) -> np.ndarray:
    """Velocities (t + 1, 3) m/s of a sensor, world frame, from those of its point on the bone,
    ``step`` s apart, and the pulse of each of t samples. What a sample with a pulse changes beyond
    gravity is given in the course of the pulse, from the sample's beginning on.
    """
    changes = np.diff(velocities, axis=0) - gravity * step
    given = changes.copy()
    for at, pulse in enumerate(pulses):
        if pulse and pulse.duration > step:
            count = min(math.ceil(pulse.duration / step), len(changes) - at)
            shares = np.diff(pulse.given(np.arange(count + 1) * step))
            given[at] -= changes[at]
            given[at:at + count] += shares[:, None] * changes[at]
    late = np.concatenate([np.zeros((1, 3)), np.cumsum(changes - given, axis=0)])
    return velocities - late
