"""Swings on bones: from a scene's data to the arrays of the levels."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone
from ...model.scene import Scene
from ...model.state import State
from ...model.swing import Swing
from .links import Level, Seat
from .sphere import cross


@dataclass(frozen=True)
class Mount:
    """A swing on bone number ``bone`` of the state; root and directions in the bone's frame."""

    swing: Swing
    bone: int
    name: str
    root: np.ndarray
    """(3,) m."""
    directions: np.ndarray
    """(links, 3) unit vectors."""

    @classmethod
    def on(cls, swing: Swing, bone: Bone, index: int, name: str = '') -> Mount:
        """Mount a swing on a doll's bone."""
        back = rotation.inverse(np.array(bone.orientation))
        return cls(swing, index, name or swing.name, bone.pose.apply_inverse(swing.root),
                   rotation.rotate(back, np.array(swing.directions())))

    @property
    def names(self) -> list[str]:
        """Name of each mass: the swing's, numbered from the root where it has several."""
        count = len(self.swing.links)
        return [self.name] if count == 1 else [f'{self.name}/{i + 1}' for i in range(count)]


def mounts(scene: Scene) -> list[Mount]:
    """Mount all swings of a scene, in its order, on its bones by their number."""
    found = []
    for placement in scene.dolls:
        for swing in placement.doll.swings:
            index = scene.bone_index(scene.qualified(placement, swing.bone))
            found.append(Mount.on(swing, placement.doll.bone(swing.bone), index,
                                  scene.qualified(placement, swing.name)))
    return found


@dataclass(frozen=True)
class Roots:
    """Points of bones: n of them, each fixed in one."""

    bone: np.ndarray
    """(n,) numbers of bones."""
    place: np.ndarray
    """(3, n) m, in the bones' frames."""

    @classmethod
    def of(cls, mounted: Sequence[Mount]) -> Roots:
        """The roots of mounted swings."""
        place = np.array([mount.root for mount in mounted], float).reshape(-1, 3).T
        return cls(np.array([mount.bone for mount in mounted], int), np.ascontiguousarray(place))

    def seat(self, bones: State) -> Seat:
        """What the roots do while the bones are in this state."""
        axes = rotation.matrix(bones.orientations).transpose(2, 1, 0).reshape(9, -1)
        rows = np.concatenate([axes, bones.positions.T, bones.linear_velocities.T,
                               bones.angular_velocities.T]).take(self.bone, axis=1)
        axes, spin = rows[:9].reshape(3, 3, -1), rows[15:18]
        arm = np.einsum('jin,jn->in', axes, self.place)
        return Seat(rows[9:12] + arm, rows[12:15] + cross(spin, arm), axes, spin)


def levels(mounted: Sequence[Mount], gravity: np.ndarray) -> list[Level]:
    """The links of chains level by level; ``mounted`` has the longest chains first.

    Level i holds link i of the first so many swings that have one.
    """
    depth = len(mounted[0].swing.links) if mounted else 0
    return [_level([mount for mount in mounted if len(mount.swing.links) > index], index, gravity)
            for index in range(depth)]


def _level(mounted: Sequence[Mount], index: int, gravity: np.ndarray) -> Level:
    links = [mount.swing.links[index] for mount in mounted]
    inertia, lever = np.array([_carried(mount.swing, index) for mount in mounted]).T
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


def _carried(swing: Swing, index: int) -> tuple[float, float]:
    """Inertia (kg m^2) and static moment (kg m) of a link with all beyond it, straight."""
    distance, inertia, lever = 0.0, 0.0, 0.0
    for link in swing.links[index:]:
        distance += link.length
        inertia += link.mass * distance ** 2
        lever += link.mass * distance
    return inertia, lever
