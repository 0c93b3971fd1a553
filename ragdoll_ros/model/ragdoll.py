"""A doll: a kinematic tree of rigid bodies (bones) and joints. Frozen, validated data.

SI units, radians, REP 103: x forward, y left, z up. All positions, axes and orientations are in
the doll's frame in the bind pose, where every joint angle is zero. Quaternions are x, y, z, w.
"""
from __future__ import annotations

import dataclasses
import math
import os
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from . import errors, rotation
from .compound import Compound, has_hull
from .errors import set_fields
from .mesh import Hull
from .passive import Passive
from .pose import Pose
from .rotation import IDENTITY
from .shapes import Part, Shape
from .surface import check_surface
from .swing import Swing
from .vectors import Quaternion, Vector, finite_floats, unit_vector, vector

Limits = tuple[float, float]

DEFAULT_COLOR = (0.5, 0.64, 0.82, 1.0)
"""Red, green, blue, opacity of a bone without a colour."""

WORLD = 'world'
"""Name of the world frame; no bone may have it, as tf frames are named by bones."""


@dataclass(frozen=True)
class Bone:
    """A rigid body.

    Args:
        name: unique in its doll, not 'world'.
        shape: a Box, Capsule, Compound, Cylinder or Sphere; its axes are the bone's. A Hull becomes
            a Compound of it.
        mass: kg.
        position: (3,) m, the centre of mass in the doll's frame, bind pose.
        orientation: quaternion x, y, z, w, bone's axes (principal axes of inertia) to doll's.
        friction, rolling_friction, restitution: Coulomb's coefficient, lever arm in m, ratio of
            speeds from 0 to 1; None: those of the scene's material.
        color: red, green, blue, opacity, 0 to 1.
        moments: (3,) kg m^2, principal moments about the centre of mass along the bone's axes;
            None: those of a uniform solid of its shape.

    Raises:
        ModelError: for a field out of its range, by a subclass that names the fault.

    Example:
        >>> Bone('head', Sphere(0.1), mass=5, position=(0, 0, 1.6)).position
        (0.0, 0.0, 1.6)
    """

    name: str
    shape: Shape | Compound
    mass: float
    position: Vector
    orientation: Quaternion = IDENTITY
    friction: float | None = None
    rolling_friction: float | None = None
    restitution: float | None = None
    color: tuple[float, float, float, float] | None = None
    moments: Vector | None = None

    def __post_init__(self) -> None:
        set_fields(self, mass=float(self.mass), position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation, count=4))
        if isinstance(self.shape, Hull):
            set_fields(self, shape=Compound((Part(self.shape),)))
        if self.name == WORLD:
            raise errors.DuplicateName('name', self.name, "a name other than the world frame's")
        errors.check_positive('mass', self.mass)
        check_surface(self, max_rolling_friction=math.inf)
        if self.moments is not None:
            moments = vector(finite_floats('inertia', self.moments))
            set_fields(self, moments=_checked_moments(moments))
        elif isinstance(self.shape, Compound):
            self.shape.check_principal()

    @property
    def pose(self) -> Pose:
        """Pose in the doll's frame, bind pose."""
        return Pose(np.array(self.position), np.array(self.orientation))

    @property
    def inertia(self) -> Vector:
        """Principal moments (3,) kg m^2 about the centre of mass, given or of the shape."""
        return self.shape.inertia(self.mass) if self.moments is None else self.moments


MAX_SWING = math.radians(85)
"""rad, largest swing limit of a ball joint: at 90 degrees its Euler angles are singular."""


@dataclass(frozen=True)
class JointKind:
    """Numbers of axes, of pairs of limits and of degrees of freedom of a kind of joint."""

    name: str
    axes: int
    limits: int
    dof: int


JOINT_KINDS = {kind.name: kind for kind in (
    JointKind('ball', axes=1, limits=2, dof=3),
    JointKind('hinge', axes=1, limits=1, dof=1),
    JointKind('universal', axes=2, limits=2, dof=2),
    JointKind('fixed', axes=0, limits=0, dof=0))}


