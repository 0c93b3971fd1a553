"""Frames of the links of a scene's swings, which move the skin of hair.

A link's frame has its origin at the link's root. At rest it has the axes of the swing's bone. In
motion it is the frame of the link before it, or of the bone, turned by the smallest rotation that
takes the link's rest direction to its rod.
"""
import numpy as np

from . import rotation
from .pose import Pose
from .scene import Scene
from .swing_mount import each_link, mount_swings


class LinkFrames:
    """World poses of the frames of all m links of a scene, in the order of its masses."""

    def __init__(self, scene: Scene) -> None:
        mounted = mount_swings(scene)
        links = list(each_link(mounted))
        self._bones = np.array([mount.bone for mount, _ in links], int)
        self._numbers = np.array([number for _, number in links], int)
        # Free masses have no rods: their frames stay at rest.
        self._chained = np.array([mount.swing.mode != 'free' for mount, _ in links], bool)
        self._directions = np.array([mount.directions[number]
                                     for mount, number in links]).reshape(-1, 3)
        roots = [root for mount in mounted for root in mount.link_roots]
        self.rest = Pose(np.array(roots).reshape(-1, 3),
                         np.tile(rotation.IDENTITY, (len(links), 1)))
        """Poses (m,) at rest in the frames of the swings' bones."""

    def poses(self, bones: Pose, rods: np.ndarray | None) -> Pose:
        """Poses (..., m) from those of the scene's bones (..., n) and from both ends of each rod
        (..., m, 2, 3) m, world frame; without rods, at rest.
        """
        carriers = bones.at(self._bones)
        found = carriers.compose(self.rest)
        if rods is None:
            return found
        steps = rods[..., 1, :] - rods[..., 0, :]
        turned = carriers.orientation
        for number in range(max(self._numbers, default=-1) + 1):
            own = np.flatnonzero(self._chained & (self._numbers == number))
            base = turned[..., own - (number > 0), :]
            rest = rotation.rotate(base, self._directions[own])
            turned[..., own, :] = rotation.multiply(_shortest_arcs(rest, steps[..., own, :]), base)
        chained = self._chained[:, None]
        return Pose(np.where(chained, rods[..., 0, :], found.position),
                    np.where(chained, turned, found.orientation))


def _shortest_arcs(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) of the smallest rotations from unit vectors a (..., 3) to vectors b."""
    lengths = np.linalg.norm(b, axis=-1, keepdims=True)
    # A rod between two frames of a recording may have shrunk to a point.
    b = np.divide(b, lengths, out=a.copy(), where=lengths > 0)
    arcs = np.concatenate([np.cross(a, b), 1 + (a * b).sum(axis=-1, keepdims=True)], axis=-1)
    # Opposite directions: any half turn about an axis across them.
    half = np.linalg.norm(arcs, axis=-1) < 1e-8
    axes = np.eye(3)[np.argmin(np.abs(a[half]), axis=-1)]
    arcs[half] = np.append(np.cross(a[half], axes), np.zeros((half.sum(), 1)), axis=-1)
    return rotation.normalized(arcs)
