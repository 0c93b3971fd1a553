"""The System of a scene: the tables that the kernels read."""
from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....model import rotation
from ....model.coordinates import DofLayout
from ....model.mesh import Hull
from ....model.pose import Pose
from ....model.ragdoll import Bone, Joint, Ragdoll, joint_axes
from ....model.scene import Scene
from ....model.shapes import Part
from ...kernels.collision.shapes import SHAPE_KIND
from ...kernels.dynamics.body import BODY, FIXED, MOVED
from ...kernels.system import (GEOM, GEOM_PAIR, JOINT_LIMIT, NO_SLIP, System, coordinate_count)
from ...rigid_body import damping_rate
from .hull_tables import NO_HULLS, HullTables, hull_geom, hull_tables, join_hulls

MAX_FLIGHT_DAMPING = 1000.0
"""1/s: largest decay rate of joint damping that is integrated explicitly, in flight; above, contact
steps take it implicitly."""

GROUND_POINTS = {'sphere': 1, 'capsule': 2, 'box': 8, 'cylinder': 10}
"""Points of each kind of shape that may touch the ground; see ground_point() of the kernels. A hull
has its vertices."""


def build_system(scene: Scene) -> System:
    """The System of a scene; its pairs are those within dolls."""
    tree = _kinematic_tree(scene)
    layout = DofLayout([placement.doll for placement in scene.dolls])
    ground = scene.ground
    limits = np.zeros(len(layout.limited[0]), JOINT_LIMIT)
    limits['q'], limits['dof'] = layout.limited
    limits['lower'], limits['upper'] = layout.limits
    geoms, hulls = _geoms(scene, tree)
    return System(
        tree=tree, gravity=np.array(scene.gravity, float), **_dofs(tree, layout.sizes[1]),
        geoms=geoms, **hulls._asdict(),
        pairs=make_pairs(_within_dolls(scene, geoms), contact_laws(scene)),
        joint_limits=limits,
        ground_normal=np.array(ground.normal if ground else (0.0, 0.0, 1.0)),
        ground_offset=np.array([ground.offset if ground else -math.inf]),
        restitution_speed=np.array([scene.material.restitution_speed]),
        doll_masses=np.array([placement.doll.mass for placement in scene.dolls]),
        energy_scale=energy_scale(tree, geoms, scene.gravity),
        flight_enabled=np.array([float(damping_rate(scene) < MAX_FLIGHT_DAMPING)]))


def _kinematic_tree(scene: Scene) -> np.ndarray:
    """Records of all bones of a scene, parents first; coordinates in the order of DofLayout."""
    places = {name: place for place, name in enumerate(scene.bone_names)}
    bodies: list[np.ndarray] = []
    q = v = 0
    for placement in scene.dolls:
        doll, at = placement.doll, {}
        for joint in (None, *doll.joints_depth_first()):
            bone = doll.bone(joint.child) if joint else doll.root
            body = np.zeros((), BODY)
            body['parent'], body['has_quaternion'] = -1, 1
            if joint:
                _enter_joint(body, doll, joint, at)
            body['bone'] = places[scene.qualified(placement, bone.name)]
            body['mass'], body['inertia'] = bone.mass, bone.inertia
            body['inertial_orientation'] = bone.orientation
            body['q_start'], body['v_start'] = q, v
            body['kinematic'] = (MOVED if placement.is_kinematic
                                 else FIXED if placement.fixed_root and joint is None else 0)
            at[bone.name] = len(bodies)
            bodies.append(body)
            if joint is None:
                q, v = q + 7, v + 6
            else:
                q, v = q + (4 if body['has_quaternion'] else joint.dof), v + joint.dof
    return np.array(bodies, BODY)


def _enter_joint(body: np.ndarray, doll: Ragdoll, joint: Joint, at: dict[str, int]) -> None:
    """Write the joint to the parent to ``body``; ``at``: index of each bone's body so far."""
    body['parent'] = at[joint.parent]
    body['has_quaternion'] = joint.is_free_ball
    body['dof_count'], body['joint_damping'] = joint.dof, joint.damping
    body['parent_to_joint'] = np.subtract(joint.anchor, doll.bone(joint.parent).position)
    body['joint_to_com'] = np.subtract(doll.bone(joint.child).position, joint.anchor)
    body['joint_axes'][:joint.dof] = joint_axes(joint)
    for axis, passive in enumerate(joint.passive):
        for index, end in enumerate((passive.lower, passive.upper) if passive else ()):
            body['has_passive'] = 1
            body['passive_torques'][axis, index] = end.torque
            body['passive_angles'][axis, index] = end.angle
            body['passive_rates'][axis, index] = 1 / end.width


