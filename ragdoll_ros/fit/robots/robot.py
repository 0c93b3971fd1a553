"""URDF to Ragdoll: a robot without motor torques.

A link with a shape, a mesh or the inertia of a plausible box becomes a body. Its joint becomes a
hinge, or part of a universal or ball joint where links that are no bodies are in between (as
to_urdf writes them). Other links are merged into their parents with mass and inertia. So are, with
their shapes, a link without a mass that is fixed to its parent, and one that weighs next to
nothing. Every link's frame becomes a frame of the doll, so that it can be published. Angles have
the names of the joints in the file, where they count from the same zero.
"""
import itertools
import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...files.doll import plain_name
from ...files.robots.urdf_tree import UrdfJoint, UrdfTree, parse_urdf
from ...files.robots.xml_text import read_xml
from ...model import errors, rotation
from ...model.pose import Pose
from ...model.ragdoll import MAX_SWING, WORLD, Bone, Joint, Ragdoll, SkeletonFrame
from ..bodies.overlap import colliding_overlaps
from .link_bodies import DEFAULT_DENSITY, LinkMeshes, PlacedShape, link_shapes, make_bone
from .xacro_text import expand_xacro

ROTATING_KINDS = ('revolute', 'continuous', 'floating', 'spherical')
"""URDF joint kinds that become a joint with angles."""

LIGHTEST_SHARE = 1e-6
"""Of the robot's mass: lighter links are merged into their parents. Their motion would be that of
their joints alone, and masses of such ratios are refused (files/doll.py, LARGEST_MASS_RATIO)."""

TOUCHING = 0.001
"""m; gap at the initial angles up to which two bodies do not collide. Shapes around meshes reach
beyond them: neighbours would jam in every pose."""

SAME_POINT = 1e-6
"""m; distance up to which successive axes intersect."""


def doll_from_urdf(text: str) -> Ragdoll:
    """Doll of a URDF's text; raises a ModelError with the fault.

    Its frame is the root link's; joints are at angle zero, or at the nearest angle within limits.
    """
    return doll_from_tree(parse_urdf(text))[0]


def read_urdf(path: str | Path) -> tuple[Ragdoll, tuple[str, ...]]:
    """Doll of a URDF or xacro file, and notes on what could not be imported.

    As doll_from_urdf; raises ModelErrors with the faults, OSError where it cannot be read.
    """
    path = Path(path)
    try:
        is_xacro = path.suffix.lower() == '.xacro'
        text = expand_xacro(path) if is_xacro else read_xml(path, 'robot')
        doll, notes = doll_from_tree(parse_urdf(text), path.parent)
        return doll, tuple(notes)
    except errors.ModelError as error:
        raise errors.ModelErrors(str(path), [error]) from None


def doll_from_tree(tree: UrdfTree, folder: Path | None = None) -> tuple[Ragdoll, list[str]]:
    """Doll of links and joints, and notes; ``folder`` is that of their file, for its meshes.

    Raises a ModelError where no doll can represent them.
    """
    notes: list[str] = []
    angles = tree.initial_angles
    poses = tree.poses(angles)
    meshes = LinkMeshes(folder)
    # Where no link has a mass, links with visuals only become bodies too.
    massless = all(link.mass <= 0 for link in tree.links.values())
    shapes = {name: link_shapes(link, meshes, notes)
              if massless or link.mass > 0 or link.collides else []
              for name, link in tree.links.items()}
    if not any(shapes.values()):
        why = f' ({notes[0]})' if notes else ''
        raise errors.WrongForm('link', list(tree.links)[:5],
                               f'a link with a shape or an inertia{why}')
    light = _light_links(tree, shapes)
    carriers = _find_carriers(tree, shapes, light)
    _merge_shapes(tree, shapes, carriers, poses)
    notes += [f'{name}: {mass:.2g} kg, less than a millionth of the robot: part of {carriers[name]}'
              for name, mass in light.items() if shapes[name] and carriers[name] != name]
    names = _unique_names([name for name in tree.links if carriers[name] == name], [WORLD])
    root = next(name for name in tree.order if carriers[name] == name)
    bones = [make_bone(text, shapes[name], tree.links[name], poses[name],
                       [(link, poses[other]) for other, link in tree.links.items()
                        if carriers[other] == name != other and link.mass > 0], notes)
             for name, text in names.items()]
    joints = _named_alone([_joint(tree, name, carriers, light, names, poses, angles, notes)
                           for name in names if name != root])
    above = root
    while above in tree.joints:
        joint, above = tree.joints[above], tree.joints[above].parent
        if joint.kind not in ('fixed', 'floating'):
            notes.append(f'{joint.name}: no link above it has a shape: ignored')
    notes += _note_friction(tree)
    notes += [f'{name}: closes a loop, of which a doll has none: ignored' for name in tree.left_out]
    frames = _frames({name: pose for name, pose in poses.items() if tree.links[name].is_in_file},
                     carriers, names, bones)
    doll = Ragdoll(plain_name(tree.name, 'link'), tuple(bones), tuple(joints), riders=frames)
    doll = replace(doll, no_collision=_pairs_of_parts(doll))
    touching = colliding_overlaps(doll, -TOUCHING)
    return replace(doll, no_collision=(*doll.no_collision, *touching)), notes


