"""Distributions of a recipe's values: uniform, truncated normal, or a weighted choice.

Each is sampled by inverse transform and takes exactly one number of the generator.
"""
import math
from collections.abc import Iterator
from statistics import NormalDist

import numpy as np

from ..model import errors

MEAN_SHIFT = 0.25
"""Standard deviations by which the bounds of a normal distribution may shift its mean without a
warning. That of `normal: [0, s], within: [0, 360]`, half of a direction, is shifted by 0.8."""

KINDS = ('uniform', 'normal', 'choice')


def is_distribution(value: object) -> bool:
    """Whether a part of a recipe's data is a distribution."""
    return isinstance(value, dict) and len(set(KINDS) & set(value)) == 1


def draw(data: object, generator: np.random.Generator) -> object:
    """The same data with every distribution replaced by a sample.

    Mappings are traversed in the order of their sorted keys: their order in the file is irrelevant.
    """
    if is_distribution(data):
        return quantile(data, generator.random())
    if isinstance(data, dict):
        return {key: draw(data[key], generator) for key in sorted(data)}
    if isinstance(data, list):
        return [draw(part, generator) for part in data]
    return data


def quantile(distribution: dict, share: float) -> object:
    """Inverse of the cumulative distribution at ``share`` in [0, 1)."""
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
    """Smallest and largest possible number of a value."""
    if not isinstance(value, dict):
        return value, value
    if 'choice' in value:
        return min(value['choice']), max(value['choice'])
    return tuple(value['uniform'] if 'uniform' in value else value['within'])


def mean(normal: dict) -> float:
    """Mean of a truncated normal distribution (Johnson, Kotz, Balakrishnan, Continuous Univariate
    Distributions 1, 1994, equation 13.134).
    """
    centre, deviation = normal['normal']
    curve = NormalDist(centre, deviation)
    (low, high) = normal['within']
    share = curve.cdf(high) - curve.cdf(low)
    return centre + deviation ** 2 * (curve.pdf(low) - curve.pdf(high)) / share


def shifted_means(data: object, path: str = '') -> Iterator[str]:
    """Warnings of truncated normal distributions whose mean differs from that of their `normal` by
    more than MEAN_SHIFT standard deviations.
    """
    if isinstance(data, dict) and 'normal' in data:
        centre, deviation = data['normal']
        if abs(mean(data) - centre) > MEAN_SHIFT * deviation:
            yield (f'{path}: the mean is {mean(data):.3g}, not {centre:g}: '
                   f'within {data["within"]} cuts it off')
    elif isinstance(data, dict):
        for key, part in data.items():
            yield from shifted_means(part, f'{path}.{key}' if path else str(key))
    elif isinstance(data, list):
        for index, part in enumerate(data):
            yield from shifted_means(part, f'{path}[{index}]')


def choices(value: object) -> list:
    """All possible values of a value that is not a number: those of its `choice`, or itself."""
    return value['choice'] if is_distribution(value) else [value]


def distribution_errors(data: object, path: str = '') -> Iterator[errors.ModelError]:
    """Errors of distributions in data, beyond the schema."""
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
            yield errors.OutOfRange(f'{path}.within', data['within'],
                                    'bounds with nonzero probability')
    elif 'within' in data:
        yield errors.WrongForm(f'{path}.within', data['within'], 'only with normal')
    weights = data.get('weights')
    if weights is not None and (len(weights) != len(data.get('choice', ()))
                                or min(weights) < 0 or not 0 < sum(weights) < math.inf):
        yield errors.OutOfRange(f'{path}.weights', weights,
                                'one for each choice, none negative, not all zero')
