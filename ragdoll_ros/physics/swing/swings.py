"""All swings of a scene: their masses over time, the same at every frame rate.

The swings keep a time grid of their own, anchored at their start, and ask for the motion of
the bones at its instants; what is wanted in between is one shorter step from the last instant,
which is then forgotten. So an answer depends on the start, the time and the bones' motion
alone, never on when or how often anyone looked.

Chains are worked from root to tip: each link hangs from the mass before it and carries what
hangs on it as if that were in line (links.py). It does not feel how the masses beyond it move
otherwise: a simplification, exact only for single masses. What it costs, small angles, lowest
frequency against that of the true chain of n equal links: under gravity 1.2 % (n = 2) and 1.8 %
(n = 8) too high; with springs alone 8 % (n = 2), 27 % (4), 60 % (8), 110 % (16) too high, as a
root that would give way to the bending beyond it does not. Nor is energy kept in a chain without
damping: hair wants a damping of .3 or more, and a strand that is shaken hard with less is
chaotic, its path then sensitive to anything. Frame rates agree because the grid is the same.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ...model import rotation
from ...model.state import State
from .links import Links, Seat, Step
from .mount import Mount, Roots, levels
from .pose import Flight, Order, SwingState
from .sphere import dot

LONGEST = 0.01
"""s, the coarsest grid: bones' motions up to about 15 Hz are followed."""
PHASE = 0.1
"""rad that the quickest pendulum may go in one interval of the grid: periods right to 0.05 %."""
SHARPEST = 0.5
"""rad of a pendulum's phase under the root's acceleration in one step; beyond, it is divided."""
MOST_PARTS = 64
_ROUNDING = 1e-9


class Swings:
    """Mounted swings under ``gravity`` (m/s^2), on bones that move as ``motion(t)`` says.

    ``step`` (s) is the interval of the grid; None: 10 ms or so large a whole part of it as the
    quickest pendulum needs. It does not follow the frame rate; frames that fall on the grid cost
    least.
    Cost: proportional to the time that passes, nothing for an instant asked for again.
    """

    def __init__(self, mounted: Sequence[Mount], gravity: Sequence[float],
                 motion: Callable[[float], State], step: float | None = None) -> None:
        self.names = [name for mount in mounted for name in mount.names]
        self.motion = motion
        gravity = np.array(gravity, float)
        chains = [mount for mount in mounted if mount.swing.mode != 'free']
        chains.sort(key=lambda mount: -len(mount.swing.links))
        self._roots = Roots.of(chains)
        self._levels = levels(chains, gravity)
        self._free = _Free([mount for mount in mounted if mount.swing.mode == 'free'], gravity)
        self._order = Order.of(mounted, chains)
        self.step = step or self._grid()
        self._steps: dict[float, list[Step]] = {}
        self._begin: float | None = None

    def evaluate(self, time: float) -> SwingState:
        """All masses at ``time`` s.

        The first call, and one for an earlier time than the last, starts from rest: every
        link in its rest direction, still in its bone's frame.
        """
        if self._begin is None or time < self._time:
            self.begin(time)
        elif time == self._time:
            return self._answer
        whole = math.floor((time - self._begin) / self.step + _ROUNDING)
        for index in range(self._count, whole):
            self._now = self._advance(self._now, self._instant(index),
                                      self._instant(index + 1), self.step)
        self._count, self._time = whole, time
        rest = time - self._instant(whole)
        now = self._now
        if rest > _ROUNDING * self.step:
            now = self._advance(now, self._instant(whole), time, rest)
        self._answer = self._give(now, time)
        return self._answer

    def begin(self, time: float, directions: np.ndarray | None = None,
              rates: np.ndarray | None = None) -> None:
        """Start at ``time`` s from rest, or from the given state.

        ``directions`` (m, 3) are unit vectors and ``rates`` (m, 3) 1/s theirs, world frame,
        one for each mass in the scene's order (those of free masses are ignored).
        """
        bones = self.motion(time)
        self._begin = self._time = time
        self._count = 0
        self._now = []
        seat = self._roots.seat(bones)
        offset = 0
        for level in self._levels:
            count = len(level.length)
            rows = self._order.chained[offset:offset + count]
            seat = _first(seat, count)
            pointing = (seat.outward(level.rest) if directions is None
                        else rotation.normalized(np.asarray(directions)[rows]).T)
            rate = None if rates is None else np.asarray(rates, float)[rows].T
            self._now.append(Links.at(seat, level.rest, np.ascontiguousarray(pointing), rate))
            seat = level.tips(self._now[-1])
            offset += count
        self._free.begin(time, bones)
        self._answer = self._give(self._now, time)

    def _grid(self) -> float:
        quickest = max((math.sqrt(np.max(np.linalg.norm(level.gravity, axis=0) / level.reach))
                        for level in self._levels), default=0.0)
        return LONGEST / max(1, math.ceil(LONGEST * quickest / PHASE))

    def _instant(self, index: int) -> float:
        return self._begin + index * self.step

    def _advance(self, now: list[Links], begin: float, end: float, h: float) -> list[Links]:
        """Swing from one instant to the next, in parts where the roots are jerked."""
        if not self._levels:
            return now
        seat = self._roots.seat(self.motion(end))
        forces = self._levels[0].forces(now[0].seat, seat, h)
        parts = _parts(forces, h)
        if parts == 1:
            return self._swing(now, seat, h, forces)
        for index in range(1, parts):
            between = self._roots.seat(self.motion(begin + h * index / parts))
            now = self._swing(now, between, h / parts)
        return self._swing(now, seat, h / parts)

    def _swing(self, now: list[Links], seat: Seat, h: float,
               forces: tuple[np.ndarray, np.ndarray] | None = None) -> list[Links]:
        """Swing all levels, root to tip, through one step."""
        then: list[Links] = []
        for level, links, step in zip(self._levels, now, self._factors(h), strict=True):
            if then:
                seat = _first(self._levels[len(then) - 1].tips(then[-1]), len(level.length))
                forces = None
            forces = forces or level.forces(links.seat, seat, h)
            swung = level.swing(links, seat, step, forces)
            then.append(_slowed(swung, math.pi / self.step) if then else swung)
        return then

    def _factors(self, h: float) -> list[Step]:
        """Each level's factors for a step; those in use are kept."""
        if h not in self._steps:
            if len(self._steps) >= MOST_PARTS:
                self._steps.clear()
            self._steps[h] = [Step(level, h) for level in self._levels]
        return self._steps[h]

    def _give(self, now: list[Links], time: float) -> SwingState:
        return SwingState(time, self.motion(time), self._levels, now, self._free.at(time),
                          self._order)


