"""StabilityTest: whether dolls that are about to fall asleep rest in a stable equilibrium.

In a stable equilibrium potential energy has a minimum, so that a disturbance never grows (Lagrange
and Dirichlet): if one copy starts with velocities d and one at rest, the difference of their
velocities stays within |d|, in the norm of the kinetic energy, |v| = sqrt(2 T). Friction and
impacts, which only take energy, do not change that. In an unstable equilibrium the difference grows
as exp(t / tau); for a rod of length l on its end tau = sqrt(2 l / 3 g), and most bodies of that
height are faster. The copy at rest also shows what creeps: it sets itself in motion, ever faster.
"""
from __future__ import annotations

import contextlib
import hashlib
import math
from dataclasses import dataclass

import numpy as np

from ..model.coordinates import DofLayout
from ..model.scene import Placement, Scene
from .engine.protocol import Engine

DISTURBANCE = 1e-3
"""m/s or rad/s: largest disturbance of a generalized velocity. A hundred times what solved contacts
leave; too little to lift a box of 1 cm over its edge."""

DURATION = 10.0
"""Simulated time in units of tau. What damps itself departs more slowly: a drum of 0.65 kg on a
damped ball joint by 2.1 in 7 tau."""

SAMPLES = 25
"""Intervals at whose ends kinetic energies are looked at. The first one is short, see
Engine.simulate_copy()."""

GROWTH = 2.0
"""Factor by which |v| must exceed |v at rest| + |d|: 1 by theory, for a linear system."""

QUIET, QUIET_AFTER = 1e-3, 6
"""A copy that is slower than this share of DISTURBANCE and does not grow, after so many intervals,
has come to rest: what contacts left of an unstable motion had grown eightfold until then."""

ACCELERATION = math.sqrt(2.0)
"""Factor by which speeds of what creeps grow as time doubles: 2 under a constant force, 1 for what
sags against damping, which is stopped."""

SOLVED = 1e-5
"""m/s: speed that solved contacts may leave, so that it is no motion."""


@dataclass(frozen=True)
class RestVerdict:
    """Which dolls (d,) of those tested are to sleep, and which depart from an equilibrium."""

    stable: np.ndarray
    departing: np.ndarray
    """Once they have the ``velocities``. All others tested are in motion, though slowly."""
    velocities: np.ndarray
    """(nv,) generalized velocities."""


