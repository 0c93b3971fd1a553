"""The motion of a doll from a motion capture file, whose skeleton and rest pose may differ from the
doll's.

Each body turns as its joint does since the rest pose. It starts from the bind pose, turned so that
its limb has the direction of the joint's limb in the rest pose: arms that hang in the bind pose but
are spread in the rest pose are first spread. So limbs point in the directions of the capture.
Positions are scaled by the ratio of the lengths of the legs, or of all edges if there are no legs.
"""
from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...model import errors, rotation
from ...model.forward_kinematics import BoneMotion
from ...model.ragdoll import Ragdoll
from ..bone_names.names import LEG, doll_roles
from ..gltf.nodes import TO_ROS
from ..key_track import KeyTrack
from .bvh_file import LARGEST, BvhFile, read_bvh
from .joints import joints_of_bodies

CENTIMETRE = 0.01
"""Metres per unit of a file, of a doll without edges."""

SAME_AXES = 0.05
"""By how much another choice of axes must fit better than Y up, facing +Z; a perfect fit is 1."""

SAME_DIRECTION, OTHER_DIRECTION = 1e-4, math.radians(45)
"""rad, below which a limb has the same direction in both poses, as by rounding; and above which the
trunk and the last segments are aligned too. Where the joints of these are depends on the skeleton:
ankle to toes is not ankle to centre of mass."""

TRUNK_ROLES = ('hips', 'spine', 'neck', 'head', 'clavicle')

SAME_SKELETON = 0.02
"""Of the length of an edge: by how much edges may differ so that places of all joints are followed.
Else the doll keeps its own proportions, and the distances from where it should be are those of
joints that do not turn as they should."""


@dataclass(frozen=True, eq=False)
class BvhMotion:
    """A file of motion capture as BodyMotions of a doll."""

    duration: float
    key_times: np.ndarray
    _tracks: dict[str, tuple[KeyTrack, KeyTrack]]
    """Turn since the bind pose and place of the centre of mass, m, by body."""

    def at(self, times: np.ndarray) -> dict[str, BoneMotion]:
        """Motions of the bodies at ``times`` (...), in the doll's frame."""
        motions = {}
        for body, (turns, places) in self._tracks.items():
            (turn, change), (place, velocity) = turns.at(times), places.at(times)
            spin = 2 * rotation.multiply(change, rotation.inverse(turn))[..., :3]
            motions[body] = BoneMotion(turn, place, velocity, spin)
        return motions


def read_bvh_motion(doll: Ragdoll, path: str | Path, bones: Mapping[str, str]) -> BvhMotion:
    """Read the motion of a doll from a file; ``bones`` has names of joints by body. See
    load_animations().
    """
    file = read_bvh(str(path))
    joints = joints_of_bodies(doll, file.names, [joint.parent for joint in file.joints], bones)
    return _Retargeting(doll, file, joints).motion()


