"""The manifest of a data set: what it is of, and each shard that is whole, with its files' hashes.

Text, JSON in lines: the first says what all is made from, each other one what a shard is. A line
is added when a shard's files are there; a torn last line is as if it were not.
"""
from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from ..files.run_scene import versions
from ..model.errors import Unreadable
from .shard import SIZE, Order, Shard

FILE = 'manifest.jsonl'
PART = '.part'
"""End of the name of a file that is being written."""


class Manifest:
    """That of a data set's folder, which shards are added to."""

    def __init__(self, folder: Path, header: dict, shards: dict[int, dict]) -> None:
        self.folder, self.header, self.shards = folder, header, shards

    @classmethod
    def begin(cls, folder: Path, order: Order) -> Manifest:
        """A new one, of a folder that holds none yet; OSError where it cannot be written."""
        folder.mkdir(parents=True, exist_ok=True)
        made = cls(folder, _header(order), {})
        made.write_sorted()
        return made

    @classmethod
    def resume(cls, folder: Path, order: Order) -> Manifest:
        """That of a folder, with the shards that are whole; Unreadable where it is of other falls.

        A shard is whole if it has all falls that it is to have, and its files have their hashes.
        """
        header, entries, end = _read(folder / FILE)
        wanted = _header(order)
        for key, value in wanted.items():
            if key != 'count' and header.get(key) != value:
                raise Unreadable(key, header.get(key), f'{value!r}, as of what is asked for now')
        if header['count'] > order.count:
            raise Unreadable('count', order.count, f'{header["count"]} or more, which are there')
        os.truncate(folder / FILE, end)
        for left in folder.rglob('*' + PART):
            left.unlink()
        shards = {entry['shard']: entry for entry in entries
                  if entry['shard'] < order.shards and _is_whole(folder, entry, order)}
        return cls(folder, wanted, shards)

    @classmethod
    def read(cls, folder: Path) -> Manifest:
        """That of a folder, as it stands; Unreadable where there is none."""
        header, entries, _ = _read(folder / FILE)
        return cls(folder, header, {entry['shard']: entry for entry in entries})

    @property
    def done(self) -> int:
        """Falls in whole shards."""
        return sum(entry['falls'][1] - entry['falls'][0] for entry in self.shards.values())

    @property
    def failures(self) -> dict[int, str]:
        """Why falls failed, by their numbers."""
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
        """Write the whole file anew, the shards in their order, however they came."""
        lines = [self.header, *(entry for _, entry in sorted(self.shards.items()))]
        text = ''.join(_line(line) for line in lines)
        write_files(self.folder, {FILE: text.encode()})


def write_files(folder: Path, files: dict[str, bytes]) -> dict[str, str]:
    """Write files by their paths in a folder, each whole or not at all; SHA-256 of each."""
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


def _header(order: Order) -> dict:
    """What all shards are made from."""
    return {'recipe': order.recipe.data, 'digest': order.recipe.digest, 'count': order.count,
            'format': order.format, 'falls_per_shard': SIZE, 'versions': versions()}


def _read(path: Path) -> tuple[dict, list[dict], int]:
    """Header and entries of a manifest, and where its last whole line ends."""
    try:
        content = path.read_bytes()
        whole = content[:content.rfind(b'\n') + 1]
        header, *entries = map(json.loads, whole.decode().splitlines())
    except (OSError, ValueError) as error:
        raise Unreadable('', str(path), 'a manifest of falls') from error
    return header, entries, len(whole)


def _is_whole(folder: Path, entry: dict, order: Order) -> bool:
    falls = order.numbers(entry['shard'])
    return entry['falls'] == [falls.start, falls.stop] and all(
        _has_hash(folder / name, digest) for name, digest in entry['files'].items())


def _has_hash(path: Path, digest: str) -> bool:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() == digest
    except OSError:
        return False
