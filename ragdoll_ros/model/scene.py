"""A scene: dolls and their initial states, what is around them, gravity, tick. Frozen and checked.

SI units, world frame: x forward, y left, z up (REP 103). Quaternions are x, y, z, w.
files/scene.py reads and writes it.
"""
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .follow import Follow
from .forward_kinematics import BoneMotion, bone_motions
from .motors import Motors
from .playback import Playback
from .pose import Pose
from .ragdoll import Bone, Ragdoll
from .robot import Robot
from .rotation import IDENTITY
from .static_body import StaticBody
from .surface import check_stiffness
from .vectors import Quaternion, Vector, finite_floats, unit_vector

SECOND = 1_000_000_000
"""Nanoseconds in a second; time is an integer of nanoseconds, as in ROS."""

STEP_RANGE = (0.0002, 0.2)
"""Shortest and longest tick, s."""

MAX_GRAVITY = 1000.0
"""Largest component of gravity, m/s^2: a hundred times the earth's, four times the sun's."""

NO_SLIP = 0.7
"""Coefficient for unlimited friction in PyBullet and MuJoCo: no slip up to 35 degrees. PyBullet's
solver alternates between normal and friction; where friction opens the contact (above 4/3 for a
rod, less for a chain) the iteration diverges: at 10, and sometimes at 0.8, a sliding contact
carried no load after an even number of iterations."""

LIMIT_TOLERANCE = 1e-9
"""rad by which an initial angle may be outside its limits, as both are rounded."""

LARGEST_FRICTION = 10.0
"""Upper bound of finite coefficients in PyBullet and MuJoCo, PyBullet's own."""


