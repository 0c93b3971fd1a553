"""The formats by their names."""
from __future__ import annotations

import importlib
from pathlib import Path
from typing import Protocol

from ...model import errors
from ..fall import Fall
from ..recipe import Recipe

FORMATS = {
    'lerobot': 'Parquet in the layout of LeRobot v3', 'kfall': 'CSV as of KFall, one a fall',
    'mcap': 'ROS 2 messages, one MCAP a fall',     'amass': "npz in AMASS's names, one a fall",
    'settled': 'states at rest, for controllers that get up, one npz'}


class Format(Protocol):
    """What a format's module has; its bytes depend on the falls and the libraries alone."""

    def check(self, recipe: Recipe) -> None:
        """Raise what is wrong with a recipe for this format; optional."""

    def shard_files(self, recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
        """Files of a shard by their paths in the data set's folder."""

    def last_files(self, recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
        """Files of the whole data set, once all shards of its ``count`` falls are there."""


def resolve_format(name: str) -> Format:
    """The module of a format; OutOfRange for a name that is none, Unreadable where its library is
    missing.
    """
    if name not in FORMATS:
        raise errors.OutOfRange('format', name, 'one of ' + ', '.join(FORMATS))
    try:
        return importlib.import_module(f'.{name}', __package__)
    except ModuleNotFoundError as error:
        raise errors.Unreadable('format', name, f'{error.name}: '
                                "pip install 'ragdoll_ros[falls]'") from None
