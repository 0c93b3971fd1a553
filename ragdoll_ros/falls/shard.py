"""A shard: consecutive falls of a data set, as the bytes of its files.

A shard depends on its job and its number alone, so it is the same on every worker and in every
order.
"""
from dataclasses import dataclass

from ..model.errors import OutOfRange
from .formats.registry import Format, resolve_format
from .recipe import Recipe
from .simulate import generate

FALLS_PER_SHARD = 50
"""Of each shard but the last: a worker that dies loses a few seconds of work."""

MAX_FALLS = 10 ** 9


@dataclass(frozen=True)
class DatasetJob:
    """A data set to be generated: falls 0 to ``count`` - 1 of a recipe, in one format or several,
    whose names are separated by commas.
    """

    recipe: Recipe
    count: int
    format: str = 'lerobot'

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MAX_FALLS:
            raise OutOfRange('count', self.count, f'1 to {MAX_FALLS}')
        for each in self.formats:
            getattr(each, 'check', lambda recipe: None)(self.recipe)

    @property
    def formats(self) -> list[Format]:
        """Modules of the formats."""
        return [resolve_format(name) for name in self.format.split(',')]

    @property
    def shards(self) -> int:
        """Number of shards."""
        return -(-self.count // FALLS_PER_SHARD)

    def falls_of(self, shard: int) -> range:
        """Numbers of the falls of a shard."""
        return range(shard * FALLS_PER_SHARD, min((shard + 1) * FALLS_PER_SHARD, self.count))


@dataclass(frozen=True)
class Shard:
    """A finished shard."""

    number: int
    falls: range
    files: dict[str, bytes]
    """By their paths in the data set's folder."""
    failures: dict[int, str]
    """Reasons of falls that failed, by their numbers."""


def make_shard(job: DatasetJob, shard: int) -> Shard:
    """Simulate the falls of a shard and encode them as files."""
    falls = list(generate(job.recipe, job.falls_of(shard)))
    files = {name: content for each in job.formats
             for name, content in each.shard_files(job.recipe, falls, shard).items()}
    failures = {fall.number: fall.failure for fall in falls if fall.failure}
    return Shard(shard, job.falls_of(shard), files, failures)
