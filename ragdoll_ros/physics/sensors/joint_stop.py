"""Joint stops: how long tissue takes to stop a joint that reaches the end of its range.

A rigid joint stops at its limit in an instant. A joint of a person is stopped by a torque that
grows e-fold per width w, rad (model/passive.py): a joint that arrives with the rate r has the
deceleration r^2 / 2 w sech^2(r t / 2 w) until it turns, whatever its inertia and the size of the
torque. A half-sine of the same peak that stops it lasts pi w / r. Where other pulses still change
the joint's rate, the stop begins later: see soft_joints.py.
"""
from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...model.ragdoll import Joint, Ragdoll
from ...model.scene import Scene
from .soft_joints import SoftJoints

SLOWEST = 1.0
"""rad/s: a slower stop hardly accelerates anything."""

STOPPED = 0.2
"""Share of the rate before that is left after a stop, at most."""

REACH = 1.5
"""Times as far as the rate takes an angle in a tick, within which it may reach its limit: it may
become faster on the way.
"""


class Stop(NamedTuple):
    """Stop of a joint angle at its limit: its duration, s; the impulse, N s, of what hangs on the
    joint, at the distance of the radius of gyration; and by how much later the stop begins, s.
    """

    duration: float
    impulse: float
    delay: float = 0.0


class JointStops:
    """Finds the stops of a scene's joint angles by their values at the ends of a tick.

    ``widths``: (lower, upper) w in rad, by the angle's name in its doll; others have none.
    """

    def __init__(self, scene: Scene, widths: Mapping[str, tuple[float, float]]) -> None:
        angles = [(joint, name, limits, placement.doll) for placement in scene.dolls
                  for joint in placement.doll.joints
                  for name, limits in zip(joint.angle_names, joint.angle_limits, strict=True)]
        # (2, k): lower ends, then upper ends, both as angles that grow towards the end.
        self._ends = np.array([(-limits[0], limits[1]) if limits else (math.inf, math.inf)
                               for _, _, limits, _ in angles]).reshape(-1, 2).T
        self._widths = np.array([widths.get(name, (math.nan, math.nan))
                                 for _, name, _, _ in angles]).reshape(-1, 2).T
        self._masses = np.array([_first_moment(doll, joint) for joint, _, _, doll in angles])

    def find(self, before: tuple[np.ndarray, np.ndarray], after: tuple[np.ndarray, np.ndarray],
             step: float, soft: SoftJoints | None = None) -> list[Stop]:
        """Stops in a tick of ``step`` s, from angles and rates (k,) before and after it; ``soft``
        knows what earlier pulses have still to give at its beginning.
        """
        signs = np.array([[-1.0], [1.0]])
        angle, rate, left = signs * before[0], signs * before[1], signs * after[1]
        near = angle + REACH * step * np.maximum(rate, SLOWEST) >= self._ends
        stops = near & (rate > SLOWEST) & (left < STOPPED * rate) & np.isfinite(self._widths)
        return [self._stop(end, k, float(rate[end, k]), soft)
                for end, k in np.argwhere(stops).tolist()]

    def _stop(self, end: int, k: int, rate: float, soft: SoftJoints | None) -> Stop:
        delay, more = soft.arrival(k, -1 if end == 0 else 1, rate) if soft else (0.0, 0.0)
        return Stop(float(math.pi * self._widths[end, k] / rate) + more,
                    float(self._masses[k] * rate), delay)


def _first_moment(doll: Ragdoll, joint: Joint) -> float:
    """Mass of what hangs on a joint times its radius of gyration about the joint, kg m, in the bind
    pose: the root mean square over all axes.
    """
    hanging, total, mass = {joint.child}, 0.0, 0.0
    for other in doll.joints_depth_first():
        if other.parent in hanging:
            hanging.add(other.child)
    # In the order of bones: that of a set differs between processes.
    for bone in (bone for bone in doll.bones if bone.name in hanging):
        away = np.array(bone.position) - joint.anchor
        total += 2 * bone.mass * float(away @ away) + sum(bone.inertia)
        mass += bone.mass
    return math.sqrt(mass * total / 3)
