"""The surface of a doll's skin in a glTF file: normals, materials, images."""
import numpy as np

from ...model.skeleton import Appearance, Skin
from .glb import ATTRIBUTES, INDICES, Glb

ROUGHNESS = 0.8
"""glTF's roughnessFactor of surfaces without materials."""


def surface_glb(skin: Skin) -> bytes:
    """The surface in its bind pose, doll's frame, z up, as a .glb for viser.

    Its primitives are the runs of group_by_material. Normals are in the attribute _NORMAL too, as
    viser replaces NORMAL.
    """
    glb = Glb()
    normals = skin_normals(skin)
    mesh = glb.add('meshes', primitives=_primitives(
        glb, skin, {'NORMAL': normals, '_NORMAL': normals}))
    glb.document['scene'] = glb.add('scenes', nodes=[glb.add('nodes', mesh=mesh)])
    return glb.content()


def group_by_material(skin: Skin) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
    """Triangles (t, 3) sorted by material, and each run's material, begin and end."""
    materials = (np.full(len(skin.triangles), -1) if skin.appearance is None
                 else skin.appearance.material_indices)
    order = np.argsort(materials, kind='stable')
    found, firsts = np.unique(materials[order], return_index=True)
    ends = [*firsts[1:].tolist(), len(materials)]
    return skin.triangles[order], list(zip(found.tolist(), firsts.tolist(), ends, strict=True))


def skin_normals(skin: Skin) -> np.ndarray:
    """Unit normals (v, 3) in the bind pose, doll's frame: the file's, else smooth ones."""
    smooth = smooth_normals(skin.vertices, skin.triangles)
    if skin.appearance is None:
        return smooth
    normals = skin.appearance.normals
    return np.where(normals.any(axis=1, keepdims=True), normals, smooth)


def add_material(glb: Glb, color: tuple[float, ...]) -> int:
    """Add a material of an sRGB colour with opacity, each from 0 to 1."""
    values = np.array(color[:3])
    # IEC 61966-2-1: glTF's factors are linear.
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return glb.add('materials', alphaMode='OPAQUE' if color[3] == 1 else 'BLEND',
                   pbrMetallicRoughness={'baseColorFactor': [*linear.tolist(), color[3]],
                                         'metallicFactor': 0.0, 'roughnessFactor': ROUGHNESS})


def _primitives(glb: Glb, skin: Skin, directions: dict[str, np.ndarray]) -> list[dict]:
    """A primitive for each material, all with the same vertices."""
    given = {'POSITION': skin.vertices, **directions}
    if skin.appearance is not None:
        given['TEXCOORD_0'] = skin.appearance.uvs
    attributes = {name: glb.accessor(values.astype(np.float32), ATTRIBUTES)
                               for name, values in given.items()}
    triangles, runs = group_by_material(skin)
    taken = [] if skin.appearance is None else _add_materials(glb, skin.appearance)
    return [{'attributes': attributes,
             'material': taken[number] if number >= 0 else add_material(glb, skin.color),
             'indices': glb.accessor(triangles[begin:end].astype(np.uint32).ravel(), INDICES)}
            for number, begin, end in runs]


def _add_materials(glb: Glb, appearance: Appearance) -> list[int]:
    """Add materials with their textures. Returns their indices."""
    textures = []
    for texture in appearance.textures:
        image = glb.add('images', bufferView=glb.view(texture.image), mimeType=texture.kind)
        textures.append(glb.add('textures', source=image,
                                sampler=glb.add('samplers', **texture.sampler)))
    return [glb.add('materials', **_with_textures(glb, material, textures))
            for material in appearance.materials]


def _with_textures(glb: Glb, entry: dict, textures: list[int]) -> dict:
    """Return a material with ``glb``'s indices of textures; adds its extensions to
    extensionsUsed.
    """
    made = {}
    for key, value in entry.items():
        made[key] = _with_textures(glb, value, textures) if isinstance(value, dict) else value
        if key == 'index':
            made[key] = textures[value]
        elif key == 'extensions':
            used = glb.document.setdefault('extensionsUsed', [])
            used += [name for name in value if name not in used]
    return made


def smooth_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return unit normals (v, 3): around each vertex the mean of the triangles' normals, weighted
    by area; the z axis where there is none.
    """
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.stack([np.bincount(triangles.ravel(), np.repeat(component, 3), len(vertices))
                     for component in normals.T], axis=1)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(lengths > 1e-30, sums / np.maximum(lengths, 1e-30), (0.0, 0.0, 1.0))