def _pairs_of_parts(doll: Ragdoll) -> tuple[tuple[str, str], ...]:
    """Pairs of bones of one part, which fixed joints hold together, and of two parts that a joint
    connects. Pairs that a joint connects directly are omitted. MuJoCo excludes all these from
    collision too.
    """
    part, beside = {doll.root.name: [doll.root.name]}, []
    for joint in doll.joints_from_root():
        above = part[joint.parent]
        if joint.kind == 'fixed':
            above.append(joint.child)
            part[joint.child] = above
        else:
            part[joint.child] = [joint.child]
            beside.append((above, part[joint.child]))
    parts, jointed = {id(bones): bones for bones in part.values()}.values(), doll.excluded_pairs
    return tuple(pair for pair in itertools.chain(
        *(itertools.combinations(bones, 2) for bones in parts),
        *(itertools.product(above, below) for above, below in beside))
        if frozenset(pair) not in jointed)


def _light_links(tree: UrdfTree, shapes: dict[str, list[PlacedShape]]) -> dict[str, float]:
    """Masses, by name, of links below LIGHTEST_SHARE of the robot's mass; the mass of a link
    without one is that of its shapes filled with water.
    """
    whole = sum(link.mass for link in tree.links.values())
    masses = {name: link.mass or DEFAULT_DENSITY * sum(shape.volume for shape, _ in shapes[name])
              for name, link in tree.links.items()}
    return {name: mass for name, mass in masses.items() if 0 < mass < LIGHTEST_SHARE * whole}


def _find_carriers(tree: UrdfTree, shapes: dict[str, list],
                   light: Collection[str]) -> dict[str, str]:
    """Carrier of each link: itself if it becomes a body, else its parent's carrier; for links above
    the first body, and their other branches, that body. A ``light`` link becomes no body.
    """
    carriers: dict[str, str] = {}
    heavy = any(link.mass > 0 for link in tree.links.values())
    for name in tree.order:
        above = tree.joints[name].parent if name in tree.joints else None
        own = bool(shapes[name]) and name not in light and not (
            tree.links[name].mass <= 0 and (
                tree.joints[name].kind == 'fixed' if carriers.get(above)
                else heavy and _has_fixed_child(tree, name)))
        carriers[name] = name if own else carriers.get(above)
    # Links above the first body, and their other branches, are merged into that body.
    first = next(name for name in tree.order if carriers[name] == name)
    return {name: carrier or first for name, carrier in carriers.items()}


def _has_fixed_child(tree: UrdfTree, name: str) -> bool:
    """Whether a link with a mass is fixed to a link."""
    return any(joint.kind == 'fixed' and tree.links[child].mass > 0
               for child, joint in tree.joints.items() if joint.parent == name)


def _merge_shapes(tree: UrdfTree, shapes: dict[str, list], carriers: dict[str, str],
                  poses: dict[str, Pose]) -> None:
    """Add the collision shapes of links that are no bodies to their carriers."""
    for name, link in tree.links.items():
        carrier = carriers[name]
        if carrier != name and link.collides:
            shapes[carrier] += [(shape, poses[carrier].relative(poses[name].compose(place)))
                                for shape, place in shapes[name]]


def _joint(tree: UrdfTree, name: str, carriers: dict[str, str], light: Collection[str],
           names: dict[str, str], poses: dict[str, Pose], angles: dict[str, float],
           notes: list[str]) -> Joint:
    """Joint of a body, from the chain of joints between it and its parent body. The chain begins at
    a ``light`` link, which is fixed to that body, if there is one in between.
    """
    chain = [tree.joints[name]]
    while (chain[0].parent in tree.joints and carriers[chain[0].parent] != chain[0].parent
           and chain[0].parent not in light):
        chain.insert(0, tree.joints[chain[0].parent])
    parent, child = names[carriers[chain[0].parent]], names[name]
    anchor = poses[chain[0].child].position
    for joint in chain:
        if joint.kind not in (*ROTATING_KINDS, 'fixed'):
            notes.append(f'{joint.name}: {joint.kind} joints are not supported: fixed')
        if joint.kind == 'floating':
            notes.append(f'{joint.name}: floating joints are not supported: a ball joint')
        if joint.mimics is not None and joint.kind in ('revolute', 'continuous'):
            notes.append(f'{joint.name}: mimics {joint.mimics.joint}: becomes an independent joint')
    if any(joint.kind in ('floating', 'spherical') for joint in chain):
        ball = next(joint for joint in chain if joint.kind in ('floating', 'spherical'))
        anchor, turn = poses[ball.child]
        axis = rotation.rotate(turn, np.array([0.0, 0.0, 1.0]))
        return Joint(parent, child, 'ball', anchor, (axis,), damping=ball.damping)
    hinges = [joint for joint in chain if joint.kind in ('revolute', 'continuous')]
    return _combine_hinges(parent, child, anchor, hinges, poses, angles, notes)


