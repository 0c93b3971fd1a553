"""URDF to Ragdoll: a robot that goes limp.

A link with a shape or a mesh becomes a body; its joint becomes a hinge, or part of a universal or
ball joint where links of no shape stand between (as to_urdf writes them). A link without a shape
is carried by its parent and gives it its mass and inertia, one without a mass its shapes. Every
link's frame is one of the doll's riders, so that it can be published.
"""
from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...files.urdf_tree import LARGEST_TEXT, UrdfJoint, UrdfTree, decode_urdf, parse_urdf
from ...model import errors, rotation
from ...model.pose import Pose
from ...model.ragdoll import MAX_SWING, WORLD, Bone, Joint, Ragdoll, SkeletonFrame
from ..roles.names import plain_name
from .link_bodies import link_shapes, make_bone
from .link_meshes import LinkMeshes

TURNING = ('revolute', 'continuous', 'floating', 'spherical')
"""Kinds of joints that a doll's joint can be."""

SAME_PLACE = 1e-6
"""m; axes in a row that meet this nearly are one joint."""


def doll_from_urdf(text: str) -> Ragdoll:
    """Doll of a robot's description, a URDF's text; ModelError with what is wrong in it.

    Its frame is the root link's; it stands at joint angles of zero, or the nearest inside the
    limits.
    """
    return _doll(parse_urdf(text))[0]


def read_urdf(path: str | Path) -> tuple[Ragdoll, tuple[str, ...]]:
    """Doll of a URDF file, and a note on each thing that could not be taken over.

    As doll_from_urdf; ModelErrors with what is wrong in the file, OSError where it cannot be read.
    """
    path = Path(path)
    try:
        if not path.is_file():
            there = 'not a regular file' if path.exists() else 'no such file'
            raise errors.Unreadable('', there, 'a URDF file')
        if path.stat().st_size > LARGEST_TEXT:
            raise errors.Unreadable('', path.stat().st_size, f'at most {LARGEST_TEXT} bytes')
        doll, notes = _doll(parse_urdf(decode_urdf(path.read_bytes())), path.parent)
        return doll, tuple(notes)
    except errors.ModelError as error:
        raise errors.ModelErrors(str(path), [error]) from None


def _doll(tree: UrdfTree, folder: Path | None = None) -> tuple[Ragdoll, list[str]]:
    notes: list[str] = []
    # Zero may lie outside a joint's limits; the doll starts at the nearest angle inside.
    angles = {child: float(np.clip(0.0, *joint.limits)) for child, joint in tree.joints.items()
              if joint.limits}
    poses = tree.poses(angles)
    meshes = LinkMeshes(folder)
    # What has no mass and only is seen is a body where nothing has a mass: a sketch of a robot.
    sketch = all(link.mass <= 0 for link in tree.links.values())
    shapes = {name: link_shapes(link, meshes, notes)
              if sketch or link.mass > 0 or link.collides else []
              for name, link in tree.links.items()}
    if not any(shapes.values()):
        why = f' ({notes[0]})' if notes else ''
        raise errors.WrongForm('link', list(tree.links)[:5],
                               f'a link with a shape or an inertia{why}')
    carriers = _carriers(tree, shapes)
    _merge_massless(tree, shapes, carriers, poses)
    names = _names([name for name in tree.links if carriers[name] == name], [WORLD])
    root = next(name for name in tree.order if carriers[name] == name)
    bones = [make_bone(text, shapes[name], tree.links[name], poses[name],
                       [(link, poses[other]) for other, link in tree.links.items()
                        if carriers[other] == name != other and link.mass > 0], notes)
             for name, text in names.items()]
    joints = [_joint(tree, name, carriers, names, poses, angles, notes)
              for name in names if name != root]
    above = root
    while above in tree.joints:
        joint, above = tree.joints[above], tree.joints[above].parent
        if joint.kind not in ('fixed', 'floating'):
            notes.append(f'{joint.name}: nothing with a shape above it: left out')
    notes += _without_friction(tree)
    frames = _frames(poses, carriers, names, bones)
    return Ragdoll(plain_name(tree.name, 'link'), tuple(bones), tuple(joints), riders=frames), notes


def _carriers(tree: UrdfTree, shapes: dict[str, list]) -> dict[str, str]:
    """Link whose body carries each link: itself where it has one, a bare root's child."""
    carriers: dict[str, str] = {}
    for name in tree.order:
        above = tree.joints[name].parent if name in tree.joints else None
        own = bool(shapes[name]) and not (
            tree.links[name].mass <= 0 and above in carriers and carriers[above] is not None
            and tree.joints[name].kind == 'fixed')
        carriers[name] = name if own else carriers.get(above)
    # Links above the first body, and other branches of them, belong to that body.
    first = next(name for name in tree.order if carriers[name] == name)
    return {name: carrier or first for name, carrier in carriers.items()}


def _merge_massless(tree: UrdfTree, shapes: dict[str, list], carriers: dict[str, str],
                    poses: dict[str, Pose]) -> None:
    """Give what a link without a mass collides as to the link that carries it."""
    for name, link in tree.links.items():
        carrier = carriers[name]
        if carrier != name and link.collides:
            shapes[carrier] += [(shape, poses[carrier].relative(poses[name].compose(place)))
                                for shape, place in shapes[name]]


