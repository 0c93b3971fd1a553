"""The folder of the page's files; besides shipped files, no others can be read or written.

Whoever reaches the page may send anything: invalid files and names raise a ModelError.
"""
from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from ...files import yaml_text
from ...files.config import config_folder, scene_names
from ...files.robots.mesh_file import SUFFIXES, read_surface
from ...files.robots.robot_bodies import PARSERS
from ...files.scene import load_scene, save_scene, scene_from_data, scene_text
from ...files.surfaces import HULLS
from ...model import errors
from ...model.mesh import SURFACES, Mesh
from ...model.scene import Placement, Scene, all_above_ground

if TYPE_CHECKING:
    from ...fit.judging.verdict import Verdict

LARGEST_UPLOAD = 100_000_000
"""Bytes: characters with large textures have tens of MB."""

ROBOTS = ('.urdf', '.sdf')

CHARACTERS = ('.glb', '.gltf', '.vrm', *ROBOTS)
DOLLS = ('.yaml', '.yml')
MESHES = SUFFIXES

ProgressCallback = Callable[[float, str], None]
"""Takes the fraction that is done, and the name of the step."""


class SceneFolder:
    """One folder of scenes and characters."""

    def __init__(self, path: str | Path = '.') -> None:
        self.path = Path(path).resolve()

    def find(self, text: str) -> Path:
        """Path of a YAML file in this folder for a typed name; ``.yaml`` is added if missing."""
        name = text.strip()
        try:
            path = (self.path / name).resolve()
            path = path if path.suffix.lower() in DOLLS else path.with_name(path.name + '.yaml')
            inside = path.is_relative_to(self.path) and path.parent.is_dir() and name
        except (ValueError, OSError, RuntimeError):
            inside = False
        if not inside or not name.isprintable() or len(path.name.encode()) > 200:
            raise errors.WrongForm('file', text, f'the name of a file inside {self.path}')
        return path

    def save(self, scene: Scene, text: str) -> Path:
        """Save a scene; OSError."""
        path = self.find(text)
        save_scene(scene, path)
        return path

    def saved(self) -> list[tuple[str, datetime]]:
        """Names and local modification times of the YAML files here, newest first."""
        found = []
        for path in self.path.iterdir() if self.path.is_dir() else ():
            with suppress(OSError):
                if path.suffix.lower() in DOLLS and path.is_file():
                    found.append((path.name, datetime.fromtimestamp(path.stat().st_mtime)))
        return sorted(found, key=lambda file: (file[1], file[0]), reverse=True)

    def load(self, text: str) -> Scene:
        """Load a scene of this folder, or a shipped one by its name."""
        name = text.strip().removesuffix('.yaml')
        path = self.find(text)
        if not path.is_file() and name in scene_names():
            return load_scene(name)
        return load_scene(str(path))

    def text(self, scene: Scene) -> bytes:
        """A scene as YAML, as it would be saved here."""
        return scene_text(scene, self.path).encode()

    def read(self, name: str, content: bytes) -> Scene:
        """Scene of an uploaded YAML file, as if it were in this folder."""
        name = safe_name(name)
        try:
            _check_size(content)
            data = yaml_text.parse(content)
            self._check_dolls(data)
            self._check_models(data)
            self._check_bodies(data)
            return scene_from_data(data, self.path / name)
        except errors.ModelError as error:
            raise errors.ModelErrors(name, [error]) from None
        except errors.ModelErrors as error:
            raise errors.ModelErrors(name, error.errors) from None

    def fit(self, name: str, content: bytes,
            progress: ProgressCallback) -> tuple[Scene, list[Verdict]]:
        """Scene of dolls fitted to the characters of an uploaded file, and a verdict on each.

        The dolls hang above level ground. They refer to the file, which is kept in this folder; a
        URDF or SDF is not kept.
        """
        name = safe_name(name)
        suffix = Path(name).suffix.lower()
        try:
            if suffix not in CHARACTERS:
                raise errors.WrongForm('', name, 'a name that ends in ' + ', '.join(CHARACTERS))
            _check_size(content)
            with tempfile.TemporaryDirectory() as inbox:
                path = Path(inbox, name)
                path.write_bytes(content)
                placements, verdicts = _fit(path, progress)
        except errors.ModelError as error:
            raise errors.ModelErrors(name, [error]) from None
        except errors.ModelErrors as error:
            raise errors.ModelErrors(name, [_with_advice(each) for each in error.errors]) from None
        if suffix not in ROBOTS:
            progress(0.9, 'saving the character')
            model = str(self._keep(name, content))
            placements = [dataclasses.replace(placement, doll=dataclasses.replace(
                placement.doll, model=model)) for placement in placements]
        scene = placements[0].name if len(placements) == 1 else Path(name).stem
        return all_above_ground(scene, placements), verdicts

    def mesh(self, name: str, content: bytes) -> Mesh:
        """The triangles of an uploaded file, which is kept in this folder."""
        name = safe_name(name)
        try:
            _check_size(content)
            with tempfile.TemporaryDirectory() as inbox:
                path = Path(inbox, name)
                path.write_bytes(content)
                mesh = read_surface(path)
        except errors.ModelError as error:
            raise errors.ModelErrors(name, [error]) from None
        return dataclasses.replace(mesh, source=(str(self._keep(name, content)), mesh.source[1]))

    def _check_dolls(self, data: object) -> None:
        """Raise Unreadable for dolls that are neither here nor in config/."""
        for place, source in _dolls_of(data):
            if not isinstance(source, str) or source in scene_names():
                continue
            try:
                found = self.find(source).name
            except errors.ModelError:
                found = ''
            if found not in (source, f'{source}.yaml'):
                raise errors.Unreadable(place, source, f'a file of {self.path}, or the doll itself')

    def _check_models(self, data: object) -> None:
        """Raise Unreadable for characters that are not here."""
        for place, doll in [('', data), *_dolls_of(data)]:
            model = doll.get('model') if isinstance(doll, dict) else None
            if isinstance(model, str) and not self._is_inside(model):
                raise errors.Unreadable('model', model, f'a file inside {self.path}').at(place)

    def _check_bodies(self, data: object) -> None:
        """Raise Unreadable for robots, worlds and meshes that are neither here nor in config/."""
        for place, source in _files_of_bodies(data):
            is_shipped = source in {path.name for path in config_folder().iterdir()}
            if not is_shipped and not (self._is_inside(source) and (self.path / source).is_file()):
                raise errors.Unreadable(place, source, f'a file inside {self.path}')

    def _is_inside(self, name: str) -> bool:
        """Whether a path, relative to this folder, is inside it; the file need not exist."""
        try:
            return (self.path / name).resolve().is_relative_to(self.path)
        except (ValueError, OSError, RuntimeError):
            return False

    def _keep(self, name: str, content: bytes) -> Path:
        """Save an uploaded file, with a number in its name if another file has that name."""
        path = Path(self.path, name)
        for number in range(2, 10_000):
            try:
                with path.open('xb') as file:
                    file.write(content)
                return path
            except FileExistsError:
                if path.is_file() and path.read_bytes() == content:
                    return path
            path = Path(self.path, f'{Path(name).stem}_{number}{Path(name).suffix}')
        raise errors.Unreadable('', name, f'an unused name in {self.path}')


