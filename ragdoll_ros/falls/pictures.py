"""Pictures of a data set: impact speeds, timing, directions, and a contact sheet of falls."""
from pathlib import Path

import numpy as np

from ..model import errors
from ..model.state import State
from ..people.real_falls import DESCENT, IMPACT_SPEEDS, Known, bones_of
from .dataset_summary import DatasetSummary
from .fall import Fall

BLUE, GREY = '#1f5fa8', '0.75'
EARLIER_POSES = 4
"""Poses of each fall on the contact sheet before the last one."""


def draw_all(summary: DatasetSummary, falls: list[Fall], folder: Path) -> list[str]:
    """Write all pictures; returns their paths in the folder. Unreadable without matplotlib."""
    try:
        import matplotlib
        matplotlib.use('Agg')
        from matplotlib import pyplot
    except ImportError:
        raise errors.Unreadable(
            '', 'no matplotlib', "pip install 'ragdoll_ros[falls]' for pictures") from None
    (folder / 'pictures').mkdir(exist_ok=True)
    names = []
    for name, draw in (('speeds', _speeds), ('courses', _timing_and_directions)):
        names.append(f'pictures/{name}.png')
        figure = draw(pyplot, summary)
        figure.savefig(folder / names[-1], dpi=100, bbox_inches='tight')
        pyplot.close(figure)
    names.append('pictures/sheet.png')
    figure = _sheet(pyplot, falls)
    figure.savefig(folder / names[-1], dpi=100)
    pyplot.close(figure)
    return names


def _speeds(pyplot: object, summary: DatasetSummary) -> object:
    """Histograms of the impact speeds of pelvis, head and hand, with those of real falls."""
    parts = [part for part in IMPACT_SPEEDS if bones_of(part, summary.bones)]
    figure, axes = pyplot.subplots(1, max(len(parts), 1), figsize=(4 * max(len(parts), 1), 3),
                                   squeeze=False)
    for ax, part in zip(axes[0], parts, strict=False):
        _histogram(ax, summary.speeds_of(part), IMPACT_SPEEDS[part])
        ax.set_xlabel(f'impact speed of the {part}, m/s')
    axes[0, 0].set_ylabel('share of falls')
    return figure


def _timing_and_directions(pyplot: object, summary: DatasetSummary) -> object:
    """Histograms of descent time and time to rest, and of the direction of the fall."""
    figure = pyplot.figure(figsize=(12, 3))
    times = figure.add_subplot(1, 3, 1)
    _histogram(times, summary.descents, DESCENT)
    times.set(xlabel='descent: onset to impact of the pelvis, s', ylabel='share of falls')
    rests = figure.add_subplot(1, 3, 2)
    _histogram(rests, summary.durations, None)
    rests.set_xlabel('onset to rest, s')
    rose = figure.add_subplot(1, 3, 3, projection='polar')
    angles = np.radians(summary.directions[summary.hits])
    counts, edges = np.histogram(angles % (2 * np.pi), 24, (0, 2 * np.pi))
    rose.bar(edges[:-1], counts, width=np.diff(edges), align='edge', color=BLUE)
    rose.set_theta_zero_location('N')
    rose.set_xticks(np.radians([0, 90, 180, 270]), ['forwards', 'left', 'back', 'right'])
    rose.set_yticks([])
    return figure


def _histogram(axes: object, values: np.ndarray, known: Known | None) -> None:
    """Histogram of values in shares, with mean and standard deviation of real falls."""
    if len(values):
        axes.hist(values, 40, weights=np.full(len(values), 1 / len(values)), color=BLUE)
    if known is not None:
        axes.axvspan(known.mean - known.deviation, known.mean + known.deviation, color=GREY,
                     alpha=0.5, zorder=0)
        axes.axvline(known.mean, color='black', lw=1, label='real falls, mean and deviation')
        axes.legend(fontsize=7, loc='upper right')


def _sheet(pyplot: object, falls: list[Fall]) -> object:
    """Each fall seen from the side, poses from light to dark, to scale."""
    rows = -(-len(falls) // 6)
    figure, axes = pyplot.subplots(rows, 6, figsize=(15, 2.6 * rows), squeeze=False)
    for ax in axes.ravel():
        ax.axis('off')
    for ax, fall in zip(axes.ravel(), falls, strict=False):
        _draw_fall(ax, fall)
    figure.tight_layout()
    return figure


def _draw_fall(axes: object, fall: Fall) -> None:
    from matplotlib.patches import Polygon
    title = f'{fall.number}'
    if fall.valid:
        last = fall.valid - 1
        until = min(last, fall.phases.rest or last)
        frames = np.linspace(0, until, EARLIER_POSES + 1).round().astype(int)
        along = _fall_direction(fall)
        for place, frame in enumerate(frames):
            for outline in _outlines(fall, frame, along):
                axes.add_patch(Polygon(outline, closed=True, fc=BLUE, ec='white', lw=0.3,
                                       alpha=0.15 + 0.75 * (place / EARLIER_POSES) ** 2))
        axes.set_aspect('equal')
        axes.autoscale_view()
        title += (': failed' if fall.failure else ': no impact' if fall.phases.impact is None
                  else f': {fall.direction:.0f}°')
    axes.set_title(title, fontsize=8)


def _fall_direction(fall: Fall) -> np.ndarray:
    """Unit vector (3,) along which the centre of mass moves horizontally, world frame."""
    centres = np.einsum('tnk,n->tk', fall.states[:fall.valid, :, :3], fall.masses)
    moved = (centres[-1] - centres[0]) * (1, 1, 0)
    length = np.linalg.norm(moved)
    return moved / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])


def _outlines(fall: Fall, frame: int, along: np.ndarray) -> list[np.ndarray]:
    """Outlines (c, 2) m of all bones projected on the plane of ``along`` and z, farthest first."""
    state = State.of(fall.states[frame])
    across = np.cross(along, (0, 0, 1))
    order = np.argsort(state.positions @ across)  # ``across`` points to the viewer
    made = []
    for bone in order:
        corners, _ = fall.scene.bones[bone].shape.mesh()
        points = state.poses(int(bone)).apply(corners)
        made.append(hull(np.column_stack([points @ along, points[:, 2]])))
    return made


def hull(points: np.ndarray) -> np.ndarray:
    """Corners (c, 2) of the convex hull of points (p, 2), counter-clockwise (Andrew 1979)."""
    def half(ordered: list) -> list:
        kept: list = []
        for x, y in ordered:
            while len(kept) > 1 and (
                    (kept[-1][0] - kept[-2][0]) * (y - kept[-2][1])
                    <= (kept[-1][1] - kept[-2][1]) * (x - kept[-2][0])):
                kept.pop()
            kept.append((x, y))
        return kept[:-1]
    ordered = sorted(set(map(tuple, points.tolist())))
    return np.array(half(ordered) + half(ordered[::-1]))
