"""Writing a recording in the format of the file's suffix."""
import csv
import io
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..model import errors
from .bvh_file import bvh_text
from .gltf.gltf_file import gltf_bytes
from .mcap_file import recording_bytes
from .recording import Recording

COLUMNS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
"""Columns of a bone, after its name and a dot: centre of mass, m; orientation."""


def csv_text(recording: Recording) -> str:
    """CSV (RFC 4180, Unix line ends): ``time`` in s, then COLUMNS of each bone. Exact."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator='\n')
    writer.writerow(['time', *(f'{name}.{part}' for name in recording.scene.bone_names
                               for part in COLUMNS)])
    poses = np.concatenate([recording.positions, recording.orientations], axis=2)
    writer.writerows([time, *row] for time, row in zip(
        recording.times.tolist(), poses.reshape(len(poses), -1).tolist(), strict=True))
    return stream.getvalue()


FORMATS: dict[str, Callable[[Recording, Callable[[str], None]], bytes]] = {
    '.mcap': lambda recording, warn: recording_bytes(recording),
    '.glb': gltf_bytes,
    '.bvh': lambda recording, warn: bvh_text(recording, warn=warn).encode(),
    '.csv': lambda recording, warn: csv_text(recording).encode()}
"""Encoders by suffix."""


def check_format(path: Path) -> None:
    """Raise OutOfRange for a suffix that is not in FORMATS."""
    if path.suffix not in FORMATS:
        raise errors.OutOfRange('', path.name, 'a name that ends in ' + ', '.join(FORMATS))


def encoded_files(recording: Recording, path: str | Path,
                  warn: Callable[[str], None] = warnings.warn) -> dict[Path, bytes]:
    """Contents of the files that save_recording writes, by path. Raises OutOfRange."""
    path = Path(path)
    check_format(path)
    dolls = recording.scene.dolls
    if path.suffix == '.bvh' and len(dolls) > 1:
        names = [placement.name.replace('/', '_') for placement in dolls]
        return {path.with_name(f'{path.stem}_{name}.bvh'):
                bvh_text(recording, index, warn).encode() for index, name in enumerate(names)}
    return {path: FORMATS[path.suffix](recording, warn)}


def save_recording(recording: Recording, path: str | Path,
                   warn: Callable[[str], None] = warnings.warn) -> list[Path]:
    """Write a recording as MCAP, glTF, BVH or CSV.

    glTF and BVH of a character that was fitted have the skeleton of its file, glTF also its skin,
    materials and images.

    Args:
        recording: from Recorder.recording().
        path: of the file; its suffix .mcap, .glb, .bvh or .csv is the format. BVH of several dolls
            is a file for each: run.bvh becomes run_left.bvh and run_right.bvh.
        warn: receives a sentence for each character whose file can not be read; glTF and BVH then
            have the doll's bones.

    Returns:
        Paths of the files.

    Raises:
        OutOfRange: the suffix is another one.
        Unreadable: the file can not be written.

    Example:
        >>> recorder = Recorder(load_scene('drop'))
        >>> with Simulation(recorder.scene) as simulation:
        ...     recorder.take(simulation)
        >>> [path.name for path in save_recording(recorder.recording(), 'fall.glb')]
        ['fall.glb']
    """
    made = encoded_files(recording, path, warn)
    try:
        for file, content in made.items():
            file.write_bytes(content)
    except OSError as error:
        raise errors.Unreadable('', str(path), f'a path that can be written: {error}') from None
    return list(made)
