"""Passive elastic torques of a person's joints.

Coefficients of Anderson (1999) as published with Falisse et al. 2019 (J R Soc Interface
16:20190402, github.com/antoinefalisse/3dpredictsim), here with the signs of joints.py. They are
those of a man of the table's mass and height, and scale with mass times height squared, as his
damping does. For the trunk the source has one joint, at the lumbar spine; waist and chest are two
in series, each with half the angle at the same torque. The source has no torques for shoulders,
elbows, wrists and neck.
"""
from __future__ import annotations

import math
from dataclasses import replace

from ..model.passive import Passive, PassiveEnd
from ..model.ragdoll import Joint, Limits, Ragdoll

GUARD_TORQUE = 200.0
"""N m of the table's man. Where a passive torque reaches it, beyond what a joint bears, the hard
limit lies: it guards what the torque alone would already have stopped."""


def _ends(lower: tuple[float, float, float], upper: tuple[float, float, float],
          joints: int = 1) -> Passive:
    """Passive torques of a lower and an upper end, shared by ``joints`` in series. Each end is
    given by torque, N m, angle, rad, and growth, 1/rad.
    """
    return Passive(*(PassiveEnd(torque, angle / joints, 1 / (growth * joints))
                     for torque, angle, growth in (lower, upper)))


def _symmetric(torque: float, angle: float, growth: float, joints: int = 1) -> Passive:
    return _ends((torque, -angle, growth), (torque, angle, growth), joints)


_TRUNK = {'p': _ends((0.35, -0.17, 30.72), (0.25, math.radians(30), 20.36), joints=2),
          'r': _symmetric(0.25, math.radians(20), 20.36, joints=2),
          'y': _symmetric(0.25, math.radians(20), 20.36, joints=2)}

TORQUES = {
    'p_hip': _ends((2.44, -1.81, 5.05), (1.51, 0.6981, 21.88)),
    'r_hip': _symmetric(0.03, 0.5, 14.94),
    'y_hip': _symmetric(0.03, 0.92, 14.94),
    'knee': _ends((6.09, -0.13, 33.94), (11.03, 2.4, 11.33)),
    'p_ankle': _ends((2.03, -0.52, 38.11), (0.18, 0.74, 12.12)),
    'r_ankle': _symmetric(60.21, 0.65, 16.32),
    **{f'{axis}_{joint}' if axis != 'p' or joint == 'chest' else joint: torque
       for joint in ('waist', 'chest') for axis, torque in _TRUNK.items()}}
"""By the name of an angle without its side."""


MEASURED_WIDTHS = {'p_hip': (1 / 0.0305, 1 / 0.0750), 'knee': (1 / 0.150, 1 / 0.0495),
                   'p_ankle': (1 / 0.0843, 1 / 0.1949)}
"""Degrees in which the torque of relaxed living legs grows e-fold towards the lower and the upper
end (Riener and Edrich 1999, J Biomech 32:539; of the two terms that resist extension of the knee
the steeper one), by the name of an angle without its side.
"""

ASSUMED_WIDTH = 0.09
"""rad: of shoulders, elbows, wrists and neck, which none of the sources has: about the first one's
knee's.
"""

TRUNK_WIDTH = 1 / 4
"""Of the range from upright, in which the torque of a relaxed living trunk grows e-fold. Measured
in lateral bending: 0.25, 0.63, 1.7 and 5.2 N m/degree in successive quarters of the lumbar range;
in flexion: 0.0, 0.1 and 0.7 N m per percent of it, as it becomes stiff (Gombatto and Beach, in
tables 3 and 2 of Watt, Callaway and Williams 2022, Med Biol Eng Comput 60:2133).
"""


def end_widths(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Widths, rad, of the lower and the upper end of each of a person's joint angles, by its name:
    over a width, the torque that stops the angle grows e-fold. Empty for a doll without any angle
    of the source.
    """
    angles = [(name, limits, bool(joint.passive)) for joint in doll.joints
              for name, limits in zip(joint.angle_names, joint.angle_limits, strict=True)]
    if not any(_torque_of(name) for name, _, _ in angles):
        return {}
    return {name: _widths(name, limits, passive) for name, limits, passive in angles}


def _widths(name: str, limits: Limits | None, passive: bool) -> tuple[float, float]:
    """Widths of the two ends of one angle, rad; ``passive``: its torques are simulated, and the
    limits are beyond them.
    """
    if limits and not passive and name.endswith(('waist', 'chest')):
        return TRUNK_WIDTH * -limits[0], TRUNK_WIDTH * limits[1]
    if name[2:] in MEASURED_WIDTHS and not passive:
        lower, upper = MEASURED_WIDTHS[name[2:]]
        return math.radians(lower), math.radians(upper)
    torque = _torque_of(name)
    return (torque.lower.width, torque.upper.width) if torque else (ASSUMED_WIDTH,) * 2


def _torque_of(name: str) -> Passive | None:
    # 'r_waist' is a roll, 'r_knee' the right one.
    return TORQUES.get(name, TORQUES.get(name[2:]))


def with_passive_torques(joint: Joint, scale: float) -> Joint:
    """A joint with the torques that the source has for its angles, times ``scale``, and with hard
    limits beyond them; unchanged if the source has none.
    """
    found = [_torque_of(name) for name in joint.angle_names]
    if not any(found):
        return joint
    limits = tuple(limit if each is None else _guards(each)
                   for each, limit in zip(found, joint.limits, strict=True))
    return replace(joint, limits=limits, passive=tuple(
        each and Passive(*(replace(end, torque=scale * end.torque)
                           for end in (each.lower, each.upper))) for each in found))


def _guards(passive: Passive) -> tuple[float, float]:
    """Lower and upper angle, rad, at which the passive torques, without scale, are GUARD_TORQUE."""
    low, high = (end.width * math.log(GUARD_TORQUE / end.torque)
                 for end in (passive.lower, passive.upper))
    return passive.lower.angle - low, passive.upper.angle + high
