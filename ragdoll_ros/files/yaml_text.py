"""YAML to plain data and back: what is too large, too deep or none is refused with its place."""
from __future__ import annotations

import math
import re
from pathlib import Path

import yaml

from ..model import errors
from ..model.errors import ModelError

LARGEST_FILE = 32_000_000
"""Bytes; a doll of 10 000 bones takes 3 MB."""

LARGEST_CONTENT = 5_000_000
"""Values in a file; a doll of 10 000 bones has 0.3 million."""

DEEPEST = 100
"""Levels of lists and mappings in a file; a scene has 12."""


class _Loader(getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):
    """YAML's safe loader, with 1e-3 read as a number (YAML 1.1 makes a text of it)."""


_Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
"""As safe_dump's, three times as quick."""

_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'^[-+]?[0-9][0-9_]*[eE][-+]?[0-9]+$'),
    list('-+0123456789'))


def _whole_number(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    """Read an int; one that no float can hold is infinite, as 1e400 is, and refused as that."""
    number = loader.construct_yaml_int(node)
    try:
        float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf
    return number


_Loader.add_constructor('tag:yaml.org,2002:int', _whole_number)


def read(path: Path) -> object:
    """What a YAML file holds as plain data; Unreadable where it is none."""
    if path.stat().st_size > LARGEST_FILE:
        raise errors.Unreadable('', f'{path.stat().st_size} bytes', f'at most {LARGEST_FILE}')
    try:
        return parse(path.read_bytes())
    except OSError as error:
        raise errors.Unreadable('', str(error), 'a YAML file in UTF-8') from None


def parse(content: bytes) -> object:
    """What a YAML file holds as plain data; Unreadable with the place where it is none."""
    if len(content) > LARGEST_FILE:
        raise errors.Unreadable('', f'{len(content)} bytes', f'at most {LARGEST_FILE}')
    try:
        text = content.decode('utf-8')
        return _construct(text)
    except ModelError:
        raise
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        where = _place(mark) if mark else ''
        line = text.splitlines()[mark.line:][:1] if mark else []
        problem = getattr(error, 'problem', None) or getattr(error, 'reason', None)
        raise errors.Unreadable(where, ''.join(line).strip(),
                                'YAML' + (f' ({problem})' if problem else '')) from None
    except (ValueError, RecursionError) as error:
        raise errors.Unreadable('', str(error), 'a YAML file in UTF-8') from None


def _construct(text: str) -> object:
    _check_depth(text)
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        # A few lines of aliases of aliases would fill the memory once they are followed.
        if node is not None and _unfolded(node, {}) > LARGEST_CONTENT:
            raise errors.Unreadable('', 'aliases of aliases',
                                    f'at most {LARGEST_CONTENT} values once they are followed')
        return None if node is None else loader.construct_document(node)
    finally:
        loader.dispose()


def _check_depth(text: str) -> None:
    """Refuse what is nested so deeply that libyaml's recursion would end the process."""
    depth = 0
    try:
        for event in yaml.parse(text, _Loader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > DEEPEST:
                raise _too_deep(event.start_mark)
    except yaml.MarkedYAMLError as error:
        # PyYAML from 6.0.4 on has a limit in its scanner, which reads ahead of the events.
        if 'maximum nesting depth' in (error.problem or ''):
            raise _too_deep(error.problem_mark) from None
        raise


def _too_deep(mark: yaml.Mark) -> errors.Unreadable:
    return errors.Unreadable(_place(mark), 'nested too deeply', f'at most {DEEPEST} levels')


def _place(mark: yaml.Mark) -> str:
    return f'line {mark.line + 1}, column {mark.column + 1}'


def _unfolded(node: yaml.Node, sizes: dict[int, float]) -> float:
    """Count what a node holds with each alias written out; without end for one inside itself."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in sizes:
        sizes[id(node)] = math.inf
        pairs = isinstance(node, yaml.MappingNode)
        parts = (part for entry in node.value for part in (entry if pairs else [entry]))
        sizes[id(node)] = 1 + sum(_unfolded(part, sizes) for part in parts)
    return sizes[id(node)]


def to_text(data: dict, schema: str, head: str) -> str:
    """A file's text: its schema, ``head`` as a comment, then the data."""
    lines = [f'# yaml-language-server: $schema={schema}.schema.json',
             '# Units: m, kg, s, degrees where a key ends in _deg. x forward, y left, z up.']
    lines += ['# ' + line if line else '#' for line in head.splitlines()]
    text = yaml.dump(data, Dumper=_Dumper, sort_keys=False, width=100, allow_unicode=True,
                     default_flow_style=None)
    return '\n'.join(lines) + '\n' + text
