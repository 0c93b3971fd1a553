"""Parts of a model from a file's data, with every fault noted and its place."""
from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from ..model.errors import Fault, Faults


def attempt(found: list[Fault], where: str, make: type, *args: object, **kwargs: object) -> object:
    """Make a part; where that fails, note the fault and give None."""
    try:
        return make(*args, **kwargs)
    except Fault as fault:
        found.append(fault.at(where) if where else fault)
        return None


def any_under(found: list[Fault], where: str) -> bool:
    """Tell whether a fault is at a place or below it."""
    return any(re.match(re.escape(where) + r'($|[.\[])', fault.path) for fault in found)


def entries(data: dict, key: str) -> list[dict]:
    """Give the mappings of a list that may be none."""
    values = data.get(key)
    return [e for e in values if isinstance(e, dict)] if isinstance(values, list) else []


def build_each(data: dict, key: str, make: Callable, found: list[Fault]) -> list:
    """Make every entry of a list that the schema has nothing against."""
    made = []
    for index, entry in enumerate(entries(data, key)):
        where = f'{key}[{index}]'
        if not any_under(found, where):
            made.append(attempt(found, where, make, entry))
    return made


def raise_or_give(path: Path, made: object, found: list[Fault]) -> object:
    """Give what was made; Faults with all of them if there are any."""
    if found:
        raise Faults(str(path), found)
    return made
