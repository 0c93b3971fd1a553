"""The scene of a run as text: a file that load_scene takes, with what computed it in its head."""
from __future__ import annotations

import hashlib
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..model.errors import ModelErrors, Unreadable
from ..model.scene import Scene
from . import yaml_text
from .scene import scene_from_data, scene_text

LIBRARIES = ('ragdoll_ros', 'numpy', 'numba', 'pybullet', 'mujoco')
"""What decides on the last bits of a run, beside the processor."""

_VERSIONS = re.compile(r'^# versions: (.*)$', re.MULTILINE)


def versions() -> str:
    """What computes here, in words; what is not installed is left out."""
    words = []
    for library in LIBRARIES:
        try:
            words.append(f'{library} {version(library)}')
        except PackageNotFoundError:
            continue
    return ', '.join([*words, f'Python {platform.python_version()}', platform.machine()])


def run_scene_text(scene: Scene) -> str:
    """A scene with all its dolls, from which read_run_scene makes an equal one."""
    return scene_text(scene, Path('/'), f'versions: {versions()}')


def read_run_scene(text: str) -> tuple[Scene, str]:
    """The scene of run_scene_text and the versions that it names; ModelErrors for no such text."""
    found = _VERSIONS.search(text)
    if not found:
        raise ModelErrors('~/scene', [Unreadable('', text[:60], 'a line "# versions: ..."')])
    return scene_from_data(yaml_text.parse(text.encode()), Path('/scene')), found[1]


def scene_digest(text: str) -> str:
    """SHA-256 of a scene's text, by which events name the scene that they are of."""
    return hashlib.sha256(text.encode()).hexdigest()
