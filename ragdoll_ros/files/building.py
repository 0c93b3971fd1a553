"""Building a model from a file's data, collecting every error with its path."""
from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ..model.errors import ModelError, ModelErrors
from . import config, yaml_text

Made = TypeVar('Made')


def read_by_name(name: str) -> tuple[object, Path]:
    """Data of a YAML file, given by path or shipped name, and its path. Raises ModelErrors."""
    try:
        path = config.find(name)
        return yaml_text.read(path), path
    except ModelError as error:
        raise ModelErrors(str(name), [error]) from None


def try_build(found: list[ModelError], where: str, make: Callable[..., Made], *args: object,
              **kwargs: object) -> Made | None:
    """Build a part; on a ModelError append it to ``found`` and return None."""
    try:
        return make(*args, **kwargs)
    except ModelError as error:
        found.append(error.at(where) if where else error)
        return None


def has_error_under(found: list[ModelError], where: str) -> bool:
    """Whether an error is at a path or below it."""
    return any(re.match(re.escape(where) + r'($|[.\[])', error.path) for error in found)


def entries(data: dict, key: str) -> list[dict]:
    """Mappings of the list ``data[key]``; empty if it is no list."""
    values = data.get(key)
    return [e for e in values if isinstance(e, dict)] if isinstance(values, list) else []


def build_each(data: dict, key: str, make: Callable, found: list[ModelError]) -> list:
    """Build every entry of a list that the schema accepts."""
    made = []
    for index, entry in enumerate(entries(data, key)):
        where = f'{key}[{index}]'
        if not has_error_under(found, where):
            made.append(try_build(found, where, make, entry))
    return made


def value_or_raise(path: Path, made: Made | None, found: list[ModelError]) -> Made:
    """What was built. Raises ModelErrors with all errors found."""
    if found or made is None:
        raise ModelErrors(str(path), found)
    return made