def _joint(tree: UrdfTree, name: str, carriers: dict[str, str], names: dict[str, str],
           poses: dict[str, Pose], angles: dict[str, float], notes: list[str]) -> Joint:
    """Joint of a body: of the joints in a row from the body that carries its parent."""
    row = [tree.joints[name]]
    while row[0].parent in tree.joints and carriers[row[0].parent] != row[0].parent:
        row.insert(0, tree.joints[row[0].parent])
    parent, child = names[carriers[row[0].parent]], names[name]
    anchor = poses[row[0].child].position
    for joint in row:
        if joint.kind in ('prismatic', 'planar'):
            notes.append(f'{joint.name}: a doll has no {joint.kind} joint: it is fixed')
        if joint.kind == 'floating':
            notes.append(f'{joint.name}: no doll has a floating joint: it becomes a ball joint')
        if joint.mimics is not None and joint.kind in ('revolute', 'continuous'):
            notes.append(f'{joint.name}: mimics {joint.mimics}: in the doll it turns by itself')
    if any(joint.kind in ('floating', 'spherical') for joint in row):
        ball = next(joint for joint in row if joint.kind in ('floating', 'spherical'))
        anchor, turn = poses[ball.child]
        axis = rotation.rotate(turn, np.array([0.0, 0.0, 1.0]))
        return Joint(parent, child, 'ball', anchor, (axis,), damping=ball.damping)
    turning = [joint for joint in row if joint.kind in ('revolute', 'continuous')]
    return _turning(parent, child, anchor, turning, poses, angles, notes)


def _without_friction(tree: UrdfTree) -> list[str]:
    """Notes on friction and restitution of joints and links, which none of a doll has."""
    joints = [joint.name for joint in tree.joints.values()
              if joint.friction > 0 and joint.kind in TURNING]
    links = [link.name for link in tree.links.values() if link.has_contact]
    return [f'{", ".join(names)}: {what}' for names, what in (
        (joints, 'dry friction (<dynamics friction>) is left out: joints of a doll have damping '
         'alone'),
        (links, 'how it touches (<contact>) is left out: friction and restitution are those of '
         'the scene')) if names]


def _turning(parent: str, child: str, anchor: np.ndarray, row: list[UrdfJoint],
             poses: dict[str, Pose], angles: dict[str, float], notes: list[str]) -> Joint:
    """One to three hinges that meet in a point are a hinge, a universal or a ball joint."""
    if not row:
        return Joint(parent, child, 'fixed', anchor)
    places = [poses[joint.child] for joint in row]
    meeting = [joint for joint, place in zip(row, places, strict=True)
               if np.linalg.norm(place.position - places[0].position) < SAME_PLACE]
    if len(meeting) < len(row):
        dropped = [joint.name for joint in row if joint not in meeting]
        notes.append(f'{", ".join(dropped)}: between links without a shape: fixed')
    axes = [rotation.rotate(poses[joint.child].orientation, joint.axis) for joint in meeting]
    limits = [_limits(joint, angles, notes) for joint in meeting]
    damping = max(joint.damping for joint in meeting)
    anchor = places[0].position
    if len(meeting) == 1:
        return Joint(parent, child, 'hinge', anchor, tuple(axes), tuple(limits), damping)
    if len(meeting) == 2 and abs(axes[0] @ axes[1]) < 1e-6:
        return Joint(parent, child, 'universal', anchor, tuple(axes), tuple(limits), damping)
    return Joint(parent, child, 'ball', anchor, (axes[-1],), _cone(limits), damping)


def _limits(joint: UrdfJoint, angles: dict[str, float],
            notes: list[str]) -> tuple[float, float] | None:
    """Limits from the angle that the joint starts at; None for a full circle and more."""
    if joint.kind == 'revolute' and joint.limits is None:
        notes.append(f'{joint.name}: a revolute joint without limits turns freely')
    if joint.limits is None or joint.limits[1] - joint.limits[0] >= 2 * math.pi:
        return None
    return tuple(limit - angles[joint.child] for limit in joint.limits)


def _cone(limits: list) -> tuple:
    """Swing and twist that hold the limits of hinges in a row, the last of them the twist."""
    def symmetric(pairs: list, most: float) -> tuple[float, float] | None:
        widest = max((max(map(abs, pair)) for pair in pairs if pair), default=0.0)
        if None in pairs or widest <= 0:
            return None
        return -min(widest, most), min(widest, most)

    return symmetric(limits[:-1], MAX_SWING), symmetric(limits[-1:], 2 * math.pi)


def _frames(poses: dict[str, Pose], carriers: dict[str, str], names: dict[str, str],
            bones: list[Bone]) -> tuple[SkeletonFrame, ...]:
    """Every link's frame, fixed on the body that carries it."""
    by_name = {bone.name: bone for bone in bones}
    carried = {name: by_name[names[carriers[name]]] for name in poses}
    return tuple(SkeletonFrame(text, carried[name].name, *carried[name].pose.relative(poses[name]))
                 for name, text in _names(list(poses)).items())


def _names(given: list[str], taken: Sequence[str] = ()) -> dict[str, str]:
    """Names as a doll takes them, each once, and none of those that are taken."""
    names: dict[str, str] = {}
    for name in given:
        text = plain_name(name, 'link')
        while text in names.values() or text in taken:
            text += '_'
        names[name] = text
    return names