def _dolls_of(data: object) -> Iterator[tuple[str, object]]:
    """Path and value of each ``doll`` in parsed data that may be a scene."""
    for place, entry in _listed(data, 'dolls'):
        yield f'{place}.doll', entry.get('doll')


def _files_of_bodies(data: object) -> Iterator[tuple[str, str]]:
    """Path and value of each file of a body or a bone in parsed data, of a scene or a doll."""
    solids = [*_listed(data, 'bodies'), *_listed(data, 'bones')]
    for place, doll in _dolls_of(data):
        solids += [(f'{place}.{bone}', entry) for bone, entry in _listed(doll, 'bones')]
    found: list[tuple[str, object]] = []
    for place, entry in solids:
        found += [(f'{place}.{key}', entry[key]) for key in PARSERS.keys() & entry.keys()]
        for where, shape in [('shape', entry.get('shape')), *_listed(entry, 'shapes')]:
            for kind in {*SURFACES, HULLS} & shape.keys() if isinstance(shape, dict) else ():
                if isinstance(shape[kind], dict):
                    found += [(f'{place}.{where}.{kind}.{key}', value)
                              for key, value in shape[kind].items()]
    yield from ((place, value) for place, value in found if isinstance(value, str))


def _listed(data: object, key: str) -> Iterator[tuple[str, dict]]:
    """Path and value of each mapping in a list of parsed data."""
    values = data.get(key) if isinstance(data, dict) else None
    for index, value in enumerate(values if isinstance(values, list) else ()):
        if isinstance(value, dict):
            yield f'{key}[{index}]', value


def safe_name(name: str) -> str:
    """A file's name without folders and leading dots, shortened to about 90 characters; others than
    letters, digits, spaces, dots, - and _ are replaced by _.
    """
    name = name.replace('\\', '/').rsplit('/', 1)[-1]
    stem, dot, suffix = ''.join(c if c.isalnum() or c in '._- ' else '_' for c in name)[-90:] \
        .strip().rpartition('.')
    return f'{stem.lstrip(".") or "file"}{dot}{suffix}'


def _check_size(content: bytes) -> None:
    if len(content) > LARGEST_UPLOAD:
        raise errors.Unreadable('', f'{len(content)} bytes', f'at most {LARGEST_UPLOAD}')


def _fit(path: Path, progress: ProgressCallback) -> tuple[list[Placement], list[Verdict]]:
    # Imported here, because few pages need them.
    from ...fit.judging.verdict import judge
    from ...fit.pipeline import fit_characters
    from ...fit.reading.character import read_character
    progress(0.1, 'reading')
    if path.suffix.lower() == '.urdf':
        from ...fit.robots.robot import read_urdf
        doll = read_urdf(path)[0]
        return [Placement(doll)], [judge(doll, measured=True)]
    if path.suffix.lower() == '.sdf':
        from ...fit.robots.sdf_dolls import read_sdf
        placements = [placement for placement, _ in read_sdf(path)]
        return placements, [judge(placement.doll, measured=True) for placement in placements]
    character = read_character(path)
    progress(0.4, f'fitting {len(character.bone_names)} bones, {len(character.vertices)} vertices')
    fits = fit_characters(character)
    progress(0.7, 'simulating a fall')
    return [fit.placed() for fit in fits], [judge(fit.doll, fit) for fit in fits]


def _with_advice(error: errors.ModelError) -> errors.ModelError:
    """The error, with advice where a file refers to others, which are not uploaded."""
    if error.path.endswith('.uri') and not str(error.value).startswith('data:'):
        return type(error)(error.path, error.value,
                           'all in one file: export it as .glb, or with its buffers embedded')
    return error
