"""A fitted character in a recording: its own file, with the motion of its doll.

Its nodes, skins, meshes, materials and images are those of the file, below a node for the doll
that turns the file's axes and units to the recording's. Its animations, cameras, lights and
extensions of the whole file, such as VRM's, are left out.
"""
from __future__ import annotations

import numpy as np

from ...files.gltf.bind_poses import read_skin
from ...model.pose import Pose
from ..file_skeleton import FileSkeleton
from ..recording import points_y_up
from .animation import GltfAnimation
from .copied_file import CopiedFile
from .node_motion import bone_motions, doll_node

KEPT = ('name', 'weights', 'extras')
"""Properties of a node that are copied."""

TRANSFORM = ('matrix', 'translation', 'rotation', 'scale')


def add_character(animation: GltfAnimation, copied: CopiedFile, skeleton: FileSkeleton,
                  bones: Pose, name: str) -> int:
    """Add a character and its motion. Returns the index of its doll's node.

    Args:
        animation: of the recording.
        copied: the file of the skeleton.
        skeleton: of the doll.
        bones: (k, b + l) poses of the doll's bones and of the links of its swings, world frame.
        name: of the doll's node.

    Raises:
        ModelError: the file is broken.
        OSError: it cannot be read.
    """
    poses = skeleton.poses(bones)
    root = doll_node(skeleton, points_y_up(poses.position))
    motions = bone_motions(skeleton, poses, root)
    nodes, glb = skeleton.source.nodes, animation.glb
    base = len(glb.document.get('nodes', []))
    meshes = _meshes(copied, skeleton, base)
    for node, given in enumerate(skeleton.source.file.json['nodes']):
        transform = motions[node][1].entry() if node in motions else {
            key: given[key] for key in TRANSFORM if given.get(key) is not None}
        children = [base + child for child in nodes.children[node]]
        kept = {key: given[key] for key in KEPT if given.get(key) is not None}
        copied.add('nodes', f'nodes[{node}]', {
            **kept, **transform, **meshes.get(node, {}),
            **({'children': children} if children else {})})
    for node, (moves, motion) in motions.items():
        if moves:
            animation.add(base + node, {'translation': motion.translation,
                                        'rotation': motion.rotation})
    tops = [base + node for node, up in enumerate(nodes.parents) if up < 0]
    return glb.add('nodes', name=name, **root.entry(), children=tops)


def _meshes(copied: CopiedFile, skeleton: FileSkeleton, base: int) -> dict[int, dict[str, int]]:
    """Return ``mesh`` and ``skin`` of the nodes that have a part of the doll's skin.

    A mesh without a skin belongs to that skin if its node is a bone of the skeleton or below one.
    """
    source, own = skeleton.source, set(skeleton.nodes)
    below = set(own)
    for node in source.nodes.order:
        if source.nodes.parents[node] in below:
            below.add(node)
    found = {}
    for node, given in enumerate(source.file.json['nodes']):
        mesh, skin = given.get('mesh'), given.get('skin')
        if mesh is None:
            continue
        if skin is None:
            if node in below:
                found[node] = {'mesh': copied.mesh(mesh)}
            continue
        joints, _ = read_skin(source.file, skin, f'nodes[{node}].skin')
        mask = np.isin(joints, skeleton.nodes)
        if mask.any():
            found[node] = {'mesh': copied.mesh(mesh, None if mask.all() else mask),
                           'skin': copied.skin(skin, base)}
    return found
