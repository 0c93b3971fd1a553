"""A scene as the tables that the rigid core reads."""
from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....model import rotation
from ....model.coordinates import DofLayout
from ....model.ragdoll import Joint, Ragdoll, joint_axes
from ....model.scene import Scene
from ...kernels.record import RECORD
from ...kernels.system import BOUND, GEOM, PAIR, STICKS, System
from ...motion import damping_rate

KINDS = {'sphere': 0, 'capsule': 1, 'box': 2, 'cylinder': 3}
"""Numbers of the kinds of shapes, as in kernels/collision/shapes.py."""

STIFFEST = 1000.0
"""1/s at which joint damping may end a motion for it to be flown; above, steps take it
implicitly."""

GROUND_POINTS = {'sphere': 1, 'capsule': 2, 'box': 8, 'cylinder': 10}
"""Points of each kind that may touch the ground, see kernels/contact/gaps.py."""

Law = tuple[float, float, float]
"""Friction, rolling friction (m), restitution."""


def system_of(scene: Scene) -> System:
    """The tables of a scene; ``pairs`` are those within dolls."""
    tree = table(scene)
    layout = DofLayout([placement.doll for placement in scene.dolls])
    ground = scene.ground
    bounds = np.zeros(len(layout.limited[0]), BOUND)
    bounds['q'], bounds['v'] = layout.limited
    bounds['lower'], bounds['upper'] = layout.limits
    geoms = _geoms(scene, tree)
    return System(
        tree=tree, gravity=np.array(scene.gravity, float), **_dofs(tree, layout.sizes[1]),
        geoms=geoms, pairs=pairs_between(scene, _within_dolls(scene)),
        bounds=bounds, normal=np.array(ground.normal if ground else (0.0, 0.0, 1.0)),
        offset=np.array([ground.offset if ground else -math.inf]),
        bounce_speed=np.array([scene.material.restitution_speed]),
        doll_masses=np.array([placement.doll.mass for placement in scene.dolls]),
        heft=np.array([tree['mass'].sum() * geoms['reach'].max() * math.hypot(*scene.gravity)]),
        flies=np.array([float(damping_rate(scene) < STIFFEST)]))


def table(scene: Scene) -> np.ndarray:
    """Records of all bones of a scene, coordinates in the order of DofLayout."""
    places = {name: place for place, name in enumerate(scene.bone_names)}
    records: list[np.ndarray] = []
    q = v = 0
    for placement in scene.dolls:
        doll, at = placement.doll, {}
        for joint in (None, *doll.joints_depth_first()):
            bone = doll.bone(joint.child) if joint else doll.root
            record = np.zeros((), RECORD)
            record['parent'], record['free'] = -1, 1
            if joint:
                _enter_joint(record, doll, joint, at)
            record['bone'] = places[scene.qualified(placement, bone.name)]
            record['mass'], record['inertia'] = bone.mass, bone.inertia
            record['bind'], record['q'], record['v'] = bone.orientation, q, v
            at[bone.name] = len(records)
            records.append(record)
            if joint is None:
                q, v = q + 7, v + 6
            else:
                q, v = q + (4 if record['free'] else joint.dof), v + joint.dof
    return np.array(records, RECORD)


def _enter_joint(record: np.ndarray, doll: Ragdoll, joint: Joint, at: dict[str, int]) -> None:
    """Enter what a joint says of its child's record; ``at``: which record is whose."""
    record['parent'] = at[joint.parent]
    record['free'] = joint.is_free_ball
    record['dof'], record['damping'] = joint.dof, joint.damping
    record['before'] = np.subtract(joint.anchor, doll.bone(joint.parent).position)
    record['after'] = np.subtract(doll.bone(joint.child).position, joint.anchor)
    record['axes'][:joint.dof] = joint_axes(joint)


def joined(systems: Sequence[System], pairs: np.ndarray) -> System:
    """The tables of several systems as one, and ``pairs`` between their geoms."""
    q = v = bones = geoms = points = 0
    parts = []
    for one in systems:
        tree, shapes, own, bounds = (part.copy() for part in (
            one.tree, one.geoms, one.pairs, one.bounds))
        tree['parent'] += np.where(tree['parent'] >= 0, bones, 0)
        tree['bone'] += bones
        shapes['bone'] += bones
        shapes['first'] += points
        for rows in (tree, bounds):
            rows['q'] += q
            rows['v'] += v
        own['a'] += geoms
        own['b'] += geoms
        parts.append(one._replace(
            tree=tree, geoms=shapes, pairs=own, bounds=bounds,
            up=np.where(one.up >= 0, one.up + v, -1), last=one.last + v,
            bone_of=one.bone_of + bones, root_of=one.root_of + bones,
            doll_of=one.doll_of + sum(len(part.doll_masses) for part in parts)))
        q, v, bones = q + coordinates(one), v + len(one.up), bones + len(tree)
        geoms, points = geoms + len(shapes), points + int(shapes['count'].sum())
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in (
        'tree', 'up', 'last', 'bone_of', 'root_of', 'doll_of', 'damping', 'geoms', 'bounds',
        'doll_masses')}
    tree, shapes = whole['tree'], whole['geoms']
    return parts[0]._replace(
        **whole, pairs=np.concatenate([*(part.pairs for part in parts), pairs]),
        heft=np.array([tree['mass'].sum() * shapes['reach'].max()
                       * math.hypot(*parts[0].gravity)]),
        flies=np.array([min(part.flies[0] for part in parts)]))


