"""SwingState: positions, velocities and orientations of all swing masses at one time."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...model import rotation
from ...model.state import State
from .links import Level, Links
from .mount import SwingMount
from .sphere import cross, dot


@dataclass(frozen=True)
class MassIndex:
    """Maps levels and free masses to the scene's order of m masses: by swing, root to tip."""

    chained: np.ndarray
    """Indices of the chained masses, level by level."""
    free: np.ndarray
    """Indices of the free masses."""
    bone: np.ndarray
    """(m,) index of each mass's bone."""

    @classmethod
    def of(cls, mounted: Sequence[SwingMount], chains: Sequence[SwingMount]) -> MassIndex:
        """Make the index of mounted swings, of which ``chains`` are not free."""
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
    def is_identity(self) -> bool:
        """Whether the only level has all masses in the scene's order."""
        return np.array_equal(self.chained, np.arange(len(self.bone)))

    def gather(self, chained: Sequence[np.ndarray], free: np.ndarray) -> np.ndarray:
        """Rows (m, k) in the scene's order from the levels' (k, n) and the free masses' (f, k)."""
        if len(chained) == 1 and self.is_identity:
            return chained[0].T
        out = np.empty((len(self.bone), free.shape[1]))
        if chained:
            out[self.chained] = np.concatenate(chained, axis=1).T
        out[self.free] = free
        return out


@dataclass(frozen=True)
class FreeMasses:
    """State of the free masses, rows, world frame; they do not rotate."""

    positions: np.ndarray
    velocities: np.ndarray
    orientations: np.ndarray


@dataclass(frozen=True)
class SwingState:
    """All m masses at ``time`` s, in the scene's order; arrays are computed on first use.

    A mass has the orientation of its rod's frame: that of the bone at rest, rotated with the rod
    by the smallest rotation of each link.
    """

    time: float
    bones: State
    levels: Sequence[Level] = field(repr=False)
    links: Sequence[Links] = field(repr=False)
    free: FreeMasses = field(repr=False)
    mass_index: MassIndex = field(repr=False)

    @cached_property
    def positions(self) -> np.ndarray:
        """Positions (m, 3) m, world frame."""
        tips = [links.base.point + level.length * links.direction
                for level, links in zip(self.levels, self.links, strict=True)]
        return self.mass_index.gather(tips, self.free.positions)

    @property
    def rods(self) -> np.ndarray:
        """Both ends of each mass's rod, (m, 2, 3) m, world frame."""
        return np.stack([self.roots, self.positions], axis=1)

    @cached_property
    def velocities(self) -> np.ndarray:
        """Velocities (m, 3) m/s, world frame."""
        tips = [links.base.velocity + level.length * links.rate
                for level, links in zip(self.levels, self.links, strict=True)]
        return self.mass_index.gather(tips, self.free.velocities)

    @cached_property
    def roots(self) -> np.ndarray:
        """Roots of the rods (m, 3) m, world frame; a free mass's own position."""
        points = [links.base.point for links in self.links]
        return self.mass_index.gather(points, self.free.positions)

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit vectors along the rods (m, 3), world frame; zero for free masses."""
        return self.mass_index.gather([links.direction for links in self.links],
                                 np.zeros_like(self.free.positions))

    @cached_property
    def rates(self) -> np.ndarray:
        """Time derivatives of the directions (m, 3) 1/s, world frame."""
        return self.mass_index.gather([links.rate for links in self.links],
                                 np.zeros_like(self.free.positions))

    @cached_property
    def orientations(self) -> np.ndarray:
        """Unit quaternions x, y, z, w (m, 4), world frame."""
        turns: list[np.ndarray] = []
        begin = 0
        for level, links in zip(self.levels, self.links, strict=True):
            count = len(level.length)
            bones = self.mass_index.bone[self.mass_index.chained[begin:begin + count]]
            frame = turns[-1][:, :count].T if turns else self.bones.orientations[bones]
            n = links.base.outward(level.rest)
            arcs = np.vstack([cross(n, links.direction), 1 + dot(n, links.direction)])
            arcs[0, np.sum(arcs * arcs, axis=0) < 1e-24] = 1
            turns.append(rotation.multiply(rotation.normalized(arcs.T), frame).T)
            begin += count
        return self.mass_index.gather(turns, self.free.orientations)
