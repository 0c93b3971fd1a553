"""Images of a glTF file: encoded bytes, embedded or in files beside it."""
import math

from ...model import errors
from .gltf_file import GltfFile, decode_data_uri, get_count, resolve_uri

MAGIC_NUMBERS = {b'\x89PNG': 'image/png', b'\xff\xd8\xff': 'image/jpeg', b'RIFF': 'image/webp',
                 b'\xabKTX 20': 'image/ktx2'}
"""First bytes of image files, and their media types."""


def read_image(file: GltfFile, image: dict, where: str, most: float = math.inf) -> bytes:
    """Return the encoded bytes of an entry of ``images``. Raises a ModelError, also for more than
    ``most`` bytes, or OSError.
    """
    uri, view = image.get('uri'), image.get('bufferView')
    if view is not None:
        entry = file.entry('bufferViews', view, where)
        size = get_count(entry, 'byteLength', f'bufferViews[{view}]')
        _check_size(size, most, where)
        return file.read(view, 0, size, where)
    if not isinstance(uri, str):
        raise errors.WrongForm(where, uri, 'a uri or a bufferView')
    if uri.startswith('data:'):
        buffer = decode_data_uri(uri, where)
        _check_size(buffer.size, most, where)
        return buffer.read(0, buffer.size, where)
    path = resolve_uri(file.path.parent, uri, where)
    _check_size(path.stat().st_size, most, where)
    return path.read_bytes()


def media_type(content: bytes) -> str | None:
    """Media type of an image by its first bytes; None for an unknown one."""
    return next((kind for magic, kind in MAGIC_NUMBERS.items() if content.startswith(magic)), None)


def _check_size(size: int, most: float, where: str) -> None:
    if size > most:
        raise errors.WrongForm(where, f'{size} bytes', f'at most {most} bytes')
