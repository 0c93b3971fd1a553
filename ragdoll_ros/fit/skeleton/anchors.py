"""Where joints are: at the lower bone's root if both bodies reach it, else where the skins meet."""
from __future__ import annotations

import dataclasses

import numpy as np

from ...model.shapes import Shape
from ..shapes.shapes import Fitted, extended
from .groups import Group

NEAR = 0.06
"""An anchor is at a body if it is this near to it, of the body's longest extent."""

FURTHEST = 0.4
"""A body is made longer by up to this share of its extent, so that it reaches its joints."""


def place_anchors(groups: list[Group], fits: list[Fitted],
                  frames: list[np.ndarray]) -> list[Fitted]:
    """Take for each group's joint the first of its points that is at both bodies.

    Where none is, the one that is least far off. Gives the bodies as they reach their anchors.
    ``fits`` are centred in the doll's frame, ``frames`` (3, 3) have their axes as columns.
    """
    jointed = [(index, group) for index, group in enumerate(groups)
               if group.parent >= 0 and not group.tied]
    for index, group in jointed:
        off = [max(_off(fits[k], frames[k], point) for k in (index, group.parent))
               for point in group.anchors]
        at = [number for number, value in enumerate(off) if value <= NEAR]
        group.anchor = group.anchors[at[0] if at else int(np.argmin(off))]
    longer = list(fits)
    for index, group in jointed:
        for k in (index, group.parent):
            if _off(fits[k], frames[k], group.anchor) <= FURTHEST:
                longer[k] = _reaching(longer[k], frames[k], group.anchor)
    return longer


def _off(fit: Fitted, frame: np.ndarray, point: np.ndarray) -> float:
    """How far a point is outside a body, as a share of the body's longest extent."""
    return max(0.0, float(outside(fit.shape, ((point - fit.centre) @ frame)[None])[0]))


def outside(shape: Shape, points: np.ndarray) -> np.ndarray:
    """How far (k,) points (k, 3) of a shape's frame are outside it, of its longest extent."""
    return shape.signed_distance(points) / (2 * max(shape.half_extents))


def _reaching(fit: Fitted, frame: np.ndarray, point: np.ndarray) -> Fitted:
    longer = extended(fit.shape, (point - fit.centre) @ frame)
    return dataclasses.replace(longer, centre=fit.centre + frame @ longer.centre, share=fit.share)