def energy_scale(tree: np.ndarray, geoms: np.ndarray, gravity: Sequence[float]) -> np.ndarray:
    """Energy scale m g L (1,), J, of the bodies that are not kinematic: m their total mass, L the
    largest reach of one of their geoms.
    """
    falls = tree['kinematic'] == 0
    reach = geoms['reach'][falls[geoms['body']]].max(initial=0.0)
    return np.array([tree['mass'][falls].sum() * reach * math.hypot(*gravity)])


def join_systems(systems: Sequence[System], pairs: np.ndarray, static_geoms: np.ndarray,
                 static_hulls: HullTables) -> System:
    """Concatenate systems and ``static_geoms``, GEOM, with their hulls, and add ``pairs`` (p,),
    GEOM_PAIR.
    """
    q = v = bodies = dolls = geoms = points = hulls = 0
    parts = []
    for one in systems:
        tree, shapes, own, limits = (part.copy() for part in (
            one.tree, one.geoms, one.pairs, one.joint_limits))
        tree['parent'] += np.where(tree['parent'] >= 0, bodies, 0)
        tree['bone'] += bodies
        tree['q_start'] += q
        tree['v_start'] += v
        shapes['body'] += bodies
        shapes['first_point'] += points
        shapes['hull'] += hulls
        limits['q'] += q
        limits['dof'] += v
        own['a'] += geoms
        own['b'] += geoms
        parts.append(one._replace(
            tree=tree, geoms=shapes, pairs=own, joint_limits=limits,
            dof_parent=np.where(one.dof_parent >= 0, one.dof_parent + v, -1),
            dof_body=one.dof_body + bodies, body_last_dof=one.body_last_dof + v,
            body_root=one.body_root + bodies, body_doll=one.body_doll + dolls))
        q, v, bodies = q + coordinate_count(one), v + len(one.dof_parent), bodies + len(tree)
        geoms, points = geoms + len(shapes), points + int(shapes['point_count'].sum())
        hulls += len(one.hulls)
        dolls += len(one.doll_masses)
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in (
        'tree', 'dof_parent', 'dof_body', 'dof_damping', 'body_last_dof', 'body_root', 'body_doll',
        'geoms', 'joint_limits', 'doll_masses')}
    scale = energy_scale(whole['tree'], whole['geoms'], parts[0].gravity)
    static_geoms = static_geoms.copy()
    static_geoms['hull'] += hulls
    whole['geoms'] = np.concatenate([whole['geoms'], static_geoms])
    tables = join_hulls([*(HullTables(*(getattr(part, name) for name in HullTables._fields))
                           for part in parts), static_hulls])
    return parts[0]._replace(
        **whole, **tables._asdict(), energy_scale=scale,
        pairs=np.concatenate([*(part.pairs for part in parts), pairs]),
        flight_enabled=np.array([min(part.flight_enabled[0] for part in parts)]))


def contact_laws(scene: Scene) -> np.ndarray:
    """Friction, rolling friction, m, and restitution (g, 3) of each geom of a scene's dolls."""
    return np.array([scene.material.on(bone) for placement in scene.dolls
                     for bone in placement.doll.bones for _ in bone.shape.parts]).reshape(-1, 3)


def make_pairs(geom_pairs: np.ndarray, laws: np.ndarray,
               points: np.ndarray | int = 0) -> np.ndarray:
    """Make GEOM_PAIR records of pairs of geoms (p, 2), by contact_law() of the ``laws`` (g, 3) of
    their materials. ``points`` (p,): for a pair with a plane, which point of the other geom may
    touch it; else 0.
    """
    pairs = np.zeros(len(geom_pairs), GEOM_PAIR)
    if len(geom_pairs):
        pairs['a'], pairs['b'] = geom_pairs.T
        law = contact_law(laws[geom_pairs[:, 0]], laws[geom_pairs[:, 1]])
        pairs['point'] = points
        pairs['friction'], pairs['rolling_friction'], pairs['restitution'] = law.T
    return pairs


