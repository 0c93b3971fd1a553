"""Build a data set: make the shards that are missing and write their files."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ..model.errors import Unreadable
from .formats.registry import resolve_format
from .manifest import FILE, Manifest, write_files
from .shard import DatasetJob, Shard

ShardMaker = Callable[[DatasetJob, Iterable[int]], Iterator[Shard]]
"""Makes shards by their numbers and yields them in any order."""


def build_dataset(job: DatasetJob, folder: Path, make: ShardMaker, resume: bool = False,
                     on_progress: Callable[[Manifest, int], None] = lambda manifest, new: None,
                     ) -> Manifest:
    """Write all falls of a job into a folder; ``on_progress`` is called after each shard.

    With ``resume``, complete shards in the folder are kept. Raises Unreadable if the folder holds
    falls already or, with ``resume``, other falls; OSError if a file cannot be written, in which
    case all earlier shards are kept.
    """
    if (folder / FILE).exists() and not resume:
        raise Unreadable('', str(folder), 'a folder without falls, or --resume to go on')
    manifest = (Manifest.resume if (folder / FILE).exists() else Manifest.begin)(folder, job)
    on_progress(manifest, 0)
    shards = make(job, [shard for shard in range(job.shards) if shard not in manifest.shards])
    try:
        for shard in shards:
            manifest.add(shard)
            on_progress(manifest, len(shard.falls))
    finally:
        getattr(shards, 'close', lambda: None)()
    last = resolve_format(job.format).last_files(job.recipe, job.count, folder)
    write_files(folder, last)
    manifest.write_sorted()
    return manifest
