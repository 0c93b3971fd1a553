"""Worlds are scenes: those in config/, and any that the parameter `scene` takes."""
from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple
from urllib.parse import unquote

import yaml

from ....files.config import config_folder, find, scene_names
from ....model.errors import RagdollError
from ..codes import Code, Refusal

UNSUPPORTED_FORMAT, NO_RESOURCE, RESOURCE_PARSE_ERROR = 101, 102, 103
"""Results of LoadWorld."""

NO_WORLD_LOADED = 101
"""Result of UnloadWorld and GetCurrentWorld."""

FORMATS = ('.yaml', '.yml')
"""Ends of the names of scenes' files."""


class World(NamedTuple):
    """A scene: its name, what loads it, and a sentence on it."""

    name: str
    uri: str
    description: str = ''


def available(sources: Sequence[str], continue_on_error: bool) -> tuple[list[World], str]:
    """The scenes in config/, and what to say about ``sources``, which are not searched.

    Raises Refusal for sources, unless the search is to continue.
    """
    reason = ''
    if sources:
        reason = f'additional_sources: {len(sources)} not searched; expected none'
        if not continue_on_error:
            raise Refusal(Code.OPERATION_FAILED, reason)
    return [World(name, name, _description(name)) for name in scene_names()], reason


def scene_of(uri: str, text: str, unsupported: int = UNSUPPORTED_FORMAT,
             formats: tuple[str, ...] = FORMATS) -> str:
    """Return the value of the parameter `scene` for a resource, or the name or path of another
    file. Raises Refusal, with the code ``unsupported`` for a file of none of the ``formats``; it
    tells nothing of a file's content.
    """
    if not uri:
        raise (Refusal(Code.FEATURE_UNSUPPORTED, 'resource_string: expected a uri') if text else
               Refusal(NO_RESOURCE, 'uri: expected a name in config/ or a path'))
    scene = unquote(uri.removeprefix('file://')) if uri.startswith('file:///') else uri
    if not scene.lower().endswith(formats) and re.search(r'\.\w+$', scene):
        raise Refusal(unsupported, f'uri: {uri[:60]!r}; expected {", ".join(formats)}')
    try:
        find(scene)
    except RagdollError as error:
        raise Refusal(Code.NOT_FOUND, f'uri: {error}') from None
    except ValueError:  # a null character
        raise Refusal(Code.NOT_FOUND, f'uri: {uri[:60]!r}; expected a path') from None
    return scene


def _description(name: str) -> str:
    """The description in a shipped scene's file, which is one line."""
    text = (config_folder() / f'{name}.yaml').read_text()
    line = re.search(r'^description: .*$', text, re.MULTILINE)
    return str(yaml.safe_load(line[0])['description']) if line else ''
