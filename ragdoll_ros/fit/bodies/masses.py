"""Masses of bodies from skin volume, from anthropometric proportions, or from both.

The volume that the skin of a body encloses follows from the divergence theorem. The body's
triangles form an open surface. A triangle fan caps each boundary with a neighbour; both bodies
share the fan's centre, so that the volumes add up to that of the whole skin. Another fan caps what
remains open where three bodies meet.
"""
import numpy as np

from ...model import errors
from ..reading.character import Character
from ..roles.person import SEGMENTS, has_persons_proportions, is_person, segment
from ..skeleton.groups import BodyGroup, mirrored_group

WATER_DENSITY = 1000.0
"""kg/m^3; the density of animals is within 10 % of it."""

MIN_FILL, MAX_FILL = 0.2, 1.5
"""Plausible ratio of skin volume to shape volume; outside it the skin is open, flat or layered."""

WELD_TOLERANCE = 1e-6
"""Vertices closer than this fraction of the extent are one: exporters split texture seams."""


def share_mass(total: float | None, sharing: str, character: Character, groups: list[BodyGroup],
               shapes: list[float], notes: list[str]) -> list[float]:
    """Mass of each group's body, kg; ``shapes`` are the volumes of the bodies' shapes, m^3.

    ``total`` is the mass of the doll, kg; None: the skin's volume times the density of water.
    ``sharing`` is 'volume' (of the skin), 'proportions' (of a person) or 'best': by volume, but for
    a doll with a person's proportions the geometric mean of both, because skin weights change
    beside the joints, not at them. A note reports an unusable skin volume. Raises NotPositive,
    NotFinite for a bad total.
    """
    volumes = _group_volumes(character, groups, np.array(shapes), notes)
    if total is None:
        total = WATER_DENSITY * float(volumes.sum())
    errors.check_positive('mass', total)
    roles = [group.role for group in groups]
    person = is_person(roles, character.positions[[group.bone for group in groups]]) and (
        has_persons_proportions(roles, [group.name for group in groups], volumes.tolist()))
    shares = volumes
    if sharing == 'proportions' or (sharing == 'best' and person):
        shares = _anthropometric_shares(groups, volumes)
    if sharing == 'best' and person:
        shares = np.sqrt(shares / shares.sum() * volumes / volumes.sum())
    return [float(f'{total * share / shares.sum():.9g}') for share in shares]


def _group_volumes(character: Character, groups: list[BodyGroup], shapes: np.ndarray,
                   notes: list[str]) -> np.ndarray:
    """Skin volume of each group, m^3, averaged over left and right and limited by its shape's; its
    shape's where the whole skin is unusable.
    """
    carriers = np.full(len(character.vertices), -1)
    for index, group in enumerate(groups):
        carriers[group.vertices[group.vertices < len(carriers)]] = index
    volumes = skin_volumes(character, carriers, len(groups))
    pairs = [mirrored_group(character, groups, index) for index in range(len(groups))]
    volumes = (volumes + volumes[pairs]) / 2
    if not MIN_FILL * shapes.sum() < volumes.sum() < MAX_FILL * shapes.sum():
        notes.append(f'the skin encloses {1000 * volumes.sum():.3g} l and the bodies '
                     f'{1000 * shapes.sum():.3g} l: the skin is open or layered, so masses follow '
                     'the volumes of the bodies (set the total with --mass)')
        return shapes
    bounded = np.clip(volumes, MIN_FILL * shapes, MAX_FILL * shapes)
    changed = [group.name for group, here in zip(groups, bounded != volumes, strict=True) if here]
    if changed:
        notes.append(f'the skin of {", ".join(changed)} is flat, open or layered: the volumes of '
                     'the bodies limit the masses')
    return bounded


def _anthropometric_shares(groups: list[BodyGroup], volumes: np.ndarray) -> np.ndarray:
    """Percent of a man's mass for each group; within a segment in proportion to volume.

    Segments that the doll lacks leave the ratios of the others unchanged.
    """
    segments = [segment(group.role, group.name) for group in groups]
    held: dict[tuple[str, int], float] = {}
    for part, volume in zip(segments, volumes, strict=True):
        held[part] = held.get(part, 0.0) + volume
    return np.array([SEGMENTS[part[0]] * volume / held[part]
                     for part, volume in zip(segments, volumes, strict=True)])


