"""Dolls that are spawned: of our YAML, a robot's URDF or SDF, or fitted to a rigged character."""
from __future__ import annotations

import functools
import re
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

URDF, SDF = ('.urdf',), ('.sdf',)
CHARACTERS = ('.glb', '.gltf', '.vrm')
"""Ends of the names of files."""

SPAWN_FORMATS = ('yaml', 'urdf', 'sdf', 'gltf')

ROOT = re.compile(r'<(robot|sdf)\b')
"""The first tag of a URDF or an SDF; plugins of an SDF have a <robotNamespace>."""

MOST_KEPT = 16
"""Files in config/ whose dolls are kept."""


class Found(NamedTuple):
    """A doll as its resource places it, and notes on what of the resource was left out."""

    placement: Placement
    notes: tuple[str, ...] = ()


def doll_of(uri: str, text: str) -> Found:
    """Read the doll of a resource: a doll, a scene of one doll, a URDF, an SDF of one robot, or a
    character. A scene's ground and bodies are left out. Raises Refusal, which tells nothing of the
    content of a file that is none of these.
    """
    try:
        found = _of_file(uri) if uri else _of_text(text)
    except Refusal:
        raise
    except (RagdollError, OSError) as error:
        raise Refusal(RESOURCE_PARSE_ERROR, error) from None
    if len(found) != 1:
        raise Refusal(UNSUPPORTED_ASSETS, f'a resource of {len(found)} dolls; expected of one')
    return found[0]


def _of_file(uri: str) -> list[Found]:
    name = scene_of(uri, '', UNSUPPORTED_FORMAT, (*YAML, *URDF, *SDF, *CHARACTERS))
    readers: dict[tuple[str, ...], Callable[[Path], list[Found]]] = {
        URDF: _robot, SDF: _robots_of_sdf, CHARACTERS: _characters}
    for ends, read in readers.items():
        if name.lower().endswith(ends):
            return read(find(name))
    path = find(name)
    if path.parent == config_folder():
        return _of_scene(_shipped(str(path), path.stat().st_mtime_ns))
    return _of_scene(load_scene(name).dolls)


@functools.lru_cache(MOST_KEPT)
def _shipped(path: str, _: int) -> tuple[Placement, ...]:
    """Return the dolls of a file in config/, read once for each time of its last change, the second
    argument: reading takes the interpreter from the ticks for longer than spawning does.
    """
    return load_scene(path).dolls


def _of_text(text: str) -> list[Found]:
    if not text.strip():
        raise Refusal(NO_RESOURCE, 'uri and resource_string are empty; expected a name in config/, '
                      'a path, YAML, URDF or SDF')
    if not text.lstrip().startswith('<'):
        data = yaml_text.parse(text.encode())
        return _of_scene(scene_from_data(data, Path('/resource_string')).dolls)
    root = ROOT.search(text)
    if root is None:
        raise Refusal(UNSUPPORTED_FORMAT, 'resource_string: XML without <robot and <sdf; expected '
                      'a URDF or an SDF, or a scene or doll as YAML')
    # Imported here: no node needs the fit that spawns none of these.
    if root[1] == 'sdf':
        from ....fit.robots.sdf_dolls import dolls_from_sdf
        return [Found(*each) for each in dolls_from_sdf(text)]
    from ....fit.robots.robot import doll_from_urdf
    return [Found(Placement(doll_from_urdf(text)))]


def _of_scene(dolls: tuple[Placement, ...]) -> list[Found]:
    return [Found(placement) for placement in dolls]


def _robot(path: Path) -> list[Found]:
    """The doll of a URDF: the robot with its motors off."""
    from ....fit.robots.robot import read_urdf
    _check_root(path, 'robot', 'URDF')
    doll, notes = read_urdf(path)
    return [Found(Placement(doll), notes)]


def _robots_of_sdf(path: Path) -> list[Found]:
    from ....fit.robots.sdf_dolls import read_sdf
    _check_root(path, 'sdf', 'SDF')
    return [Found(*each) for each in read_sdf(path)]


def _check_root(path: Path, tag: str, name: str) -> None:
    """Raise Refusal for a file without ``tag``, so that nothing else of its content is told.
    ``name``: of the format.
    """
    if f'<{tag}' not in path.read_text(encoding='utf-8', errors='replace'):
        raise Refusal(RESOURCE_PARSE_ERROR, f'{path}: a file without <{tag}; expected {name}')


def _characters(path: Path) -> list[Found]:
    """Dolls that are fitted to the characters of a file, as they stand in it."""
    from ....fit.pipeline import fit_characters
    from ....fit.reading.character import read_character
    return [Found(fit.placed(model=str(path)), tuple(fit.notes))
            for fit in fit_characters(read_character(path))]