def _named_alone(joints: list[Joint]) -> list[Joint]:
    """The joints; one loses its given names if any of these is also the name of another angle or a
    default name.
    """
    plain = [replace(joint, names=()) for joint in joints]
    counts = Counter(name for joint in joints for name in joint.angle_names)
    taken = {name for joint in plain for name in joint.angle_names}
    return [joint if all(counts[name] == 1 and name not in taken for name in joint.names) else bare
            for joint, bare in zip(joints, plain, strict=True)]


def _note_friction(tree: UrdfTree) -> list[str]:
    """Notes on friction and restitution of joints and links, which dolls do not have."""
    joints = [joint.name for joint in tree.joints.values()
              if joint.friction > 0 and joint.kind in ROTATING_KINDS]
    links = [link.name for link in tree.links.values() if link.has_contact]
    return [f'{", ".join(names)}: {what}' for names, what in (
        (joints, 'dry friction (<dynamics friction>) is ignored: joints of a doll have damping '
         'only'),
        (links, 'contact properties (<contact>) are ignored: the scene defines friction and '
         'restitution')) if names]


def _combine_hinges(parent: str, child: str, anchor: np.ndarray, chain: list[UrdfJoint],
                    poses: dict[str, Pose], angles: dict[str, float], notes: list[str]) -> Joint:
    """Joint of the hinges of a ``chain`` that coincide with the first one: hinge, universal, ball
    or, without any, fixed. A note names the other hinges.
    """
    if not chain:
        return Joint(parent, child, 'fixed', anchor)
    frames = [poses[joint.child] for joint in chain]
    concurrent = [joint for joint, place in zip(chain, frames, strict=True)
                  if np.linalg.norm(place.position - frames[0].position) < SAME_POINT]
    if len(concurrent) < len(chain):
        dropped = [joint.name for joint in chain if joint not in concurrent]
        notes.append(f'{", ".join(dropped)}: between links without a shape: fixed')
    axes = [rotation.rotate(poses[joint.child].orientation, joint.axis) for joint in concurrent]
    limits = [_limits(joint, angles, notes) for joint in concurrent]
    damping = max(joint.damping for joint in concurrent)
    anchor = frames[0].position
    # Angles that count from elsewhere than the file's do not have its names.
    known = () if any(angles.get(joint.child) for joint in concurrent) else tuple(
        plain_name(joint.name, 'joint') for joint in concurrent)
    if len(concurrent) == 1:
        return Joint(parent, child, 'hinge', anchor, tuple(axes), tuple(limits), damping, known)
    if len(concurrent) == 2 and abs(axes[0] @ axes[1]) < 1e-6:
        return Joint(parent, child, 'universal', anchor, tuple(axes), tuple(limits), damping, known)
    return Joint(parent, child, 'ball', anchor, (axes[-1],), _swing_twist_limits(limits), damping)


def _limits(joint: UrdfJoint, angles: dict[str, float],
            notes: list[str]) -> tuple[float, float] | None:
    """Limits relative to the initial angle; None for a full turn or more."""
    if joint.kind == 'revolute' and joint.limits is None:
        notes.append(f'{joint.name}: a revolute joint without limits becomes continuous')
    if joint.limits is None or joint.limits[1] - joint.limits[0] >= 2 * math.pi:
        return None
    return tuple(limit - angles[joint.child] for limit in joint.limits)


def _swing_twist_limits(limits: list) -> tuple:
    """Symmetric swing and twist limits that contain those of successive hinges, up to MAX_SWING and
    a full turn; the last hinge is the twist. None where one has no limits.
    """
    def symmetric(pairs: list, most: float) -> tuple[float, float] | None:
        widest = max((max(map(abs, pair)) for pair in pairs if pair), default=0.0)
        if None in pairs or widest <= 0:
            return None
        return -min(widest, most), min(widest, most)

    return symmetric(limits[:-1], MAX_SWING), symmetric(limits[-1:], 2 * math.pi)


def _frames(poses: dict[str, Pose], carriers: dict[str, str], names: dict[str, str],
            bones: list[Bone]) -> tuple[SkeletonFrame, ...]:
    """Frames of all links, fixed to the bodies that carry them."""
    by_name = {bone.name: bone for bone in bones}
    bodies = {name: by_name[names[carriers[name]]] for name in poses}
    return tuple(SkeletonFrame(text, bodies[name].name, *bodies[name].pose.relative(poses[name]))
                 for name, text in _unique_names(list(poses)).items())


def _unique_names(given: list[str], taken: Sequence[str] = ()) -> dict[str, str]:
    """Unique names that a doll may have, other than those in ``taken``."""
    names: dict[str, str] = {}
    for name in given:
        text = plain_name(name, 'link')
        while text in names.values() or text in taken:
            text += '_'
        names[name] = text
    return names
