"""Ragdoll to URDF text.

Every link's frame has the doll's axes in the bind pose and its origin in the joint's anchor
(the root's: in its centre of mass); a ball joint's link is turned so that z is the twist axis.
URDF has no universal and no ball joint: they become hinges in a row with links between, which
are named child/1, child/2. A joint bears the name of the angle it measures.

Two dialects: 'ros' is what urdfdom reads; 'bullet' has capsules, links of no mass, and for a
ball joint without limits its spherical joint (whose own limits hardly hold: measured, it passes
0.5 rad by 2 rad). PyBullet counts that joint's turn in the frame of the child's inertia, so a
link of no mass with the joint's frame takes it, and the child is fixed to that. Limits of effort
and of velocity are zero there, where no motor is meant.
"""
from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..model import rotation
from ..model.pose import Pose
from ..model.ragdoll import DEFAULT_COLOR, WORLD, Bone, Joint, Ragdoll, joint_frame
from ..model.scene import Scene
from ..model.shapes import Shape

UNLIMITED = 'continuous'

STRENGTH = 'effort="1000.0" velocity="100.0"'
"""N m and rad/s that URDF wants with limits, and that joints of dolls do not reach: nothing in the
doll keeps them, and planners and drivers of joints take zeros for joints that can not move."""

OWNER = '\0'
"""Stands for a doll's own name in the tree that equal dolls share: XML allows no such character."""

ESCAPES = str.maketrans({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;',
                         '\t': '&#9;', '\n': '&#10;', '\r': '&#13;'})


def to_urdf(doll: Ragdoll, dialect: str = 'ros') -> str:
    """Write a doll as URDF; angles in rad, lengths in m, masses in kg."""
    return _document(doll.name, _tree(doll, dialect))


def scene_to_urdf(scene: Scene, frame: str = WORLD) -> str:
    """Write all dolls of a scene in ROS's dialect, under the bone names of the scene.

    One doll stands for itself; several hang on a link named as the world's ``frame`` by floating
    joints, each where its root is at the start, for URDF knows one tree only.
    """
    if len(scene.dolls) == 1:
        return to_urdf(scene.dolls[0].doll)
    lines, trees = [f'  <link name={_quoted(frame)}/>'], {}
    for placement in scene.dolls:
        doll = placement.doll
        if id(doll) not in trees:
            trees[id(doll)] = doll.root, '\n'.join(_tree(doll.renamed(OWNER.__add__), 'ros'))
        root, tree = trees[id(doll)]
        name = _quoted(scene.qualified(placement, root.name))
        position, _ = placement.bone_pose(root)
        lines += [f'  <joint name={name} type="floating">',
                  f'    <parent link={_quoted(frame)}/>',
                  f'    <child link={name}/>',
                  f'    {_origin(position, np.array(placement.orientation))}', '  </joint>',
                  tree.replace(OWNER, scene.qualified(placement, '').translate(ESCAPES))]
    return _document(scene.name, lines)


def link_frames(doll: Ragdoll) -> dict[str, Pose]:
    """Frame of each bone's link, in the doll's frame in the bind pose."""
    frames = {doll.root.name: Pose(np.array(doll.root.position))}
    for joint in doll.joints:
        frames[joint.child] = Pose(np.array(joint.anchor), joint_frame(joint))
    return frames


def link_axes(joint: Joint) -> np.ndarray:
    """Axes (dof, 3) of a joint's angles, in the frame of its child's link."""
    return np.eye(3) if joint.kind == 'ball' else np.array(joint.axes).reshape(-1, 3)


def link_names(child: str, count: int) -> list[str]:
    """Links of a joint that is ``count`` joints in a row: those between, then the child's."""
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
    """Poses and XML of what makes up a bone's shape."""
    for part in bone.shape.parts:
        place = pose if part.is_centred else pose.compose(part.pose)
        if part.kind == 'capsule' and dialect == 'ros':
            # URDF has none: a cylinder between two balls.
            for piece in part.shape.primitives:
                yield Pose(place.apply(piece.position), place.orientation), _geometry(piece.shape)
        else:
            yield place, _geometry(part.shape)


def _geometry(shape: Shape) -> str:
    """URDF calls shapes and their sizes as we do."""
    sizes = ' '.join(f'{key}={_numbers(value) if key == "size" else _quoted(repr(value))}'
                     for key, value in vars(shape).items())
    return f'<geometry><{shape.kind} {sizes}/></geometry>'


def _joint(joint: Joint, frames: dict[str, Pose], dialect: str) -> list[str]:
    """Write a joint and, where it has several axes, the links between."""
    place = frames[joint.parent].relative(frames[joint.child])
    if joint.kind == 'fixed':
        return _row(joint, [(joint.child, 'fixed', None, None)], place, dialect)
    if joint.is_free_ball and dialect == 'bullet':
        row = [(joint.child, 'spherical', (0, 0, 1), None),
               (f'{joint.child}/fixed', 'fixed', None, None)]
        return _row(joint, row, place, dialect)
    strength = STRENGTH if dialect == 'ros' else 'effort="0" velocity="0"'
    row = []
    for name, axis, pair in zip(joint.angle_names, link_axes(joint), joint.angle_limits,
                                strict=True):
        limit = pair and f'<limit lower="{pair[0]!r}" upper="{pair[1]!r}" {strength}/>'
        row.append((name, 'revolute' if pair else UNLIMITED, axis, limit))
    return _row(joint, row, place, dialect)


def _row(joint: Joint, row: list, place: Pose, dialect: str) -> list[str]:
    """Write joints one behind the other; only the first one is displaced."""
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
    """Write an attribute; xml.sax.saxutils could, but loads HTTP and TLS with every node."""
    return f'"{text.translate(ESCAPES)}"'
