"""Meshes without a skin that hang from bones: armour, hats, the parts of a robot.

Each is skin that one bone moves alone. In a file without any skin every node with a mesh is a bone,
or its parent if that is there for this one mesh: a joint.
"""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import errors
from .gltf_file import GltfFile
from .nodes import Nodes
from .skins import Skins, look_of, primitive_points, primitives, triangles_of


def add_rigid_meshes(file: GltfFile, nodes: Nodes, skins: Skins) -> None:
    """Add all meshes that no skin moves; a note tells how many hang from no bone.

    WrongForm where the file has no skin and less than two parts.
    """
    loose = [index for index, node in enumerate(file.json['nodes'])
             if node.get('mesh') is not None and node.get('skin') is None]
    if not skins.rests:
        bones = {node: _pivot(file, nodes, node) for node in loose}
        if file.json['skins'] or len(set(bones.values())) < 2:
            raise errors.WrongForm('skins', 'no skin that moves a mesh',
                                   'a skinned mesh (a node with both mesh and skin), or a file '
                                   'without skins whose parts are meshes of several nodes')
        skins.rests.update((bone, nodes.worlds[bone]) for bone in bones.values())
        skins.notes.append(f'no skin: its {len(bones)} meshes are taken for rigid parts')
    else:
        bones = {node: _bone_above(nodes, skins, node) for node in loose}
    left = sum(not _add(file, nodes, skins, node, bone) for node, bone in bones.items())
    if left:
        skins.notes.append(f'{left} mesh{"es" * (left > 1)} without a skin and on no bone left out')


def _add(file: GltfFile, nodes: Nodes, skins: Skins, node: int, bone: int) -> bool:
    """Add the mesh of a node in the bind pose of its bone; False where it has no place."""
    if bone < 0 or not abs(np.linalg.det(nodes.worlds[bone])) > 1e-30:
        return False
    place = skins.rests[bone] @ np.linalg.inv(nodes.worlds[bone]) @ nodes.worlds[node]
    for primitive, where in primitives(file, file.json['nodes'][node], node):
        points = primitive_points(file, primitive, where)
        triangles = triangles_of(file, primitive, len(points), where)
        # A mirrored part would be inside out, and its volume below zero.
        triangles = triangles[:, ::-1] if np.linalg.det(place[:3, :3]) < 0 else triangles
        look = look_of(file, primitive, len(points), where)
        skins.add(points @ place[:3, :3].T + place[:3, 3], triangles,
                  np.full((len(points), 1), bone, np.int32), np.ones((len(points), 1)),
                  replace(look, normals=look.normals @ place[:3, :3].T))
    return True


def _bone_above(nodes: Nodes, skins: Skins, node: int) -> int:
    while node >= 0 and node not in skins.rests:
        node = nodes.parents[node]
    return node


def _pivot(file: GltfFile, nodes: Nodes, node: int) -> int:
    """The bone of a mesh: its parent, if that has no other mesh than this one's, at its end."""
    parent = nodes.parents[node]
    if parent < 0 or nodes.children[node]:
        return node
    ends = [other for other in nodes.children[parent] if not nodes.children[other]]
    held = file.json['nodes'][parent].get('mesh') is not None
    return node if held or len(ends) > 1 else parent
