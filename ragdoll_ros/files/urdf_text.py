"""The text of a URDF file, read as tolerantly as the tools that robots are drawn up with.

Taken as they come: a byte order mark, Latin-1, lines before the XML declaration, NULs at the end.
"""
from __future__ import annotations

import codecs


def urdf_text(data: bytes) -> str:
    """XML without its declaration, each line where it is in the file."""
    text = _decoded(data).rstrip('\0 \t\r\n')
    head, found, rest = text.partition('<?xml')
    # Before a declaration nothing may stand, and what it says of the encoding is done with.
    if found and '<robot' not in head:
        declaration, _, text = rest.partition('?>')
        text = '\n' * (head + declaration).count('\n') + text
    return text


def _decoded(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode('utf-16', errors='replace')
    try:
        return data.decode('utf-8-sig')
    except UnicodeDecodeError:
        # Every byte is a letter of Latin-1; only names and comments can come out wrong.
        return data.decode('latin-1')
