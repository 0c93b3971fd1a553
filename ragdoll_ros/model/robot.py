"""Robot: driven bodies as the links of a tree of joints, which move by given joint values."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from . import errors
from .errors import set_fields
from .pose import Pose
from .rotation import IDENTITY
from .vectors import Quaternion, Vector, finite_floats, unit_vector

ROBOT_JOINTS = ('revolute', 'continuous', 'prismatic', 'fixed')
"""Kinds of joints. A continuous one has the same pose after each turn."""

Mimic = tuple[str, float, float]
"""Name of a joint, multiplier and offset: the value is multiplier * that joint's + offset."""


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
        """The k joints that are neither fixed nor mimic another one, in the order of all arrays of
        values.
        """
        return tuple(joint for joint in self.joints if joint.kind != 'fixed' and not joint.mimic)

    @cached_property
    def indices(self) -> dict[str, int]:
        """Index of each driven joint, by name."""
        return {joint.name: index for index, joint in enumerate(self.driven)}

    @cached_property
    def mimics(self) -> frozenset[str]:
        """Names of the joints that mimic another one."""
        return frozenset(joint.name for joint in self.joints if joint.mimic)

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
