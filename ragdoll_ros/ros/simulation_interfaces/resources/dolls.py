"""Dolls that are spawned: of our YAML, of a robot's URDF, or fitted to a rigged character."""
from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from ....files import yaml_text
from ....files.config import config_folder, find
from ....files.scene import load_scene, scene_from_data
from ....model.errors import RagdollError
from ....model.scene import Placement
from ..codes import Refusal
from .worlds import FORMATS as YAML
from .worlds import scene_of

UNSUPPORTED_FORMAT, NO_RESOURCE, RESOURCE_PARSE_ERROR, UNSUPPORTED_ASSETS = 103, 104, 106, 108
"""Results of SpawnEntity."""

URDF = ('.urdf',)
CHARACTERS = ('.glb', '.gltf', '.vrm')
"""Ends of the names of files."""

SPAWN_FORMATS = ('yaml', 'urdf', 'gltf')


MOST_KEPT = 16
"""Files in config/ whose dolls are kept."""


class Found(NamedTuple):
    """A doll as its resource places it, and notes on what of the resource was left out."""

    placement: Placement
    notes: tuple[str, ...] = ()


def doll_of(uri: str, text: str) -> Found:
    """The doll of a resource: of a scene of one doll or a doll, a URDF, or a character. A scene's
    ground and bodies are left out. Raises Refusal; says nothing of a file that is none of these.
    """
    try:
        return _of_file(uri) if uri else _of_text(text)
    except Refusal:
        raise
    except (RagdollError, OSError) as error:
        raise Refusal(RESOURCE_PARSE_ERROR, error) from None


def _of_file(uri: str) -> Found:
    name = scene_of(uri, '', UNSUPPORTED_FORMAT, (*YAML, *URDF, *CHARACTERS))
    read: Callable[[Path], Found] | None = _robot if name.lower().endswith(URDF) else (
        _character if name.lower().endswith(CHARACTERS) else None)
    if read is not None:
        return read(find(name))
    path = find(name)
    if path.parent == config_folder():
        return _one(_shipped(str(path), path.stat().st_mtime_ns))
    return _one(load_scene(name).dolls)


@functools.lru_cache(MOST_KEPT)
def _shipped(path: str, _: int) -> tuple[Placement, ...]:
    """The dolls of a file in config/ that was changed at this time, read once: reading takes the
    interpreter from the ticks for longer than spawning does.
    """
    return load_scene(path).dolls


def _of_text(text: str) -> Found:
    if not text.strip():
        raise Refusal(NO_RESOURCE, 'uri and resource_string are empty; expected a name in config/, '
                      'a path, YAML or URDF')
    if not text.lstrip().startswith('<'):
        return _one(scene_from_data(yaml_text.parse(text.encode()), Path('/resource_string')).dolls)
    if '<robot' not in text:
        raise Refusal(UNSUPPORTED_FORMAT, 'resource_string: XML without <robot; expected a URDF, '
                      'or a scene or doll as YAML')
    # Imported here: no node needs the fit that spawns none of these.
    from ....fit.robots.robot import doll_from_urdf
    return Found(Placement(doll_from_urdf(text)))


def _robot(path: Path) -> Found:
    """The doll of a URDF: the robot with its motors off."""
    from ....fit.robots.robot import read_urdf
    if '<robot' not in path.read_text(encoding='utf-8', errors='replace'):
        raise Refusal(RESOURCE_PARSE_ERROR, f'{path}: a file without <robot; expected a URDF')
    doll, notes = read_urdf(path)
    return Found(Placement(doll), notes)


def _character(path: Path) -> Found:
    """A doll that is fitted to a character, as it stands in its file."""
    from ....fit.pipeline import fit_characters
    from ....fit.reading.character import read_character
    fits = fit_characters(read_character(path))
    if len(fits) > 1:
        raise Refusal(UNSUPPORTED_ASSETS, f'a file of {len(fits)} characters; expected of one')
    return Found(fits[0].placed(model=str(path)), tuple(fits[0].notes))


def _one(dolls: tuple[Placement, ...]) -> Found:
    if len(dolls) > 1:
        raise Refusal(UNSUPPORTED_ASSETS, f'a scene of {len(dolls)} dolls; expected of one')
    return Found(dolls[0])
