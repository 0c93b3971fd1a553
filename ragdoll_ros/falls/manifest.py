"""The manifest of a data set: recipe, versions, and its complete shards with their files' hashes.

JSON lines: a header, then one line per shard, appended once the shard's files are written. An
incomplete last line is ignored.
"""
from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ..files.run_scene import versions
from ..model.errors import Unreadable
from .shard import FALLS_PER_SHARD, DatasetJob, Shard

FILE = 'manifest.jsonl'
PART = '.part'
"""Suffix of a file that is being written."""

ABSENT = 'nothing'
"""Value of a key that is not there."""

MOST_LISTED, LONGEST = 20, 80
"""Differences of two recipes in an error, and characters of a value."""

ShardMaker = Callable[[DatasetJob, Iterable[int]], Iterator[Shard]]
"""Makes shards by their numbers and yields them in any order."""


class Manifest:
    """Manifest of a data set's folder."""

    def __init__(self, folder: Path, header: dict, shards: dict[int, dict]) -> None:
        self.folder, self.header, self.shards = folder, header, shards

    @classmethod
    def begin(cls, folder: Path, job: DatasetJob) -> Manifest:
        """Create the manifest in a folder that has none; OSError if it cannot be written."""
        folder.mkdir(parents=True, exist_ok=True)
        made = cls(folder, _header(job), {})
        made.write_sorted()
        return made

    @classmethod
    def resume(cls, folder: Path, job: DatasetJob) -> Manifest:
        """Read a folder's manifest and keep its complete shards. Removes an incomplete last line
        and unfinished files. Raises Unreadable if it is of another recipe, format or library
        version, or of more falls than the job.

        A shard is complete if it has all its falls and its files have their hashes.
        """
        header, entries, end = _read(folder / FILE)
        wanted = _header(job)
        keys = [key for key in wanted if key not in ('count', 'digest')]
        if found := list(differences({key: header.get(key) for key in keys},
                                     {key: wanted[key] for key in keys})):
            raise Unreadable('', str(folder), f'falls of the same recipe; {_listed(found)}')
        if header['count'] > job.count:
            raise Unreadable('count', job.count, f'{header["count"]} or more, as in the folder')
        os.truncate(folder / FILE, end)
        for left in folder.rglob('*' + PART):
            left.unlink()
        shards = {entry['shard']: entry for entry in entries
                  if entry['shard'] < job.shards and _is_complete(folder, entry, job)}
        return cls(folder, wanted, shards)

    @classmethod
    def read(cls, folder: Path) -> Manifest:
        """Read a folder's manifest; Unreadable if there is none."""
        header, entries, _ = _read(folder / FILE)
        return cls(folder, header, {entry['shard']: entry for entry in entries})

    @property
    def done(self) -> int:
        """Number of falls in complete shards."""
        return sum(entry['falls'][1] - entry['falls'][0] for entry in self.shards.values())

    @property
    def failures(self) -> dict[int, str]:
        """Reasons of falls that failed, by their numbers."""
        return {int(number): reason for _, entry in sorted(self.shards.items())
                for number, reason in entry['failures'].items()}

    def add(self, shard: Shard) -> None:
        """Write a shard's files, then its line."""
        entry = {'shard': shard.number, 'falls': [shard.falls.start, shard.falls.stop],
                 'failures': {str(key): value for key, value in shard.failures.items()},
                 'files': write_files(self.folder, shard.files)}
        with (self.folder / FILE).open('a', encoding='utf-8') as file:
            file.write(_line(entry))
        self.shards[shard.number] = entry

    def write_sorted(self) -> None:
        """Rewrite the file with the shards in order of their numbers."""
        lines = [self.header, *(entry for _, entry in sorted(self.shards.items()))]
        text = ''.join(_line(line) for line in lines)
        write_files(self.folder, {FILE: text.encode()})


def write_files(folder: Path, files: dict[str, bytes]) -> dict[str, str]:
    """Write files by their paths in a folder, each atomically; returns the SHA-256 of each."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + PART)
        try:
            part.write_bytes(content)
        except OSError:
            part.unlink(missing_ok=True)
            raise
        part.replace(path)
    return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}


def differences(old: object, new: object, path: str = '') -> Iterator[tuple[str, str, str]]:
    """Where JSON data differ: path, old and new value in JSON; ABSENT where there is none."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            yield from differences(old.get(key, ABSENT), new.get(key, ABSENT),
                                   f'{path}.{key}' if path else key)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f'{path}[{index}]')
    elif old != new:
        yield path, _shown(old), _shown(new)


def _shown(value: object) -> str:
    text = ABSENT if value is ABSENT else json.dumps(value)
    return text if len(text) <= LONGEST else text[:LONGEST - 3] + '...'


def _listed(found: list[tuple[str, str, str]]) -> str:
    """Differences, a line each."""
    lines = ['these differ:', *(f'{path}: {old} there, {new} now'
                                for path, old, new in found[:MOST_LISTED])]
    if len(found) > MOST_LISTED:
        lines.append(f'and {len(found) - MOST_LISTED} more')
    return '\n  '.join(lines)


def _line(data: dict) -> str:
    return json.dumps(data, sort_keys=True) + '\n'


def _header(job: DatasetJob) -> dict:
    """All that the shards depend on."""
    return {'recipe': job.recipe.data, 'digest': job.recipe.digest, 'count': job.count,
            'format': job.format, 'falls_per_shard': FALLS_PER_SHARD, 'versions': versions()}


def _read(path: Path) -> tuple[dict, list[dict], int]:
    """Header and entries of a manifest, and the end of its last complete line in bytes."""
    try:
        content = path.read_bytes()
        whole = content[:content.rfind(b'\n') + 1]
        header, *entries = map(json.loads, whole.decode().splitlines())
    except (OSError, ValueError) as error:
        raise Unreadable('', str(path), 'a manifest of falls') from error
    return header, entries, len(whole)


def _is_complete(folder: Path, entry: dict, job: DatasetJob) -> bool:
    falls = job.falls_of(entry['shard'])
    return entry['falls'] == [falls.start, falls.stop] and all(
        _has_hash(folder / name, digest) for name, digest in entry['files'].items())


def _has_hash(path: Path, digest: str) -> bool:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() == digest
    except OSError:
        return False


def build_dataset(job: DatasetJob, folder: Path, make: ShardMaker, resume: bool = False,
                     on_progress: Callable[[Manifest, int], None] = lambda manifest, new: None,
                     ) -> Manifest:
    """Write all falls of a job into a folder; ``on_progress`` is called once at the beginning, and
    after each shard.

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
    for each in job.formats:
        last_files = getattr(each, 'last_files', lambda *_: {})
        write_files(folder, last_files(job.recipe, job.count, folder))
    manifest.write_sorted()
    return manifest
