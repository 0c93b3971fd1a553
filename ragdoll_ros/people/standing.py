"""What holds a person upright: a spring on each joint angle, to be let go in a faint."""
from __future__ import annotations

import numpy as np

from ..model.ragdoll import Ragdoll

GRAVITY = 9.8
"""m/s^2"""

ARMS = ('shoulder', 'elbow', 'wrist')

LIGHT = 0.05
"""Share of the stiffness that arms are held with: they hang."""

DELAY = 0.05
"""s: damping over stiffness."""


def standing(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Stiffness, N m/rad, and damping, N m s/rad, by joint angle, for Simulation.hold.

    Weight times height a rad: one who tilts stiffly about both ankles needs weight times the
    height of the centre of mass, of both together (Winter, Patla et al. 1998, J Neurophysiol
    80:1211: an inverted pendulum on a spring).
    """
    tall = float(np.ptp([bone.position[2] for bone in doll.bones]))
    stiff = doll.mass * GRAVITY * tall
    found = {}
    for joint in doll.joints:
        for name in joint.angle_names:
            stiffness = stiff * (LIGHT if name.endswith(ARMS) else 1.0)
            found[name] = stiffness, DELAY * stiffness
    return found
