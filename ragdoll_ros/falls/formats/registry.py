"""Registry of the formats."""
import importlib
from pathlib import Path
from typing import Protocol

from ...model import errors
from ..fall import Fall
from ..recipe import Recipe

FORMATS = {
    'lerobot': 'Parquet in the layout of LeRobot v3',
    'kfall': 'CSV in the layout of KFall, one per fall',
    'sisfall': 'text in the layout of SisFall, one per fall',
    'mcap': 'ROS 2 messages, one MCAP per fall',
    'amass': 'npz with the keys of AMASS, one per fall',
    'settled': 'states at rest, for controllers that get up, one npz'}


class Format(Protocol):
    """Interface of a format's module; the bytes of the files depend on the arguments and on the
    versions of libraries alone.
    """

    def check(self, recipe: Recipe) -> None:
        """Raise an error if the format cannot hold a recipe's falls; optional."""

    def shard_files(self, recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
        """Files of a shard by their paths in the data set's folder."""

    def last_files(self, recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
        """Files of the data set, after all shards of its ``count`` falls are written; optional."""


def resolve_format(name: str) -> Format:
    """Import a format's module; OutOfRange if unknown, Unreadable if its library is missing."""
    if name not in FORMATS:
        raise errors.OutOfRange('format', name, 'one of ' + ', '.join(FORMATS))
    try:
        return importlib.import_module(f'.{name}', __package__)
    except ModuleNotFoundError as error:
        raise errors.Unreadable('format', name, f'{error.name}: '
                                "pip install 'ragdoll_ros[falls]'") from None
