"""The scene of a run as YAML, with the versions of the libraries that computed it: ~/scene. A doll
that comes later in the same form.
"""
import functools
import hashlib
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..model.errors import ModelErrors, Unreadable
from ..model.scene import Placement, Scene
from . import yaml_text
from .scene import scene_from_data, scene_text

LIBRARIES = ('ragdoll_ros', 'numpy', 'numba', 'pybullet', 'mujoco')
"""Their versions and the processor determine a run's last bits."""

_VERSIONS = re.compile(r'^# versions: (.*)$', re.MULTILINE)


@functools.cache
def versions() -> str:
    """Versions of the installed LIBRARIES, of Python, and the machine, as text."""
    words = []
    for library in LIBRARIES:
        try:
            words.append(f'{library} {version(library)}')
        except PackageNotFoundError:
            continue
    return ', '.join([*words, f'Python {platform.python_version()}', platform.machine()])


def run_scene_text(scene: Scene) -> str:
    """YAML of a scene with its dolls; read_run_scene reads an equal one."""
    return scene_text(scene, Path('/'), f'versions: {versions()}')


def read_run_scene(text: str) -> tuple[Scene, str]:
    """Scene and versions of a text of run_scene_text. Raises ModelErrors."""
    found = _VERSIONS.search(text)
    if not found:
        raise ModelErrors('~/scene', [Unreadable('', text[:60], 'a line "# versions: ..."')])
    return scene_from_data(yaml_text.parse(text.encode()), Path('/scene')), found[1]


def placement_text(placement: Placement) -> str:
    """YAML of a placed doll, as a scene of it alone; read_placement reads an equal one."""
    return run_scene_text(Scene(placement.name, (placement,)))


def read_placement(text: str) -> Placement:
    """The placement of a text of placement_text. Raises ModelErrors."""
    return read_run_scene(text)[0].dolls[0]


def scene_digest(text: str) -> str:
    """SHA-256 of a scene's text, by which events refer to it."""
    return hashlib.sha256(text.encode()).hexdigest()
