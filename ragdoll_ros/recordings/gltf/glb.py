"""Builder of a binary glTF 2.0 file: its JSON and its buffer."""
import json
import struct

import numpy as np

COMPONENTS = {'float32': 5126, 'uint32': 5125, 'uint16': 5123}
KINDS = {1: 'SCALAR', 2: 'VEC2', 3: 'VEC3', 4: 'VEC4', 16: 'MAT4'}
ATTRIBUTES, INDICES = 34962, 34963
"""Targets of buffer views (glTF 2.0, 5.11.5) of meshes."""


class Glb:
    """Builds a .glb file. ``document`` is its JSON; methods that add something return its index."""

    def __init__(self) -> None:
        self.document: dict = {'asset': {'version': '2.0', 'generator': 'ragdoll_ros'}}
        self._bytes = bytearray()

    def add(self, kind: str, **entry: object) -> int:
        """Add an entry to a list of the document, such as nodes."""
        entries = self.document.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def accessor(self, array: np.ndarray, target: int | None = None) -> int:
        """Add an array (n,) or (n, k) of a type of COMPONENTS, with its bounds."""
        array = np.ascontiguousarray(array)
        rows = array.reshape(len(array), -1)
        bounds = {key: edge.tolist() for key, edge in (
            ('min', rows.min(axis=0)), ('max', rows.max(axis=0)))} if len(rows) else {}
        kept = {} if target is None else {'target': target}
        return self.add('accessors', bufferView=self.view(array.tobytes(), **kept),
                        componentType=COMPONENTS[array.dtype.name], count=len(rows),
                        type=KINDS[rows.shape[1]], **bounds)

    def view(self, content: bytes, **entry: object) -> int:
        """Add a buffer view, aligned to four bytes, with further properties."""
        at = len(self._bytes)
        self._bytes += content + b'\0' * (-len(content) % 4)
        return self.add('bufferViews', buffer=0, byteOffset=at, byteLength=len(content),
                        **entry)

    def content(self) -> bytes:
        """The file (glTF 2.0, 4.4)."""
        document = {**self.document, 'buffers': [{'byteLength': len(self._bytes)}]}
        text = json.dumps(document, separators=(',', ':'), allow_nan=False).encode()
        text += b' ' * (-len(text) % 4)
        chunks = (struct.pack('<I4s', len(text), b'JSON') + text
                  + struct.pack('<I4s', len(self._bytes), b'BIN\0') + self._bytes)
        return struct.pack('<4sII', b'glTF', 2, 12 + len(chunks)) + chunks
