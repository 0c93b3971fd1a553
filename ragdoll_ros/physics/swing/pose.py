"""What swings tell about their masses at one instant."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...model import rotation
from ...model.state import State
from .links import Level, Links
from .mount import Mount
from .sphere import cross, dot


@dataclass(frozen=True)
class Order:
    """Where the m masses of a scene's swings, swing by swing, root to tip, are found."""

    chained: np.ndarray
    """Numbers of the chained masses, level by level."""
    free: np.ndarray
    """Numbers of the free masses."""
    bone: np.ndarray
    """(m,) number of the bone each rides on."""

    @classmethod
    def of(cls, mounted: Sequence[Mount], chains: Sequence[Mount]) -> Order:
        """The order for mounted swings, of which ``chains`` are not free."""
        begins, count = {}, 0
        for mount in mounted:
            begins[id(mount)] = count
            count += len(mount.swing.links)
        depth = len(chains[0].swing.links) if chains else 0
        chained = [begins[id(mount)] + level for level in range(depth)
                   for mount in chains if len(mount.swing.links) > level]
        bone = [mount.bone for mount in mounted for _ in mount.swing.links]
        free = np.setdiff1d(np.arange(count), chained)
        return cls(np.array(chained, int), free, np.array(bone, int))

    @cached_property
    def plain(self) -> bool:
        """Whether one level's columns are the masses in order."""
        return np.array_equal(self.chained, np.arange(len(self.bone)))

    def gather(self, chained: Sequence[np.ndarray], free: np.ndarray) -> np.ndarray:
        """One row for each mass from the levels' columns and the free masses' rows."""
        if len(chained) == 1 and self.plain:
            return chained[0].T
        out = np.empty((len(self.bone), free.shape[1]))
        if chained:
            out[self.chained] = np.concatenate(chained, axis=1).T
        out[self.free] = free
        return out


@dataclass(frozen=True)
class Flight:
    """Free masses at one instant: rows, world frame; they do not turn."""

    positions: np.ndarray
    velocities: np.ndarray
    orientations: np.ndarray


@dataclass(frozen=True)
class SwingState:
    """All m masses of the swings at ``time`` s, in the scene's order; worked out when asked for.

    A mass's orientation is that of its rod's frame: at rest it is the bone's own, and from
    there it has turned with the rod by the smallest rotations.
    """

    time: float
    bones: State
    levels: Sequence[Level] = field(repr=False)
    links: Sequence[Links] = field(repr=False)
    flight: Flight = field(repr=False)
    order: Order = field(repr=False)

    @cached_property
    def positions(self) -> np.ndarray:
        """(m, 3) m, world frame."""
        tips = [links.seat.point + level.length * links.direction
                for level, links in zip(self.levels, self.links, strict=True)]
        return self.order.gather(tips, self.flight.positions)

    @property
    def rods(self) -> np.ndarray:
        """(m, 2, 3) m, world frame: both ends of the rod of each mass."""
        return np.stack([self.roots, self.positions], axis=1)

    @cached_property
    def velocities(self) -> np.ndarray:
        """(m, 3) m/s, world frame."""
        tips = [links.seat.velocity + level.length * links.rate
                for level, links in zip(self.levels, self.links, strict=True)]
        return self.order.gather(tips, self.flight.velocities)

    @cached_property
    def roots(self) -> np.ndarray:
        """(m, 3) m, world frame: where each mass's rod begins; a free mass's own place."""
        return self.order.gather([links.seat.point for links in self.links], self.flight.positions)

    @cached_property
    def directions(self) -> np.ndarray:
        """(m, 3) unit vectors along the rods, world frame; zero for free masses."""
        return self.order.gather([links.direction for links in self.links],
                                 np.zeros_like(self.flight.positions))

    @cached_property
    def rates(self) -> np.ndarray:
        """(m, 3) 1/s, rates of the directions, world frame."""
        return self.order.gather([links.rate for links in self.links],
                                 np.zeros_like(self.flight.positions))

    @cached_property
    def orientations(self) -> np.ndarray:
        """(m, 4) unit quaternions x, y, z, w, world frame."""
        turns: list[np.ndarray] = []
        begin = 0
        for level, links in zip(self.levels, self.links, strict=True):
            count = len(level.length)
            bones = self.order.bone[self.order.chained[begin:begin + count]]
            frame = turns[-1][:, :count].T if turns else self.bones.orientations[bones]
            n = links.seat.outward(level.rest)
            arcs = np.vstack([cross(n, links.direction), 1 + dot(n, links.direction)])
            arcs[0, np.sum(arcs * arcs, axis=0) < 1e-24] = 1
            turns.append(rotation.multiply(rotation.normalized(arcs.T), frame).T)
            begin += count
        return self.order.gather(turns, self.flight.orientations)
