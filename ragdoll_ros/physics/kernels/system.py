"""System: the constants of a scene, or of some of its dolls, that compiled code reads."""
from __future__ import annotations

import collections

import numpy as np

from .compiling.bundle import bundle_at, bundle_type
from .dynamics.body import BODY

GEOM = np.dtype([
    ('body', np.int64), ('kind', np.int64), ('size', float, 3), ('position', float, 3),
    ('orientation', float, 4), ('bounding_radius', float), ('reach', float), ('friction', float),
    ('rolling_friction', float), ('restitution', float), ('first_point', np.int64),
    ('point_count', np.int64), ('edges', float, 3), ('hull', np.int64)], align=True)
"""A convex shape of a body, or of the WORLD. ``kind`` and ``size``: see collision/shapes.py.
``position``, m, and ``orientation``: of the shape's center and axes from the body's center of mass,
along the doll's axes in the bind pose; of static ones in the world. ``bounding_radius``: of the
sphere around it; ``reach``: from the body's center of mass to its farthest point, m. ``friction``,
``rolling_friction`` (m) and ``restitution``: against the ground. ``first_point``, ``point_count``:
its own among all points that may touch the ground. ``edges``: of a triangle, see
collision/triangles/triangle.py. ``hull``: index of a hull in System.hulls."""

GEOM_PAIR = np.dtype([
    ('a', np.int64), ('b', np.int64), ('friction', float), ('rolling_friction', float),
    ('restitution', float), ('point', np.int64)], align=True)
"""Two geoms that may collide, and the parameters of their contact; a static one is ``b``. With a
plane there is a pair for each ``point`` of ``a`` that may touch it, one after the other, as each
has a gap of its own; see ground_point() of contact/gaps.py."""

HULL_TABLE = np.dtype([
    ('first_vertex', np.int64), ('vertex_count', np.int64), ('first_face', np.int64),
    ('face_count', np.int64), ('triangle_count', np.int64), ('first_edge', np.int64),
    ('edge_count', np.int64), ('first_index', np.int64), ('extremes', np.int64, 6),
    ('size', float)], align=True)
"""A convex hull: where its vertices are in System.hull_vertices; where its triangles are in
System.hull_faces, first one of each face, then those that lie in the planes of these; where its
edges are in System.hull_edges; which of its vertices are farthest along x, -x, y, -y, z, -z; and
its radius about its centroid, m."""

HULL_VERTEX = np.dtype([('point', float, 3), ('first_neighbor', np.int64),
                        ('neighbor_count', np.int64)], align=True)
"""A vertex of a hull, m, in its geom's frame, whose origin is its centroid; and where the other
ends of its edges are in System.hull_indices, counted from the hull's ``first_index``. These are
indices of vertices, counted from the hull's first, as are corners."""

HULL_FACE = np.dtype([('normal', float, 3), ('offset', float), ('corners', np.int64, 3),
                      ('first_corner', np.int64), ('corner_count', np.int64)], align=True)
"""A triangle of a hull: unit normal n, outwards, and offset d, m, of its plane n x = d, equal for
all triangles of a flat face; its corners, anticlockwise. Of the first of a face: where the corners
of the face are in System.hull_indices, anticlockwise."""

HULL_EDGE = np.dtype([('corners', np.int64, 2), ('inward', float, (2, 3))], align=True)
"""An edge between two faces of a hull: its corners as those of HULL_FACE, and the unit vectors
perpendicular to it in both faces, inwards."""

JOINT_LIMIT = np.dtype([('q', np.int64), ('dof', np.int64), ('lower', float), ('upper', float)],
                       align=True)
"""A limited joint coordinate: its index in q, its degree of freedom, and its limits, rad."""

MAX_MANIFOLD_POINTS = 8
"""Contact points that are kept of one pair."""

CONTACT_POINT = np.dtype([('point', float, 3), ('normal', float, 3), ('gap', float),
                          ('feature_id', np.int64)], align=True)
"""A point midway between the surfaces, m, and the unit normal from b to a, both world; the ``gap``
along it, m, negative if the shapes overlap; an id that points of the same features keep."""

