"""What loads do to a bone in a stretch of motion: their mean, their work; how long it may be."""
from __future__ import annotations

import math

import numpy as np

from ....model import rotation
from ....model.state import State
from ...motion import cross, point_motion
from ..protocol import AppliedWrench

STEADY = 0.2
"""rad that a bone may turn while a torque, or a force along its axes, is entered as one."""


def longest_stretch(load: AppliedWrench, state: State, inertia: np.ndarray) -> float:
    """Time, s, in which a bone that a torque or a load along its own axes pushes turns by STEADY.

    At the least: w t + a t^2 / 2, where a is what the bone alone, of principal moments
    ``inertia`` (3,) kg m^2, would have.
    """
    if not (load.local or load.torque.any()):
        return math.inf
    spin = math.hypot(*state.angular_velocities[load.bone])
    force, arm, torque = (math.hypot(*vector) for vector in (load.force, load.point, load.torque))
    gain = (torque + force * arm) / inertia.min()
    root = math.sqrt(spin * spin + 2 * gain * STEADY)
    return 2 * STEADY / (spin + root) if root > 0 else math.inf


def mean_load(load: AppliedWrench, before: State, after: State) -> tuple[np.ndarray, np.ndarray]:
    """Force (3,) N and torque (3,) N m in world axes; of a local load over a steady turn."""
    if not load.local:
        return load.force, load.torque
    turn = rotation.mean_rotation_matrix(
        _turned(load.bone, before, after)) @ before.rotation_matrices[load.bone]
    return turn @ load.force, turn @ load.torque


def work(load: AppliedWrench, before: State, after: State, duration: float,
         substep: float) -> float:
    """Work, J, in a stretch of ``duration`` s: of the force along its point's displacement, and of
    the torque through its bone's rotation.

    A step that takes the velocity first (semi-implicit Euler, ``substep`` h s long) moves a point
    by h v' where its energy grows by F (v + v') h / 2: the difference adds up to
    F (v_end - v_start) h / 2 and is left out. Where the load turns with its bone, what it does
    beyond mean times displacement is that of two even changes, t dF dv / 12. Turns are no vectors:
    the integral of w is the turn's plus t^2 / 12 w_start x w_end (Magnus).
    """
    bone = load.bone
    force, torque = mean_load(load, before, after)
    (place, speed), (end, end_speed) = (
        point_motion(state, bone, load.point) for state in (before, after))
    faster = end_speed - speed
    spun = after.angular_velocities[bone] - before.angular_velocities[bone]
    done = force @ (end - place - substep / 2 * faster)
    if torque.any():
        swept = _turned(bone, before, after) + duration ** 2 / 12 * cross(
            before.angular_velocities[bone], after.angular_velocities[bone])
        done += torque @ (swept - substep / 2 * spun)
    if load.local:
        change = after.rotation_matrices[bone] - before.rotation_matrices[bone]
        done += duration / 12 * (change @ load.force @ faster + change @ load.torque @ spun)
    return float(done)


def _turned(bone: int, before: State, after: State) -> np.ndarray:
    """Rotation vector (3,) rad, in the world, by which a bone has turned."""
    return rotation.rotation_vector(rotation.multiply(
        after.orientations[bone], rotation.inverse(before.orientations[bone])))