_NOTHING = Flight(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 4)))


class _Free:
    """Masses that fall by themselves: closed form, from where the start had them."""

    def __init__(self, mounted: Sequence[Mount], gravity: np.ndarray) -> None:
        links = [(mount, index) for mount in mounted for index in range(len(mount.swing.links))]
        self._bone = np.array([mount.bone for mount, _ in links], int)
        self._root = np.array([mount.root for mount, _ in links]).reshape(-1, 3)
        self._rod = np.array([_rods(mount)[index] for mount, index in links]).reshape(-1, 3)
        self._gravity = np.array([mount.swing.gravity * gravity
                                  for mount, _ in links]).reshape(-1, 3)
        self._velocity = np.array([mount.swing.velocity for mount, _ in links]).reshape(-1, 3)

    def begin(self, time: float, bones: State) -> None:
        """Let go at ``time`` s, the masses where their rods at rest would hold them."""
        self._begin = time
        self._turn = bones.orientations[self._bone]
        arm = rotation.rotate(self._turn, self._root)
        rod = rotation.rotate(self._turn, self._rod)
        self._from = bones.positions[self._bone] + arm + rod

    def at(self, time: float) -> Flight:
        """The masses at ``time`` s."""
        if not len(self._bone):
            return _NOTHING
        t = time - self._begin
        return Flight(self._from + self._velocity * t + self._gravity * (t * t / 2),
                      self._velocity + self._gravity * t, self._turn)


def _rods(mount: Mount) -> np.ndarray:
    lengths = np.array([link.length for link in mount.swing.links])
    return np.cumsum(mount.directions * lengths[:, None], axis=0)


def _parts(forces: tuple[np.ndarray, np.ndarray], h: float) -> int:
    """How many steps a force that strong needs in place of one."""
    most = (SHARPEST / h) ** 4
    # The sum of all is quick to tell, and seldom more than one alone may have. Not by BLAS, whose
    # threads spin on after each sum of a crowd's.
    if all(np.einsum('in,in', force, force) <= most for force in forces):
        return 1
    sharpest = max(float(np.max(dot(force, force))) for force in forces)
    return min(max(math.ceil((sharpest / most) ** 0.25), 1), MOST_PARTS)


def _first(seat: Seat, count: int) -> Seat:
    """The first so many of the seats."""
    if seat.point.shape[1] == count:
        return seat
    return Seat(seat.point[:, :count], seat.velocity[:, :count], seat.axes[:, :, :count],
                seat.spin[:, :count])


def _slowed(links: Links, most: float) -> Links:
    """Hold links below the first to ``most`` rad/s.

    Half a turn in an interval of the grid is the most the next level can see; without the limit
    an undamped chain would draw energy from its own aliases.
    """
    squares = dot(links.rate, links.rate)
    if np.max(squares) <= most * most:
        return links
    factor = np.minimum(1, most / np.sqrt(np.maximum(squares, most * most)))
    return Links(links.seat, links.direction, links.rate * factor, links.pull, links.drift)
