"""Springs on all joint angles that hold a person upright until they are released."""
from __future__ import annotations

import numpy as np

from ..model.ragdoll import Ragdoll

GRAVITY = 9.8
"""m/s^2"""

ARMS = ('shoulder', 'elbow', 'wrist')

ARM_STIFFNESS = 0.05
"""Stiffness of the hanging arms over that of the other joints."""

DAMPING_TIME = 0.05
"""s: damping over stiffness."""


def standing(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Stiffness, N m/rad, and damping, N m s/rad, by joint angle, for Simulation.hold.

    The stiffness is weight times height per rad. An inverted pendulum about both ankles needs the
    weight times the height of the centre of mass for both together (Winter, Patla et al. 1998,
    J Neurophysiol 80:1211).
    """
    height = float(np.ptp([bone.position[2] for bone in doll.bones]))
    full = doll.mass * GRAVITY * height
    found = {}
    for joint in doll.joints:
        for name in joint.angle_names:
            stiffness = full * (ARM_STIFFNESS if name.endswith(ARMS) else 1.0)
            found[name] = stiffness, DAMPING_TIME * stiffness
    return found
