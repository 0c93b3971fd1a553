"""What compiled code knows of a bone: one record of a table, parents first."""
from __future__ import annotations

import numpy as np

BODY = np.dtype([
    ('bone', np.int64), ('parent', np.int64), ('free', np.int64), ('dof', np.int64),
    ('q', np.int64), ('v', np.int64), ('mass', float), ('inertia', float, 3), ('bind', float, 4),
    ('before', float, 3), ('after', float, 3), ('axes', float, (3, 3)), ('damping', float)],
    align=True)
"""``bone``: its place in the scene. ``parent``: the record of its parent, -1 for a root.
``free``: 1 where a quaternion in q stands for its turn: roots and ball joints without limits.
``dof``: of its joint, none for a root's. ``q``, ``v``: where its coordinates begin.
``bind``: its principal axes in the doll's. ``before``, ``after``: from the parent's centre of mass
to the anchor, and from there to its own, m, and ``axes``, rows, all along the doll's axes as in
the bind pose."""
