"""Where the file lies that a URDF names by package://, model://, file:// or a relative path.

A package is looked for as ROS does, by ROS_PACKAGE_PATH and AMENT_PREFIX_PATH, and in the folders
above the URDF, as robots are also handed on without ROS.
"""
from __future__ import annotations

import os
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ('package', 'model')
"""Schemes whose first part is the name of a package."""


def find_mesh(name: str, folder: Path | None) -> Path | None:
    """File that a URDF in ``folder`` (None: not known) means by a name; None if it is nowhere."""
    scheme, found, rest = name.partition('://')
    if not found:
        scheme, rest = 'file', name
    rest = urllib.parse.unquote(rest) if found else rest
    if scheme in PACKAGES:
        tried = _in_packages(*rest.split('/', 1), folder) if '/' in rest else ()
    elif scheme == 'file':
        rest = rest.replace('\\', '/')
        tried = [above / rest for above in _upwards(folder) or [Path('/')]]
    else:
        tried = ()
    return next((path for path in tried if _is_file(path)), None)


def _in_packages(package: str, rest: str, folder: Path | None) -> Iterator[Path]:
    for path in _paths('ROS_PACKAGE_PATH'):
        yield path / package / rest
        if path.name == package:
            yield path / rest
    for prefix in _paths('AMENT_PREFIX_PATH'):
        yield prefix / 'share' / package / rest
    for above in _upwards(folder):
        yield above / package / rest
        # The package's own folder, whatever it is called here.
        yield above / rest


def _paths(variable: str) -> list[Path]:
    return [Path(path) for path in os.environ.get(variable, '').split(os.pathsep) if path]


def _upwards(folder: Path | None) -> list[Path]:
    """A folder and all above it, the nearest first."""
    return [] if folder is None else [folder.absolute(), *folder.absolute().parents]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        # A name that is too long, or with a NUL, is no file's.
        return False
