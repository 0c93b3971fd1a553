"""The manifest of a data set: recipe, versions, and its complete shards with their files' hashes.

JSON lines: a header, then one line per shard, appended once the shard's files are written. An
incomplete last line is ignored.
"""
from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from ..files.run_scene import versions
from ..model.errors import Unreadable
from .shard import FALLS_PER_SHARD, DatasetJob, Shard

FILE = 'manifest.jsonl'
PART = '.part'
"""Suffix of a file that is being written."""


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
        """Read a folder's manifest and keep its complete shards; Unreadable if of another job.

        A shard is complete if it has all its falls and its files have their hashes.
        """
        header, entries, end = _read(folder / FILE)
        wanted = _header(job)
        for key, value in wanted.items():
            if key != 'count' and header.get(key) != value:
                raise Unreadable(key, header.get(key), f'{value!r}, as requested now')
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
