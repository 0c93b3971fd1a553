"""A shard: some falls, one after the other, as the bytes of files. It is made from the recipe and
its number alone, by whoever: the same on every worker, in every order.
"""
from __future__ import annotations

from dataclasses import dataclass

from ..model.errors import OutOfRange
from .formats.registry import resolve_format
from .recipe import Recipe
from .simulate import generate

SIZE = 50
"""Falls in each shard but the last. What a worker loses that dies: a few s of work."""

MOST_FALLS = 10 ** 9


@dataclass(frozen=True)
class Order:
    """Falls 0 to ``count`` of a recipe, in a format; what is asked for as a whole."""

    recipe: Recipe
    count: int
    format: str = 'lerobot'

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MOST_FALLS:
            raise OutOfRange('count', self.count, f'1 to {MOST_FALLS}')
        getattr(resolve_format(self.format), 'check', lambda recipe: None)(self.recipe)

    @property
    def shards(self) -> int:
        """How many there are in all."""
        return -(-self.count // SIZE)

    def numbers(self, shard: int) -> range:
        """The falls of a shard."""
        return range(shard * SIZE, min((shard + 1) * SIZE, self.count))


@dataclass(frozen=True)
class Shard:
    """What became of one."""

    number: int
    falls: range
    files: dict[str, bytes]
    """By their paths in the data set's folder."""
    failures: dict[int, str]
    """Why falls failed, by their numbers."""


def make_shard(order: Order, shard: int) -> Shard:
    """Simulate the falls of a shard and write them as files."""
    falls = list(generate(order.recipe, order.numbers(shard)))
    files = resolve_format(order.format).shard_files(order.recipe, falls, shard)
    failures = {fall.number: fall.failure for fall in falls if fall.failure}
    return Shard(shard, order.numbers(shard), files, failures)
