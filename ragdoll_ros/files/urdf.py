"""Ragdoll to URDF.

A link's frame has the doll's axes in the bind pose and its origin at the joint's anchor (the
root's: at its centre of mass); of a ball joint's link z is the twist axis. URDF has no universal or
ball joint: they are revolute joints in series with links child/1, child/2 between them. A joint has
the name of its angle.

Dialects: 'ros' is what urdfdom reads. 'bullet' has capsules, massless links, effort and velocity
zero (no motor), and PyBullet's spherical joint for a ball joint without limits (a spherical joint's
own limits do not hold: measured, 2 rad past 0.5 rad). PyBullet measures a spherical joint in the
frame of the child's inertia, so the joint moves a massless link in the joint's frame, to which the
child is fixed.
"""
from collections.abc import Iterator, Sequence

import numpy as np

from ..model import rotation
from ..model.mesh import boxed
from ..model.per_doll import PerDoll
from ..model.pose import Pose
from ..model.ragdoll import DEFAULT_COLOR, WORLD, Bone, Joint, Ragdoll, joint_frame
from ..model.scene import Scene
from ..model.shapes import Shape

UNLIMITED = 'continuous'

EFFORT_AND_VELOCITY = 'effort="1000.0" velocity="100.0"'
"""N m and rad/s, which URDF requires with limits; beyond what the joints of dolls reach. Planners
take zero for a joint that can not move."""

DOLL_NAME = '\0'
"""Placeholder for the doll's name in a text that equal dolls share; not allowed in XML."""

ESCAPES = str.maketrans({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;',
                         '\t': '&#9;', '\n': '&#10;', '\r': '&#13;'})


def to_urdf(doll: Ragdoll, dialect: str = 'ros') -> str:
    """A doll as URDF; rad, m, kg."""
    return _document(doll.name, _tree(doll, dialect))


def urdf_tree(doll: Ragdoll) -> str:
    """Links and joints of a doll in ROS's dialect, DOLL_NAME before each name."""
    return '\n'.join(_tree(doll.renamed(DOLL_NAME.__add__), 'ros'))


def scene_to_urdf(scene: Scene, frame: str = WORLD, trees: PerDoll[str] | None = None) -> str:
    """All dolls of a scene as one URDF in ROS's dialect, with the scene's names.

    Several dolls are connected by floating joints to a link named ``frame``, each at its root's
    initial pose. ``trees``: of urdf_tree, kept from scene to scene.
    """
    trees = trees or PerDoll(urdf_tree)
    if len(scene.dolls) == 1:
        doll = scene.dolls[0].doll
        return _document(doll.name, [trees[doll].replace(DOLL_NAME, '')])
    lines = [f'  <link name={_quoted(frame)}/>']
    for placement in scene.dolls:
        root, tree = placement.doll.root, trees[placement.doll]
        name = _quoted(scene.qualified(placement, root.name))
        position, _ = placement.bone_pose(root)
        lines += [f'  <joint name={name} type="floating">',
                  f'    <parent link={_quoted(frame)}/>',
                  f'    <child link={name}/>',
                  f'    {_origin(position, np.array(placement.start.orientation))}', '  </joint>',
                  tree.replace(DOLL_NAME, scene.qualified(placement, '').translate(ESCAPES))]
    return _document(scene.name, lines)


def link_frames(doll: Ragdoll) -> dict[str, Pose]:
    """Pose of each bone's link frame in the doll's frame, bind pose."""
    frames = {doll.root.name: Pose(np.array(doll.root.position))}
    for joint in doll.joints:
        frames[joint.child] = Pose(np.array(joint.anchor), joint_frame(joint))
    return frames


def link_axes(joint: Joint) -> np.ndarray:
    """Axes (dof, 3) of a joint's angles in the frame of its child's link."""
    return np.eye(3) if joint.kind == 'ball' else np.array(joint.axes).reshape(-1, 3)


def link_names(child: str, count: int) -> list[str]:
    """Names of the links of ``count`` joints in series; the last is the child's."""
    return [*(f'{child}/{index}' for index in range(1, count)), child]


def _document(name: str, lines: list[str]) -> str:
    return '\n'.join(['<?xml version="1.0"?>', f'<robot name={_quoted(name)}>', *lines,
                      '</robot>', ''])


def _tree(doll: Ragdoll, dialect: str) -> list[str]:
    frames = link_frames(doll)
    lines = _link(doll.root, frames[doll.root.name], dialect)
    for joint in doll.joints_from_root():
        lines += _joint(joint, frames, dialect)
        lines += _link(doll.bone(joint.child), frames[joint.child], dialect)
    return lines


