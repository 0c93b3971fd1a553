"""Validation of a file's data against the JSON schemas of scenes and dolls."""
from __future__ import annotations

import functools
import json

import jsonschema

from ..model import errors
from ..model.errors import ModelError
from .config import config_folder

_NAMED = {'exclusiveMinimum': errors.NotPositive, 'minimum': errors.OutOfRange,
          'maximum': errors.OutOfRange}


def schema_errors(schema: str, data: object) -> list[ModelError]:
    """All violations of the schema ``schema`` ('scene' or 'doll')."""
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


def _wrong(error: jsonschema.ValidationError) -> object:
    """The wrong value of an error; of a mapping, its keys or the unknown ones."""
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
    path = config_folder() / f'{name}.schema.json'
    return jsonschema.Draft7Validator(json.loads(path.read_text(encoding='utf-8')))