@dataclass(frozen=True)
class Material:
    """Contact parameters of all bones and bodies that have none of their own, and of the ground.

    ``friction`` is Coulomb's coefficient (infinity: no slip; NO_SLIP in PyBullet and MuJoCo),
    ``rolling_friction`` a lever arm in m, ``restitution`` the speed of separation over the speed
    of approach, applied above an approach speed of ``restitution_speed`` m/s.
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

    def on(self, bone: Bone | StaticBody | None) -> tuple[float, float, float]:
        """Friction, rolling friction (m) and restitution of a bone or body, or of the ground
        (None).
        """
        return tuple(getattr(self, key) if getattr(bone, key, None) is None else getattr(bone, key)
                     for key in ('friction', 'rolling_friction', 'restitution'))


@dataclass(frozen=True)
class Ground:
    """The half space below the plane normal . p = offset. Raises NotUnit, NotFinite, WrongForm,
    NotPositive.

    Args:
        normal: (3,), out of the ground, world frame; normalised.
        offset: m, distance of the plane from the origin along the normal.
        stiffness: N/m, of a mat on it, in series with the tissue in the contact law of impacts;
            infinity: rigid. Motions do not depend on it.

    Example:
        >>> Ground(normal=(0, 0, 2)).normal
        (0.0, 0.0, 1.0)
    """

    normal: Vector = (0.0, 0.0, 1.0)
    offset: float = 0.0
    stiffness: float = math.inf

    def __post_init__(self) -> None:
        set_fields(self, normal=unit_vector('normal', self.normal), offset=float(self.offset))
        errors.check_finite('offset', self.offset)
        check_stiffness(self.stiffness)


@dataclass(frozen=True)
class Placement:
    """A doll in a scene, with its initial pose and velocity in the world frame.

    Args:
        doll: the Ragdoll.
        name: unique in the scene; default the doll's.
        position: (3,) m, of the doll's frame.
        orientation: quaternion x, y, z, w, of the doll's frame; normalised.
        velocity: (3,) m/s, of the doll's centre of mass.
        spin: (3,) rad/s, angular velocity of the whole doll about its centre of mass; with rates
            that of its root.
        angles: initial joint angles, rad, by the names of the doll's angles; 0 where none is given.
            They are rounded to 1e-9 degrees, so that files in degrees read back to the same bits.
        rates: initial rates of joint angles, rad/s; rounded likewise.
        follow: how a doll of one bone follows Simulation.drive_body(); None: it does not.
        animation: what moves the doll until it goes limp, see Animation.play(). Position,
            orientation and velocity are then those of the animation's frame; spin, angles and rates
            are its own.
        motors: what drives the joints to the initial pose, or, beside an animation, to its poses;
            the root is not driven. None: nothing.
        fixed_root: whether the root stays where it is, attached to the world, whatever acts on it:
            a lamp that hangs, a door, a robot's arm.

    Raises:
        NotFinite, NotUnit, WrongForm: for a malformed vector or quaternion; for ``follow`` of a
            doll of several bones; for a velocity or spin of a body that follows exactly or of a
            fixed root; for a spin, angles, rates or ``follow`` beside an animation, or an animation
            of another doll; for an animation or ``follow`` of a fixed root.
        UnknownJoint, OutOfRange: for an angle that the doll does not have, or outside its limits.

    Example:
        >>> Placement(load_doll('doll'), position=(0, 1, 0.5), spin=(0, 2, 0)).name
        'doll'
    """

    doll: Ragdoll
    name: str = ''
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY
    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)
    angles: Mapping[str, float] = field(default_factory=dict, hash=False)
    rates: Mapping[str, float] = field(default_factory=dict, hash=False)
    follow: Follow | None = None
    animation: Playback | None = field(default=None, hash=False)
    motors: Motors | None = None
    fixed_root: bool = False

    def __post_init__(self) -> None:
        for key in ('position', 'velocity', 'spin'):
            set_fields(self, **{key: finite_floats(key, getattr(self, key))})
        for key in ('angles', 'rates'):
            set_fields(self, **{key: checked_angles(self.doll, key, getattr(self, key))})
        set_fields(self, name=self.name or self.doll.name, orientation=unit_vector(
            'orientation', self.orientation, 'a quaternion x, y, z, w, not zero', 4))
        if self.follow is not None and len(self.doll.bones) > 1:
            raise errors.WrongForm('follow', self.follow, 'a body, or a doll of one bone')
        for key in ('velocity', 'spin') if self.is_kinematic else ():
            if any(getattr(self, key)):
                raise errors.WrongForm(key, getattr(self, key), 'none: what follows exactly stands '
                                       'until drive_body() moves it')
        if self.fixed_root:
            self._check_fixed_root()
        if self.animation is not None:
            self._check_animation(self.animation)
        if self.motors is not None:
            try:
                self.motors.of(self.doll)
            except errors.ModelError as error:
                raise error.at('motors') from None

    @property
    def is_animated(self) -> bool:
        """Whether an animation moves it as it says, whatever acts on it, until it goes limp."""
        return self.animation is not None and self.motors is None

    @property
    def is_kinematic(self) -> bool:
        """Whether it follows Simulation.drive_body() exactly, as a kinematic body."""
        return self.follow is not None and self.follow.is_exact

    @cached_property
    def start(self) -> 'Placement':
        """The placement at the start of its animation; itself if it has none."""
        return self if self.animation is None else _started(self, self.animation)

    @property
    def pose(self) -> Pose:
        """Initial pose of the doll's frame, or of its animation's, world frame."""
        return Pose(np.array(self.position), np.array(self.orientation))

    @property
    def is_posed(self) -> bool:
        """Whether it starts with joint angles or rates, or with an animation."""
        return bool(self.angles or self.rates or self.animation)

    def bone_pose(self, bone: Bone) -> Pose:
        """Initial pose of a bone, world frame."""
        if self.animation is not None:
            return self.start.bone_pose(bone)
        here = self._motions[bone.name].pose(bone) if self.angles else bone.pose
        return self.pose.compose(here)

    @property
    def mass_centre(self) -> np.ndarray:
        """Centre of mass (3,) m at ``angles``, doll's frame. An animation is ignored: see
        ``start``.
        """
        return self._mean('position') if self.angles else self.doll.mass_centre

    @cached_property
    def root_motion(self) -> tuple[Pose, np.ndarray]:
        """Initial pose of the root, and velocity (3,) m/s of its centre of mass, world frame."""
        start = self.start
        return start.bone_pose(self.doll.root), start.root_velocity()

    def root_velocity(self) -> np.ndarray:
        """Initial velocity (3,) m/s of the root's centre of mass, world frame. An animation is
        ignored: see root_motion.
        """
        if self.fixed_root:
            return np.zeros(3)
        arm = rotation.rotate(self.orientation, self.doll.root.position - self.mass_centre)
        moved = self.velocity + np.cross(self.spin, arm)
        if self.rates:
            moved -= rotation.rotate(self.orientation, self._mean('velocity'))
        return moved

    def _check_fixed_root(self) -> None:
        for key in ('velocity', 'spin'):
            if any(getattr(self, key)):
                raise errors.WrongForm(key, getattr(self, key), 'none: the root is fixed')
        for key in ('follow', 'animation'):
            if getattr(self, key) is not None:
                raise errors.WrongForm(key, getattr(self, key), 'none: the root is fixed; motors '
                                       'move the joints')

    def _check_animation(self, animation: Playback) -> None:
        for key in ('spin', 'angles', 'rates'):
            if (values := getattr(self, key)) and any(values):
                raise errors.WrongForm(key, values, 'none: the animation has its own')
        if self.follow is not None:
            raise errors.WrongForm('follow', self.follow, 'none: the animation moves the doll')
        sizes = (7 + sum(4 if joint.is_free_ball else joint.dof for joint in self.doll.joints),
                 6 + sum(joint.dof for joint in self.doll.joints))
        if animation.motion.layout.sizes != sizes:
            raise errors.WrongForm('animation', animation.name, 'an animation of this doll')

    def _mean(self, key: str) -> np.ndarray:
        """Mean of a field of the bones' motions, weighted by their masses."""
        return np.average([getattr(self._motions[bone.name], key) for bone in self.doll.bones],
                          axis=0, weights=[bone.mass for bone in self.doll.bones])

    @cached_property
    def _motions(self) -> dict[str, BoneMotion]:
        return bone_motions(self.doll, self.angles, self.rates)