class StabilityTest:
    """Tests clusters of a scene's dolls by copies in simulation, at rest and disturbed."""

    def __init__(self, scene: Scene, layout: DofLayout) -> None:
        extents = np.array([0.0 if placement.is_kinematic else placement.doll.extent
                            for placement in scene.dolls])
        gravity = math.hypot(*scene.gravity)
        self._durations = DURATION * np.sqrt(2 * extents / (3 * gravity)) if gravity else (
            np.full(len(extents), math.inf))
        self._masses = np.array([placement.doll.mass for placement in scene.dolls])
        self._disturbance = np.zeros(layout.sizes[1])
        self._doll_of_v = np.zeros(layout.sizes[1], np.int64)
        for doll, own in enumerate(layout.doll_v):
            self._disturbance[own] = disturbance(scene.dolls[doll], own.stop - own.start)
            self._doll_of_v[own] = doll

    def durations(self, clusters: np.ndarray) -> np.ndarray:
        """Simulated time (d,) s in which a doll departs if it is unstable: DURATION tau of the
        largest doll of its cluster, ``clusters`` (d,).
        """
        longest = np.zeros(len(clusters))
        np.maximum.at(longest, clusters, self._durations)
        return longest[clusters]

    def judge(self, engine: Engine, dolls: np.ndarray, still: np.ndarray) -> RestVerdict:
        """Test ``dolls`` (d,), whole clusters, which stay as they are. If the kinetic energy of the
        copy of a cluster exceeds the sum of ``still`` (d,) J, the copy is in motion and its test
        ends. There must be gravity.
        """
        durations = self.durations(engine.cluster_of_doll)
        verdict = RestVerdict(np.zeros_like(dolls), np.zeros_like(dolls),
                              np.zeros_like(self._disturbance))
        for duration in np.unique(durations[dolls]):
            one = self._judge(engine, dolls & (durations == duration), still, duration)
            verdict = RestVerdict(verdict.stable | one.stable, verdict.departing | one.departing,
                                  verdict.velocities + one.velocities)
        return verdict

    def _judge(self, engine: Engine, dolls: np.ndarray, still: np.ndarray,
               duration: float) -> RestVerdict:
        """The verdict on ``dolls`` (d,) whose tests take ``duration`` s."""
        clusters = engine.cluster_of_doll
        velocities, departing = np.zeros_like(self._disturbance), np.zeros_like(dolls)
        limit = np.sqrt(2 * np.bincount(clusters, still))
        never = np.full((SAMPLES + 1, len(limit)), math.inf)
        interval = duration / SAMPLES
        at_rest, _ = self._simulate(engine, dolls, (velocities, interval), never, limit)
        for sign in (1.0, -1.0):
            left = dolls & ~departing
            if not left.any():
                break
            disturbed = sign * self._disturbance
            _, grown = self._simulate(engine, left, (disturbed, interval), at_rest, limit)
            found = left & grown[clusters]
            velocities[found[self._doll_of_v]] = disturbed[found[self._doll_of_v]]
            departing |= found
        moving = (at_rest > limit).any(axis=0) | self._accelerates(
            at_rest, np.bincount(clusters, self._masses))
        return RestVerdict(dolls & ~departing & ~moving[clusters], departing, velocities)

    def _simulate(self, engine: Engine, dolls: np.ndarray, start: tuple[np.ndarray, float],
                  at_rest: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate copies of ``dolls``; ``start``: their velocities, and an interval, s. Returns
        |v| (SAMPLES + 1, c) of their clusters at the start and after each interval, and which (c,)
        exceed GROWTH (``at_rest`` + |d|), |d| that of the start, and still grow. Ends as soon as
        each does, exceeds ``limit`` (c,), or is at rest. What exceeds it in the first interval, in
        which gaps of some um close, does not count.
        """
        velocities, interval = start
        clusters = engine.cluster_of_doll
        slow = QUIET * DISTURBANCE * np.sqrt(np.bincount(clusters, self._masses))
        ended = np.bincount(clusters, dolls) == 0
        speeds, exceeded = np.zeros_like(at_rest), np.zeros_like(ended)
        with contextlib.closing(engine.simulate_copy(dolls, velocities, interval)) as energies:
            for k, kinetic in zip(range(SAMPLES + 1), energies, strict=False):
                # What has ended goes on with the others, but does not count: so a doll's verdict is
                # the same in a crowd as alone.
                now = np.sqrt(2 * np.bincount(clusters, kinetic * dolls))
                now = speeds[k:] = np.where(ended, speeds[k], now)
                if k > 1:
                    exceeded |= ~ended & (now > GROWTH * (at_rest[k] + speeds[0])) & (
                        now > speeds[k - 1])
                if k > QUIET_AFTER:
                    ended |= (now < slow) & (now < 1.05 * speeds[k - 2])
                ended |= exceeded | (now > limit)
                if ended.all():
                    break
        return speeds, exceeded

    @staticmethod
    def _accelerates(speeds: np.ndarray, masses: np.ndarray) -> np.ndarray:
        """Which clusters (c,) of ``masses`` (c,) kg move ever faster."""
        quarter, half, whole = speeds[SAMPLES // 4], speeds[SAMPLES // 2], speeds[SAMPLES]
        return ((whole > np.sqrt(masses) * SOLVED) & (whole > ACCELERATION * half)
                & (half > ACCELERATION * quarter))


def disturbance(placement: Placement, count: int) -> np.ndarray:
    """Velocities (count,) within DISTURBANCE by a hash of the doll's initial pose.

    So a doll has the same in any process, after a reset, and alone.
    """
    place = np.array([*placement.position, *placement.orientation], '<f8').tobytes()
    numbers = np.frombuffer(hashlib.shake_256(place).digest(8 * count), '<u8')
    return DISTURBANCE * (numbers / 2.0 ** 63 - 1.0)
