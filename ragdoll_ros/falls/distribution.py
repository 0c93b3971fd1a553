"""Values of a recipe that are drawn anew for each fall: even, normal, or one of several.

Each takes one number of the generator, whatever it is of, so that draws have an order and nothing
else: by the inverse of its cumulative distribution.
"""
from __future__ import annotations

import math
from collections.abc import Iterator
from statistics import NormalDist

import numpy as np

from ..model import errors

KINDS = ('uniform', 'normal', 'choice')


def is_distribution(value: object) -> bool:
    """Whether a part of a recipe's data is drawn."""
    return isinstance(value, dict) and len(set(KINDS) & set(value)) == 1


def draw(data: object, generator: np.random.Generator) -> object:
    """The same data with every distribution in it replaced by what is drawn from it.

    Mappings are gone through in the order of their keys, so that a file may list them as it likes.
    """
    if is_distribution(data):
        return drawn(data, generator.random())
    if isinstance(data, dict):
        return {key: draw(data[key], generator) for key in sorted(data)}
    if isinstance(data, list):
        return [draw(part, generator) for part in data]
    return data


def drawn(distribution: dict, share: float) -> object:
    """The value below which ``share`` of all draws are, share in [0, 1)."""
    if 'uniform' in distribution:
        low, high = distribution['uniform']
        return low + (high - low) * share
    if 'choice' in distribution:
        choices = distribution['choice']
        weights = distribution.get('weights') or [1] * len(choices)
        sums = np.cumsum(weights, dtype=float)
        return choices[int(np.searchsorted(sums, share * sums[-1], side='right'))]
    curve = NormalDist(*distribution['normal'])
    low, high = (curve.cdf(end) for end in distribution['within'])
    value = curve.inv_cdf(min(max(low + (high - low) * share, 1e-300), 1 - 1e-16))
    return min(max(value, distribution['within'][0]), distribution['within'][1])


def support(value: object) -> tuple[float, float]:
    """Smallest and largest number that a value can be."""
    if not isinstance(value, dict):
        return value, value
    if 'choice' in value:
        return min(value['choice']), max(value['choice'])
    return tuple(value['uniform'] if 'uniform' in value else value['within'])


def choices(value: object) -> list:
    """All that a value which is no number can be."""
    return value['choice'] if is_distribution(value) else [value]


def distribution_errors(data: object, path: str = '') -> Iterator[errors.ModelError]:
    """What is wrong with distributions in data that the schema has nothing against."""
    if isinstance(data, list):
        for index, part in enumerate(data):
            yield from distribution_errors(part, f'{path}[{index}]')
    elif isinstance(data, dict) and set(data) & {*KINDS, 'within', 'weights'}:
        yield from _wrong(data, path)
    elif isinstance(data, dict):
        for key, part in data.items():
            yield from distribution_errors(part, f'{path}.{key}' if path else str(key))


def _wrong(data: dict, path: str) -> Iterator[errors.ModelError]:
    if not is_distribution(data):
        yield errors.WrongForm(path, ', '.join(data), 'exactly one of ' + ', '.join(KINDS))
        return
    for key in ('uniform', 'within'):
        if key in data and not -math.inf < data[key][0] <= data[key][1] < math.inf:
            yield errors.OutOfRange(f'{path}.{key}', data[key], 'lower <= upper, finite')
    if 'normal' in data:
        mean, deviation = data['normal']
        if not (math.isfinite(mean) and 0 < deviation < math.inf):
            yield errors.OutOfRange(f'{path}.normal', data['normal'],
                                    'a mean and a standard deviation above zero')
        elif 'within' not in data:
            yield errors.WrongForm(f'{path}.within', None, 'the bounds of a normal distribution')
        elif NormalDist(mean, deviation).cdf(data['within'][1]) <= NormalDist(
                mean, deviation).cdf(data['within'][0]):
            yield errors.OutOfRange(f'{path}.within', data['within'], 'bounds that it can reach')
    elif 'within' in data:
        yield errors.WrongForm(f'{path}.within', data['within'], 'nothing but with normal')
    weights = data.get('weights')
    if weights is not None and (len(weights) != len(data.get('choice', ()))
                                or min(weights) < 0 or not 0 < sum(weights) < math.inf):
        yield errors.OutOfRange(f'{path}.weights', weights,
                                'one for each choice, none negative, not all zero')
