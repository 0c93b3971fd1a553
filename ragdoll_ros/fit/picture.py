"""A picture of the skin and, beside it, of the bodies fitted to it, their joints and ranges."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from ..model import errors
from ..model.ragdoll import Bone, Ragdoll
from .dials import dials
from .reading.character import Character

COLORS = np.array([[0.90, 0.45, 0.35], [0.35, 0.60, 0.85], [0.50, 0.75, 0.45], [0.95, 0.75, 0.35],
                   [0.65, 0.50, 0.80], [0.45, 0.75, 0.75], [0.85, 0.60, 0.75], [0.70, 0.65, 0.50]])
ANGLES = np.array([[0.80, 0.15, 0.15], [0.10, 0.50, 0.15], [0.15, 0.25, 0.75]])
"""Of a joint's first, second and third angle."""
SKIN = np.array([0.80, 0.78, 0.74])
LIGHT = np.array([0.5, 0.4, 0.77])
FEWER = 30_000
"""Triangles of a skin that are drawn at the most."""


def draw(doll: Ragdoll, character: Character | None, path: str | Path) -> None:
    """Write a picture of skin, both, bodies, and joints, seen from ahead and to the left.

    Without a character: of bodies and joints alone. Unreadable where matplotlib is missing, OSError
    where the picture cannot be written.
    """
    try:
        import matplotlib
        matplotlib.use('Agg')
        from matplotlib import pyplot
    except ImportError:
        raise errors.Unreadable(
            '', 'no matplotlib', "pip install 'ragdoll_ros[fit]' for pictures") from None
    bodies = [(_triangles(bone), COLORS[number % len(COLORS)])
              for number, bone in enumerate(doll.bones)]
    views = [('bodies', [(bodies, 1.0)])]
    points = np.concatenate([triangles.reshape(-1, 3) for triangles, _ in bodies])
    if character is not None:
        triangles = character.vertices[character.triangles]
        skin = [(triangles[::max(1, len(triangles) // FEWER)], SKIN)]
        views = [('skin', [(skin, 1.0)]), ('skin and bodies', [(bodies, 0.5), (skin, 0.15)]),
                 *views]
        points = np.concatenate([points, character.vertices])
    views.append(('joints and their ranges', [(bodies, 0.12)]))
    figure = pyplot.figure(figsize=(5 * len(views), 6), dpi=100)
    for number, (title, layers) in enumerate(views, 1):
        axes = figure.add_subplot(1, len(views), number, projection='3d')
        for solids, alpha in layers:
            _draw_solids(axes, solids, alpha)
        if number == len(views):
            _draw_joints(axes, doll)
        _frame(axes, points)
        axes.set_title(title)
    figure.suptitle(doll.name)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)


def _triangles(bone: Bone) -> np.ndarray:
    corners, triangles = bone.shape.mesh()
    return bone.pose.apply(corners)[triangles]


def _draw_solids(axes: object, solids: list[tuple[np.ndarray, np.ndarray]], alpha: float) -> None:
    """All triangles in one collection: only so matplotlib sorts them by depth among each other."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    corners = np.concatenate([triangles for triangles, _ in solids])
    base = np.concatenate([np.tile(color, (len(triangles), 1)) for triangles, color in solids])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shade = 0.55 + 0.45 * np.maximum(normals @ LIGHT, 0)[:, None]
    colors = np.concatenate([base * shade, np.full((len(base), 1), alpha)], axis=1)
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors='none'))


def _draw_joints(axes: object, doll: Ragdoll) -> None:
    """A dot at each joint, and a sector for each of its limited angles, in front of the bodies."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    axes.computed_zorder = False
    sectors = dials(doll)
    if sectors:
        colors = ANGLES[[number for number, _ in sectors]]
        axes.add_collection3d(Poly3DCollection(
            [points for _, points in sectors], zorder=2, edgecolors=colors, linewidths=0.8,
            facecolors=np.column_stack([colors, np.full(len(colors), 0.25)])))
    for fixed, marker in ((False, 'o'), (True, 's')):
        anchors = np.array([joint.anchor for joint in doll.joints
                            if (joint.kind == 'fixed') == fixed]).reshape(-1, 3)
        axes.scatter(*anchors.T, c='black', s=14, marker=marker, depthshade=False, zorder=3)


def _frame(axes: object, vertices: np.ndarray) -> None:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle, half = (low + high) / 2, float((high - low).max()) * 0.36
    for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle,
                                  strict=True):
        set_limits(centre - half, centre + half)
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=12, azim=35)
    axes.set_axis_off()
