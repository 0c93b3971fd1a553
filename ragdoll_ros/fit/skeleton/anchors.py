"""Joint anchors: the child bone's root where both bodies reach it, else where the skins meet."""
from __future__ import annotations

import dataclasses

import numpy as np

from ...model.shapes import Shape
from ..shapes.fitting import FittedShape, extend_to
from .groups import BodyGroup

ANCHOR_TOLERANCE = 0.06
"""Largest distance of an anchor from its body, as a fraction of the body's longest extent."""

MAX_EXTENSION = 0.4
"""Largest extension of a body towards its anchor, as a fraction of the body's extent."""


def place_anchors(groups: list[BodyGroup], fits: list[FittedShape],
                  frames: list[np.ndarray]) -> list[FittedShape]:
    """Choose each group's anchor, and extend the shapes to reach their anchors.

    The anchor is the first candidate within ANCHOR_TOLERANCE of both bodies, else the nearest.
    The ``fits`` are centred in the doll's frame; ``frames`` (3, 3) have their axes as columns.
    """
    jointed = [(index, group) for index, group in enumerate(groups)
               if group.parent >= 0 and not group.fixed]
    for index, group in jointed:
        distances = [max(_anchor_distance(fits[k], frames[k], point) for k in (index, group.parent))
               for point in group.anchors]
        reached = [number for number, value in enumerate(distances) if value <= ANCHOR_TOLERANCE]
        group.anchor = group.anchors[reached[0] if reached else int(np.argmin(distances))]
    extended = list(fits)
    for index, group in jointed:
        for k in (index, group.parent):
            if _anchor_distance(fits[k], frames[k], group.anchor) <= MAX_EXTENSION:
                extended[k] = _extend_to_anchor(extended[k], frames[k], group.anchor)
    return extended


def _anchor_distance(fit: FittedShape, frame: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point outside a body, as a fraction of the body's longest extent."""
    return max(0.0, float(relative_distance(fit.shape, ((point - fit.centre) @ frame)[None])[0]))


def relative_distance(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Signed distance (k,) of points (k, 3) in a shape's frame over its longest extent."""
    return shape.signed_distance(points) / (2 * max(shape.half_extents))


def _extend_to_anchor(fit: FittedShape, frame: np.ndarray, point: np.ndarray) -> FittedShape:
    extended = extend_to(fit.shape, (point - fit.centre) @ frame)
    centre = fit.centre + frame @ extended.centre
    return dataclasses.replace(extended, centre=centre, coverage=fit.coverage)
