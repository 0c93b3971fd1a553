"""Contact pulses: what a sensor on a rigid body would read if its impacts took time.

An impact changes velocities at once. By the contact law of impacts.py, a linear spring k between
both sides, its force has the peak v sqrt(mu k). A half-sine of that peak that gives the impulse of
the simulation, (1 + e) mu v with the restitution e, lasts (1 + e) / 2 pi sqrt(mu / k): as long as
that of the spring where e is 1, half as long where e is 0.

The bodies' motion stays that of the rigid impact. A sensor's velocity is that of its point minus
what the pulses have still to give; nothing is lost, and in a sample that is longer than a pulse
there is no difference.
"""
from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ...model.biomechanical_limits import BiomechanicalLimits
from ...model.scene import SECOND, Scene
from .impacts import Impact

TINY = 1e-12
"""s or N s: keeps a division from being by zero."""


class PulseLaw:
    """Durations of a scene's impacts, by the stiffness of the regions of ``limits`` and of the
    ground and bodies that have one.

    A bone without a region, as a foot, has that of the next bone towards the root that has one.
    """

    def __init__(self, scene: Scene, limits: BiomechanicalLimits) -> None:
        self._stiffness: dict[str, float] = {}
        """N/m, by the name in the scene of what meets."""
        surfaces = {scene.touched_name(-1, body): scene.surface_stiffness(-1, body)
                    for body in range(-1, len(scene.bodies))}
        self._stiffness |= {name: k for name, k in surfaces.items() if math.isfinite(k)}
        for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
            doll = placement.doll
            parents = {joint.child: joint.parent for joint in doll.joints}
            for bone, name in zip(doll.bones, scene.bone_names[own], strict=True):
                at: str | None = bone.name
                while at and not limits.region_of(at):
                    at = parents.get(at)
                if at:
                    self._stiffness[name] = limits.regions[limits.region_of(at)].stiffness

    def duration(self, impact: Impact) -> float:
        """Duration of an impact, s; 0 if neither a region nor a stiffness takes part. Friction and
        simultaneous impacts may take its impulse out of the range mu v to 2 mu v; then the nearer
        end counts.
        """
        springs = [self._stiffness[name] for name in (impact.bone, impact.against)
                   if name in self._stiffness]
        if not springs:
            return 0.0
        stiffness = 1 / sum(1 / k for k in springs)
        share = impact.impulse / (impact.effective_mass * impact.speed)
        return (min(max(share, 1.0), 2.0) / 2 * math.pi
                * math.sqrt(impact.effective_mass / stiffness))


class PulseLog:
    """Pulses by sample, each ``step`` s, from the impacts of successive ticks."""

    def __init__(self, law: PulseLaw, count: int, step: float) -> None:
        self._law, self._step = law, step
        self.pulses = np.zeros((count, 2))
        """(count, 2) s: how long after its sample a pulse begins, and how long it lasts; 0 where
        there was no impact."""
        self._impulses = np.zeros(count)

    def add(self, impacts: Iterable[Impact]) -> None:
        """Add the impacts of a tick.

        Of an impulse at most 2 mu v counts, the most that a spring gives. The rest is transmitted
        through the body from other impacts and stops of that sample, and lasts as long as they do.
        """
        for impact in impacts:
            if duration := self._law.duration(impact):
                self.enter(int(impact.time / SECOND / self._step), duration,
                           min(impact.impulse, 2 * impact.effective_mass * impact.speed))

    def enter(self, sample: int, duration: float, impulse: float, delay: float = 0.0) -> None:
        """Enter a pulse that gives this ``impulse``, N s, begins ``delay`` s after a sample begins,
        and lasts ``duration`` s. Several pulses in one sample are merged: delay and duration are
        their means, weighted by the impulses.
        """
        if sample < len(self.pulses):
            self._impulses[sample] += impulse
            self.pulses[sample] += ((delay, duration) - self.pulses[sample]) * (
                impulse / self._impulses[sample])

    def between(self, first: int, last: int) -> np.ndarray:
        """Delay and duration (2,), s, of the pulse that samples ``first`` to ``last`` - 1 make
        together: means weighted by the impulses.
        """
        impulses = self._impulses[first:last, None]
        return (impulses * self.pulses[first:last]).sum(axis=0) / max(impulses.sum(), TINY)


def course(count: int, step: float, delay: float, duration: float) -> np.ndarray:
    """Shares (count,) of a half-sine pulse in successive samples of ``step`` s; it begins ``delay``
    s after the first sample begins and lasts ``duration`` s.
    """
    phases = (np.arange(count + 1) * step - delay) * (np.pi / max(duration, TINY))
    return np.diff((1 - np.cos(np.clip(phases, 0.0, np.pi))) / 2)


def spread(velocities: np.ndarray, step: float, gravity: np.ndarray,
           pulses: np.ndarray) -> np.ndarray:
    """Velocities (t + 1, 3) m/s of a sensor, world frame, from those of its point on the bone,
    ``step`` s apart. ``pulses`` (t, 2): delay and duration of the pulse of each sample, s. The
    change of velocity in a sample with a pulse, except by gravity, is spread over the half-sine.
    """
    changes = np.diff(velocities, axis=0) - gravity * step
    given = changes.copy()
    ends = pulses.sum(axis=1)
    for at in np.flatnonzero(ends > step).tolist():
        count = min(math.ceil(ends[at] / step), len(changes) - at)
        given[at] -= changes[at]
        given[at:at + count] += course(count, step, *pulses[at])[:, None] * changes[at]
    late = np.concatenate([np.zeros((1, 3)), np.cumsum(changes - given, axis=0)])
    return velocities - late
