"""How far bones are from the ground."""
from __future__ import annotations

import math

import numpy as np

from ..model.scene import Scene, height
from ..model.state import State


def ground_heights(scene: Scene, state: State) -> np.ndarray:
    """Distances (n,) m of the bones' lowest points from the ground; infinity without one."""
    if scene.ground is None:
        return np.full(len(scene.bones), math.inf)
    return np.array([height(bone, position, orientation, scene.ground) for bone, position,
                     orientation in zip(scene.bones, state.positions, state.orientations,
                                        strict=True)])
