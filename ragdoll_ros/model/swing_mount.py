"""Swings mounted on bones: roots and directions in the bones' frames."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from . import rotation
from .ragdoll import Bone
from .scene import Scene
from .swing import Swing


@dataclass(frozen=True)
class MountedCollider:
    """A collider on the bone of index ``bone``; both ends of its axis (2, 3) m in the
    bone's frame.
    """

    bone: int
    axis: np.ndarray
    radius: float


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
    colliders: tuple[MountedCollider, ...] = ()

    @classmethod
    def on(cls, swing: Swing, bone: Bone, index: int, name: str = '') -> SwingMount:
        """Mount a swing, without its colliders, on a doll's bone that has this index in
        the state.
        """
        back = rotation.inverse(np.array(bone.orientation))
        return cls(swing, index, name or swing.name, bone.pose.apply_inverse(swing.root),
                   rotation.rotate(back, np.array(swing.directions())))

    @property
    def link_roots(self) -> np.ndarray:
        """Root (links, 3) m of each link at rest, in the bone's frame."""
        lengths = np.array([link.length for link in self.swing.links])
        steps = self.directions * lengths[:, None]
        return self.root + np.cumsum(steps, axis=0) - steps

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
            mount = SwingMount.on(swing, placement.doll.bone(swing.bone), index,
                                  scene.qualified(placement, swing.name))
            colliders = tuple(MountedCollider(
                scene.bone_index(scene.qualified(placement, collider.bone)),
                placement.doll.bone(collider.bone).pose.apply_inverse(
                    np.array([collider.at, collider.to or collider.at])), collider.radius)
                for collider in swing.colliders)
            found.append(replace(mount, colliders=colliders))
    return found


def bones_of(mount: SwingMount) -> list[int]:
    """Indices of the bones that a swing and its colliders are on."""
    return [mount.bone, *(collider.bone for collider in mount.colliders)]


def each_link(mounted: Sequence[SwingMount]) -> Iterator[tuple[SwingMount, int]]:
    """Swing and index of each link, in the scene's order."""
    return ((mount, index) for mount in mounted for index in range(len(mount.swing.links)))
