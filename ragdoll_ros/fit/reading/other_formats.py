"""Formats of characters that are not read, and how to convert them to glTF.

No package on PyPI that is maintained reads their skins on all Pythons from 3.10 on; Blender does.
"""
from pathlib import Path
from typing import NamedTuple

from ...model import errors

EXPORT = 'File > Export > glTF 2.0 (.glb)'


class OtherFormat(NamedTuple):
    """A format: the bytes that its files begin with, its name, and the steps in Blender."""

    magic: bytes
    name: str
    steps: str


FORMATS = {
    '.fbx': OtherFormat(b'Kaydara FBX Binary', 'an FBX file',
                        f'File > Import > FBX (.fbx), {EXPORT}'),
    '.pmx': OtherFormat(b'PMX ', 'an MMD model', 'with the add-on MMD Tools File > Import > '
                        f'MikuMikuDance Model (.pmd, .pmx), {EXPORT}'),
    '.pmd': OtherFormat(b'Pmd', 'an MMD model', 'with the add-on MMD Tools File > Import > '
                        f'MikuMikuDance Model (.pmd, .pmx), {EXPORT}'),
    '.blend': OtherFormat(b'BLENDER', 'a Blender file', f'File > Open, {EXPORT}')}
"""Formats by the suffix of their files."""


def refuse_other_formats(path: Path) -> None:
    """Raise Unreadable for a file of one of the FORMATS, by its first bytes or its suffix."""
    try:
        with path.open('rb') as file:
            head = file.read(20)
    except OSError:
        return  # whoever reads it says so
    for suffix, (magic, name, steps) in FORMATS.items():
        if head.startswith(magic) or (path.suffix.lower() == suffix and head[:4] != b'glTF'):
            raise errors.Unreadable('', name, f'glTF: convert it in Blender: {steps}; '
                                    'docs/fit.md, Other formats, has it as a command')