def _started(placement: Placement, animation: Playback) -> Placement:
    """The placement as its animation has it at the start, without the animation."""
    alone, doll = replace(placement, animation=None), placement.doll
    state = animation.at(alone.pose, np.array(alone.velocity), 0.0)
    q, layout = state.q, animation.motion.layout
    root = Pose(q[layout.root_positions[0]], q[layout.root_orientations[0]])
    frame = root.compose(doll.root.pose.relative(Pose()))
    names = [name for joint in doll.joints for name in joint.angle_names]
    resting = replace(
        alone, position=tuple(frame.position.tolist()), velocity=(0.0, 0.0, 0.0),
        orientation=tuple(frame.orientation.tolist()),
        spin=tuple(state.v[layout.root_angular_velocities[0]].tolist()),
        angles=dict(zip(names, layout.joint_angles(q).tolist(), strict=True)),
        rates=dict(zip(names, layout.joint_rates(state).tolist(), strict=True)))
    # A placement's velocity is that of the centre of mass, that of coordinates the root's.
    velocity = state.v[layout.root_velocities[0]] - resting.root_velocity()
    return replace(resting, velocity=tuple(velocity.tolist()))


def checked_angles(doll: Ragdoll, key: str, given: Mapping[str, float]) -> dict[str, float]:
    """Check the ``given`` joint angles, rad, or rates, rad/s, and round them to 1e-9 degrees.
    ``key`` is their path in errors; it ends in 'angles' for angles. Raises UnknownJoint, NotFinite,
    and OutOfRange for angles outside their limits.
    """
    limits = {name: pair for joint in doll.joints
              for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True)}
    for name, value in given.items():
        where = f'{key}.{name}'
        if name not in limits:
            raise errors.UnknownJoint(where, name, errors.one_of(list(limits), name))
        errors.check_finite(where, value)
        lower, upper = limits[name] or (-math.inf, math.inf)
        within = lower - LIMIT_TOLERANCE <= value <= upper + LIMIT_TOLERANCE
        if key.endswith('angles') and not within:
            raise errors.OutOfRange(
                where, value, f'{lower:.4g} to {upper:.4g} rad, its limits: '
                f'{math.degrees(lower):.4g} to {math.degrees(upper):.4g} degrees')
    return {name: math.radians(round(math.degrees(value), 9)) for name, value in given.items()}


