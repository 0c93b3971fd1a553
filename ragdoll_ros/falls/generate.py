"""A data set from an order: which shards are still to be made, and their files as they come."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ..model.errors import Unreadable
from .formats.registry import resolve_format
from .manifest import FILE, Manifest, write_files
from .shard import Order, Shard

Maker = Callable[[Order, Iterable[int]], Iterator[Shard]]
"""What makes shards by their numbers, in whatever order they come."""


def run(order: Order, folder: Path, make: Maker, resume: bool = False,
        tell: Callable[[Manifest, int], None] = lambda manifest, new: None) -> Manifest:
    """Make all falls of an order into a folder; ``tell`` how far it is after each shard.

    With ``resume`` what is whole there is kept. Unreadable for a folder that holds falls already,
    or with ``resume`` others. OSError where a file cannot be written; all before it is kept.
    """
    if (folder / FILE).exists() and not resume:
        raise Unreadable('', str(folder), 'a folder without falls, or --resume to go on')
    manifest = (Manifest.resume if (folder / FILE).exists() else Manifest.begin)(folder, order)
    tell(manifest, 0)
    makes = make(order, [shard for shard in range(order.shards) if shard not in manifest.shards])
    try:
        for shard in makes:
            manifest.add(shard)
            tell(manifest, len(shard.falls))
    finally:
        getattr(makes, 'close', lambda: None)()
    last = resolve_format(order.format).last_files(order.recipe, order.count, folder)
    write_files(folder, last)
    manifest.write_sorted()
    return manifest
