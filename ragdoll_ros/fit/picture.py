"""Picture of a doll in its bind pose: skin, bodies, joints and joint ranges."""
from pathlib import Path

import numpy as np

from ..model import errors, rotation
from ..model.ragdoll import Bone, Joint, Ragdoll, joint_axes
from .reading.character import Character

BODY_COLORS = np.array([
    [0.90, 0.45, 0.35], [0.35, 0.60, 0.85], [0.50, 0.75, 0.45], [0.95, 0.75, 0.35],
    [0.65, 0.50, 0.80], [0.45, 0.75, 0.75], [0.85, 0.60, 0.75], [0.70, 0.65, 0.50]])
AXIS_COLORS = np.array([[0.80, 0.15, 0.15], [0.10, 0.50, 0.15], [0.15, 0.25, 0.75]])
"""Of a joint's first, second and third angle."""
SKIN_COLOR = np.array([0.80, 0.78, 0.74])
LIGHT_DIRECTION = np.array([0.5, 0.4, 0.77])
MAX_TRIANGLES = 30_000
"""Triangles of a skin that are drawn."""

ARC_SEGMENTS = 16
"""Line segments of an arc."""

ARC_RADII = (0.02, 0.09)
"""Smallest and largest arc radius as fractions of the doll's extent; between them, half the
child's length."""


def draw(doll: Ragdoll, character: Character | None, path: str | Path) -> None:
    """Write a picture of the skin, the bodies, both, and the joints, seen from the front left.

    Without a character: the bodies and the joints only. Raises Unreadable where matplotlib is
    missing, OSError where the picture cannot be written.
    """
    try:
        import matplotlib
        matplotlib.use('Agg')
        from matplotlib import pyplot
    except ImportError:
        raise errors.Unreadable(
            '', 'no matplotlib', "pip install 'ragdoll_ros[fit]' for pictures") from None
    bodies = [(_triangles(bone), BODY_COLORS[number % len(BODY_COLORS)])
              for number, bone in enumerate(doll.bones)]
    views = [('bodies', [(bodies, 1.0)])]
    points = np.concatenate([triangles.reshape(-1, 3) for triangles, _ in bodies])
    if character is not None:
        triangles = character.vertices[character.triangles]
        skin = [(triangles[::max(1, len(triangles) // MAX_TRIANGLES)], SKIN_COLOR)]
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
        _set_view(axes, points)
        axes.set_title(title)
    figure.suptitle(doll.name)
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)


def joint_range_arcs(doll: Ragdoll) -> list[tuple[int, np.ndarray]]:
    """Number, 0 to 2, and sector (p, 3) m, doll's frame, of each limited joint angle.

    The polygon runs from the anchor along the arc of the child's direction as this angle alone goes
    from limit to limit, and back to the anchor.
    """
    return [(number, np.concatenate([[joint.anchor], joint.anchor + arc, [joint.anchor]]))
            for joint in doll.joints
            for number, (axis, limits) in enumerate(zip(
                joint_axes(joint), joint.angle_limits, strict=True))
            if limits is not None for arc in [_arc(axis, _pointer(doll, joint, axis), limits)]]


def _pointer(doll: Ragdoll, joint: Joint, axis: np.ndarray) -> np.ndarray:
    """Vector (3,) m from the anchor towards the child, perpendicular to the axis."""
    child = doll.bone(joint.child)
    toward = np.subtract(child.position, joint.anchor)
    toward = toward - axis * (axis @ toward)
    if np.linalg.norm(toward) < 0.3 * np.linalg.norm(np.subtract(child.position, joint.anchor)):
        # A twist axis runs along the child: any perpendicular shows the angle.
        toward = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return rotation.normalized(toward) * np.clip(
        max(child.shape.half_extents), *(doll.extent * share for share in ARC_RADII))


def _arc(axis: np.ndarray, pointer: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    angles = np.linspace(*limits, ARC_SEGMENTS + 1)
    return rotation.rotate(rotation.from_rotation_vector(angles[:, None] * axis), pointer)


def _triangles(bone: Bone) -> np.ndarray:
    corners, triangles = bone.shape.mesh()
    return bone.pose.apply(corners)[triangles]


def _draw_solids(axes: object, solids: list[tuple[np.ndarray, np.ndarray]], alpha: float) -> None:
    """Draw all triangles in one collection, because matplotlib sorts by depth only within one."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    corners = np.concatenate([triangles for triangles, _ in solids])
    base = np.concatenate([np.tile(color, (len(triangles), 1)) for triangles, color in solids])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    shade = 0.55 + 0.45 * np.maximum(normals @ LIGHT_DIRECTION, 0)[:, None]
    colors = np.concatenate([base * shade, np.full((len(base), 1), alpha)], axis=1)
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colors, edgecolors='none'))


def _draw_joints(axes: object, doll: Ragdoll) -> None:
    """Draw a dot at each joint and a sector for each limited angle, in front of the bodies."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    axes.computed_zorder = False
    sectors = joint_range_arcs(doll)
    if sectors:
        colors = AXIS_COLORS[[number for number, _ in sectors]]
        axes.add_collection3d(Poly3DCollection(
            [points for _, points in sectors], zorder=2, edgecolors=colors, linewidths=0.8,
            facecolors=np.column_stack([colors, np.full(len(colors), 0.25)])))
    for fixed, marker in ((False, 'o'), (True, 's')):
        anchors = np.array([joint.anchor for joint in doll.joints
                            if (joint.kind == 'fixed') == fixed]).reshape(-1, 3)
        axes.scatter(*anchors.T, c='black', s=14, marker=marker, depthshade=False, zorder=3)


def _set_view(axes: object, points: np.ndarray) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, float((high - low).max()) * 0.36
    for set_limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle,
                                  strict=True):
        set_limits(centre - half, centre + half)
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=12, azim=35)
    axes.set_axis_off()