System = collections.namedtuple(
    'System', 'tree gravity dof_parent dof_body dof_damping body_last_dof body_root body_doll '
    'geoms pairs joint_limits ground_normal ground_offset restitution_speed doll_masses '
    'energy_scale flight_enabled hull_vertices hull_faces hull_edges '
    'hull_indices hulls')
"""A scene of n bodies, nv degrees of freedom and d dolls. ``tree`` (n,): the kinematic trees, see
dynamics/body.py. ``gravity`` (3,) m/s^2. ``dof_parent`` (nv,): the next degree of freedom towards
the root, -1 at its end; ``dof_body`` (nv,); ``dof_damping`` (nv,) N m s/rad. ``body_last_dof``
(n,): the last degree of freedom that moves a body; ``body_root`` (n,): the record of its doll's
root; ``body_doll`` (n,). ``geoms``, static ones last; ``pairs`` (of geoms that may collide),
``joint_limits``. ``ground_normal`` (3,), ``ground_offset`` (1,) m, -inf: no ground.
``restitution_speed`` (1,) m/s: slower impacts do not bounce. ``doll_masses`` (d,) kg.
``energy_scale`` (1,) J: m g L of the whole system, L the largest reach. ``flight_enabled`` (1,):
whether joint damping allows explicit integration. ``hull_vertices``, ``hull_faces``,
``hull_edges``, ``hull_indices`` (m,) and ``hulls``: the convex hulls."""

OVERLAPPING, JOINT_OUTSIDE_LIMITS, KINEMATIC = 1, 2, 4
"""Flags, why a pair is excluded from collision for now: its geoms overlap, as they did at the
start; a joint between its bodies is outside its limits; its bodies are of a kinematic doll."""

COMPLIANCE, IMPACT_COMPLIANCE = 1e-8, 1e-10
"""Compliance of contacts and limits, as a share of the diagonal of W = J H^-1 J^T, in steps and at
impacts. It makes impulses of redundant contacts unique and keeps them small where contacts jam.
Bodies at rest on slopes creep by some 1e-10 m/s; impacts miss their velocity by as large a share.
"""

MAX_DENSE_ROWS = 96
"""Islands of more rows are solved without forming W; see impulses/large_island.py."""

NO_SLIP = 1e5
"""Friction coefficient from which on friction has no limit."""


def gap_count(system: System) -> int:
    """Gaps of a system: one of each ground point, two of each limit, one of each pair."""
    return (int(system.geoms['point_count'].sum()) + 2 * len(system.joint_limits)
            + len(system.pairs))


def coordinate_count(system: System) -> int:
    """Number nq of generalized coordinates."""
    return len(system.dof_parent) + int(system.tree['has_quaternion'].sum())


def tree_depth(system: System) -> int:
    """Largest number of degrees of freedom that move one body."""
    most = 0
    for dof in system.body_last_dof:
        size = 0
        while dof >= 0:
            size, dof = size + 1, system.dof_parent[dof]
        most = max(most, size)
    return most


def blank_system() -> System:
    """A system of one body: a sample, from which the type SYSTEM is made."""
    return System(
        tree=np.zeros(1, BODY), gravity=np.zeros(3), dof_parent=np.arange(6) - 1,
        dof_body=np.zeros(6, np.int64), dof_damping=np.zeros(6),
        body_last_dof=np.zeros(1, np.int64), body_root=np.zeros(1, np.int64),
        body_doll=np.zeros(1, np.int64), geoms=np.zeros(1, GEOM), pairs=np.zeros(1, GEOM_PAIR),
        joint_limits=np.zeros(1, JOINT_LIMIT), ground_normal=np.zeros(3), ground_offset=np.zeros(1),
        restitution_speed=np.zeros(1), doll_masses=np.zeros(1), energy_scale=np.zeros(1),
        flight_enabled=np.zeros(1), hull_vertices=np.zeros(0, HULL_VERTEX),
        hull_faces=np.zeros(0, HULL_FACE), hull_edges=np.zeros(0, HULL_EDGE),
        hull_indices=np.zeros(0, np.int64), hulls=np.zeros(0, HULL_TABLE))


SYSTEM = bundle_type(blank_system())

system_at = bundle_at(SYSTEM)
"""The System at an address, in compiled code."""
