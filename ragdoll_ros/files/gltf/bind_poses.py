"""Bind poses of the joints of a glTF file's skins, the poses for which its skin was made.

In the bind pose joint j has the transform B inv(M_j), with its inverse bind matrix M_j and the
transform B from the mesh to the world, the same for all joints of a skin. The nodes of the file may
be in another pose, such as a step of a walk; B is then an estimate (see ``_mesh_to_world``).
Without inverse bind matrices the pose of the nodes is the bind pose.
"""
import itertools

import numpy as np

from ...model import errors
from .accessors import read_floats
from .gltf_file import GltfFile, get_container
from .nodes import Nodes


def read_skin(file: GltfFile, index: object, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Joint nodes (j,) of a skin, and their inverse bind matrices (j, 4, 4)."""
    skin, where = file.entry('skins', index, where), f'skins[{index}]'
    joints = get_container(skin, 'joints', list, where)
    if not joints:
        raise errors.WrongForm(f'{where}.joints', joints, 'at least one joint')
    for joint in joints:
        file.entry('nodes', joint, f'{where}.joints')
    joints = np.array(joints)
    if skin.get('inverseBindMatrices') is None:
        return joints, np.broadcast_to(np.eye(4), (len(joints), 4, 4))
    where = f'{where}.inverseBindMatrices'
    values = read_floats(file, skin['inverseBindMatrices'], 'MAT4', where)
    if len(values) < len(joints):
        raise errors.OutOfRange(where, len(values), f'{len(joints)} matrices, one for each joint')
    inverses = values[:len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).copy()
    # The specification fixes the last row; exporters write rounding errors there.
    inverses[:, 3] = (0, 0, 0, 1)
    singular = np.abs(np.linalg.det(inverses)) < 1e-30
    if singular.any():
        raise errors.WrongForm(f'{where}[{int(np.argmax(singular))}]', 'a matrix of determinant 0',
                               'matrices that have an inverse')
    return joints, inverses


def add_bind_matrices(found: dict[int, np.ndarray], nodes: Nodes, joints: np.ndarray,
                      inverses: np.ndarray, notes: list[str]) -> None:
    """Add the bind matrices of a skin's joints to those ``found``, which are kept."""
    known = [k for k, joint in enumerate(joints) if int(joint) in found]
    if (inverses == np.eye(4)).all():
        bind_matrices = nodes.worlds[joints]
    elif known:
        mesh_to_world = found[int(joints[known[0]])] @ inverses[known[0]]
        bind_matrices = mesh_to_world @ np.linalg.inv(inverses)
    else:
        bind_matrices = _mesh_to_world(nodes, joints, inverses, notes) @ np.linalg.inv(inverses)
    for joint, bind_matrix in zip(joints, bind_matrices, strict=True):
        found.setdefault(int(joint), bind_matrix)


def _mesh_to_world(nodes: Nodes, joints: np.ndarray, inverses: np.ndarray,
                   notes: list[str]) -> np.ndarray:
    """Transform B (4, 4) from a mesh in its bind pose to the world.

    Each joint gives the estimate world_j M_j; all agree if the nodes are in the bind pose. If not,
    that of the topmost joint is used, rotated to the nearest of the 24 axis-aligned rotations: a
    hip in the middle of a step is a few degrees off, a change of axes a multiple of 90.
    """
    estimates = nodes.worlds[joints] @ inverses
    top = min(range(len(joints)), key=lambda k: nodes.order.index(joints[k]))
    size = np.abs(estimates[top]).max()
    if not np.isfinite(estimates[top]).all() or not np.abs(np.linalg.det(estimates[top])) > 1e-30:
        raise errors.WrongForm('nodes', 'a scale of zero or infinity',
                               'nodes that give the skin an extent')
    if np.abs(estimates - estimates[top]).max() < 1e-3 * size:
        return estimates[top]
    notes.append('the nodes are in another pose than the bind pose, which is used')
    linear = estimates[top, :3, :3]
    scale = np.cbrt(np.abs(np.linalg.det(linear)))
    matrix = estimates[top].copy()
    matrix[:3, :3] = scale * _nearest_axis_rotation(linear / scale)
    return matrix


def _nearest_axis_rotation(matrix: np.ndarray) -> np.ndarray:
    """The rotation nearest to a matrix (3, 3) among the 24 that map axes to axes."""
    permutations = [np.eye(3)[list(p)] for p in itertools.permutations(range(3))]
    signs = [np.diag(s) for s in itertools.product((1.0, -1.0), repeat=3)]
    proper = [p @ s for p in permutations for s in signs if np.linalg.det(p @ s) > 0]
    return max(proper, key=lambda candidate: float(np.sum(candidate * matrix)))