@dataclass(frozen=True)
class Joint:
    """A joint between two bones of a doll; angles are the child's relative to the parent.

    - hinge: one axis, one pair of limits.
    - universal: the first axis is fixed in the parent, the second in the child, perpendicular in
      the bind pose; R = R(first) R(second).
    - ball: one axis, the twist axis; free, or with limits (-s, s), s up to 85 degrees, about two
      axes across it (a pyramid, as in PhysX) and a twist (-t, t). Or two axes, twist and x across
      it, and three pairs of limits: about x, which is fixed in the parent, about y = twist axis
      times x (up to 85 degrees), and the twist.
    - fixed: no axes.

    Args:
        parent, child: names of the bones.
        kind: 'hinge', 'universal', 'ball' or 'fixed'.
        anchor: (3,) m, doll's frame, bind pose.
        axes: unit vectors (3,), doll's frame, bind pose; normalised. Angles are right-handed.
        limits: pairs (lower, upper), rad, None for a free axis; rounded to 1e-9 degrees, so that
            files in degrees read back to the same bits.
        damping: N m s/rad on each axis.
        names: of the angles; default the child's, with a suffix where there are several.
        passive: elastic torque on each angle, None for none; only the engine rigid simulates it. A
            ball joint without limits, whose coordinate is a quaternion, has none.

    Raises:
        WrongAxes, LimitsReversed, OutOfRange, WrongForm, NotUnit, NotFinite: for its fields.

    Example:
        >>> Joint('thigh', 'shin', 'hinge', (0, 0, 0.5), ((0, 1, 0),), ((0, 2.5),)).angle_names
        ('shin',)
    """

    parent: str
    child: str
    kind: str
    anchor: Vector
    axes: tuple[Vector, ...] = ()
    limits: tuple[Limits | None, ...] = ()
    damping: float = 0.0
    names: tuple[str, ...] = ()
    passive: tuple[Passive | None, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in JOINT_KINDS:
            raise errors.WrongAxes('kind', self.kind, 'one of ' + ', '.join(JOINT_KINDS))
        kind = JOINT_KINDS[self.kind]
        if self.kind == 'ball' and len(self.axes) == 2:
            kind = dataclasses.replace(kind, axes=2, limits=3)
        set_fields(self, anchor=finite_floats('anchor', self.anchor), damping=float(self.damping),
                   axes=tuple(unit_vector('axes', axis) for axis in self.axes),
                   limits=tuple(map(_rounded_limits, self.limits or (None,) * kind.limits)),
                   names=tuple(self.names), passive=tuple(self.passive))
        if len(self.axes) != kind.axes:
            raise errors.WrongAxes('axes', self.axes, f'{kind.axes} for a {self.kind} joint')
        if len(self.limits) != kind.limits:
            raise errors.WrongAxes('limits', self.limits, f'{kind.limits} for a {self.kind} joint')
        if not 0 <= self.damping < math.inf:
            raise errors.OutOfRange('damping', self.damping, 'zero or above, finite')
        if self.names and len(self.names) != kind.dof:
            raise errors.WrongForm('names', list(self.names), f'{kind.dof} for a {self.kind} joint')
        if self.passive and len(self.passive) != (0 if self.is_free_ball else kind.dof):
            raise errors.WrongForm('passive', f'{len(self.passive)} torques',
                                   f'one for each angle of a {self.kind} joint')
        self._check_limits()
        if len(self.axes) == 2 and abs(np.dot(*self.axes)) > 1e-6:
            raise errors.WrongAxes('axes', self.axes, 'two perpendicular axes')

    def _check_limits(self) -> None:
        for index, pair in enumerate(self.limits):
            path = f'limits[{index}]'
            if pair is None:
                continue
            errors.check_finite(path, pair)
            if pair[0] > pair[1]:
                raise errors.LimitsReversed(path, pair, 'lower <= upper')
            if max(map(abs, pair)) > 2 * math.pi:
                raise errors.OutOfRange(path, pair, 'within one turn')
        if len(self.limits) == 3:
            if self.limits[1] is None or max(map(abs, self.limits[1])) > MAX_SWING:
                raise errors.OutOfRange('limits[1]', self.limits[1], 'a swing up to 85 degrees')
        elif self.kind == 'ball' and any(self.limits):
            self._check_ball(*self.limits)

    def _check_ball(self, swing: Limits | None, twist: Limits | None) -> None:
        if swing is None or not 0 < swing[1] <= MAX_SWING:
            raise errors.OutOfRange('limits[0]', swing, 'a swing up to 85 degrees, or no limits')
        for index, pair in enumerate((swing, twist)):
            if pair and (pair[0] != -pair[1] or pair[1] <= 0):
                raise errors.WrongAxes(f'limits[{index}]', pair, 'a symmetric pair, [-a, a]')

    @property
    def is_free_ball(self) -> bool:
        """Whether it is a ball joint without limits, whose coordinate is a quaternion."""
        return self.kind == 'ball' and not any(self.limits)

    @property
    def dof(self) -> int:
        """Number of degrees of freedom."""
        return JOINT_KINDS[self.kind].dof

    @property
    def angle_names(self) -> tuple[str, ...]:
        """Name of each joint angle; see ``names``."""
        if self.names:
            return self.names
        suffixes = {'universal': ('_1', '_2'), 'ball': ('_x', '_y', '_z')}
        count = self.dof
        return tuple(self.child + s for s in suffixes.get(self.kind, ('',) * count))

    @property
    def angle_limits(self) -> tuple[Limits | None, ...]:
        """Limits of each angle of angle_names, rad; None: free."""
        if self.kind == 'ball' and len(self.limits) == 2:
            swing, twist = self.limits
            return (swing, swing, twist)
        return self.limits


@dataclass(frozen=True)
class SkeletonFrame:
    """A frame of the skin's skeleton fixed to a bone of the doll: an entry of ``riders``.

    ``position`` (m) and ``orientation`` are in the frame of ``bone``: its centre of mass and its
    axes. It has no mass and no shape; a skin follows it (see skeleton.py). Its name may be that
    of a bone.
    """

    name: str
    bone: str
    position: Vector
    orientation: Quaternion = IDENTITY

    def __post_init__(self) -> None:
        set_fields(self, position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation, count=4))


