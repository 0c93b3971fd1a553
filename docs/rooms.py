"""Draw docs/rooms.png: the rooms of the package and the imports between them, read from the code.

python docs/rooms.py
"""
from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / 'test'))
from test_rooms import PACKAGE, imports, modules  # noqa: E402

IDEAS = {'model': 'what a scene is', 'files': 'model as text and back',
         'physics': 'how a scene moves', 'realtime': 'wall clock, arrow keys',
         'fit': 'a character becomes a doll',
         'ros': 'topics, parameters, services', 'viewer': 'the page in the browser',
         'recordings': 'poses over time, as files', 'replay': 'runs repeated to the bit',
         'people': 'dolls of people', 'falls': 'data sets of falls',
         'accuracy': 'the report and its references'}
COLUMNS = {'replay': 0.4, 'viewer': -4.4, 'ros': -6.0, 'recordings': -2.5, 'fit': 1.0, 'falls': 4.2,
           'accuracy': 7.4, 'realtime': -6.0, 'physics': 1.0, 'people': 5.8}
UNDER = ('model', 'files')
"""Rooms that are drawn as full rows, without arrows to them."""
WIDE, HIGH, MIDDLE = 3.1, 0.62, 0.75


def arrows() -> Counter:
    """Number of imports from each room to each other."""
    found: Counter = Counter()
    for name, target in imports(PACKAGE):
        rooms = name.partition('.')[0], target.partition('.')[0]
        if rooms[0] != rooms[1] and set(rooms) <= set(IDEAS):
            found[rooms] += 1
    return found


def floors(edges: Counter) -> dict[str, int]:
    """Level of each room: one above the highest that it imports."""
    def floor(room: str) -> int:
        return max((1 + floor(target) for source, target in edges if source == room), default=0)
    return {room: floor(room) if room in UNDER else max(2, floor(room)) for room in IDEAS}


def draw(path: Path) -> None:
    """Draw the rooms by level; a room that all rooms above import is drawn as a full row."""
    edges = arrows()
    level = floors(edges)
    files = Counter(name.partition('.')[0] for name in modules(PACKAGE))
    figure, axes = plt.subplots(figsize=(14, 6))
    places = {}
    for height in sorted(set(level.values())):
        for room in [room for room in IDEAS if level[room] == height]:
            x, y = COLUMNS.get(room, MIDDLE), 1.2 * height
            places[room], wide = (x, y), 16.4 if room in UNDER else WIDE
            axes.add_patch(plt.Rectangle((x - wide / 2, y - HIGH / 2), wide, HIGH, zorder=3,
                                         fc='#dde8f4', ec='#3b5b7c'))
            axes.text(x, y + 0.1, f'{room}/', ha='center', va='center', weight='bold', zorder=4)
            axes.text(x, y - 0.15, f'{IDEAS[room]}, {files[room]} files', ha='center',
                      va='center', size=7.5, zorder=4)
    for (source, target), count in edges.items():
        if target in UNDER:
            continue
        (x, y), (u, v) = places[source], places[target]
        reach = 0.45 * WIDE
        x, u = x + np.clip((u - x) / 4, -reach, reach), u + np.clip((x - u) / 4, -reach, reach)
        axes.annotate('', (u, v + HIGH / 2), (x, y - HIGH / 2), zorder=1, arrowprops={
            'arrowstyle': '-|>', 'color': '0.35', 'lw': 1.2, 'shrinkA': 0, 'shrinkB': 0})
        fall = y - v - HIGH
        share = (0.12 if y - v < 1.5 else fall - 0.3) / fall
        axes.text(x + share * (u - x), y - HIGH / 2 - share * fall, str(count), size=7.5,
                  color='0.25', ha='center', va='center', zorder=2,
                  bbox={'fc': 'white', 'ec': 'none', 'pad': 0.8})
    axes.set_xlim(-7.6, 9.0)
    axes.set_ylim(-0.5, 1.2 * max(level.values()) + 0.5)
    axes.axis('off')
    figure.savefig(path, dpi=110, bbox_inches='tight')


if __name__ == '__main__':
    draw(ROOT / 'docs' / 'rooms.png')
