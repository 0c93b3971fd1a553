"""Robot: links that driven bodies stand for, on a tree of joints that are told how to move."""
from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .pose import Pose
from .rotation import IDENTITY
from .vectors import Quaternion, Vector, finite_floats, unit_vector, vector

ROBOT_JOINTS = ('revolute', 'continuous', 'prismatic', 'fixed')
"""Kinds of joints. A continuous one has the same pose after each turn."""

Mimic = tuple[str, float, float]
"""Name of a joint, multiplier and offset: the value is multiplier * that joint's + offset."""


Row = tuple[float, float, float, float, float, float, float]
"""Position, m, and quaternion x, y, z, w."""


@dataclass(frozen=True)
class RobotJoint:
    """A joint of a robot. Its value is an angle, rad, right-handed about the axis, or a
    displacement along it, m.

    Args:
        name: unique in its robot.
        kind: one of ROBOT_JOINTS.
        parent, child: names of links.
        position, orientation: (3,) m and quaternion x, y, z, w: the child's frame in the parent's
            at zero.
        axis: (3,), in the child's frame; normalised.
        start: value at the start, rad or m.
        mimic: None, or the Mimic of a joint that itself mimics none.

    Raises:
        WrongForm, NotFinite, NotUnit: for its fields.
    """

    name: str
    kind: str
    parent: str
    child: str
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY
    axis: Vector = (1.0, 0.0, 0.0)
    start: float = 0.0
    mimic: Mimic | None = None

    def __post_init__(self) -> None:
        if self.kind not in ROBOT_JOINTS:
            raise errors.WrongForm('kind', self.kind, 'one of ' + ', '.join(ROBOT_JOINTS))
        set_fields(self, position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation,
                                           'a quaternion x, y, z, w, not zero', 4),
                   axis=unit_vector('axis', self.axis), start=float(self.start))
        errors.check_finite('start', self.start)
        if self.mimic is not None:
            leader, *numbers = self.mimic
            set_fields(self, mimic=(leader, *finite_floats('mimic', numbers, 2)))


