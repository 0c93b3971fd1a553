"""Images of a glTF file: encoded bytes, embedded or in files beside it."""
from ...model import errors
from .gltf_file import GltfFile, decode_data_uri, get_count, resolve_uri

MAGIC_NUMBERS = {b'\x89PNG': 'image/png', b'\xff\xd8\xff': 'image/jpeg', b'RIFF': 'image/webp',
                 b'\xabKTX 20': 'image/ktx2'}
"""First bytes of image files, and their media types."""


def read_image(file: GltfFile, image: dict, where: str) -> bytes:
    """The encoded bytes of an entry of ``images``. Raises a ModelError or OSError."""
    uri, view = image.get('uri'), image.get('bufferView')
    if view is not None:
        entry = file.entry('bufferViews', view, where)
        return file.read(view, 0, get_count(entry, 'byteLength', f'bufferViews[{view}]'), where)
    if not isinstance(uri, str):
        raise errors.WrongForm(where, uri, 'a uri or a bufferView')
    if uri.startswith('data:'):
        buffer = decode_data_uri(uri, where)
        return buffer.read(0, buffer.size, where)
    return resolve_uri(file.path.parent, uri, where).read_bytes()


def media_type(content: bytes) -> str | None:
    """Media type of an image by its first bytes; None for an unknown one."""
    return next((kind for magic, kind in MAGIC_NUMBERS.items() if content.startswith(magic)), None)