@dataclass(frozen=True, eq=False)
class _Retargeting:
    """Transfers the motion of a file to a doll. ``joints`` has the index of the joint of each body
    that has one.
    """

    doll: Ragdoll
    file: BvhFile
    joints: dict[str, int]

    def motion(self) -> BvhMotion:
        """The motion of the bodies through all frames."""
        points, scale, axes = self._fitted()
        to_doll, aligned = rotation.from_matrix(axes), self._alignments(points, axes)
        worlds, times, is_same = self.file.worlds(self.joints.values()), self.file.times, (
            self._is_same(points))
        moved: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for body in (self.doll.root.name, *self._parents):
            place, turn = worlds[self.joints[body]]
            turn = rotation.multiply(rotation.multiply(to_doll, turn), rotation.multiply(
                rotation.inverse(to_doll), aligned[body]))
            place, up = scale * place @ axes.T, self._parents.get(body)
            if up is not None and not is_same:
                place = moved[up][1] + rotation.rotate(moved[up][0], np.subtract(
                    points[body], self.doll.bone(up).position))
            reach = np.subtract(self.doll.bone(body).position, points[body])
            moved[body] = turn, place + rotation.rotate(turn, reach)
            if not (largest := float(np.abs(moved[body][1]).max())) < LARGEST:
                raise errors.OutOfRange(body, largest, f'places of at most {LARGEST:g} m')
        return BvhMotion(float(times[-1]), times, {
            body: (KeyTrack.sampled(times, turn, True), KeyTrack.sampled(times, place, False))
            for body, (turn, place) in moved.items()})

    @functools.cached_property
    def _parents(self) -> dict[str, str]:
        """For each body that has a joint, except the root, the nearest body above it that
        has one.
        """
        above = {joint.child: joint.parent for joint in self.doll.joints}
        found = {}
        for body in [joint.child for joint in self.doll.joints_from_root()]:
            if body in self.joints:
                found[body] = above[body]
                while found[body] not in self.joints:
                    found[body] = above[found[body]]
        return found

    @functools.cached_property
    def _rest(self) -> dict[str, np.ndarray]:
        """Position (3,) of each body's joint in the file's rest pose, in the file's axes
        and units.
        """
        return {body: self.file.rest[joint] for body, joint in self.joints.items()}

    def _fitted(self) -> tuple[dict[str, np.ndarray], float, np.ndarray]:
        """Return the position (3,) m of each body's joint in the bind pose, the metres per unit of
        the file, and the rotation matrix from the file's axes.

        Positions are those of the doll's joints, or of the riders that carry the bodies, whichever
        give edges with lengths closer to the file's. In the first case the root's joint is placed
        so that the joints below it, those of the legs if there are any, have on average the same
        offset from it as in the file.
        """
        anchors = {joint.child: np.array(joint.anchor) for joint in self.doll.joints}
        points = {body: anchors.get(body, np.array(self.doll.bone(body).position))
                  for body in self.joints}
        carriers = {}
        for rider in self.doll.riders:
            if rider.bone in self.joints and (rider.name == rider.bone
                                              or rider.bone not in carriers):
                place = np.array(rider.position)
                carriers[rider.bone] = self.doll.bone(rider.bone).pose.apply(place)
        if carriers.keys() == points.keys() and self._misfit(carriers) < self._misfit(points):
            return carriers, self._scale(carriers), self._axes(carriers)
        scale, axes, root = self._scale(points), self._axes(points), self.doll.root.name
        below = self._of_legs([body for body, up in self._parents.items() if up == root])
        if below:
            points[root] = np.mean([points[body] - scale * axes @ (self._rest[body]
                                                                   - self._rest[root])
                                    for body in below], axis=0)
        return points, scale, axes

    @functools.cached_property
    def _roles(self) -> dict[str, str | None]:
        names = [bone.name for bone in self.doll.bones]
        return dict(zip(names, doll_roles(self.doll), strict=True))

    def _of_legs(self, bodies: list[str]) -> list[str]:
        """The bodies of legs among these, or all if there are none."""
        return [body for body in bodies if self._roles[body] in LEG] or bodies

    def _lengths(self, points: Mapping[str, np.ndarray],
                 bodies: list[str]) -> tuple[np.ndarray, np.ndarray]:
        """Lengths (e,) of the edges above bodies: of the doll, m, and of the file."""
        ours, theirs = (np.array([np.linalg.norm(each[body] - each[self._parents[body]])
                                  for body in bodies]) for each in (points, self._rest))
        return ours, theirs

    def _edges(self) -> list[str]:
        """Return the bodies whose edge to the body above is compared. Edges from the root are left
        out, unless there are no others, as a root's joint may be anywhere in it.
        """
        inner = [body for body, up in self._parents.items() if up != self.doll.root.name]
        return inner or list(self._parents)

    def _scale(self, points: Mapping[str, np.ndarray]) -> float:
        """Metres per unit of the file: the ratio of the lengths of legs, or of all edges."""
        ours, theirs = self._lengths(points, self._of_legs(self._edges()))
        return float(ours.sum() / theirs.sum()) if theirs.sum() > 0 < ours.sum() else CENTIMETRE

    def _misfit(self, points: Mapping[str, np.ndarray]) -> float:
        """Sum of the squared differences of lengths, m^2."""
        ours, theirs = self._lengths(points, self._edges())
        return float(np.sum((ours - self._scale(points) * theirs) ** 2))

    def _is_same(self, points: Mapping[str, np.ndarray]) -> bool:
        """Whether the edges of the file have the lengths of the doll's."""
        ours, theirs = self._lengths(points, self._edges())
        return bool((abs(ours - self._scale(points) * theirs) <= SAME_SKELETON * ours + 1e-9).all())

    def _axes(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the rotation matrix from the file's axes to the doll's. Y up, facing +Z is
        assumed, unless another direction by quarter turns about the vertical, or Z up, fits the
        bind pose clearly better.
        """
        ours, theirs = (np.array([each[body] for body in self.joints])
                        for each in (points, self._rest))
        ours, theirs = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
        size = np.linalg.norm(ours) * np.linalg.norm(theirs) or 1.0
        quarters = [np.round(rotation.matrix(rotation.from_axis_angle((0, 0, 1), np.pi / 2 * k)))
                    for k in range(4)]
        choices = [quarter @ up for up in (TO_ROS, np.eye(3)) for quarter in quarters]
        fits = [float(np.sum(ours * (theirs @ each.T)) / size) for each in choices]
        best = int(np.argmax(fits))
        return choices[best] if fits[best] > fits[0] + SAME_AXES else choices[0]

    def _alignments(self, points: Mapping[str, np.ndarray],
                    axes: np.ndarray) -> dict[str, np.ndarray]:
        """Return the rotation (4,) that turns each body from the bind pose so that its limb has the
        direction that it has in the rest pose.

        A limb's direction is from its joint to the mean of the joints below it, of a last segment
        to its end. The trunk and last segments are turned only beyond OTHER_DIRECTION. The root is
        assumed upright in both poses.
        """
        found = {self.doll.root.name: np.array(rotation.IDENTITY)}
        for body, parent in self._parents.items():
            below = [each for each, up in self._parents.items() if up == body]
            if below:
                ours, theirs = (np.mean([each[other] for other in below], axis=0) - each[body]
                                for each in (points, self._rest))
            else:
                ours = np.subtract(self.doll.bone(body).position, points[body])
                theirs = self._end(self.joints[body])
            is_limb = below and self._roles[body] not in TRUNK_ROLES
            found[body] = _aligned(found[parent], ours, axes @ theirs,
                                   SAME_DIRECTION if is_limb else OTHER_DIRECTION)
        return found

    def _end(self, joint: int) -> np.ndarray:
        """Return the vector (3,) from a joint to the mean of the joints below it, else to its End
        Site, else zero.
        """
        below = [each.offset for each in self.file.joints if each.parent == joint]
        tip = self.file.joints[joint].tip
        return np.mean(below, axis=0) if below else np.zeros(3) if tip is None else tip


def _aligned(turn: np.ndarray, ours: np.ndarray, theirs: np.ndarray, least: float) -> np.ndarray:
    """Return the rotation ``turn`` (4,), followed by the shortest rotation from the turned ``ours``
    (3,) to the direction of ``theirs`` (3,) if that exceeds ``least`` rad.
    """
    if min(np.linalg.norm(ours), np.linalg.norm(theirs)) < 1e-9:
        return turn
    arc = rotation.shortest_arc(rotation.rotate(turn, ours), theirs)
    if np.linalg.norm(rotation.rotation_vector(arc)) <= least:
        return turn
    return rotation.multiply(arc, turn)