@dataclass(frozen=True)
class Robot:
    """Links of a scene that Simulation.drive_body() moves together, by the values of joints.

    Args:
        name: unique among robots, dolls and bodies of the scene.
        joints: RobotJoint objects of a tree; a link that is no child has the robot's frame.
        links: names of placements of the scene, by the names of the links that they stand for: each
            of one bone, whose frame is the link's, and which follows exactly.
        position, orientation: pose of the robot's frame at the start, world frame: (3,) m, and
            quaternion x, y, z, w.

    Raises:
        DuplicateName, ConnectedTwice, JointCycle, UnknownJoint, WrongForm, NotFinite, NotUnit: for
            its fields.
    """

    name: str
    joints: tuple[RobotJoint, ...]
    links: Mapping[str, str] = field(hash=False)
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY

    def __post_init__(self) -> None:
        set_fields(self, joints=tuple(self.joints), links=dict(self.links),
                   position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation,
                                           'a quaternion x, y, z, w, not zero', 4))
        if not self.links:
            raise errors.WrongForm('links', self.links, 'at least one link')
        self._check_joints()

    @property
    def pose(self) -> Pose:
        """Pose of its frame at the start, world frame."""
        return Pose(np.array(self.position), np.array(self.orientation))

    @cached_property
    def driven(self) -> tuple[RobotJoint, ...]:
        """The k joints that move by themselves, in the order of all arrays of values."""
        return tuple(joint for joint in self.joints if joint.kind != 'fixed' and not joint.mimic)

    @cached_property
    def indices(self) -> dict[str, int]:
        """Index of each driven joint, by name."""
        return {joint.name: index for index, joint in enumerate(self.driven)}

    @cached_property
    def mimics(self) -> frozenset[str]:
        """Names of the joints that mimic another one."""
        return frozenset(joint.name for joint in self.joints if joint.mimic)

    @property
    def start(self) -> np.ndarray:
        """(k,) values of the driven joints at the start, rad or m."""
        return np.array([joint.start for joint in self.driven], float)

    def link_poses(self, frame: Pose, values: np.ndarray) -> Pose:
        """Poses (n,) of ``links``, in their order, world frame.

        Args:
            frame: of the robot, world frame.
            values: (k,) of the driven joints, rad or m.
        """
        rows = np.array(self.link_rows((*frame.position, *frame.orientation), values))
        return Pose(rows[:, :3], rows[:, 3:])

    def link_rows(self, frame: Sequence[float], values: Sequence[float]) -> list[Row]:
        """As link_poses(): position and quaternion x, y, z, w of the robot's frame, and n such."""
        # Numbers, not arrays: a robot has few links, which hang on each other.
        placed: list[Row] = [tuple(map(float, frame))]
        values = [*map(float, values), 0.0]
        for joint in self._tree.joints:
            value = joint.multiplier * values[joint.leader] + joint.offset
            x, y, z = joint.position
            a, b, c, d = joint.orientation
            if joint.slides:
                x, y, z = (at + value * along for at, along in zip((x, y, z), joint.axis,
                                                                   strict=True))
            else:
                sine, cosine = math.sin(value / 2), math.cos(value / 2)
                i, j, k, r = joint.half_turn
                a, b, c, d = (cosine * a + sine * i, cosine * b + sine * j,
                              cosine * c + sine * k, cosine * d + sine * r)
            px, py, pz, e, f, g, h = placed[joint.parent]
            # v + h u + q x u, u = 2 q x v.
            u, v, w = 2 * (f * z - g * y), 2 * (g * x - e * z), 2 * (e * y - f * x)
            placed.append((px + x + h * u + f * w - g * v, py + y + h * v + g * u - e * w,
                           pz + z + h * w + e * v - f * u,
                           h * a + e * d + f * c - g * b, h * b - e * c + f * d + g * a,
                           h * c + e * b - f * a + g * d, h * d - e * a - f * b - g * c))
        return [placed[link] for link in self._tree.links]

    def _check_joints(self) -> None:
        names: set[str] = set()
        parents: dict[str, str] = {}
        for index, joint in enumerate(self.joints):
            if joint.name in names:
                raise errors.DuplicateName(f'joints[{index}].name', joint.name, 'a unique name')
            if joint.child in parents:
                raise errors.ConnectedTwice(f'joints[{index}].child', joint.child,
                                            'a link without another parent')
            above = joint.parent
            while above != joint.child and above in parents:
                above = parents[above]
            if above == joint.child:
                raise errors.JointCycle(f'joints[{index}]', joint.name, 'joints that form no loop')
            names.add(joint.name)
            parents[joint.child] = joint.parent
        for index, joint in enumerate(self.joints):
            if joint.mimic and joint.mimic[0] not in self.indices:
                raise errors.UnknownJoint(f'joints[{index}].mimic', joint.mimic[0],
                                          errors.one_of(list(self.indices), joint.mimic[0]))

    @cached_property
    def _tree(self) -> _Tree:
        return _Tree(self)


class _TreeJoint(NamedTuple):
    """A joint as forward kinematics sees it; vectors in the parent's frame."""

    parent: int
    """0: the robot's frame; i + 1: that of the child of joint i."""
    leader: int
    """Index of the driven joint that it follows; k: none."""
    multiplier: float
    offset: float
    slides: bool
    position: Vector
    orientation: Quaternion
    half_turn: Quaternion
    """Orientation after half a turn."""
    axis: Vector


class _Tree:
    """Those joints of a robot that its links hang on, parents first."""

    def __init__(self, robot: Robot) -> None:
        above = {joint.child: joint for joint in robot.joints}
        place: dict[str, int] = {}
        """Of each link, as in ``links``."""
        self.joints: list[_TreeJoint] = []
        for link in robot.links:
            path: list[RobotJoint] = []
            while link in above and link not in place:
                path.append(above[link])
                link = above[link].parent
            for joint in reversed(path):
                self.joints.append(_tree_joint(robot, joint, place.get(joint.parent, 0)))
                place[joint.child] = len(self.joints)
        self.links = [place.get(link, 0) for link in robot.links]
        """(n,) 0: the robot's frame; i + 1: that of the child of joint i."""


def _tree_joint(robot: Robot, joint: RobotJoint, parent: int) -> _TreeJoint:
    leader, multiplier, offset = joint.mimic or (joint.name, 1.0, 0.0)
    if joint.kind == 'fixed':
        leader, offset = '', 0.0
    half_turn = rotation.multiply(joint.orientation, (*joint.axis, 0.0))
    return _TreeJoint(parent, robot.indices.get(leader, len(robot.driven)), multiplier, offset,
                      joint.kind == 'prismatic', joint.position, joint.orientation,
                      tuple(half_turn.tolist()),
                      vector(rotation.rotate(joint.orientation, joint.axis)))
