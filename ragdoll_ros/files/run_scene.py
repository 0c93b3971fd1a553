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
from ..model.per_doll import PerDoll
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, Scene
from . import yaml_text
from .doll import doll_data
from .scene import scene_data, scene_from_data

LIBRARIES = ('ragdoll_ros', 'numpy', 'numba', 'pybullet', 'mujoco')
"""Their versions and the processor determine a run's last bits."""

_VERSIONS = re.compile(r'^# versions: (.*)$', re.MULTILINE)

_DOLL = re.compile(r'^- doll: doll_(\d+)$', re.MULTILINE)
"""What stands for a doll in the text of a scene, until its own text is put in."""


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


def run_scene_text(scene: Scene, texts: PerDoll[str] | None = None) -> str:
    """YAML of a scene with its dolls; read_run_scene reads an equal one.

    ``texts``: of doll_text, kept from scene to scene: a doll is most of its scene's text. The
    result is that of scene_text(), which writes a doll that several placements share once.
    """
    texts = texts or PerDoll(doll_text)
    dolls = list({id(placement.doll): placement.doll for placement in scene.dolls}.values())
    place = {id(doll): index for index, doll in enumerate(dolls)}
    text = yaml_text.to_text(scene_data(scene, data_of=lambda doll: f'doll_{place[id(doll)]}'),
                             'scene', f'versions: {versions()}')
    found = list(map(int, _DOLL.findall(text)))
    anchors: dict[int, str] = {}
    for number, index in enumerate(found):
        if index in found[:number] and index not in anchors:
            anchors[index] = f'id{len(anchors) + 1:03d}'
    written = set()

    def own(match: re.Match) -> str:
        index = int(match[1])
        if index in written:
            return f'- doll: *{anchors[index]}'
        written.add(index)
        anchor = f' &{anchors[index]}' if index in anchors else ''
        return f'- doll:{anchor}\n{texts[dolls[index]]}'

    return _DOLL.sub(own, text)


def read_run_scene(text: str) -> tuple[Scene, str]:
    """Scene and versions of a text of run_scene_text. Raises ModelErrors."""
    found = _VERSIONS.search(text)
    if not found:
        raise ModelErrors('~/scene', [Unreadable('', text[:60], 'a line "# versions: ..."')])
    return scene_from_data(yaml_text.parse(text.encode()), Path('/scene')), found[1]


def placement_text(placement: Placement, texts: PerDoll[str] | None = None) -> str:
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