@dataclass(frozen=True, repr=False)
class Ragdoll:
    """A doll: a kinematic tree of bones and joints.

    Args:
        name: of the doll.
        bones: their order is that of all arrays; exactly one, the root, is no joint's child.
        joints: one for each other bone.
        swings: chains of point masses attached to bones (model/swing.py); they do not act back.
        riders: frames of a skin's skeleton, attached to bones; see Riders.
        model: path of the character that the riders are from; made absolute, not opened.
        no_collision: pairs of names of bones that do not collide, beside jointed ones.

    Raises:
        DuplicateName, UnknownBone, ConnectedTwice, JointCycle, Detached, WrongForm: if it is no
            tree or a name is wrong.

    Example:
        >>> ball = Ragdoll('ball', (Bone('ball', Sphere(0.1), mass=1, position=(0, 0, 0)),))
        >>> ball
        Ragdoll 'ball': 1 bones, 0 joints, 0 degrees of freedom, 1 kg
    """

    name: str
    bones: tuple[Bone, ...]
    joints: tuple[Joint, ...] = ()
    swings: tuple[Swing, ...] = ()
    riders: tuple[SkeletonFrame, ...] = ()
    model: str | None = None
    no_collision: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        set_fields(self, bones=tuple(self.bones), joints=tuple(self.joints),
                   swings=tuple(self.swings), riders=tuple(self.riders),
                   model=self.model and os.path.abspath(self.model),
                   no_collision=tuple(tuple(pair) for pair in self.no_collision))
        names = [bone.name for bone in self.bones]
        edges = [(joint.parent, joint.child) for joint in self.joints]
        found = tree_errors(names, edges)
        for key in ('swings', 'riders'):
            attached = [(each.name, each.bone) for each in getattr(self, key)]
            found += attachment_errors(key, names, attached)
        found += no_collision_errors(names, self.no_collision)
        found += angle_name_errors(self.joints)
        found += link_rider_errors(self.swings, self.riders)
        found += collider_errors(self.swings, names)
        for error in found:
            raise error

    @cached_property
    def largest_half_extents(self) -> np.ndarray:
        """(n,) m: the largest half extent of each bone."""
        return np.array([max(bone.shape.half_extents) for bone in self.bones])

    @cached_property
    def hulls(self) -> tuple[str, ...]:
        """Names of the bones that have a hull."""
        return tuple(bone.name for bone in self.bones if has_hull(bone.shape))

    @cached_property
    def extent(self) -> float:
        """Size, m, in the bind pose: longest edge of the box around the bones' centres, plus twice
        the largest half extent of a bone along its own axes. Rotated bones may reach beyond it.
        """
        positions = np.array([bone.position for bone in self.bones])
        return float(np.ptp(positions, axis=0).max() + 2 * self.largest_half_extents.max())

    @property
    def root(self) -> Bone:
        """The bone without a parent."""
        children = {joint.child for joint in self.joints}
        return next(bone for bone in self.bones if bone.name not in children)

    @property
    def mass(self) -> float:
        """Total mass, kg."""
        return sum(bone.mass for bone in self.bones)

    @property
    def mass_centre(self) -> np.ndarray:
        """Centre of mass (3,) m, doll's frame, bind pose."""
        moments = [bone.mass * np.array(bone.position) for bone in self.bones]
        return np.asarray(sum(moments)) / self.mass

    @property
    def excluded_pairs(self) -> frozenset[frozenset[str]]:
        """Pairs of names of bones that do not collide: jointed ones and ``no_collision``."""
        jointed = ((joint.parent, joint.child) for joint in self.joints)
        return frozenset(frozenset(pair) for pair in (*jointed, *self.no_collision))

    def __repr__(self) -> str:
        return (f'Ragdoll {self.name!r}: {len(self.bones)} bones, {len(self.joints)} joints, '
                f'{sum(joint.dof for joint in self.joints)} degrees of freedom, {self.mass:.4g} kg')

    def bone(self, name: str) -> Bone:
        """The bone of a name. Raises UnknownBone."""
        for bone in self.bones:
            if bone.name == name:
                return bone
        raise errors.UnknownBone('', name, errors.one_of([b.name for b in self.bones], name))

    def joints_from_root(self) -> tuple[Joint, ...]:
        """All joints, each parent's before its children's."""
        below = self._joints_below()
        ordered = below[self.root.name]
        for joint in ordered:
            ordered += below[joint.child]
        return tuple(ordered)

    def joints_depth_first(self) -> tuple[Joint, ...]:
        """All joints, depth first, as engines order them."""
        below = self._joints_below()
        ordered = below[self.root.name]
        for after, joint in enumerate(ordered, start=1):
            ordered[after:after] = below[joint.child]
        return tuple(ordered)

    def _joints_below(self) -> defaultdict[str, list[Joint]]:
        """Joints to the children of each bone."""
        below: defaultdict[str, list[Joint]] = defaultdict(list)
        for joint in self.joints:
            below[joint.parent].append(joint)
        return below

    def replace_bone(self, name: str, **changes: Any) -> Ragdoll:
        """A copy with fields of one bone replaced. Raises UnknownBone."""
        self.bone(name)
        bones = tuple(dataclasses.replace(bone, **changes) if bone.name == name else bone
                      for bone in self.bones)
        return dataclasses.replace(self, bones=bones)

    def renamed(self, rename: Callable[[str], str]) -> Ragdoll:
        """A copy in which ``rename`` is applied to the name of every bone, and to every angle name
        given in Joint.names.
        """
        bones = tuple(dataclasses.replace(bone, name=rename(bone.name)) for bone in self.bones)
        joints = tuple(dataclasses.replace(
            joint, parent=rename(joint.parent), child=rename(joint.child),
            names=tuple(map(rename, joint.names))) for joint in self.joints)
        pairs = tuple((rename(first), rename(second)) for first, second in self.no_collision)
        swings = tuple(dataclasses.replace(swing, bone=rename(swing.bone), colliders=tuple(
            dataclasses.replace(collider, bone=rename(collider.bone))
            for collider in swing.colliders)) for swing in self.swings)
        riders = tuple(dataclasses.replace(rider, bone=rename(rider.bone))
                       for rider in self.riders)
        return dataclasses.replace(self, bones=bones, joints=joints, no_collision=pairs,
                                   swings=swings, riders=riders)