def skin_volumes(character: Character, carriers: np.ndarray, count: int) -> np.ndarray:
    """Skin volume (count,) m^3 of each body; ``carriers`` (v,) is each vertex's body, or -1.

    Boundaries are capped; the sum is not negative. Near zero where the skin is flat.
    """
    vertices = character.vertices - character.vertices.mean(axis=0)
    _, first, places = np.unique(np.round(vertices / (WELD_TOLERANCE * character.extent)), axis=0,
                                 return_index=True, return_inverse=True)
    points, triangles = vertices[first], places.ravel()[character.triangles]
    # A triangle across a boundary belongs to the body with two corners, else to the first corner's.
    corner = carriers[character.triangles]
    owners = np.where(corner[:, 1] == corner[:, 2], corner[:, 1], corner[:, 0])
    rims, bodies, others = _boundary_edges(triangles, owners, len(points))
    volumes = np.zeros(count)
    for body in range(count):
        mine, own = triangles[owners == body], bodies == body
        cones = [points[mine]] if len(mine) else []
        cones += _cap_boundaries(points[rims[own]], _boundary_loops(rims[own], others[own]))
        volumes[body] = sum(_volume(cone) for cone in cones)
    # A mirrored skin has its triangles inside out.
    return volumes * (np.sign(volumes.sum()) or 1.0)


def _boundary_edges(triangles: np.ndarray, owners: np.ndarray,
                    count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boundary edges (e, 2) of the bodies, each edge's body (e,) and neighbour (e,), -1 for none.

    Edges keep the winding of their triangle, so a boundary between two bodies appears twice.
    """
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    body = np.tile(owners, 3)
    there, back = edges @ (count, 1), edges @ (1, count)
    order = np.argsort(there, kind='stable')
    found = np.minimum(np.searchsorted(there, back, sorter=order), len(order) - 1)
    beyond = np.where(there[order[found]] == back, body[order[found]], -1)
    rim = (beyond != body) & (edges[:, 0] != edges[:, 1]) & (body >= 0)
    return edges[rim], body[rim], beyond[rim]


def _boundary_loops(edges: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Label (e,) of each edge's boundary: connected edges (e, 2) with the same neighbour (e,)."""
    heads: dict[tuple[int, int], tuple[int, int]] = {}

    def head(key: tuple[int, int]) -> tuple[int, int]:
        while heads.setdefault(key, key) != key:
            heads[key] = key = heads[heads[key]]
        return key

    keys = [((int(a), int(other)), (int(b), int(other)))
            for (a, b), other in zip(edges, others, strict=True)]
    for a, b in keys:
        heads[head(a)] = head(b)
    return np.unique([head(a) for a, _ in keys], axis=0, return_inverse=True)[1].ravel() \
        if keys else np.zeros(0, int)


def _cap_boundaries(rims: np.ndarray, labels: np.ndarray) -> list[np.ndarray]:
    """Triangles (t, 3, 3) m that cap the boundary edges (e, 2, 3) m: one fan for each label, and
    one for what these leave open.
    """
    fans, open_ = [], []
    for label in range(labels.max(initial=-1) + 1):
        edges = rims[labels == label]
        middle = edges.mean(axis=(0, 1))
        fans.append(_fan(edges, middle))
        starts, ends = ({tuple(point) for point in edges[:, end]} for end in (0, 1))
        open_ += [(point, middle) for point in starts - ends]
        open_ += [(middle, point) for point in ends - starts]
    if open_:
        left = np.array(open_)
        fans.append(_fan(left, left.mean(axis=(0, 1))))
    return fans


def _fan(edges: np.ndarray, middle: np.ndarray) -> np.ndarray:
    return np.stack([edges[:, 1], edges[:, 0], np.broadcast_to(middle, edges[:, 0].shape)], axis=1)


def _volume(triangles: np.ndarray) -> float:
    """Volume between triangles (t, 3, 3) m and the origin, m^3, positive for outward normals."""
    a, b, c = triangles.transpose(1, 0, 2)
    return float(np.einsum('ti,ti->', a, np.cross(b, c)) / 6)
