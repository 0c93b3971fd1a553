"""Impacts of bones: what met, its speed and impulse, and the force that a stated contact law gives.

Bodies are rigid: an impact has a speed of approach v, an impulse and an effective mass mu, and no
force. The contact law is a linear spring k of the body's region between them (ISO/TS 15066, annex
A): the force is a half-sine of peak v sqrt(mu k) and duration pi sqrt(mu / k). Where both sides
have a region, their springs are in series, and so is that of a ground or body with a stiffness. The
spring gives back what it takes: the impulse of its pulse is 2 mu v, that of the simulation
(1 + e) mu v with a restitution e and without friction; the peak, which is at the end of the
compression, does not depend on that.
"""
from __future__ import annotations

import math
from collections.abc import Container, Iterable
from dataclasses import dataclass

import numpy as np

from ...model.biomechanical_limits import BiomechanicalLimits, BodyRegion
from ...model.scene import SECOND, Scene
from ...model.vectors import Vector
from ..engine.protocol import Impacts
from .head_injury import half_sine_head_injury


@dataclass(frozen=True)
class Impact:
    """An impact of a bone; of two bones that meet each has its own.

    Without a region there is no contact law: the force and what follows from it are NaN.
    """

    time: int
    """ns of simulated time."""
    doll: str
    bone: str
    """As in Scene.bone_names."""
    region: str
    """Of the body, by the limits; '' if the bone has none."""
    against: str
    """'ground', or the name of the body or bone that it meets."""
    point: Vector
    """m, world frame: centre of pressure."""
    normal: Vector
    """Unit vector, world frame, into the bone."""
    speed: float
    """m/s: speed of approach v along the normal at the point."""
    effective_mass: float
    """kg: mu, along the normal at the point, of both sides with what hangs on them by joints."""
    impulse: float
    """N s, along the normal."""
    mobility: float
    """1/kg: change of velocity of the bone's centre of mass per impulse along the normal."""
    stiffness: float
    """N/m: k of the contact law."""
    limit: float
    """N: of the region's peak force."""

    @property
    def peak_force(self) -> float:
        """Peak force of the contact law, N: v sqrt(mu k)."""
        return self.speed * math.sqrt(self.effective_mass * self.stiffness)

    @property
    def duration(self) -> float:
        """Duration of the contact law's pulse, s: pi sqrt(mu / k)."""
        return math.pi * math.sqrt(self.effective_mass / self.stiffness)

    @property
    def ratio(self) -> float:
        """Peak force over the region's limit."""
        return self.peak_force / self.limit

    @property
    def approach_energy(self) -> float:
        """Kinetic energy of the approach along the normal, J: mu v^2 / 2."""
        return self.effective_mass * self.speed ** 2 / 2

    @property
    def lost_energy(self) -> float:
        """Energy, J, that the impulse p takes from approach_energy: p v - p^2 / (2 mu). Of a single
        impact without friction this is (1 - e^2) mu v^2 / 2 with a restitution e. Negative where
        other impacts at the same time do work on it.
        """
        return self.impulse * self.speed - self.impulse ** 2 / (2 * self.effective_mass)

    @property
    def peak_acceleration(self) -> float:
        """Peak of the acceleration of the bone's centre of mass by the pulse, m/s^2."""
        return self.peak_force * self.mobility

    def head_injury(self, window: float) -> float:
        """Head injury criterion of the contact law's pulse, s g^2.5; ``window``: HIC15, HIC36."""
        return half_sine_head_injury(self.peak_acceleration, self.duration, window)


def bones_that_hit(scene: Scene, impacts: Iterable[Impact], what: Container[str]) -> np.ndarray:
    """Which bones (n,) have an impact against one of ``what``: 'ground', or names of bodies. Finds
    also bounces within a tick, which leave no contact at its ends.
    """
    found = np.zeros(len(scene.bones), bool)
    found[[scene.bone_index(each.bone) for each in impacts if each.against in what]] = True
    return found


class ImpactRecorder:
    """Makes Impacts of a scene's bones from those that an engine logs."""

    def __init__(self, scene: Scene, limits: BiomechanicalLimits) -> None:
        self._scene, self.limits = scene, limits
        self._regions = [limits.region_of(bone.name) for bone in scene.bones]
        self.impacts: list[Impact] = []
        """By time; of two bones that meet that of a comes first."""
        self.dropped = 0
        """How many there were no room for in the engine's log."""

    def add(self, found: Impacts | None, begin: int) -> None:
        """Add the impacts of an advance that began at ``begin``, ns."""
        if found is None:
            return
        self.dropped += found.dropped
        for row in range(len(found.a)):
            a, b = int(found.a[row]), int(found.b[row])
            self.impacts.append(self._impact(found, row, begin, a, b, 1.0))
            if b >= 0:
                self.impacts.append(self._impact(found, row, begin, b, a, -1.0))

    def _impact(self, found: Impacts, row: int, begin: int, bone: int, other: int,
                sign: float) -> Impact:
        """The impact of ``bone`` in a row; ``sign``: 1 if it is a, -1 if it is b."""
        scene, own, body = self._scene, self._region(bone), int(found.bodies[row])
        springs = [one.stiffness for one in (own, self._region(other)) if one]
        springs.append(scene.surface_stiffness(other, body))
        stiffness = 1 / sum(1 / k for k in springs) if own else math.nan
        return Impact(
            begin + round(found.elapsed[row] * SECOND),
            scene.dolls[scene.doll_of_bone[bone]].name, scene.bone_names[bone],
            self._regions[bone], scene.touched_name(other, body),
            _vector(found.positions[row]), _vector(sign * found.normals[row]),
            float(found.speeds[row]), float(found.effective_masses[row]),
            float(found.impulses[row]), float(found.mobilities[row, 0 if sign > 0 else 1]),
            stiffness, own.transient_force if own else math.nan)

    def _region(self, bone: int) -> BodyRegion | None:
        """The region of a bone; None if there is none, or no bone."""
        return self.limits.regions.get(self._regions[bone]) if bone >= 0 else None


def _vector(row: np.ndarray) -> Vector:
    return float(row[0]), float(row[1]), float(row[2])
