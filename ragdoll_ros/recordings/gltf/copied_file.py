"""Entries of a glTF file, copied into another with all that they refer to."""
from __future__ import annotations

import json
from collections.abc import Callable, Iterator

import numpy as np

from ...files.gltf.accessors import read_floats, read_indices
from ...files.gltf.gltf_file import GltfFile, get_container, get_count, get_objects
from ...files.gltf.images import media_type, read_image
from ...model import errors
from .glb import INDICES, Glb

DRACO = 'KHR_draco_mesh_compression'

QUANTIZED = 'KHR_mesh_quantization'
"""The extension that no entry names: its attributes are integers."""

TRIANGLES = 4
"""Mode of a primitive, and the default."""

MAX_BYTES = 1_000_000_000
"""Of all buffer views and images, which may overlap in the file."""

ACCESSOR_KEYS = ('name', 'componentType', 'type', 'count', 'byteOffset', 'normalized', 'min', 'max')


class CopiedFile:
    """Copies entries of ``file`` into ``glb``, each once but skins; methods return the new index.

    Materials keep their extensions; meshes keep all their attributes and morph targets. Broken
    textures and materials of meshes are left out, as no character is refused for its appearance.
    Methods raise a ModelError for anything else that is broken.
    """

    def __init__(self, glb: Glb, file: GltfFile) -> None:
        self._glb, self._file = glb, file
        self._made: dict[tuple, int] = {}
        self._bytes = 0
        self._add_copyright()
        if QUANTIZED in get_container(file.json, 'extensionsUsed', list, ''):
            self._add_extension(QUANTIZED)
        for kind, copy in (('images', self._image), ('materials', self.material)):
            for index in range(len(get_objects(file.json, kind))):
                _tried(copy, index)

    def material(self, index: object) -> int:
        """Copy a material."""
        return self._once('materials', index, lambda entry, _: self._textured(entry))

    def skin(self, index: object, base: int) -> int:
        """Add a skin. Its joints are the file's nodes, each at its index in the file plus
        ``base``.
        """
        entry, where = self._entry('skins', index), f'skins[{index}]'
        given = entry.get('inverseBindMatrices')
        made = {key: entry[key] for key in ('name', 'extras') if key in entry}
        if given is not None:
            made['inverseBindMatrices'] = self._accessor(given)
        joints = get_container(entry, 'joints', list, where)
        return self.add('skins', where, made | {'joints': [base + joint for joint in joints]})

    def mesh(self, index: object, own: np.ndarray | None = None) -> int:
        """Copy a mesh, or the triangles of those joints that the mask ``own`` (j,) selects."""
        def copied(entry: dict, where: str) -> dict:
            primitives = [self._primitive(each, f'{where}.primitives[{number}]', own)
                          for number, each in enumerate(get_objects(entry, 'primitives', where))]
            return {**{key: entry[key] for key in ('name', 'weights', 'extras') if key in entry},
                    'primitives': primitives}

        return self._once('meshes', index, copied, () if own is None else own.tobytes())

    def add(self, kind: str, where: str, entry: dict) -> int:
        """Add an entry to the list ``kind``, and the extensions that it uses; ``where`` is its
        place in the file.
        """
        try:
            json.dumps(entry, allow_nan=False)
        except ValueError as error:
            raise errors.NotFinite(where, str(error), 'finite numbers') from None
        for name in _extensions(entry):
            self._add_extension(name)
        return self._glb.add(kind, **entry)

    def _primitive(self, given: dict, where: str, own: np.ndarray | None) -> dict:
        made = {key: given[key] for key in ('mode', 'extras') if key in given}
        made['attributes'] = self._attributes(given, 'attributes', where)
        if given.get('targets'):
            made['targets'] = [self._attributes({'target': target}, 'target', where)
                               for target in get_objects(given, 'targets', where)]
        material = _tried(self.material, given.get('material'))
        if material is not None:
            made['material'] = material
        compressed = get_container(given, 'extensions', dict, where).get(DRACO)
        if own is not None:
            made['indices'] = self._glb.accessor(self._own_corners(given, where, own), INDICES)
        elif given.get('indices') is not None:
            made['indices'] = self._accessor(given['indices'])
        if isinstance(compressed, dict) and own is None:
            made['extensions'] = {DRACO: {**compressed,
                                          'bufferView': self._view(compressed.get('bufferView'))}}
        return made

    def _attributes(self, given: dict, key: str, where: str) -> dict[str, int]:
        return {name: self._accessor(accessor)
                for name, accessor in get_container(given, key, dict, where).items()}

    def _own_corners(self, given: dict, where: str, own: np.ndarray) -> np.ndarray:
        """Return the corners of those triangles of which each vertex is moved by one of a skin's
        ``own`` joints.
        """
        if get_count(given, 'mode', where, TRIANGLES) != TRIANGLES or DRACO in get_container(
                given, 'extensions', dict, where):
            raise errors.WrongForm(where, 'a strip, a fan or Draco compression',
                                   'plain triangles in the file of several characters')
        attributes = get_container(given, 'attributes', dict, where)
        moved = np.zeros(0, bool)
        for name in attributes:
            if name.startswith('JOINTS_'):
                slots = read_indices(self._file, attributes[name], 'VEC4', len(own), where)
                weights = read_floats(self._file, attributes.get(name.replace('JOINTS', 'WEIGHTS')),
                                      'VEC4', where)
                theirs = (own[slots] & (weights > 0)).any(axis=1)
                moved = theirs | moved if len(moved) else theirs
        corners = np.arange(len(moved)) if given.get('indices') is None else read_indices(
            self._file, given['indices'], 'SCALAR', len(moved), where)[:, 0]
        triangles = corners[:len(corners) // 3 * 3].reshape(-1, 3)
        return triangles[moved[triangles].all(axis=1)].ravel().astype(np.uint32)

    def _accessor(self, index: object) -> int:
        return self._once('accessors', index, lambda entry, where: {
            **{key: entry[key] for key in ACCESSOR_KEYS if entry.get(key) is not None},
            **self._viewed(entry),
            **({'sparse': self._sparse(entry, where)} if entry.get('sparse') else {})})

    def _sparse(self, entry: dict, where: str) -> dict:
        sparse = get_container(entry, 'sparse', dict, where)
        return {**sparse, **{key: {**part, **self._viewed(part)} for key, part in (
            (key, get_container(sparse, key, dict, where)) for key in ('indices', 'values'))}}

    def _viewed(self, entry: dict) -> dict:
        view = entry.get('bufferView')
        return {} if view is None else {'bufferView': self._view(view)}

    def _view(self, index: object) -> int:
        entry, where = self._file.entry('bufferViews', index, 'bufferView'), f'bufferViews[{index}]'
        if ('view', index) not in self._made:
            content = self._file.read(index, 0, get_count(entry, 'byteLength', where), where)
            kept = {key: entry[key] for key in ('name', 'byteStride', 'target')
                    if entry.get(key) is not None}
            self._count(content)
            self._made['view', index] = self._glb.view(content, **kept)
        return self._made['view', index]

    def _image(self, index: object) -> int:
        def copied(entry: dict, where: str) -> dict:
            content = read_image(self._file, entry, where)
            kind = media_type(content)
            if kind is None:
                raise errors.WrongForm(where, content[:4], 'PNG, JPEG, WebP or KTX2')
            self._count(content)
            name = {'name': entry['name']} if 'name' in entry else {}
            return {**name, 'bufferView': self._glb.view(content), 'mimeType': kind}

        return self._once('images', index, copied)

    def _texture(self, index: object) -> int:
        def copied(entry: dict, where: str) -> dict:
            made = {'name': entry['name']} if 'name' in entry else {}
            sampler, source = _tried(self._sampler, entry.get('sampler')), self._sources(entry)
            extensions = {name: self._sources(value) for name, value in get_container(
                entry, 'extensions', dict, where).items() if isinstance(value, dict)}
            extensions = {name: value for name, value in extensions.items() if value}
            if not source and not extensions:
                raise errors.WrongForm(where, entry.get('source'), 'an image')
            return {**made, **({} if sampler is None else {'sampler': sampler}), **source,
                    **({'extensions': extensions} if extensions else {})}

        return self._once('textures', index, copied)

    def _sources(self, entry: dict) -> dict[str, int]:
        image = _tried(self._image, entry.get('source'))
        return {} if image is None else {'source': image}

    def _sampler(self, index: object) -> int:
        return self._once('samplers', index, lambda entry, _: entry)

    def _textured(self, entry: dict) -> dict:
        """An object with the new indices of its textures, without those that are broken."""
        made = {}
        for key, value in entry.items():
            if isinstance(value, dict) and 'index' in value:
                texture = _tried(self._texture, value['index'])
                if texture is not None:
                    made[key] = {**value, 'index': texture}
            else:
                made[key] = self._textured(value) if isinstance(value, dict) else value
        return made

    def _once(self, kind: str, index: object, copied: Callable[[dict, str], dict],
              variant: object = ()) -> int:
        """Index of an entry's copy, which ``copied`` makes of it the first time."""
        entry, where = self._entry(kind, index), f'{kind}[{index}]'
        if (kind, index, variant) not in self._made:
            self._made[kind, index, variant] = self.add(kind, where, copied(entry, where))
        return self._made[kind, index, variant]

    def _entry(self, kind: str, index: object) -> dict:
        entries = get_objects(self._file.json, kind)
        if type(index) is not int or not 0 <= index < len(entries):
            raise errors.OutOfRange(kind, index, f'an index from 0 to {len(entries) - 1}')
        return entries[index]

    def _add_extension(self, name: str) -> None:
        for key in ('extensionsUsed', 'extensionsRequired'):
            names = self._glb.document.get(key, [])
            given = get_container(self._file.json, key, list, '')
            if name not in names and (name in given or key == 'extensionsUsed'):
                self._glb.document[key] = [*names, name]

    def _add_copyright(self) -> None:
        given = get_container(self._file.json, 'asset', dict, '').get('copyright')
        asset = self._glb.document['asset']
        if isinstance(given, str) and given not in asset.get('copyright', ''):
            asset['copyright'] = '; '.join(filter(None, (asset.get('copyright'), given)))

    def _count(self, content: bytes) -> None:
        self._bytes += len(content)
        if self._bytes > MAX_BYTES:
            raise errors.OutOfRange('bufferViews', f'{self._bytes} bytes', f'at most {MAX_BYTES}')


def _tried(copy: Callable[[object], int], index: object) -> int | None:
    """The copy of an entry; None where there is none or it is broken."""
    try:
        return None if index is None else copy(index)
    except (errors.ModelError, OSError):
        return None


def _extensions(entry: object) -> Iterator[str]:
    """Names of the extensions that an entry uses."""
    values = entry if isinstance(entry, list) else entry.values() if isinstance(entry, dict) else ()
    if isinstance(entry, dict) and isinstance(entry.get('extensions'), dict):
        yield from entry['extensions']
    for value in values:
        yield from _extensions(value)
