"""Swings on bones, and the arrays for their integration."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone
from ...model.scene import Scene
from ...model.state import State
from ...model.swing import Swing
from .links import BaseFrames, Level
from .sphere import cross


@dataclass(frozen=True)
class SwingMount:
    """A swing on the bone of index ``bone``; root and directions in the bone's frame."""

    swing: Swing
    bone: int
    name: str
    root: np.ndarray
    """(3,) m."""
    directions: np.ndarray
    """(links, 3) unit vectors."""

    @classmethod
    def on(cls, swing: Swing, bone: Bone, index: int, name: str = '') -> SwingMount:
        """Mount a swing on a doll's bone with this index in the state."""
        back = rotation.inverse(np.array(bone.orientation))
        return cls(swing, index, name or swing.name, bone.pose.apply_inverse(swing.root),
                   rotation.rotate(back, np.array(swing.directions())))

    @property
    def names(self) -> list[str]:
        """Names of the masses: the swing's, with a number from the root on if there are several."""
        count = len(self.swing.links)
        return [self.name] if count == 1 else [f'{self.name}/{i + 1}' for i in range(count)]


def mount_swings(scene: Scene) -> list[SwingMount]:
    """Mount all swings of a scene, in its order."""
    found = []
    for placement in scene.dolls:
        for swing in placement.doll.swings:
            index = scene.bone_index(scene.qualified(placement, swing.bone))
            found.append(SwingMount.on(swing, placement.doll.bone(swing.bone), index,
                                       scene.qualified(placement, swing.name)))
    return found


@dataclass(frozen=True)
class Roots:
    """The attachment points of n swings."""

    bone: np.ndarray
    """(n,) bone indices."""
    positions: np.ndarray
    """(3, n) m, in the bones' frames."""

    @classmethod
    def of(cls, mounted: Sequence[SwingMount]) -> Roots:
        """Collect the roots of mounted swings."""
        points = np.array([mount.root for mount in mounted], float).reshape(-1, 3).T
        return cls(np.array([mount.bone for mount in mounted], int), np.ascontiguousarray(points))

    def frames(self, bones: State) -> BaseFrames:
        """Frames at the roots for this state of the bones."""
        axes = rotation.matrix(bones.orientations).transpose(2, 1, 0).reshape(9, -1)
        rows = np.concatenate([axes, bones.positions.T, bones.linear_velocities.T,
                               bones.angular_velocities.T]).take(self.bone, axis=1)
        axes, spin = rows[:9].reshape(3, 3, -1), rows[15:18]
        arm = np.einsum('jin,jn->in', axes, self.positions)
        return BaseFrames(rows[9:12] + arm, rows[12:15] + cross(spin, arm), axes, spin)


def levels(mounted: Sequence[SwingMount], gravity: np.ndarray) -> list[Level]:
    """Group the links of all chains by their distance from the bone.

    ``mounted`` has the longest chains first: level i has link i of the first swings of the list.
    """
    depth = len(mounted[0].swing.links) if mounted else 0
    return [_level([mount for mount in mounted if len(mount.swing.links) > index], index, gravity)
            for index in range(depth)]


def _level(mounted: Sequence[SwingMount], index: int, gravity: np.ndarray) -> Level:
    links = [mount.swing.links[index] for mount in mounted]
    inertia, lever = np.array([_straight_chain(mount.swing, index) for mount in mounted]).T
    share = np.array([mount.swing.gravity for mount in mounted])
    reach = inertia / lever
    stiffness = np.array([link.stiffness for link in links]) / inertia
    weight = np.abs(share) * np.linalg.norm(gravity) / reach
    ratio = np.array([link.damping for link in links])
    return Level(
        rest=np.ascontiguousarray(np.array([m.directions[index] for m in mounted]).T),
        length=np.array([link.length for link in links]), reach=reach, inertia=inertia,
        stiffness=stiffness, damping=2 * ratio * np.sqrt(stiffness + weight),
        gravity=np.outer(gravity, share))


def _straight_chain(swing: Swing, index: int) -> tuple[float, float]:
    """Moment of inertia (kg m^2) and first moment (kg m) about the root of link ``index``, of it
    and all links beyond, the chain straight.
    """
    distance, inertia, lever = 0.0, 0.0, 0.0
    for link in swing.links[index:]:
        distance += link.length
        inertia += link.mass * distance ** 2
        lever += link.mass * distance
    return inertia, lever
