"""A planar doll of five rods that falls: simultaneous contacts with an exact solution."""
from __future__ import annotations

import numpy as np

from ...model.coordinates import GeneralizedState
from ...model.ragdoll import Bone, Joint, Ragdoll
from ...model.scene import Ground, Material, Placement, Scene
from ...model.shapes import Capsule
from ..cases.trial import Trial, posed
from ..references import event_driven
from ..references.planar_rods import PlanarRods
from ..trajectory import Trajectory
from .motion import ReferenceMotion, orientations_about

PITCH = (0.0, 1.0, 0.0)
NAMES = ('torso', 'left_arm', 'right_arm', 'left_leg', 'right_leg')
LENGTHS = (0.6, 0.5, 0.5, 0.6, 0.6)
MASSES = (10.0, 2.0, 2.0, 4.0, 4.0)
RADII = (0.06, 0.03, 0.03, 0.03, 0.03)
"""m, kg, m: limbs are thinner than the torso, so that their hinged ends never touch."""

SIDES = (0, 1, 1, -1, -1)
FEET = ((0, 1), (0, -1), (1, -1), (2, -1), (3, -1), (4, -1))
ANGLES, RATES = (0.3, 0.9, -0.4, 0.5, -0.2), (0.0, 0.0, 1.0, -1.0, 0.3)
"""rad about y, and rad/s."""

FALLING, CLEARANCE = (0.5, -2.0), 0.02
"""Initial velocity, x and z m/s, and height of the lowest end, m."""


def planar_motions() -> list[ReferenceMotion]:
    """The doll without friction, sliding and sticking, with and without restitution.

    Durations end before two ends stick at once, whose friction forces are indeterminate.
    """
    return [planar_doll('planar_ice', 0.0, 0.0), planar_doll('planar_ice_bounce', 0.0, 0.5),
            planar_doll('planar_slide', 0.3, 0.0), planar_doll('planar_slide_bounce', 0.3, 0.5),
            planar_doll('planar_stick', 0.8, 0.0, 0.4),
            planar_doll('planar_stick_bounce', 0.8, 0.5)]


def five_rods() -> Ragdoll:
    """The doll of capsules along z, hinged about y."""
    bones = tuple(Bone(name, Capsule(radius, length), mass, _bind(index))
                  for index, (name, radius, length, mass)
                  in enumerate(zip(NAMES, RADII, LENGTHS, MASSES, strict=True)))
    joints = tuple(Joint('torso', name, 'hinge', (0.0, 0.0, side * LENGTHS[0] / 2), (PITCH,))
                   for name, side in zip(NAMES[1:], SIDES[1:], strict=True))
    return Ragdoll('five_rods', bones, joints)


def _bind(index: int) -> tuple[float, float, float]:
    hangs = SIDES[index] * LENGTHS[0] / 2 - LENGTHS[index] / 2
    return (0.0, 0.0, hangs if index else 0.0)


def figure(friction: float, restitution: float) -> PlanarRods:
    """The same doll as a model of the reference."""
    return PlanarRods(LENGTHS, MASSES, tuple(bone.inertia[1] for bone in five_rods().bones), RADII,
                      (-1, 0, 0, 0, 0), SIDES, FEET, 9.8, friction, restitution)


def initial_rows() -> np.ndarray:
    """Initial coordinates and velocities (14,) of the figure."""
    y = np.concatenate([np.zeros(2), ANGLES, FALLING, RATES])
    y[1] = CLEARANCE - figure(0.0, 0.0).gaps(y).min()
    return y


def planar_doll(name: str, friction: float, restitution: float,
                duration: float = 0.5) -> ReferenceMotion:
    """The doll thrown onto the ground from 2 cm above it."""
    doll, rods = five_rods(), figure(friction, restitution)
    material = Material(friction, 0.0, restitution, rods.restitution_speed)
    scene = Scene(name, (Placement(doll),), Ground(), material, self_collision=False)

    def truth(times: np.ndarray) -> Trajectory:
        found = event_driven.rows(rods, initial_rows(), times)
        upright = np.insert(rods.centres(found), 1, 0.0, axis=2)
        return Trajectory.of_poses(times, upright, orientations_about(PITCH, found[:, 2:7]))
    title = f'Planar doll of five rods, e = {restitution:g}, µ = {friction:g}, {duration:g} s'
    return ReferenceMotion(
        name, title, 'Lagrange, events located, impacts by their modes; DOP853 at 1e-12',
        Trial(scene, duration, _start(doll)), truth, in_flight=False)


def _start(doll: Ragdoll) -> GeneralizedState:
    angles, rates = np.array(ANGLES), np.array(RATES)
    start = posed(Placement(doll), dict(zip(NAMES[1:], angles[1:] - angles[0], strict=True)),
                  dict(zip(NAMES[1:], rates[1:] - rates[0], strict=True)))
    start.q[:7] = (0.0, 0.0, initial_rows()[1], *orientations_about(PITCH, angles[0]))
    start.v[:6] = (FALLING[0], 0.0, FALLING[1], 0.0, rates[0], 0.0)
    return start
