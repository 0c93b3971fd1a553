"""The courses of all dolls by themselves, side by side: saved and looked through all at once."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.system import ClusterState, System, make_cluster_state

KEPT = ('dense', 'ends', 'path', 'within', 'gaps', 'reaction', 'q', 'v', 'rows', 'sums', 'tally')
"""What a snapshot holds beside the contacts that are known."""

CONTACTS_OF_GEOM = 12
"""Contacts for which there is room, for each part of a bone."""


class Courses(Sequence):
    """A course of each doll; ``whole`` are their arrays, flat, doll by doll."""

    def __init__(self, systems: Sequence[System]) -> None:
        blank = {id(system): make_cluster_state(system, room_for_contacts(system)) for system in systems}
        own = [blank[id(system)] for system in systems]
        parts = []
        for name in (*KEPT, 'known'):
            each = [getattr(course, name) for course in own]
            ends = np.cumsum([part.size for part in each])
            flat = np.zeros(ends[-1], each[0].dtype)
            parts.append((name, flat, [
                flat[end - part.size:end].reshape(part.shape)
                for end, part in zip(ends.tolist(), each, strict=True)]))
        self.whole = {name: flat for name, flat, _ in parts}
        self._room = np.array([len(course.contacts) for course in own])
        self._first = np.cumsum(self._room) - self._room
        self._each = [course._replace(**{name: views[doll] for name, _, views in parts})
                      for doll, course in enumerate(own)]

    def __getitem__(self, doll: int) -> ClusterState:
        return self._each[doll]

    def __len__(self) -> int:
        return len(self._each)

    def contacts_of(self, dolls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which (c,) of ``known`` contacts these dolls (d,), true or false, know, and whose."""
        # where the first of a joined cluster counts, there may be more than it has room for
        counts = np.where(dolls, np.minimum(self.whole['tally']['contacts'], self._room), 0)
        begin = np.repeat(self._first - np.cumsum(counts) + counts, counts)
        return begin + np.arange(len(begin)), np.repeat(np.arange(len(counts)), counts)

    def save(self) -> object:
        """A snapshot of all."""
        known, _ = self.contacts_of(np.ones(len(self), bool))
        return {name: self.whole[name].copy() for name in KEPT}, self.whole['known'][known]

    def restore(self, snapshot: tuple) -> None:
        """Go back to a snapshot."""
        for name, values in snapshot[0].items():
            self.whole[name][:] = values
        known, _ = self.contacts_of(np.ones(len(self), bool))
        self.whole['known'][known] = snapshot[1]


def room_for_contacts(system: System) -> int:
    """Contacts for which a course of this system has room."""
    return CONTACTS_OF_GEOM * len(system.geoms) + len(system.joint_limits)
