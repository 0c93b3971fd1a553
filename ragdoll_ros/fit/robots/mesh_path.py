"""Path of the file that a URDF names by package://, model://, file:// or a relative path.

Packages are searched in ROS_PACKAGE_PATH and AMENT_PREFIX_PATH as in ROS, and in the folders above
the URDF, because robots are also distributed without ROS.
"""
from __future__ import annotations

import os
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

PACKAGE_SCHEMES = ('package', 'model')
"""Schemes that begin with the name of a package."""


def find_mesh(name: str, folder: Path | None) -> Path | None:
    """File that a URDF in ``folder`` (None: unknown) names; None if it does not exist."""
    scheme, found, rest = name.partition('://')
    if not found:
        scheme, rest = 'file', name
    rest = urllib.parse.unquote(rest) if found else rest
    if scheme in PACKAGE_SCHEMES:
        tried = _in_packages(*rest.split('/', 1), folder) if '/' in rest else ()
    elif scheme == 'file':
        rest = rest.replace('\\', '/')
        tried = [above / rest for above in _ancestors(folder) or [Path('/')]]
    else:
        tried = ()
    return next((path for path in tried if _is_file(path)), None)


def _in_packages(package: str, rest: str, folder: Path | None) -> Iterator[Path]:
    for path in _environment_paths('ROS_PACKAGE_PATH'):
        yield path / package / rest
        if path.name == package:
            yield path / rest
    for prefix in _environment_paths('AMENT_PREFIX_PATH'):
        yield prefix / 'share' / package / rest
    for above in _ancestors(folder):
        yield above / package / rest
        # The package's own folder may have another name here.
        yield above / rest


def _environment_paths(variable: str) -> list[Path]:
    return [Path(path) for path in os.environ.get(variable, '').split(os.pathsep) if path]


def _ancestors(folder: Path | None) -> list[Path]:
    """A folder and its ancestors, nearest first."""
    return [] if folder is None else [folder.absolute(), *folder.absolute().parents]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        # A name that is too long or contains a NUL.
        return False
