"""Vocabulary of bone names: config/bone_names.yaml and the user's own file."""
import functools
import os
from dataclasses import dataclass
from pathlib import Path

from ...model import errors
from .. import yaml_text
from ..config import config_folder

FILE = 'bone_names.yaml'


@dataclass(frozen=True)
class Vocabulary:
    """Normalized words of bone names."""

    roles: tuple[tuple[str, str], ...]
    """(role, word) in order of precedence."""
    sides: dict[str, int]
    """1 for words that mean left, -1 for right."""
    fillers: frozenset[str]

    @functools.cached_property
    def role_words(self) -> frozenset[str]:
        """All words that state a role."""
        return frozenset(word for _, word in self.roles)


def user_file() -> Path:
    """Path of the user's own vocabulary, which need not exist."""
    # Path.home() raises for a user without a passwd entry.
    folder = os.environ.get('XDG_CONFIG_HOME') or os.path.expanduser('~/.config')
    return Path(folder, 'ragdoll_ros', FILE)


@functools.cache
def vocabulary() -> Vocabulary:
    """The merged vocabulary of both files; ModelErrors for a broken file."""
    return read_vocabulary([path for path in (user_file(), config_folder() / FILE)
                            if os.path.isfile(path)])


def read_vocabulary(paths: list[Path]) -> Vocabulary:
    """The merged vocabulary of several files; earlier files take precedence."""
    roles: list[tuple[str, str]] = []
    sides: dict[str, int] = {}
    fillers: set[str] = set()
    order: list[str] = []
    for path in reversed(paths):
        data = _read(path)
        own = [(role, str(word).casefold()) for role, words in data.get('roles', {}).items()
               for word in words]
        order = order or list(data.get('roles', {}))
        _check_roles(path, own, order)
        roles = own + roles
        for key, side in (('left', 1), ('right', -1)):
            sides.update((str(word).casefold(), side) for word in data.get(key, ()))
        fillers.update(str(word).casefold() for word in data.get('fillers', ()))
    return Vocabulary(tuple(roles), sides, frozenset(fillers))


def _read(path: Path) -> dict:
    try:
        data = yaml_text.read(path)
    except errors.ModelError as error:
        raise errors.ModelErrors(str(path), [error]) from None
    lists = {'left', 'right', 'fillers'}
    roles = data.get('roles', {}) if isinstance(data, dict) else None
    if not isinstance(roles, dict) or not set(data) <= lists | {'roles'} or not all(
            isinstance(words, list) for words in [*roles.values(),
                                                  *(data[key] for key in lists & set(data))]):
        raise errors.ModelErrors(str(path), [errors.WrongForm(
            '', data, 'roles, left, right and fillers, each with lists of words')])
    return data


def _check_roles(path: Path, own: list[tuple[str, str]], known: list[str]) -> None:
    for role, word in own:
        if role not in known:
            raise errors.ModelErrors(str(path), [errors.WrongForm(
                f'roles.{role}', role, errors.one_of(known, role))])
        if not word:
            raise errors.ModelErrors(str(path), [errors.WrongForm(
                f'roles.{role}', word, 'words that are not empty')])
