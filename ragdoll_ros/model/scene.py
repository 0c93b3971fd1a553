"""What a scene needs: dolls and where they stand, ground, material, gravity, tick.

Frozen data with validation; reading and writing files is in files/scene.py.
SI units, world frame: x forward, y left, z up (REP 103). Quaternions are x, y, z, w.
"""
from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .pose import Pose
from .ragdoll import Bone, Ragdoll
from .rotation import IDENTITY
from .vectors import Quaternion, Vector, finite_floats, unit_vector

SECOND = 1_000_000_000
"""Nanoseconds in a second: time is counted in whole nanoseconds, as in ROS."""

STEP_RANGE = (0.0002, 0.2)
"""Shortest and longest tick, s."""

NO_SLIP = 0.7
"""Coefficient that stands for friction without limit in PyBullet and MuJoCo: no slip up to 35
degrees. PyBullet's solver takes turns between a contact's normal and its friction, and where a
larger one pulls the contact open (from 4/3 on for a rod, from less for a chain) they swing ever
wider: at 10, and now and then at 0.8, a sliding contact bore nothing in every solution with an even
number of turns."""

LARGEST_FRICTION = 10.0
"""Coefficient that finite ones are capped at, as PyBullet does."""


@dataclass(frozen=True)
class Material:
    """Contact of everything with everything, unless a bone has its own.

    ``friction`` is Coulomb's coefficient (infinity: no slip; in PyBullet and MuJoCo NO_SLIP),
    ``rolling_friction`` a lever arm in m, ``restitution`` the speed after over the speed
    before a bounce, which acts above an approach speed of ``restitution_speed`` m/s.
    """

    friction: float = math.inf
    rolling_friction: float = 0.0
    restitution: float = 0.5
    restitution_speed: float = 0.001

    def __post_init__(self) -> None:
        errors.check_range('friction', self.friction, 0, math.inf)
        errors.check_range('rolling_friction', self.rolling_friction, 0, 1e6)
        errors.check_range('restitution', self.restitution, 0, 1)
        errors.check_range('restitution_speed', self.restitution_speed, 0, 1e6)

    def on(self, bone: Bone | None) -> tuple[float, float, float]:
        """Friction, rolling friction (m) and restitution of a bone, its own where it has them."""
        return tuple(getattr(self, key) if getattr(bone, key, None) is None else getattr(bone, key)
                     for key in ('friction', 'rolling_friction', 'restitution'))


@dataclass(frozen=True)
class Ground:
    """The plane of points p with normal . p = offset (m); the normal points out of the ground."""

    normal: Vector = (0.0, 0.0, 1.0)
    offset: float = 0.0

    def __post_init__(self) -> None:
        set_fields(self, normal=unit_vector('normal', self.normal), offset=float(self.offset))
        errors.check_finite('offset', self.offset)


@dataclass(frozen=True)
class Placement:
    """A doll in the world: where its frame stands, and how the doll moves at the start.

    ``velocity`` (m/s) is that of its centre of mass, ``spin`` (rad/s) turns it as one rigid
    body about its centre of mass; both in the world frame.
    """

    doll: Ragdoll
    name: str = ''
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY
    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for key in ('position', 'velocity', 'spin'):
            set_fields(self, **{key: finite_floats(key, getattr(self, key))})
        set_fields(self, name=self.name or self.doll.name, orientation=unit_vector(
            'orientation', self.orientation, 'a quaternion x, y, z, w, not zero', 4))

    def bone_pose(self, bone: Bone) -> Pose:
        """Of a bone at the start, world frame."""
        return Pose(np.array(self.position), np.array(self.orientation)).compose(bone.pose)

    def root_velocity(self) -> np.ndarray:
        """Velocity (3,) m/s of the root's centre of mass at the start, world frame."""
        arm = rotation.rotate(self.orientation, self.doll.root.position - self.doll.mass_centre)
        return self.velocity + np.cross(self.spin, arm)


