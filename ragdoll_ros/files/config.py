"""Location of the shipped scenes, dolls, recipes and schemas, and look-up by name."""
import os
import re
from pathlib import Path

from ..model import errors

RECIPES = 'recipes'
"""Folder of config/ with the recipes of falls."""

LIMITS = 'limits'
"""Folder of config/ with biomechanical limits."""


def config_folder() -> Path:
    """config/ of the checkout, else of the ROS prefix, else of the package."""
    package = Path(__file__).resolve().parents[1]
    candidates = [package.parent / 'config'] if (package.parent / 'package.xml').exists() else []
    prefixes = filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))
    candidates += [Path(prefix) / 'share' / 'ragdoll_ros' / 'config' for prefix in prefixes]
    candidates.append(package / 'config')
    return next((path for path in candidates if (path / 'scene.schema.json').exists()),
                candidates[-1])


def scene_names() -> list[str]:
    """Names of the shipped scenes and dolls."""
    return _names_with('dolls|bones')


def doll_names() -> list[str]:
    """Names of the shipped dolls."""
    return _names_with('bones')


def names_in(folder: str) -> list[str]:
    """Names of the shipped files of a folder, RECIPES or LIMITS; of '': of scenes and dolls."""
    if not folder:
        return scene_names()
    return sorted(path.stem for path in (config_folder() / folder).glob('*.yaml'))


def _names_with(keys: str) -> list[str]:
    """Names of the files with one of these ``keys``, a regular expression."""
    return sorted(path.stem for path in config_folder().glob('*.yaml')
                  if re.search(f'^({keys}):', path.read_text(), re.MULTILINE))


def find(name: str, beside: Path | None = None, folder: str = '') -> Path:
    """Path of a file given by path (also relative to ``beside``) or by name in ``folder`` of
    config/: '', RECIPES or LIMITS.
    """
    choices = [Path(os.path.expanduser(name))]
    if beside is not None:
        choices.insert(0, beside / name)
    choices += [config_folder() / name, config_folder() / folder / f'{name}.yaml']
    for path in choices:
        if os.path.isfile(path):
            return path
    raise errors.Unreadable('', name, f'a file, or one of {", ".join(names_in(folder))}')
