"""Attachment of meshes without a skin to bones: armour, hats, parts of a robot.

Each mesh becomes skin of one bone with weight 1. In a file without skins each node with a mesh
becomes a bone, or its parent if that is the pivot of this mesh only.
"""
from dataclasses import replace

import numpy as np

from ...files.gltf.bones import rigid_parts, unskinned_meshes
from ...files.gltf.gltf_file import GltfFile
from ...files.gltf.nodes import Nodes
from .skins import Skins, primitives, read_appearance, read_positions, read_triangles


def add_rigid_meshes(file: GltfFile, nodes: Nodes, skins: Skins) -> None:
    """Add all unskinned meshes; a note counts those without an invertible bone above.

    Raises WrongForm where no mesh is skinned and the file has an unused skin or fewer than two
    parts.
    """
    if not skins.bind_matrices:
        bones = rigid_parts(file, nodes)
        skins.bind_matrices.update((bone, nodes.worlds[bone]) for bone in bones.values())
        skins.notes.append(f'no skin: the {len(bones)} meshes become rigid parts')
    else:
        bones = {node: nodes.nearest(node, skins.bind_matrices) for node in unskinned_meshes(file)}
    left = sum(not _add(file, nodes, skins, node, bone) for node, bone in bones.items())
    if left:
        skins.notes.append(f'{left} mesh{"es" * (left > 1)} without a skin and a bone ignored')


def _add(file: GltfFile, nodes: Nodes, skins: Skins, node: int, bone: int) -> bool:
    """Add the mesh of a node, fixed to a bone in its bind pose; False without an
    invertible bone.
    """
    if bone < 0 or not abs(np.linalg.det(nodes.worlds[bone])) > 1e-30:
        return False
    place = skins.bind_matrices[bone] @ np.linalg.inv(nodes.worlds[bone]) @ nodes.worlds[node]
    for primitive, where in primitives(file, file.json['nodes'][node], node):
        points = read_positions(file, primitive, where)
        triangles = read_triangles(file, primitive, len(points), where)
        # Reflection turns triangles inside out.
        triangles = triangles[:, ::-1] if np.linalg.det(place[:3, :3]) < 0 else triangles
        appearance = read_appearance(file, primitive, len(points), where)
        skins.add(points @ place[:3, :3].T + place[:3, 3], triangles,
                  np.full((len(points), 1), bone, np.int32), np.ones((len(points), 1)),
                  replace(appearance, normals=appearance.normals @ place[:3, :3].T))
    return True
