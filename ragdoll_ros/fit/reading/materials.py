"""Materials and images of a glTF file, for viewers.

Section 5.19 of glTF 2.0, KHR_materials_unlit and KHR_texture_transform, with the first set of
texture coordinates. Invalid parts are ignored: no character is refused for its appearance.
"""
import math

from ...files.gltf.gltf_file import GltfFile
from ...files.gltf.images import media_type, read_image
from ...model import errors
from ...model.skeleton import Texture

MAX_IMAGE_BYTES = 64_000_000
"""Total size of a character's images; each open page receives them once."""

NUMERIC_KEYS = {'baseColorFactor': 4, 'metallicFactor': 1, 'roughnessFactor': 1,
                'emissiveFactor': 3, 'alphaCutoff': 1, 'scale': 1, 'strength': 1, 'offset': 2,
                'rotation': 1}
"""Numeric properties and their numbers of components."""

TEXTURES = ('baseColorTexture', 'metallicRoughnessTexture', 'normalTexture', 'occlusionTexture',
            'emissiveTexture')

MEDIA_TYPES = ('image/png', 'image/jpeg', 'image/webp')
"""That browsers show."""


class Materials:
    """Materials of a file, read on first use; ``notes`` receive warnings."""

    def __init__(self, file: GltfFile, notes: list[str]) -> None:
        self._file, self._notes = file, notes
        self._numbers: dict[int, int] = {}
        self._textures: dict[int, int | None] = {}
        self._bytes = 0
        self.entries: list[dict] = []
        self.textures: list[Texture] = []

    def number(self, index: object) -> int:
        """Index in ``entries`` of a material of the file, by its index there; -1 for none."""
        given = self._list('materials')
        if type(index) is not int or not 0 <= index < len(given):
            return -1
        if index not in self._numbers:
            self._numbers[index] = len(self.entries)
            self.entries.append(self._material(given[index]))
        return self._numbers[index]

    def _material(self, given: dict) -> dict:
        taken = {**_numbers(given), **self._texture_infos(given)}
        surface = given.get('pbrMetallicRoughness')
        if isinstance(surface, dict):
            taken['pbrMetallicRoughness'] = {**_numbers(surface), **self._texture_infos(surface)}
        if given.get('alphaMode') in ('OPAQUE', 'MASK', 'BLEND'):
            taken['alphaMode'] = given['alphaMode']
        if isinstance(given.get('doubleSided'), bool):
            taken['doubleSided'] = given['doubleSided']
        extensions = given.get('extensions')
        if isinstance(extensions, dict) and 'KHR_materials_unlit' in extensions:
            taken['extensions'] = {'KHR_materials_unlit': {}}
        return taken

    def _texture_infos(self, given: dict) -> dict:
        """Texture infos of an object, with indices into ``textures``."""
        found = {}
        for key in TEXTURES:
            info = given.get(key)
            if not isinstance(info, dict) or info.get('texCoord', 0) != 0:
                continue
            texture = self._texture(info.get('index'))
            if texture is not None:
                found[key] = {'index': texture, **_numbers(info)}
                extensions = info.get('extensions')
                transform = extensions.get('KHR_texture_transform') if isinstance(
                    extensions, dict) else None
                if isinstance(transform, dict):
                    numbers = _numbers({**transform, 'scale': None}) | _pair(transform, 'scale')
                    found[key]['extensions'] = {'KHR_texture_transform': numbers}
        return found

    def _texture(self, index: object) -> int | None:
        """Index in ``textures`` of a texture of the file; None where it cannot be read."""
        if type(index) is not int:
            return None
        if index not in self._textures:
            self._textures[index] = None
            try:
                texture = self._read(self._entry('textures', index))
            except (errors.ModelError, OSError) as error:
                self._notes.append(f'textures[{index}] is ignored: {error}')
            else:
                self._textures[index] = len(self.textures)
                self.textures.append(texture)
        return self._textures[index]

    def _read(self, given: dict) -> Texture:
        image = self._entry('images', given.get('source'))
        content = read_image(self._file, image, 'images', MAX_IMAGE_BYTES)
        kind = media_type(content)
        self._bytes += len(content)
        if kind not in MEDIA_TYPES or self._bytes > MAX_IMAGE_BYTES:
            raise errors.WrongForm('images', f'{len(content)} bytes',
                                   f'PNG, JPEG or WebP, at most {MAX_IMAGE_BYTES} bytes in total')
        return Texture(content, kind, self._sampler(given.get('sampler')))

    def _sampler(self, index: object) -> dict:
        try:
            given = self._entry('samplers', index)
        except errors.ModelError:
            return {}
        return {key: given[key] for key in ('magFilter', 'minFilter', 'wrapS', 'wrapT')
                if type(given.get(key)) is int}

    def _entry(self, key: str, index: object) -> dict:
        entries = self._list(key)
        if type(index) is not int or not 0 <= index < len(entries):
            raise errors.OutOfRange(key, index, f'an index from 0 to {len(entries) - 1}')
        return entries[index]

    def _list(self, key: str) -> list[dict]:
        entries = self._file.json.get(key)
        return entries if isinstance(entries, list) and all(
            isinstance(entry, dict) for entry in entries) else []


def _numbers(given: dict) -> dict:
    """Valid numeric properties of an object; see NUMERIC_KEYS."""
    found = {}
    for key, width in NUMERIC_KEYS.items():
        value = given.get(key)
        values = [value] if width == 1 else value
        if isinstance(values, list) and len(values) == width and all(map(_is_number, values)):
            found[key] = value
    return found


def _pair(given: dict, key: str) -> dict:
    value = given.get(key)
    is_pair = isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))
    return {key: value} if is_pair else {}


def _is_number(value: object) -> bool:
    return type(value) in (int, float) and abs(value) < 1e9 and math.isfinite(value)
