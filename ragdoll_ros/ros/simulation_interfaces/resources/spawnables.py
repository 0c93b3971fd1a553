"""What can be spawned: the dolls in config/, robots and characters in folders that are named."""
from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

import numpy as np

from ....files.config import doll_names
from ....files.doll import load_doll
from ..bounds import bounding_box
from .dolls import CHARACTERS, SDF, URDF

MOST_FILES = 1000
"""Files of a folder that are listed."""


class Spawnable(NamedTuple):
    """A resource, and the box (2, 3) m of its doll about its root, lower corner first; None: not
    known before it is read.
    """

    uri: str
    description: str
    box: np.ndarray | None = None


@functools.cache
def shipped() -> tuple[Spawnable, ...]:
    """The dolls in config/."""
    found = []
    for name in doll_names():
        doll = load_doll(name)
        box = bounding_box([(bone.shape, doll.root.pose.relative(bone.pose))
                            for bone in doll.bones])
        found.append(Spawnable(name, f'doll of {len(doll.bones)} bones, {doll.mass:.3g} kg', box))
    return tuple(found)


def spawnables(sources: Iterable[str]) -> tuple[list[Spawnable], str]:
    """Return the dolls in config/, the robots and characters in ``sources``, which are folders, and
    a sentence on sources that are no folders, or an empty text.
    """
    found, unknown = list(shipped()), []
    for source in sources:
        folder = Path(unquote(source.removeprefix('file://')))
        try:
            found += _files(folder)
        except (OSError, ValueError):
            unknown.append(source[:60])
    return found, f'sources: {unknown}; expected folders' if unknown else ''


def _files(folder: Path) -> Iterator[Spawnable]:
    """Robots and characters in a folder. Raises OSError."""
    paths = sorted(path for path in folder.iterdir()
                   if path.suffix.lower() in (*URDF, *SDF, *CHARACTERS))
    for path in paths[:MOST_FILES]:
        what = 'robot' if path.suffix.lower() in (*URDF, *SDF) else 'character'
        yield Spawnable(path.absolute().as_uri(), f'{what} in {path.name}')
