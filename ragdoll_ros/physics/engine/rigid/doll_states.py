"""DollStates: the cluster states of all single dolls, in arrays of the whole scene."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.collision.shapes import TRIANGLE
from ...kernels.cluster_state import ClusterState, make_cluster_state
from ...kernels.system import System

SNAPSHOT = ('dense_output', 'end_rates', 'dense_step', 'excluded', 'gaps', 'contact_accelerations',
            'accelerations', 'q', 'v', 'bone_states', 'doll_sums', 'contact_impulses', 'stats')
"""Fields that a snapshot stores beside the contacts."""

CONTACTS_PER_GEOM = 12
"""Capacity for contacts, for each geom; limits have their own."""

TRIANGLES_TOUCHED = 8
"""Triangles of a surface for each other geom, beyond which they add no capacity: many are near, and
few are touched."""


class DollStates(Sequence):
    """The ClusterState of each doll alone; ``arrays`` hold those of all dolls, flat."""

    def __init__(self, systems: Sequence[System]) -> None:
        blank = {id(system): make_cluster_state(system, contact_capacity(system))
                 for system in systems}
        own = [blank[id(system)] for system in systems]
        parts = []
        for name in (*SNAPSHOT, 'contacts'):
            each = [getattr(state, name) for state in own]
            ends = np.cumsum([part.size for part in each])
            flat = np.zeros(ends[-1], each[0].dtype)
            parts.append((name, flat, [
                flat[end - part.size:end].reshape(part.shape)
                for end, part in zip(ends.tolist(), each, strict=True)]))
        self.arrays = {name: flat for name, flat, _ in parts}
        self._room = np.array([len(state.contacts) for state in own])
        self._first = np.cumsum(self._room) - self._room
        self._each = [state._replace(**{name: views[doll] for name, _, views in parts})
                      for doll, state in enumerate(own)]

    def __getitem__(self, doll: int) -> ClusterState:
        return self._each[doll]

    def __len__(self) -> int:
        return len(self._each)

    def contacts_of(self, dolls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Indices (c,) of the contacts in arrays['contacts'] of the dolls for which ``dolls`` (d,)
        is true, and the doll (c,) of each.
        """
        # the first doll of a larger cluster holds its statistics, with more contacts than it has
        counts = np.where(dolls, np.minimum(self.arrays['stats']['contact_count'], self._room), 0)
        begin = np.repeat(self._first - np.cumsum(counts) + counts, counts)
        return begin + np.arange(len(begin)), np.repeat(np.arange(len(counts)), counts)

    def copy(self, doll: int, other: DollStates, old: int) -> None:
        """Copy to ``doll`` the state of the equal doll ``old`` of ``other``."""
        for name in (*SNAPSHOT, 'contacts'):
            getattr(self._each[doll], name)[:] = getattr(other._each[old], name)

    def save(self) -> object:
        """A snapshot of all states."""
        known, _ = self.contacts_of(np.ones(len(self), bool))
        return {name: self.arrays[name].copy() for name in SNAPSHOT}, self.arrays['contacts'][known]

    def restore(self, snapshot: tuple) -> None:
        """Restore a snapshot."""
        for name, values in snapshot[0].items():
            self.arrays[name][:] = values
        known, _ = self.contacts_of(np.ones(len(self), bool))
        self.arrays['contacts'][known] = snapshot[1]


def contact_capacity(system: System) -> int:
    """Number of contacts that a state of this system can store."""
    triangles = int(np.count_nonzero(system.geoms['kind'] == TRIANGLE))
    others = len(system.geoms) - triangles
    return (CONTACTS_PER_GEOM * (others + min(triangles, TRIANGLES_TOUCHED * others))
            + len(system.joint_limits))