@dataclass(frozen=True, repr=False)
class Scene:
    """Everything that a simulation starts from.

    Args:
        name: of the scene.
        dolls: at least one Placement, with different names.
        ground: None: no ground.
        material: contact parameters, by default no slip and restitution 0.5.
        gravity: (3,) m/s^2, world frame; each of -1000 to 1000.
        step: one tick, s, 0.0002 to 0.2.
        pace: real-time factor that the node starts with.
        self_collision: whether the bones of a doll collide with each other.
        description: a sentence on it.
        bodies: StaticBody objects; their names differ from each other and from the dolls'.
        robots: Robot objects, whose links are dolls of one bone that follow exactly.

    Raises:
        WrongForm, OutOfRange, NotPositive, NotFinite, DuplicateName: for its fields.

    Example:
        >>> Scene('fall', (Placement(load_doll('doll'), position=(0, 0, 0.4)),), Ground())
        Scene 'fall': 'doll' of 10 bones; over the ground, tick 0.01 s
    """

    name: str
    dolls: tuple[Placement, ...]
    ground: Ground | None = None
    material: Material = field(default_factory=Material)
    gravity: Vector = (0.0, 0.0, -9.8)
    step: float = 0.01
    pace: float = 1.0
    self_collision: bool = True
    description: str = ''
    bodies: tuple[StaticBody, ...] = ()
    robots: tuple[Robot, ...] = ()

    def __post_init__(self) -> None:
        set_fields(self, dolls=tuple(self.dolls), bodies=tuple(self.bodies),
                   robots=tuple(self.robots), gravity=finite_floats('gravity', self.gravity))
        if not self.dolls:
            raise errors.WrongForm('dolls', (), 'at least one doll')
        for value in self.gravity:
            errors.check_range('gravity', value, -MAX_GRAVITY, MAX_GRAVITY)
        errors.check_range('step', self.step, *STEP_RANGE)
        errors.check_positive('pace', self.pace)
        names: set[str] = set()
        for key in ('dolls', 'bodies', 'robots'):
            for index, one in enumerate(getattr(self, key)):
                if one.name in names:
                    raise errors.DuplicateName(f'{key}[{index}].name', one.name, 'a unique name')
                names.add(one.name)
        self._check_robots()

    def _check_robots(self) -> None:
        follow = {placement.name for placement in self.dolls if placement.is_kinematic}
        linked: set[str] = set()
        for index, robot in enumerate(self.robots):
            for link, name in robot.links.items():
                if name not in follow or name in linked:
                    raise errors.WrongForm(f'robots[{index}].links.{link}', name,
                                           'a body with `follow: exact` of its own')
                linked.add(name)

    @cached_property
    def robot_of_body(self) -> dict[str, str]:
        """Name of the robot of each placement that is a link of one, by the placement's name."""
        return {name: robot.name for robot in self.robots for name in robot.links.values()}

    @cached_property
    def driven_names(self) -> tuple[str, ...]:
        """Names of the bodies with ``follow`` that are no links, and of the robots."""
        return (*(each.name for each in self.dolls
                  if each.follow and each.name not in self.robot_of_body),
                *(robot.name for robot in self.robots))

    @cached_property
    def bones(self) -> tuple[Bone, ...]:
        """All bones, doll by doll: the order of all arrays."""
        return tuple(bone for placement in self.dolls for bone in placement.doll.bones)

    @cached_property
    def bone_names(self) -> tuple[str, ...]:
        """Names of all bones; with several dolls, doll/bone."""
        return tuple(self.qualified(placement, bone.name)
                     for placement in self.dolls for bone in placement.doll.bones)

    @cached_property
    def bone_slices(self) -> tuple[slice, ...]:
        """Each doll's range in arrays over bones, in the order of ``dolls``."""
        ends = list(itertools.accumulate(len(placement.doll.bones) for placement in self.dolls))
        return tuple(map(slice, [0, *ends[:-1]], ends))

    @cached_property
    def link_slices(self) -> tuple[slice, ...]:
        """Each doll's range in arrays over the links of all swings, in the order of ``dolls``."""
        ends = list(itertools.accumulate(sum(len(swing.links) for swing in placement.doll.swings)
                                         for placement in self.dolls))
        return tuple(map(slice, [0, *ends[:-1]], ends))

    @cached_property
    def doll_of_bone(self) -> np.ndarray:
        """(n,) index into ``dolls`` of each bone."""
        counts = [own.stop - own.start for own in self.bone_slices]
        return np.repeat(np.arange(len(counts)), counts)

    @property
    def first_pushed_bone(self) -> str:
        """Name of the bone that is pushed until another is chosen: the first doll's root, or where
        that is fixed a bone that hangs on it.
        """
        first = self.dolls[0]
        name = first.doll.root.name
        if first.fixed_root and first.doll.joints:
            name = first.doll.joints_from_root()[0].child
        return self.qualified(first, name)

    @cached_property
    def yielding_bones(self) -> np.ndarray:
        """(n,) bool: bones that forces can move, all but fixed roots and bodies that follow
        exactly. Animations are ignored.
        """
        yields = np.array([not placement.is_kinematic for placement in self.dolls])[
            self.doll_of_bone]
        for own, placement in zip(self.bone_slices, self.dolls, strict=True):
            if placement.fixed_root:
                yields[own.start + placement.doll.bones.index(placement.doll.root)] = False
        return yields

    @cached_property
    def angle_names(self) -> tuple[str, ...]:
        """Names of all joint angles, doll by doll in the order of their joints."""
        return tuple(name for placement in self.dolls for name in self.angle_names_of(placement))

    def angle_names_of(self, placement: Placement) -> list[str]:
        """Names of the joint angles of a doll of the scene, in the order of its joints."""
        return [self.qualified(placement, name)
                for joint in placement.doll.joints for name in joint.angle_names]

    def __repr__(self) -> str:
        ground = 'over the ground' if self.ground else 'without ground'
        dolls = ', '.join(f'{placement.name!r} of {len(placement.doll.bones)} bones'
                          for placement in self.dolls[:3]) + ', ...' * (len(self.dolls) > 3)
        bodies = f', {len(self.bodies)} static bodies' if self.bodies else ''
        return f'Scene {self.name!r}: {dolls}; {ground}{bodies}, tick {self.step:g} s'

    def touched_name(self, bone: int, body: int) -> str:
        """Name of what is touched: the bone of index ``bone``, or if that is negative the static
        body of index ``body``, or 'ground' if both are negative.
        """
        if bone >= 0:
            return self.bone_names[bone]
        return self.bodies[body].name if body >= 0 else 'ground'

    def surface_stiffness(self, bone: int, body: int) -> float:
        """Stiffness, N/m, of the surface that is touched, by indices as in touched_name(). Infinity
        for a bone, whose tissue is part of the contact law.
        """
        if bone >= 0:
            return math.inf
        if body >= 0:
            return self.bodies[body].stiffness
        return self.ground.stiffness if self.ground else math.inf

    def qualified(self, placement: Placement, name: str) -> str:
        """Name of a doll's bone or angle in the scene: prefixed where there are several dolls."""
        return name if len(self.dolls) == 1 else f'{placement.name}/{name}'

    @cached_property
    def _bone_indices(self) -> dict[str, int]:
        return {name: index for index, name in enumerate(self.bone_names)}

    def bone_index(self, name: str) -> int:
        """Index of a bone in all arrays. Raises UnknownBone."""
        try:
            return self._bone_indices[name]
        except KeyError:
            raise errors.UnknownBone('', name, errors.one_of(self.bone_names, name)) from None


