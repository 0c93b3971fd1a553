"""Write config/walker.glb, a character that walks in place: `walk`, one cycle of two steps.

python docs/walker.py [walker.glb]
ragdoll_fit config/walker.glb -o config/walker.yaml
"""
from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'test')]

import animated_rigs  # noqa: E402
import fit_rigs  # noqa: E402

from ragdoll_ros.model import rotation  # noqa: E402

SPEED, PERIOD = 1.0, 1.0
"""m/s at which a foot on the ground goes back, and s of a cycle."""
STANCE = 0.58
"""Share of the cycle for which a foot is on the ground."""
LIFT, LOWERED, RISE = 0.07, 0.055, 0.012
"""m: of a foot above the ground, of the hips below the bind pose, and of their rise and fall."""
FLEXION, BALL = 0.25, 0.16
"""Rad by which an ankle bends up at most, and m from it to the ball of the foot, on which the heel
rises then."""
FRAMES = 30
"""Keys, which are 1/30 s apart: baked, as files of games are."""
COLOR = (0.85, 0.55, 0.3, 1.0)

X, Y, Z = np.eye(3)
"""glTF's axes: left, up, forward."""

RIG = dataclasses.replace(fit_rigs.RIGS['vrm'], name='walker')


def hips(time: float) -> np.ndarray:
    """Displacement (3,) m of the hips: highest while one leg passes the other."""
    return Y * (-LOWERED + RISE * np.cos(4 * np.pi * (time / PERIOD - STANCE / 2)))


def ankle(phase: float) -> np.ndarray:
    """Forward and upward displacement (2,) m of an ankle from the bind pose; the foot comes down at
    phase 0, and its way ends as it begins.
    """
    phase, reach = phase % 1, SPEED * PERIOD * STANCE / 2
    if phase < STANCE:
        return np.array((reach - SPEED * PERIOD * phase, 0.0))
    s = (phase - STANCE) / (1 - STANCE)
    # A cubic that leaves and arrives as fast as the ground goes.
    slope = -SPEED * PERIOD * (1 - STANCE)
    forward = (-reach * (1 - 3 * s ** 2 + 2 * s ** 3) + reach * (3 * s ** 2 - 2 * s ** 3)
               + slope * (s - 3 * s ** 2 + 2 * s ** 3))
    return np.array((forward, LIFT * np.sin(np.pi * s) ** 2))


def leg_angles(side: str, time: float) -> tuple[float, float]:
    """Rotations, rad about x, of a thigh and of a shin relative to it."""
    found, heel = (0.0, 0.0), 0.0
    for _ in range(12):
        found = reach(side, time, heel)
        heel = (heel + BALL * np.sin(max(0.0, sum(found) - FLEXION))) / 2
    return found


def reach(side: str, time: float, heel: float) -> tuple[float, float]:
    """Likewise, for a ``heel`` m above the ground; by the law of cosines."""
    bones = {bone.name: bone for bone in RIG.bones}
    points = [np.array(bones[f'J_Bip_{side}_{name}'].head)[[2, 1]]
              for name in ('UpperLeg', 'LowerLeg', 'Foot')]
    down = (points[2] - points[0] + ankle(time / PERIOD + (side == 'R') / 2) + (0.0, heel)
            - hips(time)[[2, 1]])
    thigh, shin = points[1] - points[0], points[2] - points[1]
    a, b, c = (np.hypot(*each) for each in (thigh, shin, down))
    bend = np.pi - np.arccos((a * a + b * b - c * c) / (2 * a * b))
    lead = np.arccos((a * a + c * c - b * b) / (2 * a * c))

    def pitch(way: np.ndarray) -> float:
        """Rad about x that turn straight down to a way (forward, up)."""
        return float(np.arctan2(-way[0], -way[1]))

    first = pitch(down) - lead - pitch(thigh)
    return first, pitch(down) - lead + bend - pitch(shin) - first


def about(*turns: np.ndarray) -> np.ndarray:
    """Rotation vector (3,) of several, the last one first."""
    q = np.array(rotation.IDENTITY)
    for turn in turns:
        q = rotation.multiply(q, rotation.from_rotation_vector(turn))
    return rotation.rotation_vector(q)


def moves() -> dict[str, animated_rigs.Move]:
    """What each bone does; see animated_rigs."""
    still = np.zeros(3)

    def wave(time: float, shift: float = 0.0) -> float:
        return float(np.sin(2 * np.pi * (time / PERIOD + shift)))

    found: dict[str, animated_rigs.Move] = {
        'J_Bip_C_Hips': lambda time: (hips(time), 0.06 * wave(time, 0.25) * Y),
        'J_Bip_C_Chest': lambda time: (still, -0.1 * wave(time, 0.25) * Y + 0.03 * X),
        'J_Bip_C_Head': lambda time: (still, 0.04 * wave(time, 0.25) * Y)}
    for side, sign in (('L', 1.0), ('R', -1.0)):
        def arm(time: float, sign: float = sign) -> tuple[np.ndarray, np.ndarray]:
            return still, about((0.05 + 0.45 * sign * wave(time, 0.25)) * X, -1.3 * sign * Z)

        def forearm(time: float, sign: float = sign) -> tuple[np.ndarray, np.ndarray]:
            return still, -sign * (0.35 - 0.2 * sign * wave(time, 0.25)) * Y

        def thigh(time: float, side: str = side) -> tuple[np.ndarray, np.ndarray]:
            return still, leg_angles(side, time)[0] * X

        def shin(time: float, side: str = side) -> tuple[np.ndarray, np.ndarray]:
            return still, leg_angles(side, time)[1] * X

        def foot(time: float, side: str = side) -> tuple[np.ndarray, np.ndarray]:
            return still, -min(sum(leg_angles(side, time)), FLEXION) * X

        found |= {f'J_Bip_{side}_UpperArm': arm, f'J_Bip_{side}_LowerArm': forearm,
                  f'J_Bip_{side}_UpperLeg': thigh, f'J_Bip_{side}_LowerLeg': shin,
                  f'J_Bip_{side}_Foot': foot}
    return found


def document() -> fit_rigs.Document:
    """The character with its animation."""
    made = animated_rigs.document(RIG)
    made.data['materials'] = [{'name': 'skin', 'pbrMetallicRoughness': {
        'baseColorFactor': COLOR, 'metallicFactor': 0.0, 'roughnessFactor': 0.8}}]
    made.data['meshes'][0]['primitives'][0]['material'] = 0
    animated_rigs.animate(made, RIG, moves(), PERIOD * np.arange(FRAMES + 1) / FRAMES, 'LINEAR',
                          'walk')
    return made


if __name__ == '__main__':
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / 'config/walker.glb'
    path.write_bytes(document().glb())
