"""Messages of a rosbag2 recording, MCAP or SQLite, also of a truncated file.

Of a truncated MCAP file every complete record is read, also within an uncompressed chunk; of SQLite
every row on a complete page.
"""
import io
import re
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from ...model import errors

NO_MCAP = "MCAP files need mcap: pip install 'ragdoll_ros[replay]'"

Messages = Iterator[tuple[str, str, bytes]]
"""(topic, type, CDR data), in recorded order."""


def read_messages(path: Path, warn: Callable[[str], None]) -> Messages:
    """All messages of a recording: a rosbag2 folder, or one of its files.

    ``warn`` gets a text if a file is truncated. Raises Unreadable if there is no recording.
    """
    for file in _files(path):
        read = _read_mcap if file.suffix == '.mcap' else _read_sqlite
        try:
            yield from read(file)
        except errors.ModelError:
            raise
        except Exception as error:  # truncated data can raise anything
            warn(f'{file} is truncated ({str(error) or type(error).__name__}): '
                 'it is read up to there')


def _files(path: Path) -> list[Path]:
    """Files of a recording in the order of the numbers in their names."""
    found = [path] if path.is_file() else list(path.glob('*')) if path.is_dir() else []
    found = [file for file in found if file.suffix in ('.mcap', '.db3')]
    if not found:
        raise errors.Unreadable('', str(path), 'a folder of `ros2 bag record`, a .mcap or a .db3')
    return sorted(found, key=lambda file: [int(part) if part.isdigit() else part
                                           for part in re.split(r'(\d+)', file.name)])


def _read_sqlite(file: Path) -> Messages:
    connection = sqlite3.connect(f'{file.resolve().as_uri()}?mode=ro', uri=True)
    try:
        # Lets SQLite open a file that is shorter than its header says.
        connection.execute('PRAGMA writable_schema = ON')
        yield from connection.execute(
            'SELECT topics.name, topics.type, messages.data FROM messages JOIN topics '
            'ON topics.id = messages.topic_id ORDER BY messages.id')
    finally:
        connection.close()


def _read_mcap(file: Path) -> Messages:
    try:
        from mcap.records import Channel, Message, Schema
    except ImportError:
        raise errors.Unreadable('', str(file), NO_MCAP) from None
    kinds: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    with file.open('rb') as stream:
        for record in _records(stream):
            if isinstance(record, Schema):
                kinds[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record.topic, kinds.get(record.schema_id, '')
            elif isinstance(record, Message):
                yield *channels[record.channel_id], record.data


def _records(stream: BinaryIO, in_chunk: bool = False) -> Iterator[object]:
    """Records of a file or a chunk. Raises EndOfFile where it is truncated."""
    from mcap.exceptions import EndOfFile
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk
    end = 0
    try:
        for record in StreamReader(stream, skip_magic=in_chunk, emit_chunks=True).records:
            end = stream.tell()
            if isinstance(record, Chunk):
                yield from breakup_chunk(record, validate_crc=True)
            else:
                yield record
    except EndOfFile:
        stream.seek(end)
        yield from _records_of_truncated(stream)
        raise


def _records_of_truncated(stream: BinaryIO) -> Iterator[object]:
    """Yield the complete records within the truncated last record, if it is an
    uncompressed chunk.
    """
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import EndOfFile
    from mcap.opcode import Opcode
    from mcap.records import Chunk
    if stream.read(9)[:1] != bytes([Opcode.CHUNK]):
        return
    chunk = Chunk.read(ReadDataStream(stream))
    if not chunk.compression:
        try:
            yield from _records(io.BytesIO(chunk.data), in_chunk=True)
        except EndOfFile:
            return
