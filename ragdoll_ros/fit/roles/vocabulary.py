"""Words that tell what a bone is: those of config/bone_names.yaml, and the user's own."""
from __future__ import annotations

import functools
import os
from dataclasses import dataclass
from pathlib import Path

from ...files import yaml_text
from ...files.config import config_folder
from ...model import errors

FILE = 'bone_names.yaml'


@dataclass(frozen=True)
class Vocabulary:
    """Words as they stand in names once these are made plain."""

    roles: tuple[tuple[str, str], ...]
    """Role and word, those first that are to win."""
    sides: dict[str, int]
    """1 for words of the left, -1 for words of the right."""
    fillers: frozenset[str]

    @functools.cached_property
    def known(self) -> frozenset[str]:
        """Every word of a role."""
        return frozenset(word for _, word in self.roles)


def users_file() -> Path:
    """Where a user's own words are, if there are any."""
    # Path.home() fails where the user has no entry.
    folder = os.environ.get('XDG_CONFIG_HOME') or os.path.expanduser('~/.config')
    return Path(folder, 'ragdoll_ros', FILE)


@functools.cache
def vocabulary() -> Vocabulary:
    """The words of both files; ModelErrors for a file that is none."""
    return read_vocabulary([path for path in (users_file(), config_folder() / FILE)
                            if os.path.isfile(path)])


def read_vocabulary(paths: list[Path]) -> Vocabulary:
    """The words of several files, an earlier one's before a later one's."""
    roles: list[tuple[str, str]] = []
    sides: dict[str, int] = {}
    fillers: set[str] = set()
    order: list[str] = []
    for path in reversed(paths):
        data = _read(path)
        own = [(role, str(word).casefold()) for role, words in data.get('roles', {}).items()
               for word in words]
        order = order or list(data.get('roles', {}))
        _check(path, own, order)
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


def _check(path: Path, own: list[tuple[str, str]], known: list[str]) -> None:
    for role, word in own:
        if role not in known:
            raise errors.ModelErrors(str(path), [errors.WrongForm(
                f'roles.{role}', role, errors.one_of(known, role))])
        if not word:
            raise errors.ModelErrors(str(path), [errors.WrongForm(
                f'roles.{role}', word, 'words that are not empty')])
