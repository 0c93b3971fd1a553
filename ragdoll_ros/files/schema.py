"""Validation of a file's data against its JSON schema; models built from it, with every error."""
import functools
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeGuard, TypeVar

import jsonschema

from ..model import errors
from ..model.errors import ModelError, ModelErrors
from . import config, yaml_text

_NAMED = {'exclusiveMinimum': errors.NotPositive, 'minimum': errors.OutOfRange,
          'maximum': errors.OutOfRange}

Made = TypeVar('Made')


MARKS = {'scene': 'dolls', 'doll': 'bones', 'recipe': 'who', 'limits': 'regions'}
"""The key without which a file is none of the kind. Its values then are in no error: whoever may
set a node's scene could read any file by them."""


def is_marked(data: object, schema: str) -> TypeGuard[dict]:
    """Whether data may be meant for the schema: a mapping with the key that MARKS has for it."""
    return isinstance(data, dict) and MARKS[schema] in data


def schema_errors(schema: str, data: object) -> list[ModelError]:
    """All violations of the schema ``schema``, a key of MARKS."""
    if not is_marked(data, schema):
        form = 'a mapping' if isinstance(data, dict) else 'no mapping'
        others = [other for other in MARKS if is_marked(data, other)]
        is_other = f', but {_kind(others[0])}' if others else ''
        return [errors.WrongForm('', f'{form} without {MARKS[schema]}{is_other}',
                                 f'{_kind(schema)}, with {MARKS[schema]}')]
    found = []
    for error in _validator(schema).iter_errors(data):
        if error.validator == 'oneOf' and not isinstance(error.instance, dict):
            # An error of its type is reported already.
            continue
        path = ''
        for part in error.absolute_path:
            path += f'[{part}]' if isinstance(part, int) else f'.{part}' if path else str(part)
        kind = _NAMED.get(error.validator, errors.WrongForm)
        found.append(kind(path, _wrong(error), _expected(error)))
    return sorted(found, key=lambda error: error.path)


def _kind(schema: str) -> str:
    """A kind of file in words."""
    return schema if schema == 'limits' else f'a {schema}'


def _wrong(error: jsonschema.ValidationError) -> object:
    """Return the wrong value of an error: for oneOf the keys of the mapping, for
    additionalProperties its unknown keys, else the value itself.
    """
    if error.validator == 'oneOf':
        return ', '.join(map(str, error.instance))
    if error.validator != 'additionalProperties':
        return error.instance
    return ', '.join(str(key) for key in error.instance if key not in error.schema['properties'])


KINDS = {'array': 'a list', 'object': 'a mapping', 'string': 'a string', 'number': 'a number',
         'integer': 'an integer', 'boolean': 'true or false', 'null': 'nothing'}
"""JSON Schema's types in words."""


def _expected(error: jsonschema.ValidationError) -> str:
    """What the schema expects instead, in words."""
    about = error.schema.get('description', '')
    if error.validator == 'required':
        missing = [key for key in error.validator_value if key not in error.instance]
        return 'the missing ' + ', '.join(missing)
    if error.validator == 'oneOf':
        choices = [key for choice in error.validator_value for key in choice['required']]
        return 'exactly one of ' + ', '.join(choices)
    if error.validator == 'additionalProperties':
        return 'only ' + ', '.join(error.schema['properties'])
    rule = {'enum': 'one of {}', 'type': '{}', 'minItems': 'at least {} items',
            'maxItems': 'at most {} items', 'exclusiveMinimum': 'above {}',
            'minimum': '{} or more', 'maximum': '{} or less',
            'minProperties': 'at least {} key', 'maxProperties': 'at most {} key'}
    value = error.validator_value
    values = value if isinstance(value, list) else [value]
    if error.validator == 'type':
        values = [KINDS[each] for each in values]
    value = ' or '.join(map(str, values))
    return (rule.get(error.validator, '') .format(value) + (about and f' ({about})')).strip()


@functools.cache
def _validator(name: str) -> jsonschema.Draft7Validator:
    schema, doll = _read(name), _read('doll')
    schema['definitions'] = doll['definitions'] | schema['definitions']
    return jsonschema.Draft7Validator(schema)


def _read(name: str) -> dict:
    """Read a schema in config/; its references to doll.schema.json are made references to
    itself.
    """
    text = (config.config_folder() / f'{name}.schema.json').read_text(encoding='utf-8')
    return json.loads(text.replace('"doll.schema.json#', '"#'))


def read_by_name(name: str, folder: str = '') -> tuple[object, Path]:
    """Data of a YAML file, given by path or by its name in ``folder`` of config/, and its path.
    Raises ModelErrors.
    """
    try:
        path = config.find(name, folder=folder)
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