def coordinates(system: System) -> int:
    """How many coordinates a system has."""
    return len(system.up) + int(system.tree['free'].sum())


def pairs_between(scene: Scene, couples: np.ndarray) -> np.ndarray:
    """Pairs of geoms (p, 2) with the law of their contact."""
    laws = np.array([scene.material.on(bone) for bone in scene.bones
                     for _ in bone.shape.parts]).reshape(-1, 3)
    pairs = np.zeros(len(couples), PAIR)
    if len(couples):
        pairs['a'], pairs['b'] = couples.T
        law = contact_law(laws[couples[:, 0]], laws[couples[:, 1]])
        pairs['friction'], pairs['rolling'], pairs['restitution'] = law.T
    return pairs


def contact_law(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Laws (..., 3) between two materials (..., 3): geometric means of frictions and restitutions,
    the mean of the lever arms; friction without limit leaves it to the other.
    """
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    low, high = np.minimum(a[..., 0], b[..., 0]), np.maximum(a[..., 0], b[..., 0])
    mean = np.sqrt(np.minimum(low, STICKS) * np.minimum(high, STICKS))
    out[..., 0] = np.where(np.isfinite(high), mean, np.minimum(low, STICKS))
    out[..., 1] = (a[..., 1] + b[..., 1]) / 2
    out[..., 2] = np.sqrt(a[..., 2] * b[..., 2])
    return out


def _dofs(tree: np.ndarray, count: int) -> dict[str, np.ndarray]:
    """How velocities and bones hang together; see System."""
    up, bone_of = np.full(count, -1), np.zeros(count, np.int64)
    last, root_of, doll_of = np.zeros((3, len(tree)), np.int64)
    damping, doll = np.zeros(count), -1
    for i, bone in enumerate(tree):
        if bone['parent'] < 0:
            doll, before, dof, root_of[i] = doll + 1, -1, 6, i
        else:
            before, dof, root_of[i] = last[bone['parent']], bone['dof'], root_of[bone['parent']]
        doll_of[i] = doll
        for j in range(bone['v'], bone['v'] + dof):
            up[j], bone_of[j], before = before, i, j
            damping[j] = bone['damping'] if bone['parent'] >= 0 else 0.0
        last[i] = before
    return {'up': up, 'last': last, 'bone_of': bone_of, 'root_of': root_of, 'doll_of': doll_of,
            'damping': damping}


def _geoms(scene: Scene, tree: np.ndarray) -> np.ndarray:
    """All parts of all bones' shapes, in the scene's order of bones."""
    record = {int(bone): place for place, bone in enumerate(tree['bone'])}
    base = np.array(scene.material.on(None))
    parts = [(index, bone, part) for index, bone in enumerate(scene.bones)
             for part in bone.shape.parts]
    geoms, first = np.zeros(len(parts), GEOM), 0
    for geom, (index, bone, part) in zip(geoms, parts, strict=True):
        shape, count = part.shape, GROUND_POINTS[part.shape.kind]
        geom['bone'], geom['kind'] = record[index], KINDS[shape.kind]
        geom['size'] = _size(shape)
        geom['offset'] = rotation.rotate(bone.orientation, np.array(part.position))
        geom['turn'] = rotation.multiply(bone.orientation, np.array(part.orientation))
        geom['radius'] = _radius(shape)
        geom['reach'] = geom['radius'] + math.hypot(*part.position)
        law = contact_law(np.array(scene.material.on(bone)), base)
        geom['friction'], geom['rolling'], geom['restitution'] = law
        geom['first'], geom['count'] = first, count
        first += count
    return geoms


def _size(shape: object) -> tuple[float, ...]:
    if shape.kind == 'box':
        return shape.half_extents
    return (shape.radius, 0.0 if shape.kind == 'sphere' else shape.length / 2, 0.0)


def _radius(shape: object) -> float:
    """Of the ball around a shape, m."""
    if shape.kind == 'sphere':
        return shape.radius
    if shape.kind == 'capsule':
        return shape.radius + shape.length / 2
    return math.hypot(*((shape.radius, shape.length / 2) if shape.kind == 'cylinder'
                        else shape.half_extents))


def _within_dolls(scene: Scene) -> np.ndarray:
    """Pairs (p, 2) of geoms of one doll whose bones are two that may collide."""
    if not scene.self_collision:
        return np.zeros((0, 2), np.int64)
    owner = np.repeat(np.arange(len(scene.bones)), [len(b.shape.parts) for b in scene.bones])
    apart = set()
    for own, placement in zip(scene.bone_slices, scene.dolls, strict=True):
        place = {bone.name: own.start + k for k, bone in enumerate(placement.doll.bones)}
        apart |= {frozenset(place[name] for name in pair) for pair in placement.doll.excluded_pairs}
    doll = scene.doll_of_bone[owner]
    found = [(a, b) for d in range(len(scene.dolls))
             for members in [np.flatnonzero(doll == d)]
             for n, a in enumerate(members) for b in members[n + 1:]
             if owner[a] != owner[b] and frozenset((owner[a], owner[b])) not in apart]
    return np.array(found, np.int64).reshape(-1, 2)
