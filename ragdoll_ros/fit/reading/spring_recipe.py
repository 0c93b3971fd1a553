"""VRM's spring bones, whose recipe goes by frames, as swings in SI units.

Each frame of dt s, a spring bone's tip moves on by (1 - drag) times its last step, then by
stiffness dt in the rest direction and by gravity dt downwards, and is brought back to the length l
(VRMC_springBone 1.0, "SpringBone Algorithm"; both are speeds, m/s). For a small angle a from rest

    (1 + e) a' = a + (1 - drag) (a - a''),    e = stiffness dt / l,

so its modes go by roots z of (1 + e) z^2 - (2 - drag) z + 1 - drag = 0 a frame. The swing has the
rates log(z)/dt: at RATE frames a second, and with its own mass alone, the recipe's angles are the
swing's at every frame. k/J is the product of the rates and 2 zeta sqrt(k/J + share g/reach) minus
their sum, as chain.py has them. Gravity's share keeps the angle at which a rod comes to rest: the
balance of gravity and stiffness is the recipe's. It is one for the whole chain: the mean.

What differs: VRM's drag is against the world (or the spring's ``center``), a swing's against what
it hangs from; large angles go back by the angle, not by its sine.
"""
from __future__ import annotations

import cmath
import math

import numpy as np

from ...model.swing import MAX_DAMPING, MAX_GRAVITY, Link, Swing
from .spring_bones import Rod, Spring

RATE = 60.0
"""1/s, the frame rate at which VRM's numbers are taken to be meant."""

DENSITY = 0.1
"""kg/m, an assumption (a thick ponytail): nothing acts back and k goes with it, so it is free."""

GRAVITY = 9.8
"""m/s^2 of the scene that the share is meant for."""

SOFTEST, MOST_DRAG = 1e-6, 0.99
"""m/s and a share: without stiffness damping has no ratio, with all drag no motion is left."""


def swing_of(spring: Spring, bone: str, metres: float) -> tuple[Swing, bool]:
    """Swing on the body ``bone`` that moves as a spring does, by the formulas above.

    The spring's points are in m, bind pose, doll's frame; ``metres`` is m to one unit of its
    file. And whether its gravity had to be cut to what a swing may have.
    """
    steps = np.diff(spring.points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    masses = DENSITY * lengths
    rates = [_rates(rod, length, metres) for rod, length in zip(spring.rods, lengths, strict=True)]
    carried = [_carried(lengths[index:], masses[index:]) for index in range(len(lengths))]
    reaches = [inertia / lever for inertia, lever in carried]
    wanted = float(np.mean([rod.gravity / max(rod.stiffness, SOFTEST / metres) * stiff * reach
                            for rod, (stiff, _), reach in zip(spring.rods, rates, reaches,
                                                              strict=True)])) / GRAVITY
    share = min(max(wanted, -MAX_GRAVITY), MAX_GRAVITY)
    links = []
    for index, (stiff, damping) in enumerate(rates):
        pull = math.sqrt(stiff + abs(share) * GRAVITY / reaches[index])
        links.append(Link(_short(lengths[index]), _short(masses[index]),
                          _short(carried[index][0] * stiff),
                          _short(min(damping / (2 * pull), MAX_DAMPING)),
                          tuple(steps[index] / lengths[index])))
    root = tuple(round(float(x), 10) for x in spring.points[0])
    swing = Swing(spring.name, bone, root, links[0].direction, tuple(links), _short(share))
    return swing, share != wanted


def _rates(rod: Rod, length: float, metres: float = 1.0) -> tuple[float, float]:
    """k/J, 1/s^2, and the damping coefficient, 1/s, of a rod of ``length`` m at RATE.

    The product and minus the sum of log(z) RATE for both roots z; ``metres`` as in swing_of.
    """
    e = max(rod.stiffness * metres, SOFTEST) / (RATE * length)
    drag = min(rod.drag, MOST_DRAG)
    half, product = (1 - drag / 2) / (1 + e), (1 - drag) / (1 + e)
    root = cmath.sqrt(half * half - product)
    first, second = (RATE * cmath.log(z) for z in (half + root, half - root))
    return (first * second).real, max(-(first + second).real, 0.0)


def _carried(lengths: np.ndarray, masses: np.ndarray) -> tuple[float, float]:
    """Inertia (kg m^2) and static moment (kg m) about a rod's root of all that hangs on it."""
    distances = np.cumsum(lengths)
    return float(masses @ distances ** 2), float(masses @ distances)


def _short(value: float) -> float:
    return float(f'{value:.9g}')