def contact_law(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Friction, rolling friction, m, and restitution (..., 3) of contacts between two materials
    (..., 3). Rolling friction is the arithmetic mean, the others are geometric means; if one
    friction is infinite, that of the other is taken. Friction is at most NO_SLIP.
    """
    (friction_a, rolling_a, restitution_a), (friction_b, rolling_b, restitution_b) = (
        np.moveaxis(law, -1, 0) for law in (a, b))
    low, high = np.minimum(friction_a, friction_b), np.maximum(friction_a, friction_b)
    mean = np.sqrt(np.minimum(low, NO_SLIP) * np.minimum(high, NO_SLIP))
    friction = np.where(np.isfinite(high), mean, np.minimum(low, NO_SLIP))
    return np.stack([friction, (rolling_a + rolling_b) / 2,
                     np.sqrt(restitution_a * restitution_b)], axis=-1)


def _dofs(tree: np.ndarray, count: int) -> dict[str, np.ndarray]:
    """The fields of a System that say how degrees of freedom, bodies and dolls are connected."""
    dof_parent, dof_body = np.full(count, -1), np.zeros(count, np.int64)
    body_last_dof, body_root, body_doll = np.zeros((3, len(tree)), np.int64)
    dof_damping, doll = np.zeros(count), -1
    for i, body in enumerate(tree):
        if body['parent'] < 0:
            doll, before, dofs, body_root[i] = doll + 1, -1, 6, i
        else:
            before, dofs = body_last_dof[body['parent']], body['dof_count']
            body_root[i] = body_root[body['parent']]
        body_doll[i] = doll
        for j in range(body['v_start'], body['v_start'] + dofs):
            dof_parent[j], dof_body[j], before = before, i, j
            dof_damping[j] = body['joint_damping'] if body['parent'] >= 0 else 0.0
        body_last_dof[i] = before
    return {'dof_parent': dof_parent, 'dof_body': dof_body, 'dof_damping': dof_damping,
            'body_last_dof': body_last_dof, 'body_root': body_root, 'body_doll': body_doll}


def _geoms(scene: Scene, tree: np.ndarray) -> tuple[np.ndarray, HullTables]:
    """GEOM records of all parts of all bones' shapes, in the scene's order of bones, and their
    hulls.
    """
    record = {int(bone): place for place, bone in enumerate(tree['bone'])}
    base = np.array(scene.material.on(None))
    made, hulls, first = [], [NO_HULLS], 0
    for index, bone in enumerate(scene.bones):
        law = contact_law(np.array(scene.material.on(bone)), base)
        for part in bone.shape.parts:
            geom = _part_geom(bone, part)
            geom['body'] = record[index]
            geom['friction'], geom['rolling_friction'], geom['restitution'] = law
            if isinstance(part.shape, Hull):
                geom['hull'] = len(hulls) - 1
                hulls.append(hull_tables(part.shape))
                count = len(hulls[-1].hull_vertices)
            else:
                count = GROUND_POINTS[part.kind]
            # What does not yield has nothing to do with the ground.
            count = 0 if tree['kinematic'][record[index]] else count
            geom['first_point'], geom['point_count'] = first, count
            made.append(geom)
            first += count
    return np.concatenate(made), join_hulls(hulls)


def _part_geom(bone: Bone, part: Part) -> np.ndarray:
    """GEOM (1,) of a part of a bone, but for body, law and indices."""
    shape, pose = part.shape, Pose(rotation.rotate(bone.orientation, np.array(part.position)),
                                   rotation.multiply(bone.orientation, np.array(part.orientation)))
    if isinstance(shape, Hull):
        return hull_geom(shape, pose)
    geom = np.zeros(1, GEOM)
    geom['kind'], geom['size'] = SHAPE_KIND[shape.kind], geom_size(shape)
    geom['position'], geom['orientation'] = pose
    geom['bounding_radius'] = bounding_radius(shape)
    geom['reach'] = geom['bounding_radius'] + math.hypot(*part.position)
    return geom


def geom_size(shape: object) -> tuple[float, ...]:
    """GEOM size of a shape; see kernels/collision/shapes.py."""
    if shape.kind == 'box':
        return shape.half_extents
    return (shape.radius, 0.0 if shape.kind == 'sphere' else shape.length / 2, 0.0)


def bounding_radius(shape: object) -> float:
    """Radius, m, of the bounding sphere about the shape's center."""
    if shape.kind == 'sphere':
        return shape.radius
    if shape.kind == 'capsule':
        return shape.radius + shape.length / 2
    return math.hypot(*((shape.radius, shape.length / 2) if shape.kind == 'cylinder'
                        else shape.half_extents))


def _within_dolls(scene: Scene, geoms: np.ndarray) -> np.ndarray:
    """Pairs (p, 2) of ``geoms`` of different bones of one doll that the doll does not exclude."""
    if not scene.self_collision:
        return np.zeros((0, 2), np.int64)
    owner = np.repeat(np.arange(len(scene.bones)), [
        len(bone.shape.parts) for bone in scene.bones])
    excluded = set()
    for own, placement in zip(scene.bone_slices, scene.dolls, strict=True):
        place = {bone.name: own.start + k for k, bone in enumerate(placement.doll.bones)}
        excluded |= {frozenset(place[name] for name in pair)
                     for pair in placement.doll.excluded_pairs}
    doll = scene.doll_of_bone[owner]
    found = [(a, b) for d in range(len(scene.dolls))
             for members in [np.flatnonzero(doll == d)]
             for n, a in enumerate(members) for b in members[n + 1:]
             if owner[a] != owner[b] and frozenset((owner[a], owner[b])) not in excluded]
    return np.array(found, np.int64).reshape(-1, 2)
