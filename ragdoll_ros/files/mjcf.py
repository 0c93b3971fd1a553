"""A scene as MJCF for MuJoCo: the same bodies, joints, limits, damping and ground.

A body's frame is its bone's: centre of mass and the shape's axes. MuJoCo's quaternions are w, x, y,
z. Several hinges of one body act in series, each axis turned by the hinges before it: two are a
universal joint. Approximations:
- a ball joint with limits is three hinges, as in urdf.py;
- restitution is a spring and a damper in the contact, and needs small steps;
- friction is finite; MuJoCo takes the larger of a pair, so each bone has the combined coefficient
  with the ground, and the ground zero. A static body with a material of its own has priority: its
  coefficients are those with a bone of the scene's material.
"""
import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable

import numpy as np

from ..model import rotation
from ..model.mesh import boxed
from ..model.plane import Plane
from ..model.pose import Pose
from ..model.ragdoll import Bone, Joint, joint_axes
from ..model.scene import Placement, Scene, finite_friction
from ..model.shapes import Shape
from ..model.static_body import StaticBody

UNLIMITED = (0.0, 0.0, 1.0)
"""Size of a plane without an end; the last number is the spacing of what is drawn."""

CONTACT_TIME = 0.02
"""s, time constant of a contact without restitution, MuJoCo's default. With restitution the
frequency is the same, 1 / (time constant * damping ratio). The engine sets one for its step."""


def to_mjcf(scene: Scene, excluded: Collection[frozenset[str]] = ()) -> str:
    """Write a scene as MJCF.

    ``excluded`` are pairs of bones (scene.bone_names) that do not collide, as they overlap at the
    start, beside the dolls' own pairs.
    """
    root = ET.Element('mujoco', model=scene.name)
    ET.SubElement(root, 'compiler', angle='radian', autolimits='true', inertiafromgeom='false')
    ET.SubElement(root, 'option', timestep=repr(scene.step), gravity=_text(scene.gravity),
                  cone='elliptic')
    world = ET.SubElement(root, 'worldbody')
    if scene.ground is not None:
        _add_ground(world, scene)
    _add_bodies(world, scene)
    for placement in scene.dolls:
        _add_doll(world, scene, placement)
    contact = ET.SubElement(root, 'contact')
    own = {frozenset(scene.qualified(placement, name) for name in pair)
           for placement in scene.dolls for pair in placement.doll.excluded_pairs}
    for index, (a, b) in enumerate(sorted(map(sorted, own | {*excluded}))):
        ET.SubElement(contact, 'exclude', name=f'apart_{index}', body1=a, body2=b)
    ET.indent(root)
    return ET.tostring(root, encoding='unicode') + '\n'


def damping_ratio(restitution: float) -> float:
    """Damping ratio z of a spring and damper with a coefficient of ``restitution``.

    The contact ends when its force, not its penetration, is zero:
    e = exp(-z / s (pi - atan(2 z s / (1 - 2 z^2)))), s = sqrt(1 - z^2) (Schwager and Poeschel,
    Granular Matter 9, 2007). The least e is exp(-2), at critical damping.
    """
    low, high = 0.0, 1.0
    for _ in range(50):
        ratio = (low + high) / 2
        rest = math.sqrt(1 - ratio ** 2)
        left = math.exp(-ratio / rest * (
            math.pi - math.atan2(2 * ratio * rest, 1 - 2 * ratio ** 2))) if rest else 0.0
        low, high = (ratio, high) if left > restitution else (low, ratio)
    return max(0.01, high)


def _add_ground(world: ET.Element, scene: Scene) -> None:
    normal = np.array(scene.ground.normal)
    turn = rotation.shortest_arc(np.array((0.0, 0.0, 1.0)), normal)
    ET.SubElement(world, 'geom', name='ground', type='plane', size=_text(UNLIMITED), contype='1',
                  conaffinity='3', solmix='0', pos=_text(normal * scene.ground.offset),
                  quat=_quaternion(turn), **_material(scene, None))


def _add_bodies(world: ET.Element, scene: Scene) -> None:
    for body in scene.bodies:
        own = (body.friction, body.rolling_friction, body.restitution)
        is_special = own != (None, None, None)
        for number, (kind, size, pose) in enumerate(static_geoms(body), 1):
            ET.SubElement(world, 'geom', name=f'bodies/{body.name}/{number}', type=kind,
                          size=_text(size), pos=_text(pose.position),
                          quat=_quaternion(pose.orientation), contype='1', conaffinity='3',
                          priority='1' if is_special else '0',
                          **_material(scene, body if is_special else None))


