"""A recording into a file of the format that the file's suffix names."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from ..model import errors
from ..model.skin import Skin
from .bvh_file import bvh_text
from .csv_file import csv_text
from .gltf.gltf_file import gltf_bytes
from .mcap_file import recording_bytes
from .recording import Recording

FORMATS: dict[str, Callable[[Recording, Mapping[int, Skin]], bytes]] = {
    '.mcap': lambda recording, skins: recording_bytes(recording),
    '.glb': gltf_bytes,
    '.bvh': lambda recording, skins: bvh_text(recording).encode(),
    '.csv': lambda recording, skins: csv_text(recording).encode()}
"""By suffix: MCAP, glTF, BVH, CSV."""


def check_format(path: Path) -> None:
    """Raise OutOfRange for a file's name whose suffix is not one of FORMATS."""
    if path.suffix not in FORMATS:
        raise errors.OutOfRange('', path.name, 'a name that ends in ' + ', '.join(FORMATS))


def encoded_files(recording: Recording, path: str | Path,
             skins: Mapping[int, Skin] = {}) -> dict[Path, bytes]:
    """Files with their contents; OutOfRange for a suffix that is not one of FORMATS.

    It is one file but for the BVH of several dolls, which is one for each: run.bvh becomes
    run_left.bvh and run_right.bvh. ``skins`` are those of some dolls, by index, for glTF.
    """
    path = Path(path)
    check_format(path)
    dolls = recording.scene.dolls
    if path.suffix == '.bvh' and len(dolls) > 1:
        names = [placement.name.replace('/', '_') for placement in dolls]
        return {path.with_name(f'{path.stem}_{name}.bvh'):
                bvh_text(recording, index).encode() for index, name in enumerate(names)}
    return {path: FORMATS[path.suffix](recording, skins)}


def save_recording(recording: Recording, path: str | Path,
                   skins: Mapping[int, Skin] = {}) -> list[Path]:
    """Write what `contents` has; the paths. Unreadable where the disk refuses."""
    made = encoded_files(recording, path, skins)
    try:
        for file, content in made.items():
            file.write_bytes(content)
    except OSError as error:
        raise errors.Unreadable('', str(path), f'a path that can be written: {error}') from None
    return list(made)
