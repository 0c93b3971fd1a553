"""The scene of a run as YAML, with the versions of the libraries that computed the run: ~/scene. A
doll that is added later is written in the same form.
"""
import dataclasses
import functools
import hashlib
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..model.errors import ModelErrors, Unreadable
from ..model.per_doll import PerDoll
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, Scene
from . import yaml_text
from .doll import doll_data
from .robots.robot_data import robots_data
from .scene import scene_data, scene_from_data

LIBRARIES = ('ragdoll_ros', 'numpy', 'numba', 'pybullet', 'mujoco')
"""Their versions and the processor determine a run's last bits."""

_VERSIONS = re.compile(r'^# versions: (.*)$', re.MULTILINE)

DOLLS = 'dolls_of_the_run'
"""What stands for the dolls in the text of a scene, until their own texts are put in."""


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


def doll_text(doll: Ragdoll) -> str:
    """YAML of a doll as it stands in the list of a scene's dolls, from its second line on."""
    text = yaml_text.dump({'dolls': [{'doll': doll_data(doll, Path('/'))}]})
    return text.split('\n', 2)[2].rstrip('\n')


class SceneTexts:
    """Texts of dolls and of how they are placed, kept from scene to scene: they are most of a
    scene's text.
    """

    def __init__(self) -> None:
        self.dolls, self.entries = PerDoll(doll_text), PerDoll(entry_text)

    def keep(self, scene: Scene) -> None:
        """Forget what is not of this scene."""
        self.dolls.keep(placement.doll for placement in scene.dolls)
        self.entries.keep(scene.dolls)


def entry_text(placement: Placement) -> str:
    """YAML of a placement as it stands in the list of a scene's dolls, but for the doll."""
    alone = scene_data(Scene(placement.name, (placement,)), data_of=lambda doll: None)
    return yaml_text.dump({'dolls': alone['dolls']}).split('\n', 2)[2]


def run_scene_text(scene: Scene, texts: SceneTexts | None = None) -> str:
    """Return YAML of a scene with its dolls; read_run_scene reads an equal one. The text is that of
    scene_text(), which writes a doll that several placements share once. ``texts`` keeps the texts
    of dolls and placements from scene to scene.
    """
    texts = texts or SceneTexts()
    first = dataclasses.replace(scene, dolls=scene.dolls[:1], robots=())
    data = scene_data(first, data_of=lambda doll: None) | robots_data(scene)
    text = yaml_text.to_text({**data, 'dolls': DOLLS}, 'scene', f'versions: {versions()}')
    seen: set[int] = set()
    anchors: dict[int, str] = {}
    for key in (id(placement.doll) for placement in scene.dolls):
        if key in seen and key not in anchors:
            anchors[key] = f'id{len(anchors) + 1:03d}'
        seen.add(key)
    entries = ['dolls:\n']
    for placement in scene.dolls:
        key = id(placement.doll)
        if key in seen:
            seen.remove(key)
            anchor = f' &{anchors[key]}' if key in anchors else ''
            entries.append(f'- doll:{anchor}\n{texts.dolls[placement.doll]}\n')
        else:
            entries.append(f'- doll: *{anchors[key]}\n')
        entries.append(texts.entries[placement])
    return text.replace(f'dolls: {DOLLS}\n', ''.join(entries), 1)


def read_run_scene(text: str) -> tuple[Scene, str]:
    """Scene and versions of a text of run_scene_text. Raises ModelErrors."""
    found = _VERSIONS.search(text)
    if not found:
        raise ModelErrors('~/scene', [Unreadable('', text[:60], 'a line "# versions: ..."')])
    return scene_from_data(yaml_text.parse(text.encode()), Path('/scene')), found[1]


def placement_text(placement: Placement, texts: SceneTexts | None = None) -> str:
    """YAML of a placed doll, as a scene of it alone; read_placement reads an equal one.
    ``texts``: see run_scene_text().
    """
    return run_scene_text(Scene(placement.name, (placement,)), texts)


def read_placement(text: str) -> Placement:
    """The placement of a text of placement_text. Raises ModelErrors."""
    return read_run_scene(text)[0].dolls[0]


def scene_digest(text: str) -> str:
    """SHA-256 of a scene's text, by which events refer to it."""
    return hashlib.sha256(text.encode()).hexdigest()