def _add_doll(world: ET.Element, scene: Scene, placement: Placement) -> None:
    """Add the bodies of one doll, nested along its joints."""
    doll = placement.doll
    made = {doll.root.name: _add_bone(world, scene, placement, doll.root,
                                      placement.bone_pose(doll.root))}
    if not placement.fixed_root:
        ET.SubElement(made[doll.root.name], 'freejoint',
                      name=scene.qualified(placement, doll.root.name) + '/free')
    for joint in doll.joints_from_root():
        parent, child = doll.bone(joint.parent), doll.bone(joint.child)
        body = _add_bone(made[parent.name], scene, placement, child,
                         parent.pose.relative(child.pose))
        for attributes in _joints(joint, child):
            attributes['name'] = scene.qualified(placement, attributes['name'])
            ET.SubElement(body, 'joint', attributes)
        made[child.name] = body


def _add_bone(parent: ET.Element, scene: Scene, placement: Placement, bone: Bone,
              pose: Pose) -> ET.Element:
    name = scene.qualified(placement, bone.name)
    body = ET.SubElement(parent, 'body', name=name, pos=_text(pose.position),
                         quat=_quaternion(pose.orientation))
    ET.SubElement(body, 'inertial', pos='0 0 0', mass=repr(bone.mass),
                  diaginertia=_text(bone.inertia))
    # bit 0: collides with the ground and, with self_collision, with bones; bit 1: ground only
    mask = '1' if scene.self_collision else '2'
    for number, part in enumerate(map(boxed, bone.shape.parts), 1):
        at = {} if part.is_centred else {'pos': _text(part.position),
                                         'quat': _quaternion(part.orientation)}
        # A bone's own name has no slash.
        ET.SubElement(body, 'geom', name=name if number == 1 else f'{name}/{number}',
                      type=part.kind, size=_text(_size(part.shape)), **at,
                      contype=mask, conaffinity='1' if scene.self_collision else '0',
                      **_material(scene, bone))
    return body


def _joints(joint: Joint, child: Bone) -> Iterable[dict[str, str]]:
    """Yield the attributes of each joint element, in the child's frame: one ball for a ball joint
    without limits, else a hinge for each axis; none for a fixed joint.
    """
    back = rotation.inverse(child.orientation)
    place = {'pos': _text(child.pose.apply_inverse(joint.anchor)), 'damping': repr(joint.damping)}
    if joint.is_free_ball:
        yield {'name': joint.child, 'type': 'ball', **place}
        return
    for name, axis, pair in zip(joint.angle_names, joint_axes(joint), joint.angle_limits,
                                strict=True):
        ranged = {'range': _text(pair)} if pair else {}
        yield {'name': name, 'type': 'hinge', **place, **ranged,
               'axis': _text(rotation.rotate(back, axis))}


def static_geoms(body: StaticBody) -> list[tuple[str, tuple[float, ...], Pose]]:
    """Type, size and pose in the world of each geom of a static body, in MuJoCo's form."""
    if isinstance(body.shape, Plane):
        return [('plane', UNLIMITED, body.pose)]
    return [(part.kind, _size(part.shape), part.pose)
            for part in map(boxed, body.parts)]


def _size(shape: Shape) -> tuple[float, ...]:
    """Sizes in MuJoCo's form: half lengths, and one radius."""
    if shape.kind == 'box':
        return shape.half_extents
    return tuple(size / (2 if key == 'length' else 1) for key, size in vars(shape).items())


def _material(scene: Scene, bone: Bone | StaticBody | None) -> dict[str, str]:
    """Friction and restitution of a bone or static body, or of the ground (None)."""
    friction, rolling, restitution = scene.material.on(bone)
    friction = math.sqrt(finite_friction(friction) * finite_friction(scene.material.friction))
    if bone is None:
        friction = rolling = 0.0
    ratio = damping_ratio(math.sqrt(restitution * scene.material.restitution))
    return {'friction': _text((friction, 0.0, rolling)),
            'condim': '6' if rolling else '3',
            'solref': _text((CONTACT_TIME / ratio, ratio))}


def _quaternion(q: np.ndarray) -> str:
    x, y, z, w = q
    return _text((w, x, y, z))


def _text(values: Iterable[float]) -> str:
    return ' '.join(repr(float(value)) for value in values)