@dataclass(frozen=True, repr=False)
class Scene:
    """All that a simulation needs to begin.

    ``step`` is one tick in s, ``pace`` the seconds of the scene for each second on the wall,
    ``gravity`` in m/s^2. No ground: nothing to fall on, and none in the engine.
    """

    name: str
    dolls: tuple[Placement, ...]
    ground: Ground | None = None
    material: Material = field(default_factory=Material)
    gravity: Vector = (0.0, 0.0, -9.8)
    step: float = 0.01
    pace: float = 1.0
    self_collision: bool = True

    def __post_init__(self) -> None:
        set_fields(self, dolls=tuple(self.dolls), gravity=finite_floats('gravity', self.gravity))
        if not self.dolls:
            raise errors.WrongForm('dolls', (), 'at least one doll')
        errors.check_range('step', self.step, *STEP_RANGE)
        errors.check_positive('pace', self.pace)
        names = [placement.name for placement in self.dolls]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise errors.DuplicateName(f'dolls[{index}].name', name, 'a name of its own')

    @cached_property
    def bones(self) -> tuple[Bone, ...]:
        """Every bone, doll by doll: the order of all arrays."""
        return tuple(bone for placement in self.dolls for bone in placement.doll.bones)

    @cached_property
    def bone_names(self) -> tuple[str, ...]:
        """Name of every bone; with several dolls, doll/bone."""
        return tuple(self.qualified(placement, bone.name)
                     for placement in self.dolls for bone in placement.doll.bones)

    @cached_property
    def bone_slices(self) -> tuple[slice, ...]:
        """What of all bone arrays is each doll's, in the order of ``dolls``."""
        ends = list(itertools.accumulate(len(placement.doll.bones) for placement in self.dolls))
        return tuple(map(slice, [0, *ends[:-1]], ends))

    @cached_property
    def doll_of_bone(self) -> np.ndarray:
        """(n,) index into ``dolls`` of each bone's doll."""
        counts = [own.stop - own.start for own in self.bone_slices]
        return np.repeat(np.arange(len(counts)), counts)

    @cached_property
    def angle_names(self) -> tuple[str, ...]:
        """Name of every joint angle, doll by doll, joint by joint as the doll lists them."""
        return tuple(self.qualified(placement, name) for placement in self.dolls
                     for joint in placement.doll.joints for name in joint.angle_names)

    def __repr__(self) -> str:
        ground = 'over the ground' if self.ground else 'without ground'
        dolls = ', '.join(f'{placement.name!r} of {len(placement.doll.bones)} bones'
                          for placement in self.dolls[:3]) + ', ...' * (len(self.dolls) > 3)
        return f'Scene {self.name!r}: {dolls}; {ground}, tick {self.step:g} s'

    def qualified(self, placement: Placement, name: str) -> str:
        """Name of a doll's bone or angle that is unique in the scene."""
        return name if len(self.dolls) == 1 else f'{placement.name}/{name}'

    def bone_index(self, name: str) -> int:
        """Index of a bone in all arrays; UnknownBone if there is none of that name."""
        try:
            return self.bone_names.index(name)
        except ValueError:
            raise errors.UnknownBone('', name, errors.one_of(self.bone_names, name)) from None


def height(bone: Bone, position: np.ndarray, orientation: np.ndarray, ground: Ground) -> float:
    """Distance of a bone's lowest point from the ground, m; negative inside it."""
    normal = np.array(ground.normal)
    inward = rotation.rotate(rotation.inverse(orientation), -normal)
    return float(position @ normal - ground.offset - bone.shape.support(inward))


def above_ground(doll: Ragdoll, clearance: float = 0.4) -> Scene:
    """A scene of one doll over level ground, its lowest point ``clearance`` m above it."""
    return all_above_ground(doll.name, (Placement(doll),), clearance)


def all_above_ground(name: str, placements: Sequence[Placement], clearance: float = 0.4) -> Scene:
    """A scene of dolls as they are placed, over level ground, all lifted or lowered by the same.

    The lowest point of all is ``clearance`` m above the ground.
    """
    ground = Ground()
    lowest = min(height(bone, *placement.bone_pose(bone), ground)
                 for placement in placements for bone in placement.doll.bones)
    return Scene(name, tuple(replace(placement, position=(
        *placement.position[:2], round(placement.position[2] + clearance - lowest, 12)))
        for placement in placements), ground)


def finite_friction(friction: float) -> float:
    """The coefficient of friction that PyBullet and MuJoCo are to work with."""
    return NO_SLIP if math.isinf(friction) else min(friction, LARGEST_FRICTION)
