"""Parts of a model from a file's data, with every error noted and its place."""
from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from ..model.errors import ModelError, ModelErrors
from . import config, yaml_text


def read_by_name(name: str) -> tuple[object, Path]:
    """What the YAML file of a path or a shipped name holds, and its path; or ModelErrors."""
    try:
        path = config.find(name)
        return yaml_text.read(path), path
    except ModelError as error:
        raise ModelErrors(str(name), [error]) from None


def try_build(found: list[ModelError], where: str, make: type, *args: object,
            **kwargs: object) -> object:
    """Make a part; where that fails, note the error and give None."""
    try:
        return make(*args, **kwargs)
    except ModelError as error:
        found.append(error.at(where) if where else error)
        return None


def has_error_under(found: list[ModelError], where: str) -> bool:
    """Whether an error is at a place or below it."""
    return any(re.match(re.escape(where) + r'($|[.\[])', error.path) for error in found)


def entries(data: dict, key: str) -> list[dict]:
    """The mappings of a list that may be none."""
    values = data.get(key)
    return [e for e in values if isinstance(e, dict)] if isinstance(values, list) else []


def build_each(data: dict, key: str, make: Callable, found: list[ModelError]) -> list:
    """Make every entry of a list that the schema has nothing against."""
    made = []
    for index, entry in enumerate(entries(data, key)):
        where = f'{key}[{index}]'
        if not has_error_under(found, where):
            made.append(try_build(found, where, make, entry))
    return made


def value_or_raise(path: Path, made: object, found: list[ModelError]) -> object:
    """What was made; ModelErrors with all of them if there are any."""
    if found:
        raise ModelErrors(str(path), found)
    return made
