"""Swings: integration of all swings of a scene, with results independent of the frame rate.

Integration uses a fixed time grid that begins at the start. The state between two grid points is
computed by one shorter step from the earlier one; this step is then discarded. So a state depends
on the start, the time and the bones' motion only, not on which other times were evaluated.

Chains are integrated from root to tip: each link hangs from the mass before it, whose motion drives
it, and carries the masses beyond it as an inertia with which its own frequency is that of the true
chain (chains.py). Their other motion has no effect on it. This is exact for single masses only.
Energy of an undamped chain is not conserved: hair needs a damping of 0.3 or more, and few links.
With less, a strand that is shaken hard moves chaotically.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ...model import rotation
from ...model.scene import SECOND, Scene
from ...model.scene_change import SceneChange
from ...model.state import State
from ...model.swing_mount import SwingMount, bones_of, mount_swings
from ..kernels.compiling.decorators import rows_of
from ..kernels.swing.links import LINK_STATE, RESPONSE, Chains
from ..kernels.swing.loaded import advance_chains
from .chains import make_colliders, make_links
from .pose import FreeMasses, MassIndex, SwingState
from .track import Track

LONGEST_STEP = 0.01
"""s: coarsest grid, sufficient for bone motions up to about 15 Hz."""
LARGEST_PHASE = 0.1
"""rad: phase of the fastest pendulum in one grid interval; gives periods correct to 0.05 %."""
_ROUNDING = 1e-9


class Swings:
    """Mounted swings under ``gravity`` (m/s^2), on bones in the state ``motion(t)``.

    ``step`` (s) is the grid interval; None: 10 ms divided by the smallest sufficient integer. Times
    on the grid cost least, a time that is evaluated again costs nothing.
    """

    def __init__(self, mounted: Sequence[SwingMount], gravity: Sequence[float],
                 motion: Callable[[float], State], step: float | None = None) -> None:
        self.names = [name for mount in mounted for name in mount.names]
        self.motion = motion
        gravity = np.array(gravity, float)
        self._free = _FreeFall([mount for mount in mounted if mount.swing.mode == 'free'], gravity)
        self._mass_index = MassIndex.of(mounted)
        bones = max((bone for mount in mounted for bone in bones_of(mount)), default=-1) + 1
        chains = [mount for mount in mounted if mount.swing.mode != 'free']
        links = make_links(chains, gravity)
        self.step = step or _grid(links)
        ends = np.cumsum([len(mount.swing.links) for mount in chains], dtype=np.int64)
        self._chains = Chains(links, np.append(0, ends)[:-1], ends, rows_of(RESPONSE, len(links)),
                              rows_of(RESPONSE, len(links)), np.zeros((bones, 13)),
                              *make_colliders(chains), rows_of(LINK_STATE, len(links)))
        advance_chains.set_responses(links, self.step, self._chains.responses)
        self._states = rows_of(LINK_STATE, len(links))
        self._begin: float | None = None

    def evaluate(self, time: float) -> SwingState:
        """State of all masses at ``time`` s.

        The first call, and one for an earlier time than the last, starts at rest: each link in its
        rest direction, without velocity relative to its bone.
        """
        if self._begin is None or time < self._time:
            self.begin(time)
        elif time == self._time:
            return self._last
        whole = math.floor((time - self._begin) / self.step + _ROUNDING)
        remainder = time - self._instant(whole)
        if remainder <= _ROUNDING * self.step:
            remainder = 0.0
        now = self._states
        if len(now):
            times, rows = self._path(self._count, whole, time if remainder else None)
            advance_chains.advance_chains(self._chains, now, times, rows, self._begin, self._count,
                                          whole, self.step)
            if remainder:
                now = _copy(now)
                advance_chains.advance_chains(self._chains, now, times, rows, self._instant(whole),
                                              0, 1, remainder)
        self._count, self._time = whole, time
        self._last = self._state(now, time)
        return self._last

    def begin(self, time: float, directions: np.ndarray | None = None,
              rates: np.ndarray | None = None) -> None:
        """Start at ``time`` s at rest, or with these directions and rates.

        ``directions`` (m, 3) are unit vectors and ``rates`` (m, 3) 1/s their derivatives, world
        frame, in the scene's order of masses; those of free masses are ignored.
        """
        bones = self.motion(time)
        self._begin = self._time = time
        self._count = 0
        chained = self._mass_index.chained
        if directions is not None:
            self._states['direction'] = rotation.normalized(np.asarray(directions)[chained])
        if rates is not None:
            self._states['rate'] = np.asarray(rates, float)[chained]
        advance_chains.begin_chains(
            self._chains, self._states, bones.rows, directions is not None, rates is not None)
        self._free.begin(time, bones)
        self._last = self._state(self._states, time)

    def resume(self, time: float, other: Swings, masses: np.ndarray) -> None:
        """Start at ``time`` s, at rest except for masses of ``other``, which go on as they are
        there. ``masses`` (m,): index here of each mass of ``other``; -1: it is gone.
        """
        self.begin(time)
        stay = masses >= 0
        directions, rates = self._last.directions, self._last.rates
        directions[masses[stay]] = other._last.directions[stay]
        rates[masses[stay]] = other._last.rates[stay]
        self.begin(time, directions, rates)
        here, there = self._mass_index.free, other._mass_index.free
        known = masses[there] >= 0
        self._free.resume(np.searchsorted(here, masses[there][known]),
                          (rows[known] for rows in vars(other._last.free).values()))
        self._last = self._state(self._states, time)

    def _instant(self, index: int) -> float:
        return self._begin + index * self.step

    def _path(self, first: int, last: int, end: float | None) -> tuple[np.ndarray, np.ndarray]:
        """Times (k,) and states (k, b, 13) of the bones from one point of the grid to another, or
        to ``end`` s.
        """
        if isinstance(self.motion, Track):
            return self.motion.states(self._instant(first),
                                      self._instant(last) if end is None else end)
        times = [self._instant(index) for index in range(first, last + 1)]
        if end is not None:
            times.append(end)
        return np.array(times), np.array([self.motion(time).rows for time in times])

    def _state(self, states: np.ndarray, time: float) -> SwingState:
        return SwingState(time, self.motion(time), self._chains.links, _copy(states),
                          self._free.at(time), self._mass_index)


def _copy(states: np.ndarray) -> np.ndarray:
    """Copy of records of numbers, at once: NumPy copies records field by field."""
    return states.view(float).copy().view(states.dtype)


def _grid(links: np.ndarray) -> float:
    """Interval of the grid, s: LONGEST_STEP over the smallest sufficient whole number."""
    fastest = math.sqrt(max(np.linalg.norm(links['gravity'], axis=1), default=0.0))
    return LONGEST_STEP / max(1, math.ceil(LONGEST_STEP * fastest / LARGEST_PHASE))


_NO_MASSES = FreeMasses(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 4)))


class _FreeFall:
    """Masses of swings of mode 'free': projectile motion in closed form."""

    def __init__(self, mounted: Sequence[SwingMount], gravity: np.ndarray) -> None:
        links = [(mount, index) for mount in mounted for index in range(len(mount.swing.links))]
        self._bone = np.array([mount.bone for mount, _ in links], int)
        self._root = np.array([mount.root for mount, _ in links]).reshape(-1, 3)
        self._rod = np.array([_rods(mount)[index] for mount, index in links]).reshape(-1, 3)
        self._gravity = np.array([mount.swing.gravity * gravity
                                  for mount, _ in links]).reshape(-1, 3)
        self._velocity = np.array([mount.swing.velocity for mount, _ in links]).reshape(-1, 3)

    def begin(self, time: float, bones: State) -> None:
        """Release the masses at ``time`` s, with their swings' velocities, from where the ends of
        their rods are at rest.
        """
        self._begin = time
        self._turn = bones.orientations[self._bone]
        arm = rotation.rotate(self._turn, self._root)
        rod = rotation.rotate(self._turn, self._rod)
        self._from = bones.positions[self._bone] + arm + rod
        self._thrown = self._velocity.copy()

    def resume(self, masses: np.ndarray, motion: Iterable[np.ndarray]) -> None:
        """Let ``masses`` (k,) go on from the begin with positions, velocities and orientations."""
        for mine, given in zip((self._from, self._thrown, self._turn), motion, strict=True):
            mine[masses] = given

    def at(self, time: float) -> FreeMasses:
        """State of the masses at ``time`` s."""
        if not len(self._bone):
            return _NO_MASSES
        t = time - self._begin
        return FreeMasses(self._from + self._thrown * t + self._gravity * (t * t / 2),
                      self._thrown + self._gravity * t, self._turn)


def _rods(mount: SwingMount) -> np.ndarray:
    lengths = np.array([link.length for link in mount.swing.links])
    return np.cumsum(mount.directions * lengths[:, None], axis=0)


class SwingSimulation:
    """All swings of a scene. Bones drive them; they exert no force on the bones."""

    def __init__(self, scene: Scene) -> None:
        mounted = mount_swings(scene)
        self._bones = np.unique([bone for mount in mounted for bone in bones_of(mount)])
        mounted = [self._on_own_bones(mount) for mount in mounted]
        self._track = Track()
        self._swings = Swings(mounted, scene.gravity, self._track)
        self.names = self._swings.names
        """Names of the masses, in the order of the state's arrays."""
        self.state: SwingState | None = None
        """State of all masses at the last tick; None before reset()."""

    def _on_own_bones(self, mount: SwingMount) -> SwingMount:
        """The mount with indices among the bones that carry swings or colliders."""
        def own(bone: int) -> int:
            return int(np.searchsorted(self._bones, bone))
        colliders = tuple(dataclasses.replace(collider, bone=own(collider.bone))
                          for collider in mount.colliders)
        return dataclasses.replace(mount, bone=own(mount.bone), colliders=colliders)

    def reset(self, time: int, state: State) -> None:
        """Start at rest at ``time`` ns."""
        self._track = self._swings.motion = Track()
        self._add(time, state)
        self._swings.begin(time / SECOND)
        self.state = self._swings.evaluate(time / SECOND)

    def changed(self, after: SwingSimulation, change: SceneChange, time: int,
                state: State) -> SwingSimulation:
        """Return the swings of the scene after a change at ``time`` ns; ``after``: new ones of that
        scene. Masses that stay go on; if all stay and none comes, these swings go on to the bit.
        """
        masses = _new_masses(change)
        if np.array_equal(masses, np.arange(len(after.names))):
            self._bones, self.names = change.new_bones[self._bones], after.names
            return self
        after.reset(time, state)
        after._swings.resume(time / SECOND, self._swings, masses)
        after.state = after._swings.evaluate(time / SECOND)
        return after

    def advance(self, time: int, state: State) -> None:
        """Advance to ``time`` ns, where the bones are in ``state``."""
        self._add(time, state)
        self.state = self._swings.evaluate(time / SECOND)

    def _add(self, time: int, state: State) -> None:
        self._track.add(time / SECOND, State.of(state.rows[self._bones]))


def _new_masses(change: SceneChange) -> np.ndarray:
    """Index (m,) in the scene after of each mass of the scene before; -1: it is gone."""
    before, after = change.before.link_slices, change.after.link_slices
    return np.concatenate([
        np.arange(own.stop - own.start) + after[doll].start if doll >= 0
        else np.full(own.stop - own.start, -1)
        for own, doll in zip(before, change.new_dolls, strict=True)])
