"""A walking person at the middle of a step: velocities of the stance and of the swinging leg.

As in ballistic walking (Mochon and McMahon 1980, J Biomech 13:49), the body is an inverted pendulum
over the stance foot, which rests on the ground, and the other leg swings.
"""
from dataclasses import dataclass

import numpy as np

from ..model.forward_kinematics import bone_motions
from ..model.ragdoll import Ragdoll

SWING_SPEED = 2.5
"""Speed of the swinging foot over that of walking: it makes two steps in the 0.4 of a stride that
the foot is off the ground (Perry and Burnfield, Gait Analysis, 2010)."""

SIDES = {'left': 'l', 'right': 'r'}
"""Prefixes of the names of joint angles."""


@dataclass(frozen=True)
class Gait:
    """Velocities of a doll at an instant of a step, in its frame."""

    velocity: np.ndarray
    """(3,) m/s, of the centre of mass."""
    spin: np.ndarray
    """(3,) rad/s, of the root."""
    rates: dict[str, float]
    """rad/s, of joint angles by name."""


def gait(doll: Ragdoll, angles: dict[str, float], speed: float, swing: str) -> Gait:
    """Velocities at which the root moves forwards at ``speed`` m/s, the stance foot rests, and the
    foot of the side ``swing`` moves forwards at SWING_SPEED times ``speed``, moved by its hip.

    ``angles``: rad, by name, of a person's doll; those that are not named are zero.
    """
    stance = next(side for side in SIDES if side != swing)
    spin = np.array([0.0, 1.0, 0.0])
    hip, foot = f'{SIDES[swing]}_p_hip', f'{swing}_foot'

    def motion_at(rate: float) -> tuple[dict[str, float], dict[str, np.ndarray]]:
        """Rates of the joints, and velocity of each bone while the stance foot rests and the root
        turns at 1 rad/s, at a rate of the swinging hip.
        """
        rates = {f'{SIDES[stance]}_p_ankle': -spin[1], hip: rate}
        found = {name: motion.velocity + np.cross(spin, motion.position)
                 for name, motion in bone_motions(doll, angles, rates).items()}
        return rates, {name: each - found[f'{stance}_foot'] for name, each in found.items()}

    still, unit = (motion_at(rate)[1][foot][0] for rate in (0.0, 1.0))
    root_speed = motion_at(0.0)[1][doll.root.name][0]
    rates, velocities = motion_at((SWING_SPEED * root_speed - still) / (unit - still))
    velocity = np.average([velocities[bone.name] for bone in doll.bones], axis=0,
                          weights=[bone.mass for bone in doll.bones])
    scale = speed / velocities[doll.root.name][0]
    return Gait(scale * velocity, scale * spin,
                {name: scale * rate for name, rate in rates.items()})
