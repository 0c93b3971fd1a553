"""StaticGeoms: the geoms of a scene's static bodies, and which of them bones may touch soon."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....model import rotation
from ....model.mesh import Hull, Surface
from ....model.plane import Plane
from ....model.pose import Pose
from ....model.scene import Scene
from ....model.scene_change import SceneChange
from ....model.shapes import Part, support_distance
from ....model.static_body import StaticBody
from ...kernels.collision.shapes import HULL, PLANE, SHAPE_KIND
from ...kernels.dynamics.body import WORLD
from ...kernels.loaded import aabb_tree
from ...kernels.system import GEOM
from .build_system import GROUND_POINTS, bounding_radius, geom_size
from .hull_tables import NO_HULLS, HullTables, hull_geom, hull_tables, join_hulls
from .triangle_geoms import triangle_geoms

LOOK_AHEAD = 0.1
"""s: what a bone may touch within this time is given to its cluster, when it has to be made anew;
then it is made anew less often."""

POINT_COUNTS = np.array([*(GROUND_POINTS[name] for name in sorted(SHAPE_KIND, key=SHAPE_KIND.get)),
                         0, 0, 0])
"""Points that may touch the ground or a plane, by the kind of shape: none of triangles and planes;
a hull has a number of its own."""

NO_KEYS = np.zeros(0, np.int64)


class StaticGeoms:
    """The g static geoms of a scene, and which of them each bone may touch. The pairs of a doll are
    found independently of other dolls, so that the last digits of its results do not depend on
    them.

    A pair of a bone and a geom has the key bone * g + geom.
    """

    def __init__(self, scene: Scene, reach: np.ndarray) -> None:
        parts = [(index, part) for index, body in enumerate(scene.bodies) for part in body.parts]
        surfaces = [(index, body.shape, body.pose) for index, body in enumerate(scene.bodies)
                    if isinstance(body.shape, Surface) and not isinstance(body.shape, Hull)]
        hulls = [(index, body.shape, body.pose) for index, body in enumerate(scene.bodies)
                 if isinstance(body.shape, Hull)]
        hulls += [(index, part.shape, part.pose) for index, part in parts
                  if isinstance(part.shape, Hull)]
        parts = [(index, part) for index, part in parts if not isinstance(part.shape, Hull)]
        planes = [(index, body) for index, body in enumerate(scene.bodies)
                  if isinstance(body.shape, Plane)]
        own = [_primitive_geoms([part for _, part in parts]),
               _hull_geoms([(shape, pose) for _, shape, pose in hulls]),
               *(triangle_geoms(shape.triangles, pose) for _, shape, pose in surfaces)]
        self._hulls = [hull_tables(shape) for _, shape, _ in hulls]
        self.geoms = np.concatenate([*(geoms for geoms, _, _ in own),
                                     _plane_geoms([body for _, body in planes])])
        """(g,): of primitive shapes, then hulls, then triangles of surfaces, then planes."""
        self.bodies = np.concatenate([np.array(
            [index for index, *_ in (*parts, *hulls)], np.int64), *(
            np.full(len(geoms), index) for (index, _, _), (geoms, _, _) in zip(
                surfaces, own[2:], strict=True)),
            np.array([index for index, _ in planes], np.int64)])
        """(g,): index of each geom's body in the scene's bodies."""
        laws = np.array([scene.material.on(body) for body in scene.bodies]).reshape(-1, 3)
        self.laws = laws[self.bodies]
        """(g, 3): friction, rolling friction, m, and restitution of each geom."""
        self._tree = aabb_tree.make_aabb_tree(
            *(np.concatenate([box[side] for _, *box in own]) for side in range(2))
        ) if len(self.geoms) > len(planes) else None
        self._normals = np.array([body.normal for _, body in planes]).reshape(-1, 3)
        self._offsets = np.array([np.dot(body.normal, body.position) for _, body in planes])
        self._reach = np.ascontiguousarray(reach)
        self._doll_of_bone = scene.doll_of_bone
        self._first_keys = len(self.geoms) * np.array(
            [*(own.start for own in scene.bone_slices), len(scene.bones)])
        self._found = np.zeros(4 * len(scene.bones), np.int64)
        self._keys = NO_KEYS

    def update(self, states: np.ndarray, duration: float, moving: np.ndarray) -> bool:
        """Find the pairs of ``moving`` dolls (d,) that may touch within ``duration`` s. If a doll
        has one that is not known, find its pairs anew, for LOOK_AHEAD at least. Returns whether the
        known pairs have changed. ``states`` (n, 13) of all bones.
        """
        if not len(self.geoms):
            return False
        near = self._find(states, duration, moving)
        place = np.searchsorted(self._keys, near)
        known = np.take(self._keys, place, mode='clip') == near if len(self._keys) else np.zeros(
            len(near), bool)
        if known.all():
            return False
        changed = np.zeros(len(moving), bool)
        changed[self._dolls_of(near[~known])] = True
        kept = self._keys[~changed[self._dolls_of(self._keys)]]
        self._keys = np.sort(np.concatenate([
            kept, self._find(states, max(duration, LOOK_AHEAD), changed)]))
        return True

    def keys_of(self, dolls: np.ndarray) -> np.ndarray:
        """Keys (k,) of the known pairs of ``dolls``, which are indices in ascending order."""
        if not len(self._keys):
            return NO_KEYS
        begin, end = (np.searchsorted(self._keys, self._first_keys[dolls + after])
                      for after in (0, 1))
        return np.concatenate([self._keys[i:j] for i, j in zip(begin, end, strict=True)])

    def bones_and_geoms(self, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The bones and the geoms (k,) of pairs."""
        return np.divmod(keys, max(1, len(self.geoms)))

    def pair_counts(self, moving: np.ndarray, geoms: np.ndarray) -> np.ndarray:
        """Numbers (k,) of GEOM_PAIR records for pairs of a moving and a static geom: one each, but
        with a plane one for each point that may touch it. ``moving`` (k,): kinds and point counts
        of the moving ones; ``geoms`` (k,): indices of the static ones.
        """
        kinds, static = moving['kind'], self.geoms['kind'][geoms]
        points = np.where(kinds == HULL, moving['point_count'], POINT_COUNTS[kinds])
        return np.where(static == PLANE, points, 1)

    def take(self, indices: np.ndarray) -> tuple[np.ndarray, HullTables]:
        """GEOM (k,) of ``indices``, and their hulls."""
        geoms = self.geoms[indices]
        of_hulls = np.flatnonzero(geoms['kind'] == HULL)
        tables = join_hulls([NO_HULLS, *(self._hulls[k] for k in geoms['hull'][of_hulls])])
        geoms['hull'][of_hulls] = np.arange(len(of_hulls))
        return geoms, tables

    def clear(self) -> None:
        """Forget all pairs."""
        self._keys = NO_KEYS

    def continue_from(self, other: StaticGeoms, change: SceneChange, known: np.ndarray) -> None:
        """Take from ``other`` the pairs of those dolls for which ``known`` (d,) is true; all of
        these stay.
        """
        self._keys = self.moved_keys(other._keys[known[other._dolls_of(other._keys)]], change)

    def moved_keys(self, keys: np.ndarray, change: SceneChange) -> np.ndarray:
        """Keys (k,) in the scene after a change of ``keys`` of the scene before, all of bones that
        stay.
        """
        if not len(keys):
            return NO_KEYS
        bones, geoms = self.bones_and_geoms(keys)
        return change.new_bones[bones] * len(self.geoms) + geoms

    def save(self) -> np.ndarray:
        """A snapshot of the known pairs."""
        return self._keys

    def restore(self, keys: np.ndarray) -> None:
        """Restore a snapshot."""
        self._keys = keys

    def _dolls_of(self, keys: np.ndarray) -> np.ndarray:
        """The doll (k,) of each pair."""
        return self._doll_of_bone[keys // max(1, len(self.geoms))]

    def _find(self, states: np.ndarray, ahead: float, moving: np.ndarray) -> np.ndarray:
        """Pairs (k,) that may touch within ``ahead`` s, of ``moving`` dolls (d,), sorted."""
        chosen = moving[self._doll_of_bone]
        if self._tree is None:
            return self._near_planes(states, ahead, chosen)
        count = aabb_tree.find_near(self._tree, states, self._reach, chosen, ahead, self._found)
        if count > len(self._found):
            self._found = np.zeros(2 * count, np.int64)
            return self._find(states, ahead, moving)
        if not len(self._offsets):
            return np.sort(self._found[:count])
        # The tree knows of the geoms before the planes alone.
        bones, geoms = np.divmod(self._found[:count], len(self.geoms) - len(self._offsets))
        return np.sort(np.concatenate([bones * len(self.geoms) + geoms,
                                       self._near_planes(states, ahead, chosen)]))

    def _near_planes(self, states: np.ndarray, ahead: float, chosen: np.ndarray) -> np.ndarray:
        """Pairs (k,), sorted, of ``chosen`` bones (n,) with planes, as _find()."""
        speed = (np.linalg.norm(states[:, 7:10], axis=1)
                 + self._reach * np.linalg.norm(states[:, 10:13], axis=1))
        radius = self._reach + aabb_tree.MARGIN + aabb_tree.IMPACT_SPEEDUP * ahead * speed
        height = states[:, :3] @ self._normals.T - self._offsets
        bones, planes = np.nonzero(chosen[:, None] & (height <= radius[:, None]))
        return bones * len(self.geoms) + len(self.geoms) - len(self._offsets) + planes


def _plane_geoms(bodies: Sequence[StaticBody]) -> np.ndarray:
    """GEOM (p,) of planes."""
    geoms = np.zeros(len(bodies), GEOM)
    for geom, body in zip(geoms, bodies, strict=True):
        geom['body'], geom['kind'] = WORLD, PLANE
        geom['position'], geom['orientation'] = body.position, body.orientation
    return geoms


Geoms = tuple[np.ndarray, np.ndarray, np.ndarray]
"""GEOM (g,), and the lower and the upper corners (g, 3) m of their bounding boxes."""


def _hull_geoms(hulls: Sequence[tuple[Hull, Pose]]) -> Geoms:
    """Geoms of hulls at their poses in the world."""
    geoms = np.zeros(len(hulls), GEOM)
    lower, upper = np.zeros((2, len(hulls), 3))
    for k, (hull, pose) in enumerate(hulls):
        geoms[k] = hull_geom(hull, pose)[0]
        vertices = pose.apply(hull.vertices)
        lower[k], upper[k] = vertices.min(axis=0), vertices.max(axis=0)
    geoms['body'], geoms['hull'], geoms['reach'] = WORLD, np.arange(len(hulls)), 0.0
    return geoms, lower, upper


def _primitive_geoms(parts: Sequence[Part]) -> Geoms:
    """Geoms of primitive shapes at their poses in the world."""
    geoms = np.zeros(len(parts), GEOM)
    for geom, part in zip(geoms, parts, strict=True):
        geom['body'], geom['kind'] = WORLD, SHAPE_KIND[part.kind]
        geom['size'] = geom_size(part.shape)
        geom['position'], geom['orientation'] = part.position, part.orientation
        geom['bounding_radius'] = bounding_radius(part.shape)
    if not parts:
        return geoms, np.zeros((0, 3)), np.zeros((0, 3))
    terms = np.array([part.shape.support_terms for part in parts])
    # Row i of a rotation matrix is the world's axis i in the part's frame.
    half = support_distance(terms[:, None], rotation.matrix(geoms['orientation']))
    return geoms, geoms['position'] - half, geoms['position'] + half