def height(bone: Bone, position: np.ndarray, orientation: np.ndarray, ground: Ground) -> float:
    """Distance of a bone's lowest point from the ground, m; negative if it penetrates."""
    normal = np.array(ground.normal)
    inward = rotation.rotate(rotation.inverse(orientation), -normal)
    return float(position @ normal - ground.offset - bone.shape.support(inward))


def above_ground(doll: Ragdoll, clearance: float = 0.4) -> Scene:
    """A scene of one doll over level ground, its lowest point ``clearance`` m above it."""
    return all_above_ground(doll.name, (Placement(doll),), clearance)


def all_above_ground(name: str, placements: Sequence[Placement], clearance: float = 0.4) -> Scene:
    """A scene of dolls over level ground, shifted together along z.

    The lowest point of all is ``clearance`` m above the ground.
    """
    ground = Ground()
    lowest = min(height(bone, *placement.bone_pose(bone), ground)
                 for placement in placements for bone in placement.doll.bones)
    return Scene(name, tuple(replace(placement, position=(
        *placement.position[:2], round(placement.position[2] + clearance - lowest, 12)))
        for placement in placements), ground)


def finite_friction(friction: float) -> float:
    """Coefficient of friction for PyBullet and MuJoCo."""
    return NO_SLIP if math.isinf(friction) else min(friction, LARGEST_FRICTION)
