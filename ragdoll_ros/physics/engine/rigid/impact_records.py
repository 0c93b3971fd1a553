"""Entries of the kernels' impact logs as Impacts between bones of the scene."""
import dataclasses
from collections.abc import Sequence

import numpy as np

from ...kernels.cluster_state import IMPACT
from ..protocol import Impacts


def logged_impacts(log: np.ndarray, pairs: np.ndarray, since: float, dropped: int) -> Impacts:
    """Impacts of the entries (c,) of a log whose times count from ``since`` s after the start of
    the advance. ``pairs``: what meets, (c, 3) as Clusters.contacts() returns it; ``dropped``:
    number of impacts for which the log had no room.
    """
    return Impacts(*pairs.T, log['time'] + since, log['point'].copy(), log['normal'].copy(),
                   log['speed'].copy(), log['impulse'].copy(), log['effective_mass'].copy(),
                   log['mobility'].copy(), dropped)


def join_impacts(parts: Sequence[Impacts]) -> Impacts:
    """All impacts of ``parts``, by time; equal times in the order of the parts."""
    if not parts:
        return NO_IMPACTS
    order = np.argsort(np.concatenate([part.elapsed for part in parts]), kind='stable')
    arrays = [field.name for field in dataclasses.fields(Impacts) if field.name != 'dropped']
    return Impacts(**{name: np.concatenate([getattr(part, name) for part in parts])[order]
                      for name in arrays}, dropped=sum(part.dropped for part in parts))


NO_IMPACTS = logged_impacts(np.zeros(0, IMPACT), np.zeros((0, 3), np.int64), 0.0, 0)
