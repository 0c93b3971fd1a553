"""Conversion of VRM spring bones, defined per frame, to swings in SI units.

Each frame of dt s, the tip of a spring bone moves by (1 - drag) times its previous step, by
stiffness dt in the rest direction and by gravity dt downwards, and is projected back to the length
l (VRMC_springBone 1.0, "SpringBone Algorithm"; both are speeds, m/s). For a small angle a from
rest, a'' one frame before and a' one after,

    (1 + e) a' = a + (1 - drag) (a - a''),    e = stiffness dt / l,

so the modes per frame are the roots z of (1 + e) z^2 - (2 - drag) z + 1 - drag = 0. The swing has
the eigenvalues log(z)/dt: at FRAME_RATE, and for a single segment, its angles equal VRM's at every
frame. k/J is the product of the eigenvalues, and 2 zeta sqrt(k/J + share g/l) is their negative
sum, with J = m l^2, as each segment swings as if none hung on it. The gravity share keeps the
equilibrium angle of gravity and stiffness; the swing has one share, the mean over the chain.

Differences: VRM's drag is relative to the world (or the spring's ``center``), a swing's damping to
the body; the restoring torque at large angles is proportional to the angle, not to its sine.
"""
import cmath
import math

import numpy as np

from ...model.swing import MAX_DAMPING, MAX_GRAVITY, Link, Swing
from .spring_bones import SpringBone, SpringJoint

FRAME_RATE = 60.0
"""1/s; frame rate for which VRM's settings are assumed to be made."""

LINEAR_DENSITY = 0.1
"""kg/m, assumed (a thick ponytail). Free: swings do not act on bodies, and k scales with it."""

GRAVITY = 9.8
"""m/s^2; gravity of the scene for which the share is computed."""

MIN_STIFFNESS, MAX_DRAG = 1e-6, 0.99
"""m/s and fraction: without stiffness the damping ratio is undefined, with full drag the motion."""


def swing_from_spring(spring: SpringBone, bone: str, metres: float) -> tuple[Swing, bool]:
    """Swing on the body ``bone`` with the motion of a spring bone, and whether gravity is clamped.

    The spring's points are in m, bind pose, doll's frame; ``metres`` is metres per unit of its
    file. Gravity is clamped to the range that a swing may have.
    """
    steps = np.diff(spring.points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    masses = LINEAR_DENSITY * lengths
    rates = [_rates(joint, length, metres)
             for joint, length in zip(spring.joints, lengths, strict=True)]
    shares = [joint.gravity / max(joint.stiffness, MIN_STIFFNESS / metres) * stiff * length
              for joint, (stiff, _), length in zip(spring.joints, rates, lengths, strict=True)]
    target = float(np.mean(shares)) / GRAVITY
    share = min(max(target, -MAX_GRAVITY), MAX_GRAVITY)
    links = []
    for index, (stiff, damping) in enumerate(rates):
        natural_rate = math.sqrt(stiff + abs(share) * GRAVITY / lengths[index])
        links.append(Link(_round(lengths[index]), _round(masses[index]),
                          _round(masses[index] * lengths[index] ** 2 * stiff),
                          _round(min(damping / (2 * natural_rate), MAX_DAMPING)),
                          tuple(steps[index] / lengths[index])))
    root = tuple(round(float(x), 10) for x in spring.points[0])
    swing = Swing(spring.name, bone, root, links[0].direction, tuple(links), _round(share),
                  independent=True)
    return swing, share != target


def _rates(joint: SpringJoint, length: float, metres: float = 1.0) -> tuple[float, float]:
    """k/J, 1/s^2, and damping coefficient, 1/s, of a segment of ``length`` m.

    Product and negative sum of log(z) FRAME_RATE for both roots z; ``metres`` as for
    swing_from_spring.
    """
    e = max(joint.stiffness * metres, MIN_STIFFNESS) / (FRAME_RATE * length)
    drag = min(joint.drag, MAX_DRAG)
    half, product = (1 - drag / 2) / (1 + e), (1 - drag) / (1 + e)
    root = cmath.sqrt(half * half - product)
    first, second = (FRAME_RATE * cmath.log(z) for z in (half + root, half - root))
    return (first * second).real, max(-(first + second).real, 0.0)


def _round(value: float) -> float:
    return float(f'{value:.9g}')
