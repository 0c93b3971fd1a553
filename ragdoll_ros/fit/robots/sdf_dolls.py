"""SDF to dolls: one for each robot or body of the file that nothing attaches to another.

Links and joints are read as a UrdfTree (files/robots/sdf_tree.py), in which all free models hang on
a link WORLD without a shape. Each is then converted as the robot of a URDF (robot.py); static
models are left out.
"""
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ...files.doll import plain_name
from ...files.robots.sdf_tree import WORLD, parse_sdf
from ...files.robots.urdf_tree import UrdfTree
from ...files.robots.xml_text import read_xml
from ...model import errors
from ...model.scene import Placement
from .robot import doll_from_tree

INCLUDED = 'an <include>'
"""What is left out of the link that stands for what a file includes."""

NOT_FREE = 'a model that moves: a scene has what is <static> as a body, {sdf: FILE}'


def read_sdf(path: str | Path) -> list[tuple[Placement, tuple[str, ...]]]:
    """Dolls of an SDF file at their poses in it, each with notes on what could not be imported.

    Raises ModelErrors with the faults, OSError where it cannot be read.
    """
    path = Path(path)
    try:
        return _read(parse_sdf(read_xml(path, 'sdf')), path.parent)
    except errors.ModelError as error:
        raise errors.ModelErrors(str(path), [error]) from None


def dolls_from_sdf(text: str) -> list[tuple[Placement, tuple[str, ...]]]:
    """Dolls of the text of an SDF, as read_sdf() without a folder for meshes; raises a ModelError
    with the fault.
    """
    return _read(parse_sdf(text), None)


def _read(tree: UrdfTree, folder: Path | None) -> list[tuple[Placement, tuple[str, ...]]]:
    made: list[tuple[Placement, tuple[str, ...]]] = []
    poses, others, static = tree.poses(tree.initial_angles), [], []
    refused: list[errors.ModelError] = []
    for root, part in _free_parts(tree):
        first = next(link for link in part.links.values() if link.is_in_file)
        if INCLUDED in first.left_out:
            others.append(f'{root}: {INCLUDED} is left out: put the model itself there, as '
                          '`gz sdf -p FILE` prints it')
        elif first.is_static:
            static.append(root)
        else:
            try:
                doll, notes = doll_from_tree(part, folder)
            except errors.ModelError as error:
                refused.append(error)
                continue
            held = tree.joints[root]
            if held.kind != 'fixed':
                notes.append(f'{held.name}: a {held.kind} joint to the world: ignored')
            position, orientation = poses[root]
            made.append((Placement(doll, position=position, orientation=orientation),
                         tuple(notes)))
    if not made and refused:
        raise refused[0]
    if not made:
        why = f' ({others[0]})' if others else ''
        raise errors.WrongForm('model', static[:5], NOT_FREE + why)
    others += [f'{name}: <static>, no doll: a scene has it as a body, {{sdf: FILE, without: [...]}}'
               for name in static]
    others += [f'left out: {error}' for error in refused]
    placements = _with_names([placement for placement, _ in made])
    notes_of = [notes for _, notes in made]
    notes_of[0] += tuple(others)
    return list(zip(placements, notes_of, strict=True))


def _free_parts(tree: UrdfTree) -> Iterator[tuple[str, UrdfTree]]:
    """Root link of each tree that hangs on the link WORLD, and the tree, with names relative to its
    model.
    """
    root_of: dict[str, str] = {}
    for name in tree.order:
        if name != WORLD:
            root_of[name] = root_of.get(tree.joints[name].parent, name)
    for root in dict.fromkeys(root_of.values()):
        names = [name for name in tree.links if root_of.get(name) == root]
        model = _common_model([name for name in names if tree.links[name].is_in_file])
        yield root, UrdfTree(model or tree.name, *_named_within(tree, names, model))


def _common_model(names: Sequence[str]) -> str:
    """The model that all links are in, by their names model::link; '' without one."""
    models = [name.split('::')[:-1] for name in names]
    shared = itertools.takewhile(lambda parts: len(set(parts)) == 1, zip(*models, strict=False))
    return '::'.join(parts[0] for parts in shared)


def _named_within(tree: UrdfTree, names: Sequence[str], model: str) -> tuple[dict, dict, dict]:
    """Links, joints and left-out joints of one part of a tree; names are without the
    model's name.
    """
    prefix = f'{model}::' if model else ''

    def short(name: str) -> str:
        return name.removeprefix(prefix)

    links = {short(name): replace(tree.links[name], name=short(name)) for name in names}
    joints = {short(name): replace(
        joint, name=short(joint.name), parent=short(joint.parent), child=short(name),
        mimics=joint.mimics and joint.mimics._replace(joint=short(joint.mimics.joint)))
        for name, joint in tree.joints.items() if name in names and joint.parent != WORLD}
    return links, joints, {short(name): short(child) for name, child in tree.left_out.items()
                           if child in names}


def _with_names(placements: Sequence[Placement]) -> list[Placement]:
    """The dolls with unique names: the second robot is robot_2."""
    names: list[str] = []
    for placement in placements:
        name, number = plain_name(placement.doll.name, 'robot'), 2
        while name in names:
            name, number = f'{plain_name(placement.doll.name, "robot")}_{number}', number + 1
        names.append(name)
    return [replace(placement, name=name, doll=replace(placement.doll, name=name))
            for placement, name in zip(placements, names, strict=True)]
