"""SwingState: positions, velocities and orientations of all swing masses at one time."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...model import rotation
from ...model.state import State
from ...model.swing_mount import SwingMount, each_link


@dataclass(frozen=True)
class MassIndex:
    """Places of the links of chains and of the free masses in the scene's order of m masses: by
    swing, root to tip.
    """

    chained: np.ndarray
    """(k,) of each link of the chains."""
    free: np.ndarray
    """(f,) of each free mass."""
    bone: np.ndarray
    """(m,) row of each mass's bone."""
    number: np.ndarray
    """(k,) of each link in its chain, from 0 at the root."""

    @classmethod
    def of(cls, mounted: Sequence[SwingMount]) -> MassIndex:
        """Make the index of mounted swings."""
        is_free = np.array([mount.swing.mode == 'free' for mount, _ in each_link(mounted)], bool)
        numbers = np.array([index for _, index in each_link(mounted)], int)
        return cls(np.flatnonzero(~is_free), np.flatnonzero(is_free),
                   np.array([mount.bone for mount, _ in each_link(mounted)], int),
                   numbers[~is_free])

    def gather(self, chained: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Rows (m, n) in the scene's order from the links' (k, n) and the free masses' (f, n)."""
        if not len(self.free):
            return chained
        out = np.empty((len(self.bone), free.shape[1]))
        out[self.chained] = chained
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
    links: np.ndarray = field(repr=False)
    """Records LINK of the chains' links, and LINK_STATE."""
    link_states: np.ndarray = field(repr=False)
    free: FreeMasses = field(repr=False)
    mass_index: MassIndex = field(repr=False)

    @cached_property
    def positions(self) -> np.ndarray:
        """Positions (m, 3) m, world frame."""
        tips = (self.link_states['point']
                + self.links['length'][:, None] * self.link_states['direction'])
        return self.mass_index.gather(tips, self.free.positions)

    @property
    def rods(self) -> np.ndarray:
        """Both ends of each mass's rod, (m, 2, 3) m, world frame."""
        return np.stack([self.roots, self.positions], axis=1)

    @cached_property
    def velocities(self) -> np.ndarray:
        """Velocities (m, 3) m/s, world frame."""
        tips = (self.link_states['velocity']
                + self.links['length'][:, None] * self.link_states['rate'])
        return self.mass_index.gather(tips, self.free.velocities)

    @cached_property
    def roots(self) -> np.ndarray:
        """Roots of the rods (m, 3) m, world frame; a free mass's own position."""
        return self.mass_index.gather(self.link_states['point'], self.free.positions)

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit vectors along the rods (m, 3), world frame; zero for free masses."""
        return self.mass_index.gather(self.link_states['direction'],
                                      np.zeros_like(self.free.positions))

    @cached_property
    def rates(self) -> np.ndarray:
        """Time derivatives of the directions (m, 3) 1/s, world frame."""
        return self.mass_index.gather(self.link_states['rate'],
                                      np.zeros_like(self.free.positions))

    @cached_property
    def orientations(self) -> np.ndarray:
        """Unit quaternions x, y, z, w (m, 4), world frame."""
        # Columns of a link's rotation are its frame's axes.
        rest = np.einsum('kji,kj->ki', self.link_states['axes'], self.links['rest'])
        d = self.link_states['direction']
        arcs = np.column_stack([np.cross(rest, d), 1 + np.einsum('ki,ki->k', rest, d)])
        arcs[np.einsum('ki,ki->k', arcs, arcs) < 1e-24, 0] = 1
        turns = rotation.normalized(arcs)
        index = self.mass_index
        out = self.bones.orientations[index.bone[index.chained]]
        for number in range(max(index.number, default=-1) + 1):
            own = np.flatnonzero(index.number == number)
            if number:
                out[own] = out[own - 1]
            out[own] = rotation.multiply(turns[own], out[own])
        return index.gather(out, self.free.orientations)