def _numbers(values: Sequence[float]) -> str:
    return '"' + ' '.join(repr(float(value)) for value in values) + '"'


def _origin(position: Sequence[float], orientation: np.ndarray) -> str:
    return f'<origin xyz={_numbers(position)} rpy={_numbers(rotation.to_rpy(orientation))}/>'


def _link(bone: Bone, frame: Pose, dialect: str) -> list[str]:
    pose = frame.relative(bone.pose)
    ixx, iyy, izz = bone.inertia
    color = bone.color or DEFAULT_COLOR
    lines = [f'  <link name={_quoted(bone.name)}>',
             '    <inertial>', f'      {_origin(*pose)}',
             f'      <mass value="{bone.mass!r}"/>',
             f'      <inertia ixx="{ixx!r}" iyy="{iyy!r}" izz="{izz!r}" ixy="0" ixz="0" iyz="0"/>',
             '    </inertial>']
    for place, geometry in _geometries(bone, pose, dialect):
        origin = _origin(*place)
        lines += ['    <visual>', f'      {origin}', f'      {geometry}',
                  f'      <material name={_quoted(bone.name)}>'
                  f'<color rgba={_numbers(color)}/></material>', '    </visual>',
                  '    <collision>', f'      {origin}', f'      {geometry}', '    </collision>']
    return [*lines, '  </link>']


def _geometries(bone: Bone, pose: Pose, dialect: str) -> Iterator[tuple[Pose, str]]:
    """Pose and XML of each geometry of a bone."""
    for part in map(boxed, bone.shape.parts):
        place = pose if part.is_centred else pose.compose(part.pose)
        if part.kind == 'capsule' and dialect == 'ros':
            # urdfdom has no capsule: a cylinder and two spheres.
            for piece in part.shape.primitives:
                yield Pose(place.apply(piece.position), place.orientation), _geometry(piece.shape)
        else:
            yield place, _geometry(part.shape)


def _geometry(shape: Shape) -> str:
    """XML of a shape, whose names of kinds and sizes are URDF's."""
    sizes = ' '.join(f'{key}={_numbers(value) if key == "size" else _quoted(repr(value))}'
                     for key, value in vars(shape).items())
    return f'<geometry><{shape.kind} {sizes}/></geometry>'


def _joint(joint: Joint, frames: dict[str, Pose], dialect: str) -> list[str]:
    """Lines of a joint and of the links between its axes."""
    place = frames[joint.parent].relative(frames[joint.child])
    if joint.kind == 'fixed':
        return _serial_joints(joint, [(joint.child, 'fixed', None, None)], place, dialect)
    if joint.is_free_ball and dialect == 'bullet':
        row = [(joint.child, 'spherical', (0, 0, 1), None),
               (f'{joint.child}/fixed', 'fixed', None, None)]
        return _serial_joints(joint, row, place, dialect)
    motor = EFFORT_AND_VELOCITY if dialect == 'ros' else 'effort="0" velocity="0"'
    row = []
    for name, axis, pair in zip(joint.angle_names, link_axes(joint), joint.angle_limits,
                                strict=True):
        limit = pair and f'<limit lower="{pair[0]!r}" upper="{pair[1]!r}" {motor}/>'
        row.append((name, 'revolute' if pair else UNLIMITED, axis, limit))
    return _serial_joints(joint, row, place, dialect)


def _serial_joints(joint: Joint, row: list, place: Pose, dialect: str) -> list[str]:
    """Lines of joints in series; only the first has an offset."""
    lines, parent = [], joint.parent
    links = link_names(joint.child, len(row))
    for index, (child, (name, kind, axis, limit)) in enumerate(zip(links, row, strict=True)):
        last = child == joint.child
        lines += [f'  <joint name={_quoted(name)} type="{kind}">',
                  f'    <parent link={_quoted(parent)}/>',
                  f'    <child link={_quoted(child)}/>',
                  f'    {_origin(*place) if index == 0 else "<origin/>"}']
        if axis is not None:
            lines.append(f'    <axis xyz={_numbers(axis)}/>')
        if limit:
            lines.append(f'    {limit}')
        if kind != 'fixed':
            lines.append(f'    <dynamics damping="{joint.damping!r}"/>')
        lines.append('  </joint>')
        if not last and dialect == 'ros':
            lines.append(f'  <link name={_quoted(child)}/>')
        elif not last:
            lines += [f'  <link name={_quoted(child)}>',
                      '    <inertial><mass value="0"/>'
                      '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>',
                      '  </link>']
        parent = child
    return lines


def _quoted(text: str) -> str:
    """A quoted attribute. xml.sax.saxutils would import HTTP and TLS into every node."""
    return f'"{text.translate(ESCAPES)}"'
