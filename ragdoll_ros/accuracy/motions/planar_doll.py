"""A doll of five rods that falls in a plane: several contacts at a time, and still a truth."""
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
"""m, kg, m: limbs are thinner, so that none touches by the end that hangs on the torso."""

SIDES = (0, 1, 1, -1, -1)
FEET = ((0, 1), (0, -1), (1, -1), (2, -1), (3, -1), (4, -1))
ANGLES, RATES = (0.3, 0.9, -0.4, 0.5, -0.2), (0.0, 0.0, 1.0, -1.0, 0.3)
"""rad about y, and rad/s."""

FALLING, CLEARANCE = (0.5, -2.0), 0.02
"""m/s, x and z, and m below the lowest end."""


def planar_motions() -> list[ReferenceMotion]:
    """The doll on ice, sliding and sticking, bouncing or not, for as long as the truth is known.

    Two rods' ends that stick at once can share their friction in many ways: the last one ends
    before that.
    """
    return [planar_doll('planar_ice', 0.0, 0.0), planar_doll('planar_ice_bounce', 0.0, 0.5),
            planar_doll('planar_slide', 0.3, 0.0), planar_doll('planar_slide_bounce', 0.3, 0.5),
            planar_doll('planar_stick', 0.8, 0.0, 0.4),
            planar_doll('planar_stick_bounce', 0.8, 0.5)]


def five_rods() -> Ragdoll:
    """The doll of capsules, all hinged about y, every bone along z."""
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
    """The same doll as the reference knows it."""
    return PlanarRods(LENGTHS, MASSES, tuple(bone.inertia[1] for bone in five_rods().bones), RADII,
                      (-1, 0, 0, 0, 0), SIDES, FEET, 9.8, friction, restitution)


def beginning() -> np.ndarray:
    """Coordinates and velocities (14,) of the figure at the start of all these motions."""
    y = np.concatenate([np.zeros(2), ANGLES, FALLING, RATES])
    y[1] = CLEARANCE - figure(0.0, 0.0).gaps(y).min()
    return y


def planar_doll(name: str, friction: float, restitution: float,
                duration: float = 0.5) -> ReferenceMotion:
    """A throw onto the ground from 2 cm above it."""
    doll, rods = five_rods(), figure(friction, restitution)
    material = Material(friction, 0.0, restitution, rods.restitution_speed)
    scene = Scene(name, (Placement(doll),), Ground(), material, self_collision=False)

    def truth(times: np.ndarray) -> Trajectory:
        found = event_driven.rows(rods, beginning(), times)
        upright = np.insert(rods.centres(found), 1, 0.0, axis=2)
        return Trajectory.of_poses(times, upright, orientations_about(PITCH, found[:, 2:7]))
    title = f'Planar doll of five rods, e = {restitution:g}, µ = {friction:g}, {duration:g} s'
    return ReferenceMotion(
        name, title, 'Lagrange, events located, impacts by their modes; DOP853 at 1e-12',
        Trial(scene, duration, _start(doll)), truth, in_air=False)


def _start(doll: Ragdoll) -> GeneralizedState:
    angles, rates = np.array(ANGLES), np.array(RATES)
    start = posed(Placement(doll), dict(zip(NAMES[1:], angles[1:] - angles[0], strict=True)),
                  dict(zip(NAMES[1:], rates[1:] - rates[0], strict=True)))
    start.q[:7] = (0.0, 0.0, beginning()[1], *orientations_about(PITCH, angles[0]))
    start.v[:6] = (FALLING[0], 0.0, FALLING[1], 0.0, rates[0], 0.0)
    return start
