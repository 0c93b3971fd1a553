"""The report's data: a JSON file with every figure and the conditions of the run."""
import datetime
import importlib.metadata
import json
import math
import os
import platform
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from ...physics import kernels
from ...physics.accuracy import ACCURACIES

FILE = 'accuracy.json'

PACKAGE = 'ragdoll_ros'

Row = dict[str, object]
"""One result: figures by their names, which end in their units."""

Figures = dict[str, list[Row]]
"""Rows by part."""


def about(command: str, seconds: float, quick: bool, starts: int) -> dict[str, object]:
    """Conditions of the run: versions, machine, date."""
    return {'date': datetime.datetime.now(datetime.timezone.utc).strftime('%Y-%m-%d %H:%M UTC'),
            'command': command, 'quick': quick, 'starts': starts, 'seconds': round(seconds, 1),
            'machine': _processor(), 'cores': os.cpu_count(),
            'system': f'{platform.system()} {platform.machine()}',
            'python': platform.python_version(), 'engine': 'rigid' if kernels.ready() else 'bullet',
            'versions': dict(_versions())}


def save(data: dict, folder: Path) -> Path:
    """Write the JSON file, one line per row for readable diffs; returns its path.

    Infinity is written as the text 'inf', NaN as null: JSON has neither.
    """
    parts = (f'{_line(part)}: [\n' + ',\n'.join(map(_line, rows)) + '\n]'
             for part, rows in data['figures'].items())
    path = folder / FILE
    path.write_text(f'{{"about": {_line(data["about"])},\n"figures": {{\n' + ',\n'.join(parts)
                    + '\n}}\n', encoding='utf-8')
    return path


def load(folder: Path) -> dict:
    """Read what save() wrote: 'about', and 'figures' with the rows of each part."""
    return json.loads((folder / FILE).read_text(encoding='utf-8'))


def merged(data: dict, newer: dict) -> dict:
    """A report's data with the parts of a newer run, whose conditions are kept beside its own."""
    parts = newer['figures']
    later = {**data['about'].get('updated', {}), **dict.fromkeys(parts, newer['about'])}
    return {'about': {**data['about'], 'updated': later}, 'figures': {**data['figures'], **parts}}


def number(value: object) -> float:
    """A figure of the JSON as a float."""
    return math.nan if value is None else float(value)


def sound(rows: Iterable[Row]) -> list[Row]:
    """Rows of jobs that did not fail."""
    return [row for row in rows if 'failed' not in row]


def criterion(name: str, required: str, measured: str, met: bool) -> Row:
    """Row of an acceptance criterion."""
    return {'criterion': name, 'required': required, 'measured': measured, 'met': met}


def by_setting(figures: Figures, part: str, keep: Callable[[Row], bool] = lambda row: True,
               ) -> Iterator[tuple[str, list[Row]]]:
    """Yield each of our accuracies and its rows of a part, if there are any."""
    for accuracy in ACCURACIES:
        rows = [row for row in figures.get(part, ())
                if row.get('method') == f'ours-{accuracy}' and keep(row)]
        if rows:
            yield accuracy, rows


def _line(value: object) -> str:
    return json.dumps(_plain(value), allow_nan=False, ensure_ascii=False)


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, float):
        if math.isnan(value):
            return None
        if math.isinf(value):
            return 'inf'
        return float(f'{value:.6g}')
    return value


def _versions() -> Iterator[tuple[str, str]]:
    """Versions of the package and of the installed ones that the figures depend on."""
    for name in (PACKAGE, 'pybullet', 'mujoco', 'dartpy', 'drake', 'numpy', 'scipy', 'numba'):
        try:
            yield name, importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            if name == PACKAGE:
                yield name, 'from the source tree'


def _processor() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    except OSError:
        return platform.processor() or 'unknown'
    names = [line.split(':', 1)[1].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.machine()