def tree_errors(names: list[str], edges: list[tuple[str, str]]) -> list[errors.ModelError]:
    """Errors that keep (parent, child) edges from being one tree over the named bones."""
    found: list[errors.ModelError] = []
    if not names:
        found.append(errors.Detached('bones', names, 'at least one bone'))
    for index, name in enumerate(names):
        if name in names[:index]:
            found.append(errors.DuplicateName(f'bones[{index}].name', name, 'a unique name'))
    parent_of: dict[str, str] = {}
    for index, (parent, child) in enumerate(edges):
        for end, name in (('parent', parent), ('child', child)):
            if name not in names:
                expected = errors.one_of(names, name)
                found.append(errors.UnknownBone(f'joints[{index}].{end}', name, expected))
        if child in parent_of:
            found.append(errors.ConnectedTwice(
                f'joints[{index}].child', child, 'a bone without another parent'))
        elif _is_ancestor(parent_of, parent, child):
            found.append(errors.JointCycle(
                f'joints[{index}]', f'{parent} -> {child}', 'joints without a loop'))
        else:
            parent_of[child] = parent
    roots = [name for name in dict.fromkeys(names) if name not in parent_of]
    if len(roots) > 1 and not found:
        found.append(errors.Detached('joints', roots, 'exactly one bone without a parent'))
    return found


def attachment_errors(key: str, names: list[str],
                      attached: list[tuple[str, str]]) -> list[errors.ModelError]:
    """Errors of what is attached to bones, pairs (name, bone): unknown bones, equal names."""
    found: list[errors.ModelError] = []
    known, seen = set(names), set()
    for index, (name, bone) in enumerate(attached):
        if bone not in known:
            expected = errors.one_of(names, bone)
            found.append(errors.UnknownBone(f'{key}[{index}].bone', bone, expected))
        if name in seen:
            found.append(errors.DuplicateName(f'{key}[{index}].name', name, 'a unique name'))
        seen.add(name)
    return found


