"""YAML to plain data and back, with limits on size and depth and the position of errors."""
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
    """The safe loader, which reads 1e-3 as a number, as YAML 1.2 does."""


_Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
"""As safe_dump's, three times as fast."""

_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'^[-+]?[0-9][0-9_]*[eE][-+]?[0-9]+$'),
    list('-+0123456789'))


OURS = re.compile(r'^(dolls|bones|who|regions):', re.MULTILINE)
"""Found in every scene, doll, recipe and limits: text without it may be a secret, and is in no
error."""

A_SCENE = 'a scene or a doll in YAML'

CHARACTERS = ('.glb', '.gltf', '.vrm', '.urdf', '.xacro')
"""Suffixes of files from which `ragdoll_fit` makes dolls."""


def _whole_number(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    """Return an int; infinity if it exceeds the largest float, as 1e400 does, so that it is refused
    as infinite.
    """
    number = loader.construct_yaml_int(node)
    try:
        float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf
    return number


_Loader.add_constructor('tag:yaml.org,2002:int', _whole_number)


def read(path: Path) -> object:
    """Data of a YAML file. Raises Unreadable."""
    if path.suffix.lower() in CHARACTERS:
        raise errors.Unreadable('', path.name, 'a scene or a doll in YAML, which '
                                f'`ragdoll_fit {path}` makes of a character or a robot')
    if path.stat().st_size > LARGEST_FILE:
        raise errors.Unreadable('', f'{path.stat().st_size} bytes', f'at most {LARGEST_FILE}')
    try:
        return parse(path.read_bytes())
    except OSError as error:
        raise errors.Unreadable('', str(error), 'a YAML file in UTF-8') from None


def parse(content: bytes) -> object:
    """Data of a YAML text. Raises Unreadable with the line and column."""
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
        if not OURS.search(text):
            raise errors.Unreadable(where, 'text that is no YAML', A_SCENE) from None
        line = text.splitlines()[mark.line:][:1] if mark else []
        problem = getattr(error, 'problem', None) or getattr(error, 'reason', None)
        raise errors.Unreadable(where, ''.join(line).strip(),
                                'YAML' + (f' ({problem})' if problem else '')) from None
    except UnicodeDecodeError as error:
        raise errors.Unreadable('', f'byte {error.start} of {len(content)}',
                                'a YAML file in UTF-8') from None
    except (ValueError, RecursionError, AttributeError) as error:  # the last: for !!timestamp
        raise errors.Unreadable('', str(error) if OURS.search(text) else 'a wrong value',
                                A_SCENE) from None


def _construct(text: str) -> object:
    _check_depth(text)
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        # Nested aliases can expand a few lines beyond all memory ("billion laughs").
        if node is not None and _unfolded(node, {}) > LARGEST_CONTENT:
            raise errors.Unreadable('', 'aliases of aliases',
                                    f'at most {LARGEST_CONTENT} values once they are followed')
        return None if node is None else loader.construct_document(node)
    finally:
        loader.dispose()


def _check_depth(text: str) -> None:
    """Raise Unreadable for a nesting at which libyaml's recursion would crash the process."""
    depth = 0
    try:
        for event in yaml.parse(text, _Loader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > DEEPEST:
                raise _too_deep(event.start_mark)
    except yaml.MarkedYAMLError as error:
        # From 6.0.4 on PyYAML's scanner, which is ahead of the events, has a limit too.
        if 'maximum nesting depth' in (error.problem or ''):
            raise _too_deep(error.problem_mark) from None
        raise


def _too_deep(mark: yaml.Mark) -> errors.Unreadable:
    return errors.Unreadable(_place(mark), 'nested too deeply', f'at most {DEEPEST} levels')


def _place(mark: yaml.Mark) -> str:
    return f'line {mark.line + 1}, column {mark.column + 1}'


def _unfolded(node: yaml.Node, sizes: dict[int, float]) -> float:
    """Number of values of a node with aliases expanded; infinite for a recursive one."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in sizes:
        sizes[id(node)] = math.inf
        pairs = isinstance(node, yaml.MappingNode)
        parts = (part for entry in node.value for part in (entry if pairs else [entry]))
        sizes[id(node)] = 1 + sum(_unfolded(part, sizes) for part in parts)
    return sizes[id(node)]


def to_text(data: dict, schema: str, head: str) -> str:
    """YAML text: its schema, ``head`` as a comment, the data."""
    lines = [f'# yaml-language-server: $schema={schema}.schema.json',
             '# Units: m, kg, s, degrees where a key ends in _deg. x forward, y left, z up.']
    lines += ['# ' + line if line else '#' for line in head.splitlines()]
    return '\n'.join(lines) + '\n' + dump(data)


def dump(data: dict) -> str:
    """YAML text of data."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, width=100, allow_unicode=True,
                     default_flow_style=None)
