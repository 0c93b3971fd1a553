"""Swings: integration of all swings of a scene, with results that do not depend on the frame rate.

Integration uses a fixed time grid that begins at the start. The state between two grid points is
one shorter step from the last of them, which is then discarded. So a state depends on the start,
the time and the bones' motion only, not on which other times were evaluated.

Chains are integrated from root to tip: each link hangs from the mass before it and carries the
masses beyond it as if they were in line (links.py). Other motion of those masses has no effect on
it. This is exact for single masses only. Error of the lowest frequency at small angles, for n equal
links: under gravity +1.2 % (n = 2), +1.8 % (n = 8); with springs alone +8 % (n = 2), +27 % (4),
+60 % (8), +110 % (16). Energy of an undamped chain is not conserved: hair needs a damping of 0.3 or
more. With less, a strand that is shaken hard moves chaotically.
"""
import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from ...model import rotation
from ...model.scene import SECOND, Scene
from ...model.state import State
from .links import BaseFrames, Links, Step
from .mount import Roots, SwingMount, levels, mount_swings
from .pose import FreeMasses, MassIndex, SwingState
from .sphere import dot
from .track import Track

LONGEST_STEP = 0.01
"""s: coarsest grid, sufficient for bone motions up to about 15 Hz."""
LARGEST_PHASE = 0.1
"""rad: phase of the fastest pendulum in one grid interval; gives periods correct to 0.05 %."""
LARGEST_FORCED_PHASE = 0.5
"""rad: phase of a pendulum under its root's acceleration above which a step is divided."""
MAX_SUBSTEPS = 64
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
        chains = [mount for mount in mounted if mount.swing.mode != 'free']
        chains.sort(key=lambda mount: -len(mount.swing.links))
        self._roots = Roots.of(chains)
        self._levels = levels(chains, gravity)
        self._free = _FreeFall([mount for mount in mounted if mount.swing.mode == 'free'], gravity)
        self._mass_index = MassIndex.of(mounted, chains)
        self.step = step or self._grid()
        self._steps: dict[float, list[Step]] = {}
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
        for index in range(self._count, whole):
            self._now = self._advance(self._now, self._instant(index),
                                      self._instant(index + 1), self.step)
        self._count, self._time = whole, time
        remainder = time - self._instant(whole)
        now = self._now
        if remainder > _ROUNDING * self.step:
            now = self._advance(now, self._instant(whole), time, remainder)
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
        self._now = []
        base = self._roots.frames(bones)
        offset = 0
        for level in self._levels:
            count = len(level.length)
            rows = self._mass_index.chained[offset:offset + count]
            base = _take(base, count)
            pointing = (base.outward(level.rest) if directions is None
                        else rotation.normalized(np.asarray(directions)[rows]).T)
            rate = None if rates is None else np.asarray(rates, float)[rows].T
            self._now.append(Links.at(base, level.rest, np.ascontiguousarray(pointing), rate))
            base = level.tips(self._now[-1])
            offset += count
        self._free.begin(time, bones)
        self._last = self._state(self._now, time)

    def _grid(self) -> float:
        fastest = max((math.sqrt(np.max(np.linalg.norm(level.gravity, axis=0) / level.reach))
                        for level in self._levels), default=0.0)
        return LONGEST_STEP / max(1, math.ceil(LONGEST_STEP * fastest / LARGEST_PHASE))

    def _instant(self, index: int) -> float:
        return self._begin + index * self.step

    def _advance(self, now: list[Links], begin: float, end: float, h: float) -> list[Links]:
        """Integrate over h s, in several steps where the roots' acceleration is large."""
        if not self._levels:
            return now
        base = self._roots.frames(self.motion(end))
        forces = self._levels[0].forces(now[0].base, base, h)
        substeps = _substep_count(forces, h)
        if substeps == 1:
            return self._swing(now, base, h, forces)
        for index in range(1, substeps):
            between = self._roots.frames(self.motion(begin + h * index / substeps))
            now = self._swing(now, between, h / substeps)
        return self._swing(now, base, h / substeps)

    def _swing(self, now: list[Links], base: BaseFrames, h: float,
               forces: tuple[np.ndarray, np.ndarray] | None = None) -> list[Links]:
        """Integrate all levels, root to tip, over one step."""
        then: list[Links] = []
        for level, links, step in zip(self._levels, now, self._factors(h), strict=True):
            if then:
                base = _take(self._levels[len(then) - 1].tips(then[-1]), len(level.length))
                forces = None
            forces = forces or level.forces(links.base, base, h)
            swung = level.swing(links, base, step, forces)
            then.append(_limit_rates(swung, math.pi / self.step) if then else swung)
        return then

    def _factors(self, h: float) -> list[Step]:
        """Coefficients of each level for step h, from a cache."""
        if h not in self._steps:
            if len(self._steps) >= MAX_SUBSTEPS:
                self._steps.clear()
            self._steps[h] = [Step(level, h) for level in self._levels]
        return self._steps[h]

    def _state(self, now: list[Links], time: float) -> SwingState:
        return SwingState(time, self.motion(time), self._levels, now, self._free.at(time),
                          self._mass_index)


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
        """Release the masses at ``time`` s from the ends of their rods at rest."""
        self._begin = time
        self._turn = bones.orientations[self._bone]
        arm = rotation.rotate(self._turn, self._root)
        rod = rotation.rotate(self._turn, self._rod)
        self._from = bones.positions[self._bone] + arm + rod

    def at(self, time: float) -> FreeMasses:
        """State of the masses at ``time`` s."""
        if not len(self._bone):
            return _NO_MASSES
        t = time - self._begin
        return FreeMasses(self._from + self._velocity * t + self._gravity * (t * t / 2),
                      self._velocity + self._gravity * t, self._turn)


def _rods(mount: SwingMount) -> np.ndarray:
    lengths = np.array([link.length for link in mount.swing.links])
    return np.cumsum(mount.directions * lengths[:, None], axis=0)


def _substep_count(forces: tuple[np.ndarray, np.ndarray], h: float) -> int:
    """Number of steps into which to divide h under these forces."""
    most = (LARGEST_FORCED_PHASE / h) ** 4
    # The sum of all squares is cheap, and seldom above the bound for one. BLAS would be slower: its
    # threads spin after each sum.
    if all(np.einsum('in,in', force, force) <= most for force in forces):
        return 1
    sharpest = max(float(np.max(dot(force, force))) for force in forces)
    return min(max(math.ceil((sharpest / most) ** 0.25), 1), MAX_SUBSTEPS)


def _take(base: BaseFrames, count: int) -> BaseFrames:
    """The first ``count`` frames."""
    if base.point.shape[1] == count:
        return base
    return BaseFrames(base.point[:, :count], base.velocity[:, :count], base.axes[:, :, :count],
                base.spin[:, :count])


def _limit_rates(links: Links, most: float) -> Links:
    """Limit the rates of links below the first level to ``most`` rad/s.

    The next level cannot resolve more than half a turn in a grid interval: without the limit an
    undamped chain gains energy from aliasing.
    """
    squares = dot(links.rate, links.rate)
    if np.max(squares) <= most * most:
        return links
    factor = np.minimum(1, most / np.sqrt(np.maximum(squares, most * most)))
    return Links(links.base, links.direction, links.rate * factor, links.pull, links.drift)


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