def link_rider_errors(swings: Sequence[Swing],
                      riders: Sequence[SkeletonFrame]) -> list[errors.ModelError]:
    """Errors of the riders of links: unknown ones, those of other bones, and repeated ones."""
    found: list[errors.ModelError] = []
    bones = {rider.name: rider.bone for rider in riders}
    taken: set[str] = set()
    moved = [(f'swings[{index}].links[{number}].riders', swing.bone, name)
             for index, swing in enumerate(swings)
             for number, link in enumerate(swing.links) for name in link.riders]
    for where, bone, name in moved:
        if name not in bones:
            found.append(errors.UnknownBone(where, name, errors.one_of([*bones], name)))
        elif bones[name] != bone:
            found.append(errors.WrongForm(where, name, f"a rider on the swing's bone, {bone}; "
                                          f'this one is on {bones[name]}'))
        elif name in taken:
            found.append(errors.DuplicateName(where, name, 'a rider that no other link moves'))
        taken.add(name)
    return found


def collider_errors(swings: Sequence[Swing], names: list[str]) -> list[errors.ModelError]:
    """Errors of colliders on bones that do not exist."""
    return [errors.UnknownBone(f'swings[{index}].colliders[{number}].bone', collider.bone,
                               errors.one_of(names, collider.bone))
            for index, swing in enumerate(swings)
            for number, collider in enumerate(swing.colliders) if collider.bone not in names]


def no_collision_errors(names: list[str],
                        pairs: Sequence[Sequence[str]]) -> list[errors.ModelError]:
    """Errors of pairs of ``no_collision`` that are not two bones."""
    found: list[errors.ModelError] = []
    for index, pair in enumerate(pairs):
        where = f'no_collision[{index}]'
        found += [errors.UnknownBone(where, name, errors.one_of(names, name))
                  for name in pair if name not in names]
        if len(pair) != 2 or pair[0] == pair[1]:
            found.append(errors.WrongForm(where, list(pair), 'two bones'))
    return found


def angle_name_errors(joints: Sequence[Joint]) -> list[errors.ModelError]:
    """Errors of joints that share a name of an angle."""
    found: list[errors.ModelError] = []
    seen: set[str] = set()
    for index, joint in enumerate(joints):
        found += [errors.DuplicateName(f'joints[{index}].names', name, 'a unique name')
                  for name in joint.angle_names if name in seen]
        seen.update(joint.angle_names)
    return found


def joint_frame(joint: Joint) -> np.ndarray:
    """Orientation (4,) of a joint's frame in the doll's; of a ball joint z is the twist axis."""
    if joint.kind != 'ball':
        return np.array(rotation.IDENTITY)
    if len(joint.axes) == 2:
        twist, x = np.array(joint.axes)
        return rotation.from_matrix(np.stack([x, np.cross(twist, x), twist], axis=1))
    return rotation.shortest_arc(np.array([0.0, 0.0, 1.0]), np.array(joint.axes[0]))


def joint_axes(joint: Joint) -> np.ndarray:
    """Axes (dof, 3) of a joint's angles, doll's frame, bind pose."""
    if joint.kind == 'ball':
        return rotation.matrix(joint_frame(joint)).T
    return np.array(joint.axes).reshape(-1, 3)


def _is_ancestor(parent_of: dict[str, str], start: str, goal: str) -> bool:
    """Whether ``goal`` is ``start`` itself or one of its ancestors."""
    while start != goal and start in parent_of:
        start = parent_of[start]
    return start == goal


def _checked_moments(moments: Vector) -> Vector:
    """Principal moments that fulfil the triangle inequality; a relative excess of up to 1e-6 is
    removed.

    PyBullet takes an inertia with such an excess for zero, MuJoCo refuses it.
    """
    errors.check_positive('inertia', moments)
    others = tuple(sum(moments[:axis] + moments[axis + 1:]) for axis in range(3))
    if any(moment > most * (1 + 1e-6) for moment, most in zip(moments, others, strict=True)):
        raise errors.OutOfRange('inertia', moments, 'each at most the sum of the other two')
    return vector(map(min, moments, others))


def _rounded_limits(pair: Limits | None) -> Any:
    if pair is None:
        return None
    return tuple(math.radians(round(math.degrees(angle), 9)) for angle in pair)
